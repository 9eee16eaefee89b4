"""How a scene is stepped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal, cast

from .. import _core
from ..arrays.checks import is_number
from ..errors import InputError, refusal
from ..files.memory import free_memory, in_bytes
from ..scene.compiled import CompiledScene
from .extrapolation import MOST, Extrapolated, weights
from .options import option, options_of
from .redundancy import warn_redundant

ITERATIONS = {"gauss_seidel": 10, "implicit": 100}  # by default; 2 of the others


@dataclass(frozen=True)
class Solver:
    """Time step and method of a simulation.

    This is the one definition of the solver's options: [solver] of a configuration takes names, types, defaults, ranges
    and descriptions from here.

    Attributes:
        h: substep, s. Constant within a rollout.
        integrator: "bdf2" (second order, the default) or "bdf1" (backward Euler: damps like zeta = omega h/2).
        method: "direct" (each connected part is one block, solved for the multipliers of its constraints: for ropes
            and rods; the default), "newton" (the same blocks, solved for the positions of their particles: for cloth;
            each rigid row, of compliance 0, costs one more solve), "newton_cg" (as "newton", by conjugate gradients on
            two levels: for cloth of more than some 20,000 vertices, in half the memory), "implicit" (each substep is
            iterated until its forces balance: for contacts, and for fabrics that stiffen strongly) or "gauss_seidel"
            (colored sweeps; unconverged ones add about 0.9 h^2/(m sweeps) of compliance per link).
        iterations: Newton iterations of a block (2 by default), sweeps (10 by default), or the largest number of Newton
            matrices of an "implicit" substep (100 by default); if it needs more, it raises an error.
        threads: threads of one rollout; results do not depend on it.
        grain: constraints per thread below which a color is not split.
        force_tolerance: largest unbalanced force along a coordinate at which "implicit" stops, relative to the largest
            sum of forces. The motion and its gradient are as exact as the forces balance.
        cg_tolerance: relative residual at which conjugate gradients stop ("newton_cg" runs them twice per solve).
        cg_iterations: largest number of conjugate gradients of a solve; if it needs more, it raises an error.
        memory: memory of a gradient through a rollout, such as "2 GB" or a number of bytes. What does not fit on the
            tape is computed again, with the same result. By default half of the memory that is free at the recording.
            `tape_plan` predicts the cost. Tangents (`fit`, forward mode) keep no tape.
        extrapolate: number of runs that are combined at the frames: 1 (off, the default); 2, at h and h/2, third order
            with "bdf2"; 3, at h, h/2 and h/4, fourth order, with seven times the substeps of one run. For smooth
            motions: it refuses scenes that yield, scenes with linear knots of driven particles, and "gauss_seidel"
            (and with it tethers), whose error comes from sweeps. Scenes with contacts take 2 with "bdf1".
    """

    h: float = option(1e-3, "time", "s", above=0)
    integrator: Literal["bdf1", "bdf2"] = option("bdf2")
    method: Literal["direct", "newton", "newton_cg", "implicit", "gauss_seidel"] = option("direct")
    iterations: int | None = option(None, least=1)
    threads: int = option(1, least=1)
    grain: int = option(256, least=1)
    force_tolerance: float = option(1e-10, "share of the largest force", above=0, most=1e-3)
    cg_tolerance: float = option(1e-12, "relative residual", above=0, most=1e-3)
    cg_iterations: int = option(10_000, least=1)
    memory: str | int | None = option(None)
    extrapolate: int = option(1, "number of runs", least=1, most=MOST)

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            check_option(name, getattr(self, name))
        if self.extrapolate > 1 and self.method == "gauss_seidel":
            problem, fix = "does not go with sweeps that do not converge", "use 'direct' or 'newton', or leave it out"
            raise InputError("solver.extrapolate", problem, self.extrapolate, fix)

    @property
    def budget(self) -> int:
        """`memory` in bytes; by default half of the memory that is free now."""
        return free_memory() // 2 if self.memory is None else in_bytes("solver.memory", self.memory)

    @property
    def sweeps(self) -> int:
        """Iterations with the method's default filled in."""
        return self.iterations if self.iterations is not None else ITERATIONS.get(self.method, 2)

    @classmethod
    def given(cls, solver: Solver | None) -> Solver:
        """What a caller gave as solver; the default for None.

        Raises:
            InputError: it is something else, such as a substep alone.
        """
        if solver is None or isinstance(solver, cls):
            return solver or cls()
        fix = f"write sb.Solver(h={solver!r})" if is_number(solver) else "give such as sb.Solver(h=1e-3)"
        raise InputError("solver", "is not a Solver", solver, fix)

    def with_h(self, h: float) -> Solver:
        """The same solver at another substep."""
        return replace(self, h=h)

    @property
    def runs(self) -> tuple[tuple[float, float], ...]:
        """Substep [s] and weight of each run."""
        return tuple((self.h / 2**k, w) for k, w in enumerate(weights(self.integrator, self.extrapolate)))

    def check_smooth(self, scene: CompiledScene) -> None:
        """Raises InputError where runs are to be combined and errors of the motions have no such powers of h."""
        if self.extrapolate == 1 or self.knows_order(scene):
            return
        touching = "" if scene.kinks else f"contacts, which take 2 runs with 'bdf1', not {self.integrator!r}"
        fix = "leave it out (1) and shorten h"
        raise InputError(
            "solver.extrapolate",
            f"is for smooth motions: the scene has {scene.kinks or touching}",
            self.extrapolate,
            fix,
        )

    def knows_order(self, scene: CompiledScene) -> bool:
        """Whether errors of a scene's motions have the powers of h that the combination of runs takes out.

        Where something touches, those of backward Euler have the first one: the impulses of a landing have the moment
        of one at its time, and a friction that changes kicks nothing. The next terms depend on where in its substep a
        contact begins or slides.
        """
        first = not scene.contacts or (self.integrator == "bdf1" and self.extrapolate <= 2)
        return not scene.kinks and self.method != "gauss_seidel" and first

    @property
    def core_options(self) -> dict[str, Any]:
        """What the compiled solvers of rollouts and of fits take alike, under the names of the core."""
        return {
            "h": self.h,
            "integrator": self.integrator,
            "partition": self.method,
            "iterations": self.sweeps,
            "force_tolerance": self.force_tolerance,
            "cg_tolerance": self.cg_tolerance,
            "cg_iterations": self.cg_iterations,
        }

    def core(self, scene: CompiledScene) -> _core.Solver:
        """The compiled solver for a scene, or what is called as it is and combines several.

        Raises:
            InputError: the method cannot step the scene, such as "implicit" with a kept volume.

        Warns:
            RedundantConstraintsWarning: some rigid constraints follow from others at the start; "gauss_seidel" leaves
                none out, and does not say so.
        """
        self.check_smooth(scene)
        if self.extrapolate == 1:
            return self._one(scene)
        ones = [self.with_h(h)._one(scene) for h, _ in self.runs]
        return cast(_core.Solver, Extrapolated(ones, [w for _, w in self.runs]))

    def _one(self, scene: CompiledScene) -> _core.Solver:
        for f in scene.fastest:
            if f.speed * self.h > f.reach:
                problem = f"lets '{f.name}' move {1e3 * f.speed * self.h:.3g} mm at most, past what it touches: it is "
                problem += f"{1e3 * f.reach:.3g} mm thick to each side, the contact's radius included"
                fix = f"use at most {f.reach / f.speed:.2g} s, or a slower or thicker collider"
                raise InputError("solver.h", problem, self.h, fix)
        if self.method == "gauss_seidel" and scene.has_means:
            problem = "leaves means of particles millimeters away from where they belong"
            fix = "use 'newton', 'newton_cg', 'direct' or 'implicit' for scenes with sb.add_mean"
            raise InputError("solver.method", problem, self.method, fix)
        if self.method == "direct" and self.sweeps == 1 and "shear" in scene.kinds:
            problem = "loses up to half of the digits of gradients of rods that shear (GA)"
            raise InputError("solver.iterations", problem, 1, "use 2, or leave GA out")
        try:
            core = _core.Solver(scene=scene.core, threads=self.threads, grain=self.grain, **self.core_options)
        except ValueError as error:
            raise refusal(error, InputError, self.method) from error
        inputs = scene.inputs()
        elastic = (scene.part(inputs, "compliance") > 0).all()
        if self.method == "direct" or (self.method != "gauss_seidel" and not elastic):
            warn_redundant(scene.name, core.redundant(inputs, 0.0))
        return core


OPTIONS = options_of(Solver)
"""What a solver can be told, by name."""


def check_option(name: str, value: object) -> None:
    """Refuse a value that an option of the solver cannot take.

    Raises:
        InputError: it names solver.NAME.
    """
    OPTIONS[name].check("solver", value)
    if name == "memory" and value is not None:
        in_bytes("solver.memory", value)
