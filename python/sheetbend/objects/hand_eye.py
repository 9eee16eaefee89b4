"""The rigid transform from the frame of a tool's poses to the frame of a recording, with a correction of six numbers.

A robot reports its tool in its own frame, a camera sees the cloth in another. The transform between them is calibrated
(eye-to-hand; Tsai & Lenz 1989, IEEE Trans. Robot. Autom. 5, 345), and the calibration is off by some millimeters and
degrees. The correction moves whatever rides on the tool, x -> a + s + Rz(c) Ry(b) Rx(a') (x - a), about a fixed point a
by the shift s and the angles a', b, c. A product of three plane rotations is a sum of products of sines and cosines, so
the map from the six quantities to the scene's inputs and its derivative are exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_label, finite, is_number, vectors
from ..arrays.rotations import rotated, unit_quaternions
from ..arrays.types import Array
from ..errors import InputError, SceneError
from ..quantities.expression import rotation, rotation_products, vector
from ..quantities.parameters import Parameter
from ..quantities.quantities import Term
from ..scene.body import FrameState
from ..scene.moving_clamp import clamped_ends

if TYPE_CHECKING:
    from ..scene.scene import Scene

AXES = "xyz"
SHIFT, TURN = 0.01, 0.1  # m, rad: the sizes against which the precision of the six is judged


@dataclass(frozen=True, eq=False)
class HandEye:
    """The transform from the frame of tool poses to the recording's frame.

    Its correction is the quantities `<name>_x`, `<name>_y`, `<name>_z` (m) and `<name>_turn_x`, `<name>_turn_y`,
    `<name>_turn_z` (rad, about the recording's axes, x first), all zero where the transform is right as given.

    Attributes:
        name: prefix of the six quantities.
        position: (3,) m, the origin of the poses' frame in the recording's frame.
        quaternion: (4,) (x, y, z, w), from the axes of the poses' frame to those of the recording.
        about: (3,) m, a point of the recording's frame about which the correction turns. Recordings that share the six
            numbers share it. Near the tool's places shift and turn are hardly correlated.

    Raises:
        SceneError: shapes, NaN, or a quaternion of no length.
    """

    name: str
    position: Array
    quaternion: Array
    about: Array

    def __init__(
        self,
        name: str,
        position: ArrayLike = (0.0, 0.0, 0.0),
        quaternion: ArrayLike = (0.0, 0.0, 0.0, 1.0),
        about: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        check_label("hand_eye.name", name)
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "position", finite(f"{name}.position", position, (3,), SceneError))
        object.__setattr__(self, "quaternion", unit_quaternions(f"{name}.quaternion", quaternion, (4,)))
        object.__setattr__(self, "about", finite(f"{name}.about", about, (3,), SceneError))

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the six: three shifts, three turns."""
        return (*(f"{self.name}_{k}" for k in AXES), *(f"{self.name}_turn_{k}" for k in AXES))

    def points(self, x: ArrayLike) -> Array:
        """Points (..., 3) m of the poses' frame in the recording's frame, without the correction."""
        return self.directions(x) + self.position

    def directions(self, d: ArrayLike) -> Array:
        """Directions (..., 3) of the poses' frame in the recording's frame, without the correction."""
        return rotated(self.quaternion, vectors(f"{self.name}.directions", d))

    def corrected(self, x: Array, values: Mapping[str, float]) -> Array:
        """Points (..., 3) m of the recording's frame, moved by the correction; quantities not in `values` are zero."""
        at = {name: values.get(name, 0.0) for name in self.quantities}
        functions = {"sin": np.sin, "cos": np.cos}
        turn = np.zeros((3, 3))
        for factors, matrix in rotation_products(self.quantities[3:]):
            turn += matrix * np.prod([functions[f](at[q]) for q, f in factors.items()])
        return np.asarray(self.about + [at[q] for q in self.quantities[:3]] + (x - self.about) @ turn.T)

    def parameters(self, shift: float, turn: float) -> list[Parameter]:
        """The six as fit parameters with priors of mean zero.

        Args:
            shift: standard deviation of each shift, m.
            turn: of each turn, rad.

        Raises:
            InputError: one is not positive.
        """
        for field, sd in (("shift", shift), ("turn", turn)):
            if not (is_number(sd) and sd > 0):
                raise InputError(f"{self.name}.{field}", "must be positive", sd, "give a standard deviation")
        return [
            Parameter(name=q, initial=0.0, prior=(0.0, sd), unit=unit, scale=size)
            for own, sd, unit, size in ((slice(3), shift, "m", SHIFT), (slice(3, 6), turn, "rad", TURN))
            for q in self.quantities[own]
        ]

    def drive(
        self, scene: Scene, particles: ArrayLike, times: Array, motion: Array, vectors: ArrayLike = False
    ) -> None:
        """Give particles a motion in the recording's frame that the correction moves.

        Args:
            scene: of the particles.
            particles: (k,) indices.
            times: (knots,) s, see `Scene.drive`.
            motion: (knots, k, 3) m, without the correction.
            vectors: which of them are directions, which turn and don't shift; one for all or (k,).

        Raises:
            SceneError: as `Scene.drive`.
        """
        which = np.atleast_1d(np.asarray(particles))
        if clamped_ends(scene, which.tolist()):
            fix = "hold the end by a grip that has these poses: Grip.from_poses, [[scene.rope.grip]]"
            raise SceneError(
                "drive.particles", "are clamped ends, which a tool would have to turn", which.tolist(), fix
            )
        scene.drive(which, times, motion)
        scene.boundary.posed.update(which.tolist())
        shifts = ~np.broadcast_to(np.asarray(vectors, dtype=bool), which.shape)
        arm = motion - np.where(shifts[:, None], self.about, 0.0)
        for factors, coefficients in self._moves(scene, arm, shifts):
            scene.add_motion_term(which, coefficients, factors)

    def place(self, scene: Scene, particles: Array) -> None:
        """Let the correction move the initial positions of particles (k,), as a rigid body."""
        x = scene.nodes[particles]
        index = (3 * np.asarray(particles)[:, None] + np.arange(3)).ravel()
        for factors, coefficients in self._moves(scene, (x - self.about)[None], np.ones(len(x), dtype=bool)):
            kept = coefficients[0].ravel() != 0.0
            term = Term("position", index[kept], coefficients[0].ravel()[kept], tuple(factors.items()))
            scene.add_terms([term] if kept.any() else [])

    def corrected_start(self, scene: Scene, start: FrameState) -> FrameState:
        """The state of a body's frame at the start, moved by the correction."""
        self.declare(scene)
        turn, arm = rotation(self.quantities[3:]), start.origin - self.about
        return replace(
            start,
            origin=vector(self.quantities[:3]) + self.about + turn @ arm,
            frame=turn @ start.frame,
            velocity=turn @ start.velocity,
            spin=turn @ start.spin,
        )

    def turned(self, by: Array, factors: Mapping[str, str]) -> Iterator[tuple[dict[str, str], Array]]:
        """Terms of vectors (..., 3), which have factors of their own, as the correction turns them."""
        for own, matrix in rotation_products(self.quantities[3:]):
            yield {**factors, **own}, by @ matrix.T

    def declare(self, scene: Scene) -> None:
        """Add the six quantities to a scene, unless they are there."""
        for q, unit, size in zip(self.quantities, ("m",) * 3 + ("rad",) * 3, (SHIFT,) * 3 + (TURN,) * 3, strict=True):
            scene.add_quantity(q, 0.0, unit, positive=False, scale=size, shared=True)

    def _moves(self, scene: Scene, arm: Array, shifts: Array) -> Iterator[tuple[dict[str, str], Array]]:
        """Terms (factors, coefficients (knots, k, 3)) of what the correction adds to vectors arm (knots, k, 3); those
        of `shifts` (k,) also shift."""
        self.declare(scene)
        yield {}, -arm
        yield from self.turned(arm, {})
        for axis, q in enumerate(self.quantities[:3]):
            yield {q: "identity"}, np.broadcast_to(shifts[:, None] * np.eye(3)[axis], arm.shape)
