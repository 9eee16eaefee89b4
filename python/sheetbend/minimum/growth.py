"""How fast small differences grow along a motion, which decides what can be derived from its Jacobian.

The free particles are displaced at random at the start, in eight directions, and one rollout carries the tangents
along. sigma(t) is the largest singular value of the displacements at time t over that at the start. It stays near 1 for
a rope or a cloth in a resolved motion. Where it grows by many orders of magnitude, the columns of the Jacobian all lie
along the one direction that grows, and a linear model of the motion holds for no step that an optimizer takes.

A displacement that violates a rigid constraint is projected away within the first substeps, so that a mechanism needs
no special treatment. Directors have no inertia and are left out, as is what is pinned or driven. Directions in which
nothing moves but by rounding (the normal of a plane motion) are left out too: a residual never feels what grows there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..errors import NoEquilibriumError
from ..experiment.cut import shot, start_quantities
from ..experiment.experiment import Experiment
from ..motion.equilibrium import equilibrium
from ..motion.solver import Solver
from ..problem.lifted import Lifted
from ..problem.problem import FitProblem
from ..scene.scene import Scene

ROUGH = 1e4
"""Growth above which nothing is derived from a Jacobian. Measured: a flag in the wind that is fitted to 1e-10 has 255,
a real double pendulum over 2 s has 2.4, a cloth whose fit stalls where it starts has 2e18."""
DIRECTIONS = 8  # as many tangents as one rollout carries
FRAMES = 100  # at which sigma is taken, at most
STILL = 1e-9  # of the largest motion along any direction: what is less is rounding
WINDOWS = 8  # of a motion that is shot in windows, at which growth is looked at
SEED = 19


@dataclass(frozen=True)
class Growth:
    """Growth of small displacements along the motion of one experiment.

    Attributes:
        name: of the experiment.
        times: (frames,) s from the scene's start.
        sigma: (frames,) largest singular value of the free particles' displacements, over that at the start; infinite
            from the time on where the motion diverges.
    """

    name: str
    times: Array
    sigma: Array

    @property
    def largest(self) -> float:
        """Largest sigma; infinite where it overflows or the motion diverges."""
        return float(self.sigma.max())

    @property
    def rate(self) -> float:
        """Slope of log sigma over time, 1/s, by least squares over what is finite; 0 for fewer than two frames."""
        known = np.isfinite(self.sigma) & (self.sigma > 0.0)
        if known.sum() < 2:
            return 0.0
        return float(np.polyfit(self.times[known], np.log(self.sigma[known]), 1)[0])

    @property
    def until(self) -> float | None:
        """Last of `times` up to which sigma stays below `ROUGH`, s; None where it always does."""
        return self.below(ROUGH)

    def below(self, limit: float) -> float | None:
        """Last of `times` up to which sigma stays below a limit, s; None where it always does."""
        above = np.flatnonzero(~(self.sigma < limit))
        return None if len(above) == 0 else float(self.times[max(above[0] - 1, 0)])

    def to_dict(self) -> dict[str, float | None]:
        """Values for JSON: `largest` (None where it overflows), `rate` and `until`."""
        return {
            "largest": self.largest if np.isfinite(self.largest) else None,
            "rate": self.rate,
            "until": self.until,
        }


def in_words(found: Growth) -> str:
    """One line for people."""
    size = f"at most {found.largest:.3g} times" if np.isfinite(found.largest) else "without limit"
    until = "" if found.until is None else f"; nothing can be derived from it beyond {found.until:.3g} s"
    return f"{found.name}: small displacements grow {size} over {found.times[-1]:.3g} s{until}"


def over_fit(e: Experiment) -> Growth:
    """`growth` of one moving experiment over its fitted part, at its scene's own values."""
    return growth(e, float(e.fitted().times[-1]) - e.t0)


def growths(problem: FitProblem, u: Array) -> tuple[Growth, ...]:
    """Growth of every moving experiment of a problem over its fitted part.

    Args:
        u: (free,) internal point. A motion that diverges there is no error, see `Growth.sigma`. Of one that is shot in
            windows it is the largest within a window, of some of them.
    """
    return tuple(
        growth(e, float(r.times[-1]) - e.t0, problem.values_of(e, u))
        if shot(e) is None
        else _growth_of_windows(problem, i, u)
        for i, (e, r) in enumerate(zip(problem.experiments, problem.recordings, strict=True))
        if not e.static
    )


def _growth_of_windows(problem: FitProblem, i: int, u: Array) -> Growth:
    e, core = problem.experiments[i], problem.core
    assert isinstance(core, Lifted)
    motion, names = core.motions[i], start_quantities(e.scene)
    known = {**dict.fromkeys(names), **problem.values_of(e, u)}
    first = {name: e.scene.quantities[name].value if at is None else at for name, at in known.items()}
    found = [growth(e, motion.length, first)]
    onward = replace(e, start="given")
    for k in range(1, len(motion.states) + 1, max(1, len(motion.states) // WINDOWS)):
        state = dict(zip(names, motion.states[k - 1], strict=True))
        found.append(growth(onward, motion.length, first | state, float(motion.edges[k]) - e.t0))
    return Growth(e.name, found[0].times, np.max([one.sigma for one in found], axis=0))


def growth(e: Experiment, end: float, values: Mapping[str, float] | None = None, t0: float = 0.0) -> Growth:
    """Growth of one moving experiment from its scene's start to `end` s; takes some three rollouts' time.

    Args:
        values: quantities of its scene to change, by name.
        t0: s, of the scene's clock, at which it starts.
    """
    last = max(1, round(end / e.solver.h))
    steps = np.unique(np.rint(np.linspace(0, last, min(FRAMES, last + 1))).astype(int))
    times, sigma = steps * e.solver.h, np.full(len(steps), np.inf)
    sigma[0] = 1.0
    compiled = e.scene.compiled
    inputs = compiled.inputs(compiled.values(values))
    if e.start == "equilibrium":
        try:
            compiled.part(inputs, "position")[:] = equilibrium(e.scene, values=values).nodes.ravel()
        except NoEquilibriumError:
            return Growth(e.name, times, sigma)
    x, moved = _rollout(e.scene, e.solver, inputs, steps, t0)
    sigma[: len(moved)] = _sigma(x, moved)
    return Growth(e.name, times, sigma)


def _rollout(scene: Scene, solver: Solver, inputs: Array, steps: Array, t0: float) -> tuple[Array, Array]:
    """Free particles' positions (frames, free, 3) and displacements (frames, free, 3, directions), up to where the
    motion has an answer."""
    compiled = scene.compiled
    free = np.setdiff1d(scene.free_nodes, scene.places_of(list(scene.directors)))
    offset, _ = compiled.layout["position"]
    places = (offset + 3 * free[:, None] + np.arange(3)).ravel()
    start = np.zeros((DIRECTIONS, len(inputs)))
    start[:, places] = np.random.default_rng(SEED).standard_normal((DIRECTIONS, len(places)))
    core = solver.core(compiled)
    while True:
        try:
            x, x_dot = core.jvp(inputs, start, steps.tolist(), t0)
            break
        except _core.Diverged as error:
            steps = steps[steps < error.substep]
        except (_core.Unbalanced, _core.Unconverged):
            steps = steps[: len(steps) // 2]
        if len(steps) < 2:  # the displacements at the start, which need no motion
            x, x_dot = (
                inputs[None, offset : offset + compiled.core.dofs],
                start[:, None, offset:][..., : compiled.core.dofs],
            )
            break
    frames = x.shape[0]
    moved = x_dot.reshape(DIRECTIONS, frames, -1, 3)[:, :, free]
    return x.reshape(frames, -1, 3)[:, free], np.moveaxis(moved, 0, -1)


def _moving(x: Array) -> Array:
    """(3, directions) in which particles at positions (frames, free, 3) move by more than rounding; all axes where that
    are all, or none."""
    way = (x - x[0]).reshape(-1, 3)
    size = np.abs(way).max(initial=0.0)
    if not 0.0 < size < np.inf:
        return np.eye(3)
    _, lengths, directions = np.linalg.svd(np.linalg.qr(way / size, mode="r"), full_matrices=False)
    moving = lengths > STILL * lengths[0]
    return np.eye(3) if moving.sum() == 3 else np.asarray(directions[moving].T)


def _sigma(x: Array, moved: Array) -> Array:
    """(frames,) from positions (frames, free, 3) and displacements (frames, free, 3, directions)."""
    matrices = np.einsum("fpad,ab->fpbd", moved, _moving(x)).reshape(len(moved), -1, DIRECTIONS)
    size = np.abs(matrices).max(axis=(1, 2))
    finite = np.isfinite(size) & (size > 0.0)
    sigma = np.where(np.isfinite(size), 0.0, np.inf)
    with np.errstate(over="ignore"):
        unit = np.linalg.svd(matrices[finite] / size[finite, None, None], compute_uv=False)[:, 0]
        sigma[finite] = size[finite] * unit / (size[0] * unit[0])
    return sigma
