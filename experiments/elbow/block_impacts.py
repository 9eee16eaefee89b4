"""What acts in the first impact of two tossed blocks on a hinge: the balance of momentum before and after it.

    python experiments/elbow/block_impacts.py

Seven velocities describe the blocks: of the first block's center, its spin, and the rate of the hinge. An impact on one
corner changes them by M du = J' P, with the impulse P on that corner. Each impact of the tosses that numbers are from
is explained by P alone, by P and an impulse of a torque in the hinge, and by P and one of a torque about the vertical,
which would be drilling friction of the corner. Takes some seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from block_landings import BOX, DOWN, FOUND, SCALE, TOUCHING, Toss, halves
from blocks import ARM, AXIS, HINGE, MASS, RATE
from sheetbend.arrays.rotations import matrices_of

HIT = 50.0  # m/s^2 beyond gravity, of the middle between the blocks
ALONE = 0.003  # m, by which one corner is lower than all others
FAR = 0.01  # m, above which all corners of the other block stay
LEVER = 0.05  # m, by which angular velocities count beside velocities


@dataclass(frozen=True)
class Impact:
    """Attitudes (2, 3, 3) of the blocks, which of them was hit, the corner's place from its center (3,) m, and the
    seven velocities before and after."""

    name: str
    frames: np.ndarray
    block: int
    corner: np.ndarray
    before: np.ndarray
    after: np.ndarray


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def turn_vector(matrix: np.ndarray) -> np.ndarray:
    """Of a rotation by less than half a turn."""
    twice = np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])
    sine = np.linalg.norm(twice) / 2.0
    return twice / 2.0 * (np.arctan2(sine, (np.trace(matrix) - 1.0) / 2.0) / sine if sine > 0 else 1.0)


def motions(frames: np.ndarray) -> np.ndarray:
    """(7, 12): velocity and spin of the first block, then of the second, for each of the seven velocities."""
    hinge, arm, axis = frames[0] @ HINGE, frames[1] @ ARM, frames[0] @ np.array(AXIS)
    rows = np.zeros((12, 7))
    rows[:3, :3] = rows[6:9, :3] = np.eye(3)
    rows[3:6, 3:6] = rows[9:12, 3:6] = np.eye(3)
    rows[6:9, 3:6] = -skew(hinge) - skew(arm)
    rows[6:9, 6], rows[9:12, 6] = np.cross(axis, arm), axis
    return rows


def mass_matrix(frames: np.ndarray) -> np.ndarray:
    moments = np.diag([FOUND[f"first_inertia_{k}"] for k in BOX])
    masses = np.zeros((12, 12))
    for k, frame in enumerate(frames):
        masses[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = MASS * np.eye(3)
        masses[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = frame @ moments @ frame.T
    rows = motions(frames)
    return rows.T @ masses @ rows


def at_corner(impact: Impact) -> np.ndarray:
    """(3, 7): the corner's velocity for each of the seven."""
    own = motions(impact.frames)[6 * impact.block : 6 * impact.block + 6]
    return own[:3] - skew(impact.corner) @ own[3:]


def velocities(toss: Toss, few: np.ndarray, at: int) -> np.ndarray:
    """The seven at the frame `at`, from what these frames show. The middle falls as a point does."""
    t, frames = (few - at) / RATE, matrices_of(toss.quaternions)
    fit = np.polynomial.polynomial.polyfit
    along = fit(t, toss.middle()[few] - 0.5 * np.outer(t**2, DOWN), 1)[1]
    turns = np.array([turn_vector(frames[k] @ frames[few[0]].T) for k in few])
    spin, rate = fit(t, turns, 2)[1], fit(t, toss.angles[few], 2)[1]
    own = np.r_[np.zeros(3), spin, rate]
    now = np.stack([frames[at], toss.second()[1][at]])
    own[:3] = along - 0.5 * (motions(now) @ own)[6:9]
    return own


def first_impact(toss: Toss) -> Impact | None:
    """None where it is not on one corner alone, or where another follows within five frames."""
    pull = np.linalg.norm(np.diff(toss.middle(), 2, axis=0) * RATE**2 - DOWN, axis=1)
    hits = np.flatnonzero(pull > HIT) + 1
    hits = hits[hits >= toss.free - 2]
    last = next(k for k in hits if k + 1 not in hits)
    after = np.arange(last + 1, last + 5)
    if np.isin(np.append(after, last + 5), hits).any() or hits[0] < 6 or last - hits[0] > 2:
        return None
    seen = np.stack([toss.positions, toss.second()[0]]), np.stack([matrices_of(toss.quaternions), toss.second()[1]])
    heights = (seen[0][:, :, None] + np.einsum("bfij,kj->bfki", seen[1], TOUCHING))[..., 2]
    at = hits[0] + int(heights[:, hits[0] : last + 1].min(axis=(0, 2)).argmin())
    low = np.sort(heights[:, at].ravel())
    if low[1] - low[0] < ALONE:
        return None
    block, corner = np.unravel_index(heights[:, at].argmin(), heights[:, at].shape)
    if heights[1 - block, hits[0] : after[-1] + 1].min() < FAR:
        return None
    before, now = np.arange(hits[0] - 5, hits[0]), seen[1][:, at]
    place = now[block] @ TOUCHING[corner]
    return Impact(toss.name, now, int(block), place, velocities(toss, before, at), velocities(toss, after, at))


def explained(impact: Impact, more: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    """The impulses that come nearest to the change of velocities, and what they leave of it, m/s."""
    pushes = at_corner(impact).T if more is None else np.column_stack([at_corner(impact).T, more])
    weights = np.r_[np.ones(3), np.full(4, LEVER)]
    change = weights * (impact.after - impact.before)
    rows = weights[:, None] * np.linalg.solve(mass_matrix(impact.frames), pushes)
    found = np.linalg.lstsq(rows, change, rcond=None)[0]
    return found, float(np.linalg.norm(change - rows @ found))


def main() -> None:
    every = [impact for toss in halves()[0] if (impact := first_impact(toss))]
    left, against = [], 0
    for one in every:
        vertical = motions(one.frames)[6 * one.block + 3 : 6 * one.block + 6].T @ [0.0, 0.0, 1.0]
        _, alone = explained(one)
        with_hinge, hinged = explained(one, np.eye(7)[6])
        _, drilled = explained(one, vertical)
        left.append([alone, hinged, drilled])
        came, leaves = (at_corner(one) @ u for u in (one.before, one.after))
        against += with_hinge[3] * (one.before[6] + one.after[6]) < 0
        ratio = np.linalg.norm(with_hinge[:2]) / with_hinge[2]
        print(
            f"{one.name}: leaves with {-leaves[2] / came[2]:.2f} of {-came[2]:.2f} m/s, impulse along the table over "
            f"that across {ratio:.2f}; left over {alone:.2f} m/s, with a torque of the hinge {hinged:.2f}, of the "
            f"corner {drilled:.2f}; torque over impulse {1e3 * SCALE * with_hinge[3] / with_hinge[2]:+.1f} mm, hinge "
            f"{one.before[6]:.0f} to {one.after[6]:.0f} rad/s"
        )
    middle = np.median(left, axis=0)
    print(f"medians left over: {middle[0]:.2f}, {middle[1]:.2f}, {middle[2]:.2f} m/s")
    print(f"the torque of the hinge is against its motion in {against} of {len(every)} impacts")


if __name__ == "__main__":
    main()
