"""Which numbers a scene can be simulated with: no stiffness, mass or length may be negative.

A compiled scene has one vector of inputs, made from its quantities. `Domain` knows the least and the largest value of
every quantity and of every input, and finds the quantity behind an input that lies outside.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.kinds import KINDS
from ..quantities.quantities import intermediate_of
from .group import OF_CONSTRAINTS, places_of_groups
from .scene_data import SceneData

HUGE = float(np.finfo(float).max)
TINY = float(np.nextafter(0.0, 1.0))
NOT_NEGATIVE = (
    *("mass", "compliance", "damping", "drag_linear", "drag_quadratic", "air_normal", "air_tangential"),
    *("volume_compliance", "friction", "contact_radius", "restitution", "contact_dissipation"),
)
POSITIVE = ("volume", "contact_stiffness", "collider_size")


class Domain:
    """The ranges of a scene's quantities and inputs.

    Attributes:
        least, most: (inputs,) the range of each input, both ends allowed.
    """

    def __init__(self, scene: SceneData, layout: Mapping[str, tuple[int, int]]) -> None:
        self._scene, self._layout = scene, layout
        total = sum(size for _, size in layout.values())
        self.least, self.most = np.full(total, -HUGE), np.full(total, HUGE)
        for arrays, least in ((NOT_NEGATIVE, 0.0), (POSITIVE, TINY)):
            for array in arrays:
                self._part(self.least, array)[:] = least
        self._part(self.least, "mass")[scene.free_nodes] = TINY
        if not scene.has_drag:
            for array in ("drag_linear", "drag_quadratic"):
                self._part(self.most, array)[:] = 0.0
        for places in places_of_groups(scene.groups):
            kind = KINDS[places.group.kind]
            if kind["compliance"]["never_zero"]:
                self._part(self.least, "compliance")[places.constraints] = TINY
            if not places.group.damped:
                self._part(self.most, "damping")[places.constraints] = 0.0
            for own, about in zip(places.rest.T, kind["parameters"].values(), strict=True):
                for ends, end in ((self.least, about["least"]), (self.most, about["most"])):
                    self._part(ends, "rest")[own] = end

    def _part(self, flat: Array, array: str) -> Array:
        offset, size = self._layout[array]
        return flat[offset : offset + size]

    def sums(self) -> list[tuple[dict[str, float], float]]:
        """The masses that are differences of quantities: coefficients by quantity, and a constant. Such are those of a
        body's axes, (I1 + I2 + I3)/2 - I_k: a moment of inertia is less than the sum of the two others."""
        mass = [t for t in self._scene.terms if t.array == "mass"]
        count = self._layout["mass"][1]
        entries: set[int] = set()
        for t in mass:
            down = np.broadcast_to(np.less(t.coefficient, 0.0), np.shape(np.ravel(t.index)))
            entries |= set(t.places(0, count)[down].tolist())
        found: dict[int, tuple[dict[str, float], float]] = {i: ({}, 0.0) for i in entries}
        base = self._scene.base_arrays()["mass"] if entries else np.zeros(0)
        for t in mass:
            for i, c in np.broadcast(t.places(0, count), t.coefficient):
                if i not in found:
                    continue
                parts, constant = found[i]
                if not t.quantities:
                    found[i] = parts, constant + float(c)
                elif not t.exponents and [f for _, f in t.factors] == ["identity"]:
                    name = t.factors[0][0]
                    parts[name] = parts.get(name, 0.0) + float(c)
                else:  # no sum of quantities
                    del found[i]
        return [(parts, constant + float(base[i])) for i, (parts, constant) in sorted(found.items())]

    def check_quantities(self, theta: Array) -> None:
        """Refuse values (scenes, quantities) that are not finite or outside the range of their quantity.

        Raises:
            SceneError: names the quantity, and the scene of a batch.
        """
        quantities = list(self._scene.quantities.values())
        ends = [(0.0, HUGE) if q.positive else q.limits or (-HUGE, HUGE) for q in quantities]
        least, most = np.clip(np.reshape(ends, (-1, 2)).T, -HUGE, HUGE)
        bad = np.argwhere(~((theta >= least) & (theta <= most)))
        if len(bad) == 0:
            return
        row, k = bad[0].tolist()
        q, value = quantities[k], float(theta[row, k])
        wanted = "a finite number"
        if np.isfinite(value):
            wanted = "a positive number" if q.positive else f"between {least[k]:g} and {most[k]:g}"
            if not q.positive and most[k] == HUGE:
                wanted = "zero or more"
        where = f" in scene {row} of the batch" if len(theta) > 1 else ""
        raise SceneError(f"values.{q.name}", f"must be {wanted}{where}", value, f"give it in {q.unit or 'its range'}")

    def check_inputs(self, inputs: Array, theta: Array | None = None, replaced: Collection[str] = ()) -> None:
        """Refuse inputs (scenes, inputs) that are not finite or outside their range.

        Args:
            theta: (quantities,) that the inputs were made from, where they are known.
            replaced: names of arrays that a user gave as they are.

        Raises:
            SceneError: names the quantities, or the array and its entry, and the scene of a batch.
        """
        inside = (inputs >= self.least) & (inputs <= self.most)
        if inside.all():
            return
        row, column = np.argwhere(~inside)[0].tolist()
        array = next(name for name, (offset, size) in self._layout.items() if offset <= column < offset + size)
        i = column - self._layout[array][0]
        value = float(inputs[row, column])
        state = self._state(value, float(self.least[column]), float(self.most[column]))
        where = f" in scene {row} of the batch" if len(inputs) > 1 else ""
        makers = {} if array in replaced else self._makers(column, theta)
        if not makers:
            field = f"inputs.{array}" if array in replaced else array
            raise SceneError(field, f"is {state} at {self._entry(array, i)}{where}", value, self._fix(array, state))
        field, verb = (f"values.{next(iter(makers))}", "makes") if len(makers) == 1 else ("values", "make")
        problem = f"{verb} the {array} of {self._entry(array, i)} {state}{where}"
        if theta is None:
            got: object = value
            problem += "" if len(makers) == 1 else f" by {', '.join(makers)}"
        else:
            got = next(iter(makers.values())) if len(makers) == 1 else makers
        raise SceneError(field, problem, got, "give values that leave it positive")

    @staticmethod
    def _state(value: float, least: float, most: float) -> str:
        if not np.isfinite(value):
            return "not finite"
        if most == 0.0 and value > 0.0:
            return "without effect"
        if least < 0.0 or (value > most and most < HUGE):
            return "outside its range"
        return "zero" if value == 0.0 else "negative"

    @staticmethod
    def _fix(array: str, state: str) -> str:
        if state == "without effect":
            return "give zero there, or add the group with damping (0 will do)"
        return f"check the {array} given"

    def _makers(self, column: int, theta: Array | None) -> dict[str, float]:
        """The quantities that an input is made from: those that are zero, else those of either sign, else all."""
        names: dict[str, None] = {}
        through: set[int | None] = set()  # intermediate values that it is made from
        for t in reversed(self._scene.every_term):
            between = t.array == "intermediate"
            own = t.places(0, 0) if between else t.places(*self._layout[t.array])
            if (through if between else {column}) & set(own.tolist()):
                names |= dict.fromkeys(t.quantities)
                through |= {intermediate_of(name) for name in t.made_of}
        quantities = self._scene.quantities
        values = {n: quantities[n].value for n in names}
        if theta is not None:
            values = {n: float(v) for n, v in zip(quantities, theta, strict=True) if n in names}
        zero = {n: v for n, v in values.items() if quantities[n].positive and v == 0.0}
        return zero or {n: v for n, v in values.items() if not quantities[n].positive} or values

    def _entry(self, array: str, i: int) -> str:
        """Which number of an array, in words."""
        if array in ("position", "velocity"):
            return self._scene.node_in_words(i // 3)
        if array in ("mass", "drag_linear", "drag_quadratic"):
            return self._scene.node_in_words(i)
        if array.startswith("volume"):
            return f"'{list(self._scene.volumes.triangles)[i]}'"
        if array in ("friction", "contact_radius"):
            contacts = self._scene.contacts
            names = [*(c.name for c in contacts.contacts), *(p.name for p in contacts.pieces)]
            balls = [] if contacts.balls is None else contacts.balls.particles.tolist()
            return f"'{names[i]}'" if i < len(names) else self._scene.node_in_words(balls[i - len(names)])
        if array not in OF_CONSTRAINTS:
            return f"entry {i}"
        places = next(p for p in places_of_groups(self._scene.groups) if i in p.of(array))
        constraint, *parameter = np.argwhere(places.of(array) == i)[0].tolist()
        names = list(KINDS[places.group.kind]["parameters"])
        part = "".join(f"'{names[k]}' of " for k in parameter)
        return f"{part}constraint {constraint} of group '{places.group.name}'"
