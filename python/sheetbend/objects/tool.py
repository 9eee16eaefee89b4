"""A tool whose pose was recorded, such as a robot's hand, and what it moves."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import finite, is_number, vectors
from ..arrays.poses import checked_poses, poses_at
from ..arrays.rotations import rotated, rotation_vectors
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import ZERO_OR_MORE
from ..recording.io.poses import read_poses
from ..scene.colliders import Collider
from ..scene.given import check_scene
from ..scene.scene import Scene
from .hand_eye import HandEye

Shape = TypeVar("Shape", bound=Collider)
COVERED = 1e-9  # s
SMOOTHING, FEWEST = 0.1, 5  # s and poses, over which an acceleration is taken from a parabola


@dataclass(frozen=True, eq=False)
class Tool:
    """Poses of a tool over time, at any rate, evenly spaced or not.

    Attributes:
        times: (poses,) s, increasing.
        positions: (poses, 3) m, the tool's origin in the poses' frame.
        quaternions: (poses, 4), (x, y, z, w), from the tool's axes to those of the poses' frame.
        frame: where the poses' frame lies in the recording's frame; by default it is the same.
        flex: s^2, how far what the tool holds is off it per acceleration, g - a, because the rod that carries it bends:
            1/(2 pi f)^2 of the rod's lowest frequency f, for motions well below that. The quantity `<frame>_flex`;
            None = a stiff rod.
        rod: (3,) direction of the rod in the tool's axes, along which it does not give; None = it gives all ways.

    Raises:
        SceneError: shapes, NaN, times that do not increase, or quaternions of no length.
    """

    times: Array
    positions: Array
    quaternions: Array
    frame: HandEye = field(default_factory=lambda: HandEye("tool"))
    flex: float | None = None
    rod: ArrayLike | None = None

    def __post_init__(self) -> None:
        if self.flex is not None and not (is_number(self.flex) and self.flex >= 0):
            fix = "give 1/(2 pi f)^2 of the rod's lowest frequency f in Hz, or leave it out"
            raise SceneError("tool.flex", "must not be negative", self.flex, fix)
        if self.rod is not None:
            rod = finite("tool.rod", self.rod, (3,), SceneError)
            if not rod.any():
                raise SceneError("tool.rod", "has no length", rod.tolist(), "give a direction in the tool's axes")
            object.__setattr__(self, "rod", rod / np.linalg.norm(rod))
        poses = checked_poses("tool", self.times, self.positions, self.quaternions)
        for name, values in zip(("times", "positions", "quaternions"), poses, strict=True):
            object.__setattr__(self, name, values)

    @classmethod
    def load(
        cls,
        path: str | Path,
        frame: HandEye | None = None,
        flex: float | None = None,
        rod: ArrayLike | None = None,
        body: str | None = None,
    ) -> Tool:
        """Read poses from a CSV or NPZ file, see `sheetbend.recording.io.poses`; of a take of Motive those of `body`.

        Raises:
            RecordingError: the file is missing, damaged, or holds no poses.
        """
        poses = read_poses(Path(path), body)
        return cls(*poses, HandEye("tool") if frame is None else frame, flex, rod)

    def shifted(self, t0: float) -> Tool:
        """The same poses on a clock whose zero is the old time t0, s."""
        return replace(self, times=self.times - finite("t0", t0, (), SceneError))

    def between(self, start: float, stop: float) -> Tool:
        """The poses that a motion from `start` to `stop` s needs: those within, and two more on either side.

        Raises:
            SceneError: the poses begin later or end earlier.
        """
        finite("start", start, (), SceneError)
        finite("stop", stop, (), SceneError)
        if self.times[0] > start + COVERED or self.times[-1] < stop - COVERED:
            span = f"{self.times[0]:.6g} to {self.times[-1]:.6g} s"
            fix = f"they reach from {span}: start later, cut the recording, or set its clock right"
            raise SceneError("tool.times", "do not cover the motion", (float(start), float(stop)), fix)
        first = max(int(np.searchsorted(self.times, start, side="right")) - 3, 0)
        last = int(np.searchsorted(self.times, stop)) + 3
        own = slice(first, last)
        return replace(self, times=self.times[own], positions=self.positions[own], quaternions=self.quaternions[own])

    def path(self, points: ArrayLike) -> Array:
        """(poses, k, 3) m: where points (k, 3) m in the tool's axes are in the recording's frame, uncorrected."""
        arm = rotated(self.quaternions[:, None], vectors("points", points)[None])
        return self.frame.points(self.positions[:, None] + arm)

    def placed(self, points: ArrayLike, time: float = 0.0) -> Array:
        """(k, 3) m: where points in the tool's axes are in the recording's frame at a time, uncorrected."""
        position, quaternion = self._pose(time)
        return self.frame.points(position + rotated(quaternion, vectors("points", points)))

    def held(self, x: ArrayLike, time: float = 0.0) -> Array:
        """(k, 3) m: the places in the tool's axes of points (k, 3) m of the recording's frame at a time; `placed`
        backwards."""
        position, quaternion = self._pose(time)
        back = np.array([-1.0, -1.0, -1.0, 1.0])
        own = rotated(back * self.frame.quaternion, vectors("x", x) - self.frame.position)
        return rotated(back * quaternion, own - position)

    def drive(self, scene: Scene, particles: ArrayLike, points: ArrayLike | None = None) -> None:
        """Let particles ride on the tool; the six quantities of its frame correct their motion.

        Args:
            particles: (k,) indices.
            points: (k, 3) m, their places in the tool's axes; by default those that they have at 0 s, where the scene
                starts, from their initial positions and the transform as given. Give them where the transform is in
                doubt: an error of it would be in these places too.

        Raises:
            SceneError: shapes, NaN, or particles that are driven already.
        """
        check_scene(scene)
        which = scene.node_array("tool.particles", particles)
        at = self.held(scene.nodes[which]) if points is None else points
        path = self.path(finite("tool.points", at, (len(which), 3), SceneError))
        self.frame.drive(scene, which, self.times, path)
        if self.flex is not None:
            limits = None if self.flex > 0 else ZERO_OR_MORE
            name = f"{self.frame.name}_flex"
            scene.add_quantity(name, self.flex, "s^2", positive=self.flex > 0, limits=limits, shared=True)
            given = self._load(path.mean(axis=1), scene.gravity)
            every = np.broadcast_to(given[:, None], path.shape)
            scene.add_motion_term(which, every, {name: "identity"})

    def carry(self, collider: Shape) -> Shape:
        """A shape that moves and turns with the tool, from where it is given at 0 s, where the scene starts.

        The six quantities of the tool's frame do not correct it.

        Raises:
            SceneError: the tool has a rod that bends.
        """
        if self.flex is not None:
            fix = "leave out flex, or give the motion by Collider.moving"
            raise SceneError("tool.flex", "is that of a rod that bends, which no collider follows", self.flex, fix)
        if not hasattr(collider, "poses"):
            raise SceneError("collider", "is not a shape", collider, "give a Plane, Sphere, Capsule, Cylinder or Box")
        origin = collider.poses.positions[0]
        moved = self.path(self.held(origin[None]))[:, 0] - origin
        x, w = np.split(self._pose(0.0)[1], [3])
        q, qw = np.split(self.quaternions, [3], axis=1)
        axes = w * q - qw * x - np.cross(q, x)  # of each quaternion times the inverse of the one at 0 s
        turns = np.concatenate([self.frame.directions(axes), qw * w + (q @ x)[:, None]], axis=1)
        return collider.moving(self.times, moved, rotation_vectors(turns, np.zeros(3)))

    def _load(self, path: Array, gravity: Array) -> Array:
        """(poses, 3) m/s^2: what a path (poses, 3) m of the grip puts on its rod, across it."""
        load = gravity - accelerations(self.times, path)
        if self.rod is None:
            return np.asarray(load)
        along = self.frame.directions(rotated(self.quaternions, np.asarray(self.rod)))
        return np.asarray(load - (load * along).sum(axis=1, keepdims=True) * along)

    def _pose(self, time: float) -> tuple[Array, Array]:
        """Position (3,) and unit quaternion (4,) at a time."""
        return poses_at(self.times, self.positions, self.quaternions, finite("time", time, (), SceneError))


def accelerations(times: Array, x: Array) -> Array:
    """(poses, 3) m/s^2 of a path (poses, 3) m, zero for fewer than three poses.

    Each is that of the parabola that fits the poses around it best (Savitzky and Golay 1964, Anal. Chem. 36, 1627).

    The window is `SMOOTHING` wide and holds at least `FEWEST` poses. At both ends of the path it is one-sided.
    """
    found = np.zeros_like(x)
    count = len(times)
    if count < 3:
        return found
    first = np.searchsorted(times, times - SMOOTHING / 2)
    last = np.searchsorted(times, times + SMOOTHING / 2, side="right")
    for k in range(count):
        missing = FEWEST - (last[k] - first[k])
        low = max(int(first[k]) - max(-(-missing // 2), 0), 0)
        high = min(max(int(last[k]) + max(missing // 2, 0), low + FEWEST), count)
        own = slice(max(min(low, high - FEWEST), 0), high)
        t = times[own] - times[k]
        found[k] = 2.0 * np.linalg.lstsq(np.vander(t, 3), x[own], rcond=None)[0][0]
    return found
