"""Given numbers that no rope or cloth has: a density in another unit, as g/m told as kg/m."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from ..experiment.experiment import Experiment
from ..experiment.wanted import quantities_of
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from ..quantities.wording import short
from ..scene.scene import Scene
from .at_limits import at_limits
from .other_units import other_units

STEEL = 8000.0  # kg/m^3: what ropes and sheets are made of is hardly ever denser
THICK = 0.15  # of its length: what is thicker is no rope; a stubby beam of silicone has 0.12
HEAVIEST = 10.0  # kg/m, 40 mm of solid steel
LIGHTEST = 1e-6  # kg/m, a third of a human hair
SHEETS = (1e-3, 0.005 * STEEL)  # kg/m^2: a thousandth of paper's, and 5 mm of steel
HEAVIEST_GRAVITY = 30.0  # m/s^2, more than on Jupiter


def implausible(problem: FitProblem) -> tuple[str, ...]:
    """A warning for every given number of the scenes that is likely to be in another unit."""
    return other_than_meant(problem.experiments, problem.parameters)


def other_than_meant(experiments: Sequence[Experiment], parameters: Parameters | None) -> tuple[str, ...]:
    """The same, before a fit; None of a scene of which nothing is fitted."""
    free = set() if parameters is None else {parameters.roots[name][0] for name in parameters.free}
    known = {name: q.value for name, q in quantities_of(experiments).items() if name not in free}
    found = (words for e in experiments for words in (*_of(known, e.scene), *other_units(e, free), *at_limits(e)))
    return tuple(dict.fromkeys(found))


def _of(known: Mapping[str, float], scene: Scene) -> Iterator[str]:
    for name, rope in scene.ropes.items():
        density, length = known.get(f"{name}_density", 0.0), float(rope.arc_length[-1])
        thick = math.sqrt(4.0 * max(density, 0.0) / (math.pi * STEEL))
        if thick > THICK * length or density > HEAVIEST:
            size = f"{short(1e3 * thick, 2)} mm thick over {short(length, 2)} m"
            yield (
                f"{name}_density of {short(density)} kg/m makes {name} {size}, were it of steel. Is it in g/m? Then "
                f"write `density` = {short(1e-3 * density)}"
            )
        elif 0.0 < density < LIGHTEST:
            yield f"{name}_density of {short(density)} kg/m is less than a hair's. Is it in another unit?"
    for name, cloth in scene.cloths.items():
        density = known.get(f"{cloth.fabric or name}_density", 0.0)
        if density > SHEETS[1]:
            steel = short(1e3 * density / STEEL, 2)
            said = f"{name}_density of {short(density)} kg/m^2 is that of {steel} mm of steel"
            yield f"{said}. Is it in g/m^2? Then write `density` = {short(1e-3 * density)}"
        elif 0.0 < density < SHEETS[0]:
            yield f"{name}_density of {short(density)} kg/m^2 is less than any fabric's. Is it in another unit?"
    gravity = math.hypot(*scene.gravity)
    if gravity > HEAVIEST_GRAVITY:
        yield f"gravity of {short(gravity)} m/s^2 is not that of any planet. Is it in another unit?"
