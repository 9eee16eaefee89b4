"""How a scene is stepped."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import cast

from .. import _core
from ..errors import InputError, refusal
from ..files.memory import free_memory, in_bytes
from ..scene.compiled import CompiledScene
from .extrapolation import MOST, Extrapolated, weights
from .redundancy import warn_redundant

INTEGRATORS = ("bdf1", "bdf2")
METHODS = ("direct", "gauss_seidel", "implicit", "newton", "newton_cg")
ITERATIONS = {"gauss_seidel": 10, "implicit": 100}  # by default; 2 of the others


@dataclass(frozen=True)
class Solver:
    """Substep and solver of a rollout.

    Attributes:
        h: substep, s. Constant within a rollout.
        integrator: "bdf2" (second order, the default) or "bdf1" (backward Euler: damps like zeta = omega h/2).
        method: "direct" (each connected part one block, solved by its constraints: for ropes; the default), "newton"
            (the same blocks, solved by their particles: for cloth; every compliance must be positive), "newton_cg" (the
            same by conjugate gradients on two levels: for cloth of more than some 20,000 vertices, in half the memory),
            "implicit" (each substep solved until its forces balance: for fabrics that stiffen strongly; no rods, no
            rigid constraints) or "gauss_seidel" (colored; unconverged sweeps add
            about 0.9 h^2/(m sweeps) of compliance per link).
        iterations: Newton iterations of a block (2 by default) or sweeps (10 by default); of "implicit" the Newton
            matrices that a substep may take (100 by default): more are an error.
        threads: of one rollout; results do not depend on it.
        grain: constraints per thread below which a color is not split.
        force_tolerance: what "implicit" may leave of the forces that act along a coordinate, of their largest sum. A
            motion and its gradient are as exact as forces balance.
        cg_tolerance: relative residual at which conjugate gradients stop ("newton_cg" runs them twice per solve).
        cg_iterations: conjugate gradients until there; more are an error.
        memory: budget of a gradient through a rollout, such as "2 GB" or a number of bytes: what does not fit on the
            tape is computed again, with the same result. None = half of the memory that is free when it is recorded.
            `tape_plan` tells what a budget costs. Tangents (`fit`, forward mode) keep no tape.
        extrapolate: number of runs that are combined at the frames: 1 (the default, off); 2, at h and h/2, third order
            with "bdf2"; 3, at h, h/2 and h/4, fourth order, in seven times the substeps of one run. For smooth motions:
            scenes with joints that yield or with linear knots of driven particles are refused, and so is
            "gauss_seidel" (and with it tethers), whose error comes from sweeps.
    """

    h: float = 1e-3
    integrator: str = "bdf2"
    method: str = "direct"
    iterations: int | None = None
    threads: int = 1
    grain: int = 256
    force_tolerance: float = 1e-10
    cg_tolerance: float = 1e-12
    cg_iterations: int = 10_000
    memory: str | int | None = None
    extrapolate: int = 1

    def __post_init__(self) -> None:
        if not (isinstance(self.h, int | float) and math.isfinite(self.h) and self.h > 0):
            raise InputError("solver.h", "must be a positive time in s", self.h, "give the substep, such as 1/600")
        if self.integrator not in INTEGRATORS:
            raise InputError(
                "solver.integrator", "is unknown", self.integrator, f"use one of: {', '.join(INTEGRATORS)}"
            )
        if self.method not in METHODS:
            raise InputError("solver.method", "is unknown", self.method, f"use one of: {', '.join(METHODS)}")
        for field in ("iterations", "threads", "grain", "cg_iterations"):
            value = getattr(self, field)
            if value is not None and (not isinstance(value, int) or value < 1):
                raise InputError(f"solver.{field}", "must be a positive whole number", value, "give at least 1")
        for field, what, usual in (
            ("force_tolerance", "share of the largest force", "1e-10"),
            ("cg_tolerance", "relative residual", "1e-12"),
        ):
            value = getattr(self, field)
            if not (isinstance(value, float) and 0.0 < value <= 1e-3):
                fix = f"give a small number, such as {usual}"
                raise InputError(f"solver.{field}", f"must be a {what} of at most 1e-3", value, fix)
        if self.memory is not None:
            in_bytes("solver.memory", self.memory)
        runs = self.extrapolate
        if not isinstance(runs, int) or isinstance(runs, bool) or not 1 <= runs <= MOST:
            raise InputError("solver.extrapolate", "is no number of runs", runs, f"give 1 (off) to {MOST}")
        if runs > 1 and self.method == "gauss_seidel":
            fix = "use 'direct' or 'newton', or leave it out"
            raise InputError("solver.extrapolate", "does not go with sweeps that do not converge", runs, fix)

    @property
    def budget(self) -> int:
        """`memory` in bytes; by default half of the memory that is free now."""
        return free_memory() // 2 if self.memory is None else in_bytes("solver.memory", self.memory)

    @property
    def sweeps(self) -> int:
        """Iterations with the method's default filled in."""
        return self.iterations if self.iterations is not None else ITERATIONS.get(self.method, 2)

    def with_h(self, h: float) -> Solver:
        """The same solver at another substep."""
        return replace(self, h=h)

    @property
    def runs(self) -> tuple[tuple[float, float], ...]:
        """Substep [s] and weight of each run."""
        return tuple((self.h / 2**k, w) for k, w in enumerate(weights(self.integrator, self.extrapolate)))

    def check_smooth(self, scene: CompiledScene) -> None:
        """Raises InputError where runs are to be combined and the scene's motions are not smooth in time."""
        if self.extrapolate > 1 and scene.kinks:
            fix = "leave it out (1) and shorten h"
            raise InputError(
                "solver.extrapolate", f"is for smooth motions: the scene has {scene.kinks}", self.extrapolate, fix
            )

    def core(self, scene: CompiledScene) -> _core.Solver:
        """The compiled solver for a scene, or what is called as it is and combines several.

        Raises:
            InputError: the method cannot step the scene, such as "newton" with rigid constraints.

        Warns:
            RedundantConstraintsWarning: method "direct", and some rigid constraints follow from others at the start.
        """
        self.check_smooth(scene)
        if self.extrapolate == 1:
            return self._one(scene, self.h)
        return cast(_core.Solver, Extrapolated([self._one(scene, h) for h, _ in self.runs], [w for _, w in self.runs]))

    def _one(self, scene: CompiledScene, h: float) -> _core.Solver:
        if self.method in ("implicit", "newton", "newton_cg"):
            offset, size = scene.layout["compliance"]
            if size and not (scene.inputs()[offset : offset + size] > 0).all():
                fix = "use 'direct', or give every constraint a compliance"
                raise InputError("solver.method", "cannot hold rigid constraints", self.method, fix)
        if self.method == "direct" and self.sweeps == 1 and "shear" in scene.kinds:
            problem = "loses up to half of the digits of gradients of rods that shear (GA)"
            raise InputError("solver.iterations", problem, 1, "use 2, or leave GA out")
        try:
            core = _core.Solver(
                scene=scene.core,
                h=h,
                integrator=self.integrator,
                partition=self.method,
                iterations=self.sweeps,
                force_tolerance=self.force_tolerance,
                threads=self.threads,
                grain=self.grain,
                cg_tolerance=self.cg_tolerance,
                cg_iterations=self.cg_iterations,
            )
        except ValueError as error:
            raise refusal(error, InputError, self.method) from error
        if self.method == "direct":
            warn_redundant(scene.name, core.redundant(scene.inputs(), 0.0))
        return core
