"""Air and pressure on triangles, and the scene's wind: what a scene knows of them, and how they are added."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_increasing, check_label, finite, per_item, triangle_array
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import ZERO_OR_MORE, Builder, Term

WIND = ("wind_x", "wind_y", "wind_z")
STRENGTH = "wind_strength"
NAMED_KNOTS = 50  # a wind of more has no quantity for each


class Air:
    """Triangles in air or under pressure, and the scene's one wind.

    Attributes:
        triangles: (n, 3) particles.
        normal, tangential: (n,) kg/m^3, the plain parts of the coefficients.
        pressure: (n,) Pa, the plain part.
        times: (knots,) s, of the wind.
        wind: (knots, 3) m/s, its plain part.
        blowing: times and wind as given; None without a wind.
        resisting: whether triangles have coefficients of the air, not a pressure alone.
    """

    def __init__(self) -> None:
        self.triangles: Array = np.zeros((0, 3), dtype=np.int64)
        self.normal, self.tangential, self.pressure = np.zeros(0), np.zeros(0), np.zeros(0)
        self.times, self.wind = np.zeros(0), np.zeros((0, 3))
        self.blowing: tuple[Array, Array] | None = None
        self.resisting = False

    def add(
        self,
        scene: Builder,
        triangles: ArrayLike,
        normal: ArrayLike,
        tangential: ArrayLike,
        wind: ArrayLike | None,
        times: ArrayLike | None,
        name: str,
    ) -> None:
        """See `Scene.add_air`."""
        check_label("add_air.name", name)
        corners = triangle_array(f"{name}.air.triangles", triangles, scene.particle_count)
        given = {"normal": normal, "tangential": tangential}
        values = {kind: _coefficient(f"{name}.air.{kind}", k, len(corners)) for kind, k in given.items()}
        self.blow(scene, wind, times)
        for kind, k in values.items():
            if np.ndim(given[kind]) == 0:
                self._name(scene, name, f"air_{kind}", k, "kg/m^3")
        self._append(corners, values)
        self.resisting = True

    def blow(self, scene: Builder, wind: ArrayLike | None, times: ArrayLike | None = None) -> None:
        """Set the wind, or check that it is the one that was set (`Scene.set_wind`)."""
        if wind is None:
            if times is not None:
                raise SceneError("wind", "is missing", None, "give it at every one of the times")
            if self.blowing is not None:
                return
            wind = (0.0, 0.0, 0.0)
        t = np.zeros(1) if times is None else finite("wind.times", times, None, SceneError).ravel()
        check_increasing("wind.times", t)
        w = finite("wind", wind, (3,) if times is None else (len(t), 3), SceneError).reshape(-1, 3)
        if self.blowing is not None:
            before_t, before_w = self.blowing
            if not (np.array_equal(t, before_t) and np.array_equal(w, before_w)):
                fix = "leave it out, the wind of a scene is one, or call set_wind before add_air"
                raise SceneError("wind", "differs from the one given before", w[0].tolist(), fix)
            return
        self.blowing = (t, w)
        self.times, self.wind = t, w.copy()
        if times is None:
            for place, (quantity, velocity) in enumerate(zip(WIND, w[0], strict=True)):
                _name_wind(scene, place, quantity, velocity)
        else:
            _name_changing_wind(scene, w)
        self.wind[:] = 0.0

    def press(self, scene: Builder, triangles: ArrayLike, pressure: ArrayLike, name: str) -> None:
        """See `Scene.add_pressure`."""
        check_label("add_pressure.name", name)
        corners = triangle_array(f"{name}.pressure.triangles", triangles, scene.particle_count)
        p = per_item(f"{name}.pressure", pressure, len(corners))
        if np.ndim(pressure) == 0:
            self._name(scene, name, "pressure", p, "Pa")
        if not len(self.times):
            self.times, self.wind = np.zeros(1), np.zeros((1, 3))
        self._append(corners, {"pressure": p})

    def vary(self, scene: Builder, times: Array) -> None:
        """Take knots (knots,) s at which a wind that is constant so far may change.

        Raises:
            SceneError: nothing is in air or has drag, or it changes already.
        """
        self.expect_blown(scene.has_drag)
        if self.blowing is None:
            self.blow(scene, None)
        if len(self.times) > 1:
            fix = "give a constant wind, or none; of a wind that is given over time the quantities are the unknowns"
            raise SceneError("wind", "changes over given times already", len(self.times), fix)
        knots = 3 * np.arange(len(times))
        for i, t in enumerate(scene.terms):
            if t.array == "wind":
                scene.terms[i] = replace(t, index=np.ravel(t.index) + knots)
        self.times, self.wind = times, np.zeros((len(times), 3))

    def expect_blown(self, has_drag: bool) -> None:
        """Refuse a wind that has no effect.

        Raises:
            SceneError: nothing is in air or has drag.
        """
        if not self.resisting and not has_drag:
            wind = None if self.blowing is None else self.blowing[1].tolist()
            fix = "give something drag (drag_linear of a rope) or air (Scene.add_air, or air_normal of a cloth)"
            raise SceneError("wind", "blows on nothing", wind, fix)

    def blow_in(self, scene: Builder, shapes: Array, names: Sequence[Sequence[str]]) -> None:
        """Add to the wind quantities, three for each mode, times its shape (knots, modes) over the knots.

        Args:
            names: by mode and axis.
        """
        knots = 3 * np.arange(len(self.times))
        scene.add_terms(
            [
                Term("wind", knots + axis, shape, ((name, "identity"),))
                for shape, own in zip(shapes.T, names, strict=True)
                for axis, name in enumerate(own)
            ]
        )

    def arrays(self) -> dict[str, Array]:
        """The plain parts of the input arrays."""
        coefficients = {"air_normal": self.normal, "air_tangential": self.tangential}
        return {"wind": self.wind, **coefficients, "pressure": self.pressure}

    def _name(self, scene: Builder, name: str, array: str, values: Array, unit: str) -> None:
        """Let a quantity, `<name>_<array>`, stand for the one value of triangles that are about to be appended."""
        value = float(values[0])
        limits = None if value > 0 or array == "pressure" else ZERO_OR_MORE
        quantity = scene.add_quantity(f"{name}_{array}", value, unit, positive=value > 0, limits=limits)
        where = len(self.triangles) + np.arange(len(values))
        scene.add_terms([Term(array, where, 1.0, ((quantity, "identity"),))])
        values[:] = 0.0

    def _append(self, corners: Array, values: dict[str, Array]) -> None:
        self.triangles = np.concatenate([self.triangles, corners])
        for kind in ("normal", "tangential", "pressure"):
            setattr(self, kind, np.concatenate([getattr(self, kind), values.get(kind, np.zeros(len(corners)))]))


def _name_wind(scene: Builder, place: int, quantity: str, velocity: float, *factors: tuple[str, str]) -> None:
    """Let a quantity stand for one number of the wind."""
    scene.add_quantity(quantity, float(velocity), "m/s", positive=False, scale=1.0)
    scene.add_terms([Term("wind", place, 1.0, ((quantity, "identity"), *factors))])


def _name_changing_wind(scene: Builder, wind: Array) -> None:
    """One factor for all of it, `wind_strength`, and where the knots are few each of their numbers, `wind_x_0` ..."""
    strength = (scene.add_quantity(STRENGTH, 1.0, "", positive=True), "identity")
    if len(wind) > NAMED_KNOTS:
        scene.add_terms([Term("wind", np.arange(wind.size), wind.ravel(), (strength,))])
        return
    for knot, velocities in enumerate(wind):
        for axis, velocity in enumerate(velocities):
            _name_wind(scene, 3 * knot + axis, f"{WIND[axis]}_{knot}", velocity, strength)


def _coefficient(field: str, values: ArrayLike, count: int) -> Array:
    k = per_item(field, values, count)
    if (k < 0).any():
        raise SceneError(field, "must not be negative", float(k.min()), "give air density * drag coefficient / 2")
    return k
