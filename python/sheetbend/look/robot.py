"""A cloth's upper row of markers that rides on a robot's tool: the camera's clock, its frame, and where the row is.

The robot logs poses (p, Q) in its frame and by its clock, the camera sees markers x in another frame and by another
clock. For markers that keep their places c on the tool, x(t) = R (p(t + d) + Q(t + d) c) + T. At a shift d of the
clock, R, T and c follow by Gauss-Newton; the shift is the one with the smallest residual. Where the tool hardly turns,
c and T are not told apart: the smallest c is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..arrays.poses import checked_poses, poses_at
from ..arrays.rotations import matrices_of, quaternions_of, rotation_matrix
from ..arrays.types import Array
from ..errors import RecordingError, SceneError
from ..recording.io.poses import read_poses
from .seen import Seen
from .text import table

SHIFT, COARSE, FINE = 2.0, 0.05, 0.01  # s: how far the clocks may differ, and how finely this is searched
SHARE = 0.8  # of the frames that must lie within the poses
STEPS, RANK = 12, 1e-3  # of Gauss-Newton; singular values, relative, below which nothing is told
FITS = 0.3  # of the row's motion: how far off the row may be on average where the poses are its holder's
MOVES = 0.02  # m/s, of a tool that does not rest
TOOL, CLOCK = "robot", "clock"  # their names in the configuration
SHIFT_SD, TURN_SD, CLOCK_SD = 0.05, 0.1, 0.1  # m, rad, s: of the transform and the clock as they are read off
BEFORE = 0.3  # s, by which the scene starts before the first frame


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a tool as a robot logs them.

    Attributes:
        file: what the configuration calls it.
        times: (poses,) s.
        positions: (poses, 3) m.
        quaternions: (poses, 4), (x, y, z, w).
    """

    file: str
    times: Array
    positions: Array
    quaternions: Array

    @classmethod
    def read(cls, path: Path, file: str) -> Poses:
        """Those of a file.

        Raises:
            RecordingError: the file is missing, damaged, or holds no poses over time.
        """
        try:
            t, x, q = checked_poses("poses", *read_poses(path))
        except SceneError as problem:
            field = f"{path.name}: {problem.field}"
            raise RecordingError(field, problem.problem, problem.got, problem.fix) from problem
        if len(t) < 2:
            raise RecordingError("poses", "are not a motion over time", path.name, "give a row for each time")
        return cls(file, t, x, q)

    def at(self, times: Array) -> tuple[Array, Array]:
        """Positions (n, 3) and rotations (n, 3, 3), linear between poses."""
        x, q = poses_at(self.times, self.positions, self.quaternions, times)
        return x, matrices_of(q)


@dataclass(frozen=True, eq=False)
class Riding:
    """How a row of markers rides on a tool.

    Attributes:
        poses: the tool's.
        shift: s, added to the recording's times to get those of the poses.
        turn: (3, 3) from the axes of the poses' frame to those of the recording.
        position: (3,) m, the origin of the poses' frame in the recording's.
        places: (k, 3) m, of the markers in the tool's axes, but for a constant distance that is in `position`: a row
            that hangs below what holds it turns about that, and its places are those that it would have there.
        off: m, root mean square distance of the markers from there.
        start: s of the poses, where the scene starts.
        rests: whether the tool rests then.
    """

    poses: Poses
    shift: float
    turn: Array
    position: Array
    places: Array
    off: float
    start: float
    rests: bool


def riding(x: Array, t: Array, poses: Poses) -> Riding:
    """How points (frames, k, 3) m at times t, s, ride on a tool.

    Raises:
        RecordingError: they do not move as the poses do.
    """

    def tried_at(shifts: Array) -> list[tuple[float, float]]:
        inside = [((t + d >= poses.times[0]) & (t + d <= poses.times[-1])).mean() >= SHARE for d in shifts]
        return [(_off(x, *_ride(x, t, poses, d), poses, t, d), float(d)) for d in shifts[np.array(inside)]]

    tried = tried_at(np.arange(-SHIFT, SHIFT + COARSE / 2, COARSE))
    fix = "give the poses of the tool that holds the cloth, on a clock within 2 s of the recording's"
    if not tried:
        raise RecordingError(
            "poses", "do not cover the recording", [float(poses.times[0]), float(poses.times[-1])], fix
        )
    off, shift = min(tried_at(min(tried)[1] + np.arange(-COARSE, COARSE + FINE / 2, FINE)))
    moved = float(np.sqrt(np.nanmean(np.nanvar(x, axis=0).sum(axis=1))))
    if off > FITS * moved:
        got = f"{1e3 * off:.3g} mm off, of a motion of {1e3 * moved:.3g} mm"
        raise RecordingError("poses", "are not those of what moves the upper row of markers", got, fix)
    turn, position, places = _ride(x, t, poses, shift)
    start = max(float(poses.times[0]), float(t[0]) + shift - BEFORE)
    near, _ = poses.at(np.array([start - 0.05, start, start + 0.05]))
    rests = bool(np.linalg.norm(np.diff(near, axis=0), axis=1).max() <= MOVES * 0.05)
    return Riding(poses, shift, turn, position, places, off, start, rests)


def off_near(x: Array, t: Array, poses: Poses, shift: float) -> float:
    """m, root mean square distance of points (frames, k, 3) from where they ride best, with the clock near a shift."""
    near = shift + np.arange(-COARSE, COARSE + FINE / 2, FINE)
    return min(_off(x, *_ride(x, t, poses, float(d)), poses, t, float(d)) for d in near)


def _within(x: Array, t: Array, poses: Poses, shift: float) -> tuple[Array, Array, Array]:
    """Markers of the frames within the poses, and the poses then."""
    inside = (t + shift >= poses.times[0]) & (t + shift <= poses.times[-1])
    return x[inside], *poses.at(t[inside] + shift)


def _ride(x: Array, t: Array, poses: Poses, shift: float) -> tuple[Array, Array, Array]:
    """Turn, origin and places (k, 3) that fit best at a shift of the clock."""
    x, p, q = _within(x, t, poses, shift)
    seen = np.isfinite(x[..., 0])
    both = seen.any(axis=1)
    middle = np.nanmean(x[both], axis=1)
    u, _, vt = np.linalg.svd((middle - middle.mean(axis=0)).T @ (p[both] - p[both].mean(axis=0)))
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    places = np.zeros((x.shape[1], 3))
    position = middle.mean(axis=0) - turn @ p[both].mean(axis=0)
    for _ in range(STEPS):
        on = p[:, None] + np.einsum("fij,kj->fki", q, places)
        own = on @ turn.T
        residual = (x - own - position)[seen]
        frames, markers = np.nonzero(seen)
        columns = np.zeros((len(frames), 3, 6 + places.size))
        a = own[seen]
        columns[:, :, :3] = np.cross(np.eye(3)[None], a[:, None]).transpose(0, 2, 1)
        columns[:, :, 3:6] = np.eye(3)
        for k in range(len(places)):
            columns[markers == k, :, 6 + 3 * k : 9 + 3 * k] = turn @ q[frames[markers == k]]
        rows = columns.reshape(-1, columns.shape[2])
        step = np.linalg.pinv(rows.T @ rows, RANK**2, hermitian=True) @ (rows.T @ residual.ravel())
        turn = rotation_matrix("turn", step[:3]) @ turn
        position, places = position + step[3:6], places + step[6:].reshape(-1, 3)
    return turn, position, places


def _off(x: Array, turn: Array, position: Array, places: Array, poses: Poses, t: Array, shift: float) -> float:
    """m, root mean square distance of the markers from where they ride."""
    x, p, q = _within(x, t, poses, shift)
    on = (p[:, None] + np.einsum("fij,kj->fki", q, places)) @ turn.T + position
    return float(np.sqrt(np.nanmean(((x - on) ** 2).sum(axis=2))))


def placed(
    ride: Riding, s: Seen, along: Array, below: float, near: float, height: float
) -> tuple[Array, Array, Array, Array]:
    """Origin and the x and y axes of a cloth in the tool's axes as it hangs at the start, and the origin of the poses'
    frame in the recording's.

    Args:
        along: (k,) m, where what rides is along the cloth's upper edge.
        below: m, from the edge to what rides.
        near: m, how near the tool's origin an edge is that is taken to run through it.
        height: m, of the cloth.
    """
    up = -s.gravity / np.linalg.norm(s.gravity)
    _, (at_start,) = ride.poses.at(np.array([ride.start]))
    x = np.polyfit(along, ride.places, 1)[0]
    x /= np.linalg.norm(x)
    y = at_start.T @ ride.turn.T @ up
    y -= (y @ x) * x
    y /= np.linalg.norm(y)
    edge = (ride.places - along[:, None] * x).mean(axis=0)
    aside = edge - (edge @ x) * x
    position = ride.position + below * up
    if np.linalg.norm(aside) <= near:  # what the row's own swing may seem; a tool's origin is where it grips
        edge, position = edge - aside, position + ride.turn @ at_start @ aside
    return edge - height * y, x, y, position


def lines(ride: Riding, position: Array) -> list[str]:
    """Tables of the tool and of the camera's clock."""
    tool = {"name": TOOL, "file": ride.poses.file, "position": position.tolist()}
    tool |= {"quaternion": quaternions_of(ride.turn).tolist(), "about": about(ride).tolist()}
    tool |= {"shift_sd": SHIFT_SD, "turn_sd": TURN_SD}
    notes = {"position": "of the poses' frame in the recording's, as the upper row of markers moves"}
    clock = {"value": ride.shift, "unit": "s", "scale": 0.1}
    return table("[[scene.tool]]", tool, notes) + table(f"[scene.quantities.{CLOCK}]", clock)


def about(ride: Riding) -> Array:
    """(3,) m, the middle of the tool's path in the recording's frame."""
    return np.asarray(ride.turn @ ride.poses.positions.mean(axis=0) + ride.position)


def notes(ride: Riding, what: str) -> tuple[list[str], list[str]]:
    """What is seen, and what is not known, of what rides on the tool."""
    seen = [
        f"{what} moves as the poses of {ride.poses.file} do, {1e3 * ride.off:.2g} mm off on average, "
        f"if {ride.shift:.2f} s are added to the recording's times"
    ]
    unknown = [
        f"where the tool holds the cloth, and the transform between the two frames: both are read off how {what} "
        "moves, and an edge that seems to be near the tool's origin is taken to run through it. "
        f"The transform is fitted, with a prior of {1e3 * SHIFT_SD:.0f} mm and {TURN_SD} rad, and so is the "
        "clock. Give a calibration (`position`, `quaternion`) and the cloth's place on the tool (`origin`) where you "
        "have them",
        "whether what carries the cloth bends: it is taken as stiff. Add `flex` to [[scene.tool]] if it is not",
    ]
    if not ride.rests:
        unknown.append(
            "how the cloth moves at the start, when the tool moves already: it starts at rest. Record a rest"
        )
    return seen, unknown
