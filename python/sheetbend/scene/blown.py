"""Building scenes on which air, wind and pressure act."""

from __future__ import annotations

from numpy.typing import ArrayLike

from .collisions import CollidingScene


class BlownScene(CollidingScene):
    """A scene under construction on which air, wind and pressure may act."""

    def add_air(
        self,
        triangles: ArrayLike,
        normal: ArrayLike,
        tangential: ArrayLike,
        wind: ArrayLike | None = None,
        times: ArrayLike | None = None,
        name: str = "cloth",
    ) -> None:
        """Let air act on triangles: A (k_n |u_n| u_n + k_t |u_t| u_t) on each, a third to every corner, where the wind
        relative to the triangle, u, parts into u_n along its normal and u_t across it.

        k is air density * drag coefficient / 2 (air: 1.2 kg/m^3). One value for all is the quantity
        `<name>_air_normal` or `<name>_air_tangential`; a constant wind is the quantities `wind_x`, `wind_y`, `wind_z`.
        A changing one is multiplied by `wind_strength` and, with at most 50 knots, is `wind_x_0`, `wind_y_0`,
        `wind_z_0`, `wind_x_1` and so on.
        The force is taken at the extrapolated state, so substeps must resolve it: with BDF2 h k |u| must stay below 2/3
        of the area density. `set_drag` has no such limit.

        Args:
            triangles: (count, 3) particles.
            normal, tangential: k_n, k_t, one for all or (count,), kg/m^3.
            wind: m/s, one for the whole scene: (3,), or (knots, 3) at `times`; still air, or that of an earlier call,
                by default.
            times: (knots,) s, increasing; the wind is linear between and constant outside.
            name: of the quantities.

        Raises:
            SceneError: shapes, NaN, negative coefficients, corners that are not distinct, times that do not increase,
                or another wind than an earlier call's.
        """
        self._building()
        self.air.add(self, triangles, normal, tangential, wind, times, name)

    def set_wind(self, wind: ArrayLike, times: ArrayLike | None = None) -> None:
        """Let the air move: the wind blows on everything that has drag, such as a rope with `drag_linear`, and on
        triangles in air (`add_air`).

        Its quantities are those of `add_air`, which can set the wind too: call `set_wind` before it.

        Args:
            wind: m/s, (3,), or (knots, 3) at `times`.
            times: (knots,) s, increasing; the wind is linear between and constant outside.

        Raises:
            SceneError: shapes, NaN, times that do not increase, or another wind than an earlier call's; when the scene
                is compiled: a wind that blows on nothing.
        """
        self._building()
        self.air.blow(self, wind, times)

    def add_pressure(self, triangles: ArrayLike, pressure: ArrayLike, name: str = "cloth") -> None:
        """Let a pressure push triangles along their normals, (x1 - x0) x (x2 - x0): pressure * area on each, a third to
        every corner.

        One value for all is the quantity `<name>_pressure`. The force is taken at the extrapolated state, so substeps
        must resolve it: h^2 p/(area density * edge) must stay well below 1 (a balloon is calm at 0.02, not at 0.35).
        `equilibrium` takes it where it has an energy: a closed surface, or one with a held rim, under one pressure.

        Args:
            triangles: (count, 3) particles; those of a closed surface, counterclockwise from outside, are blown up.
            pressure: Pa, one for all or (count,), inside above outside.
            name: of the quantity.

        Raises:
            SceneError: shapes, NaN, or corners that are not distinct.
        """
        self._building()
        self.air.press(self, triangles, pressure, name)
