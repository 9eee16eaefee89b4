"""Stiffnesses that a model takes as equal in two directions, because only one was given: the weft of a cloth as its
warp, its bending and its twist along the weft, and the second bending stiffness of a rod.

The inputs hold the root of the ratio of the second to the first, a plain number. If a motion shows only the soft
direction, a fit of one number for both finds the soft one, and its residuals are hardly larger than the noise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..objects.rod import Rod
from ..quantities.wording import short
from ..scene.scene import Scene
from .tangents import Input


@dataclass(frozen=True)
class Alike:
    """A ratio of two stiffnesses that is taken as given.

    Attributes:
        label: what over what.
        added: what the ratio's logarithm adds to inputs.
        says: a size of it, in words.
    """

    label: str
    added: list[Input]
    says: Callable[[float], str]


_OF_CLOTH = (  # of bends that know directions; hinges between triangles know none
    ("_membrane", 5, "weft", "warp"),
    ("_bend", 9, "bending_weft", "bending"),
    ("_bend", 10, "bending_twist", "bending"),
)


def alike(scene: Scene, inputs: Array) -> Iterator[Alike]:
    """The ratios of a scene that no quantity changes; cuts of one fabric share theirs.

    Args:
        inputs: of the scene.
    """
    found: dict[str, Alike] = {}
    for one in _each(scene, inputs):
        found.setdefault(one.label, replace(one, added=[])).added.extend(one.added)
    yield from found.values()


def _each(scene: Scene, inputs: Array) -> Iterator[Alike]:
    for cloth in scene.cloths.values():
        for group, place, second, first in _OF_CLOTH:
            yield from _ratio(scene, inputs, cloth.fabric, cloth.name + group, place, second, first)
    for rope in scene.ropes.values():
        if isinstance(rope, Rod):
            yield from _ratio(scene, inputs, rope.name, f"{rope.name}_bend", 0, "EI2", "EI")


def _ratio(
    scene: Scene, inputs: Array, prefix: str, group: str, place: int, second: str, first: str
) -> Iterator[Alike]:
    known = {g.name: g for g in scene.groups}
    if f"{prefix}_{second}" in scene.quantities or f"{prefix}_{first}" not in scene.quantities or group not in known:
        return
    if place >= known[group].rest.shape[1] or (place > 8 and "sheet_curvature" not in known[group].kind):
        return
    at = scene.places_of_group(group).rest[:, place]
    values = inputs[scene.compiled.layout["rest"][0] + at]

    def says(size: float) -> str:
        how = "larger" if size > 0 else "smaller"
        return f"{prefix}_{second} were {short(100 * abs(np.expm1(size)), 2)} % {how} than {prefix}_{first}"

    yield Alike(f"{prefix}_{second}/{prefix}_{first}", [("rest", at, 0.5 * values)], says)
