"""Which particles of a scene are held, and how they are moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite
from ..errors import SceneError
from .moving_clamp import clamped_ends, keep_direction, let_go
from .nodes import SceneNodes


class HeldScene(SceneNodes):
    """A scene under construction, and the motion that its held particles are given."""

    def drive(self, particles: ArrayLike, times: ArrayLike, positions: ArrayLike, interpolation: str = "cubic") -> None:
        """Give particles a motion. An end of a rope that is clamped takes its clamp along, which keeps its direction.

        Args:
            particles: (k,) indices.
            times: (knots,) s, increasing; one set of knots serves the whole scene.
            positions: (knots, k, 3) m.
            interpolation: "cubic" (C1) or "linear" (kicks at every knot).

        Raises:
            SceneError: shapes, NaN, times that do not increase, other knots than an earlier call's, or particles that
                are attached to a body.
        """
        self._building()
        which, ends = self._with_clamps("drive", particles)
        x = finite("drive.positions", positions, None, SceneError)
        if ends and x.ndim == 3 and x.shape[1] == len(which):
            x = np.concatenate([x, x[:, [slot for slot, _ in ends]]], axis=1)
            which = [*which, *(ghost for _, ghost in ends)]
        self.boundary.drive(which, times, x, interpolation)
        keep_direction(self, which, ends)

    def follow(
        self,
        particles: ArrayLike,
        times: ArrayLike,
        motion: ArrayLike,
        markers: Sequence[str],
        weights: ArrayLike | None = None,
        placed: ArrayLike | None = None,
        interpolation: str = "cubic",
    ) -> None:
        """Give particles the motion of recorded markers, so that a fit can allow for its noise
        (`Experiment.driven_sigma`). Clamped ends of ropes take their clamp along, as in `drive`.

        Args:
            particles: (k,) indices.
            times: (knots,) s, increasing, from the scene's start on; see `drive`.
            motion: (knots, markers, 3) m, of the markers.
            markers: their names in the recording.
            weights: (k, markers), by which a particle moves with each; one marker for each particle by default.
            placed: (k, 3) m, where the particles are at the first knot: they move from there by what the markers move.
                By default they are where the weighted markers are.
            interpolation: "cubic" (C1) or "linear" (kicks at every knot).

        Raises:
            SceneError: shapes, NaN, times that do not increase or differ from an earlier call's, names that are
                repeated, particles that are driven already or attached to a body.
        """
        self._building()
        which, ends = self._with_clamps("follow", particles)
        if ends:
            slots = [slot for slot, _ in ends]
            w = np.eye(len(which)) if weights is None else np.asarray(weights, dtype=float)
            weights = np.concatenate([w, w[slots]])
            if placed is not None:
                placed = np.concatenate([np.asarray(placed, dtype=float), np.asarray(placed, dtype=float)[slots]])
            which = [*which, *(ghost for _, ghost in ends)]
        self.boundary.follow(which, times, motion, markers, weights, placed, interpolation)
        keep_direction(self, which, ends)

    def _with_clamps(self, field: str, particles: ArrayLike) -> tuple[list[int], list[tuple[int, int]]]:
        """Particles to be driven, and those of them that are clamped ends of ropes, which are let go."""
        which: list[int] = self.node_array(field, particles).tolist()
        self._refuse_attached(field, which)
        ends = clamped_ends(self, which)
        let_go(self, which, ends)
        return which, ends

    def add_motion_term(self, particle: ArrayLike, coefficients: ArrayLike, factors: Mapping[str, str]) -> None:
        """Add to a driven particle's motion (knots, 3) coefficients times a product of functions of quantities; to
        those of several particles (k,) with coefficients (knots, k, 3).

        Raises:
            SceneError: the particle is not driven, shapes, NaN, or unknown quantities.
        """
        self._building()
        self.boundary.add_term(particle, coefficients, factors, self.quantities)
