"""Whether a shape at rest would stay as it was fitted: at a saddle of the energy nothing rests.

The solver leaves saddles, but close to the edge of stability it comes back to them. A fit follows a shape across this
edge, and a little farther every step leads to another shape, far from the recording. So the search ends there although
the cost has no minimum, and a linear interval at that point tells nothing. Wires at rest with a free shape without load
do this: the larger their stiffness, the larger the moment that their set has to take back.
"""

from __future__ import annotations

import numpy as np

from ..arrays.timeseries import Array
from ..errors import SheetbendError
from ..experiment.experiment import Experiment
from ..minimum.problem import FitProblem
from ..motion.equilibrium import Equilibrium, equilibrium
from ..objects.markers import Place

SAME = 1e-6  # m: shapes nearer than this everywhere are one, as those of `equilibria`


def unstable_rests(problem: FitProblem, u: Array) -> dict[str, str]:
    """By free parameter, that a shape at rest which depends on it would not stay there. Takes two equilibria for each
    static experiment.

    Args:
        u: (free,) the minimum.
    """
    found: dict[str, str] = {}
    for i, e in enumerate(problem.experiments):
        if not e.static or e.is_cloud:
            continue
        try:
            fitted = problem.simulate_one(i, u)
            nearest = equilibrium(e.scene, values=problem.values_of(e, u), stable=False)
        except SheetbendError:
            continue  # no shape to judge
        if nearest.unstable_modes > 0 and _same(e, nearest, fitted):
            found |= dict.fromkeys(problem.acting_on(e), _words(e.name, nearest.unstable_modes))
    return found


def _same(e: Experiment, rest: Equilibrium, fitted: Array) -> bool:
    """Whether the compared markers (1, markers, 3) m of a fit lie on a shape, those with offsets left out."""
    places = [
        (k, place) for k, (i, place) in enumerate(zip(e.placed, e.compared_places, strict=True)) if _bare(e, i, place)
    ]
    if not places:
        return False
    shape = np.array([p.weights @ rest.nodes[e.scene.places_of(p.particles)] for _, p in places])
    gaps = np.abs(shape - fitted[0, [k for k, _ in places]])
    return bool(gaps.max() < SAME)


def _bare(e: Experiment, i: int, place: Place) -> bool:
    """Whether a marker is where weights of nodes put it."""
    return place.offset is None and place.body is None and e.recording.markers[i] not in e.offsets


def _words(name: str, count: int) -> str:
    ways = "one direction" if count == 1 else f"{count} directions"
    return (
        f"the fitted shape of {name} is unstable: its energy falls in {ways}, so nothing would rest there, and the "
        "search ended at an edge of the possible values. Look at how it is held and at its shape without load: a "
        "narrower prior of it, or fewer of its modes (set_modes)"
    )
