"""Internal friction in elements that a model takes as elastic.

Fibers of a rope or a fabric slide on each other, and yarns where they cross (`core/constraints/yielding.h`). Below its
yield such friction is a stiffness, and far beyond it a constant moment, so that it has no derivative at zero. A fit
without it takes it for damping and for a lower stiffness. So half of the stiffness is given to a spring that slides
beyond some parts of how far the fitted motion deforms.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..experiment.found_start import start_nodes
from ..motion.simulate import simulate
from ..motion.values import constraint_values
from ..problem.problem import FitProblem
from ..quantities.kinds import KINDS
from ..quantities.parameters import Parameter
from ..quantities.quantities import Quantity, Term
from ..scene.group import places_of_groups
from ..scene.scene import Scene
from .more_parameters import with_parameter

YIELDING = {
    "sheet_curvature": ("yielding_sheet_curvature", slice(0, 3)),
    "strain": ("yielding_strain", slice(2, 3)),
    "material_curvature": ("yielding_curvature", slice(0, 2)),
    "section_curvature": ("section_yielding_curvature", slice(0, 2)),
}  # by elastic kind, the one that yields, and which of its rows slide
STIFFNESS = ("inverse", "sqrt", "inverse_sqrt")  # functions of a stiffness in these
HALF = 0.5
SHARE = Parameter(name="[sliding_share]", initial=HALF, lower=0.0, upper=0.95, scale=0.1)  # of the stiffness
AT = Parameter(name="[sliding_at]", initial=1.0, log=True)  # the deformation beyond which it slides
PARTS = (0.3, 1.0, 2.0)  # of the root mean square of what slides, over the fitted motion
FRAMES = 9  # of the motion, at which this is asked


def elastic_names(motions: Sequence[Experiment]) -> list[str]:
    """Names of the groups that could yield and do not."""
    groups = [g for e in motions if _may_yield(e) for g in e.scene.groups]
    return list(dict.fromkeys(g.name for g in groups if g.kind in YIELDING))


def held_stiffness(problem: FitProblem, name: str) -> list[str]:
    """Names of what makes the stiffness of a group that could yield, where no free parameter is among them."""
    found = {q: None for e in problem.experiments if _may_yield(e) for q in _stiffness(e.scene, name)}
    free = {problem.parameters.roots[parameter][0].partition("[")[0] for parameter in problem.parameters.free}
    return [] if free & found.keys() else list(found)


def _stiffness(scene: Scene, name: str) -> Iterator[str]:
    """Names of the quantities that are a stiffness in the compliance or the numbers of a group."""
    for places in places_of_groups(scene.groups):
        for t in scene.terms if places.group.name == name else ():
            if t.array in ("compliance", "rest") and np.ravel(t.index)[0] in places.of(t.array):
                yield from (q for q, function in t.factors if function in STIFFNESS)


def deformed(problem: FitProblem, u: Array, name: str) -> float:
    """Root mean square, over the motions at u (free,), of what would slide in the elements of a group."""
    squares = list[float]()
    for i, recording in enumerate(problem.recordings):
        e = problem.experiment_at(i, u)
        rows = next((YIELDING[g.kind][1] for g in e.scene.groups if g.name == name and g.kind in YIELDING), None)
        if not _may_yield(e) or rows is None:
            continue
        solver, values = e.solver, problem.values_of(e, u)
        times = np.maximum(e.scene_times(recording.times, values), 0.0)
        some = times[np.linspace(0, len(times) - 1, FRAMES).astype(int)[1:]]
        with suppress(SheetbendError):
            at, start = np.unique(np.rint(some / solver.h)) * solver.h, start_nodes(e, values)
            for x in simulate(e.scene, at, solver, values, start).nodes:
                C = constraint_values(e.scene, x, values)[name][:, rows]
                squares.append(float((C**2).sum(axis=1).mean()))
    return float(np.sqrt(np.mean(squares))) if squares else 0.0


def with_yield(problem: FitProblem, name: str, at: float) -> FitProblem:
    """The problem whose elements of a group slide in all of its motions, beyond a deformation of `at`."""
    made = [replace(e, scene=_sliding(e.scene, name, at)) if _may_yield(e) else e for e in problem.experiments]
    return problem.of(made)


def with_free_yield(problem: FitProblem, name: str, at: float) -> FitProblem:
    """The same problem with two more parameters at the end, `SHARE` and `AT`."""
    return with_parameter(with_parameter(with_yield(problem, name, at), SHARE), replace(AT, initial=at))


def _may_yield(e: Experiment) -> bool:
    """Whether an experiment is a motion that may have yields; only smooth motions are extrapolated."""
    return not e.static and e.solver.extrapolate == 1


def _sliding(scene: Scene, name: str, at: float) -> Scene:
    places = [k for k, g in enumerate(scene.groups) if g.name == name and g.kind in YIELDING]
    if not places:
        return scene
    (k,) = places
    g, made = scene.groups[k], scene.shallow()
    kind, count = YIELDING[g.kind][0], len(g.particles)
    made._hidden = scene._hidden.moved(*np.zeros((2, scene.hidden_count, 3)))
    made._hidden.extend(np.zeros((count, 3)), np.zeros((count, 3)), np.ones(count))
    sets = np.arange(-1 - scene.hidden_count, -1 - made.hidden_count, -1)
    made.pinned = scene.pinned | set(sets.tolist())
    place = list(KINDS[kind]["parameters"]).index("share")
    rest = np.insert(g.rest, [place, place], 0.0, axis=1)
    made.groups = list(scene.groups)
    made.groups[k] = replace(g, kind=kind, particles=np.column_stack([g.particles, sets]), rest=rest)
    own = made.places_of_group(name).rest[:, place : place + 2]
    moved = np.delete(np.arange(sum(group.rest.size for group in made.groups)), own.ravel())
    made.quantities = {
        **scene.quantities,
        SHARE.name: Quantity(SHARE.name, HALF, "", positive=False, scale=SHARE.scale),
        AT.name: Quantity(AT.name, at, ""),
    }
    made.terms = [
        *(_moved(term, moved) if term.array == "rest" else term for term in scene.terms),
        *(Term("rest", own[:, n], 1.0, ((p.name, "identity"),)) for n, p in enumerate((SHARE, AT))),
    ]
    return made


def _moved(term: Term, places: np.ndarray) -> Term:
    index = places[np.asarray(term.index)]
    return replace(term, index=index if np.ndim(index) else int(index))
