"""Masses of a linkage of arms from how it swings: momentum balances, linear in the masses and in the friction.

With the angle q_k of arm k (from straight down), its rate w_k and its length L_k, a planar linkage has the Lagrangian

    1/2 sum_k A_k w_k^2 + sum_{j<k} L_j B_k cos(q_j - q_k) w_j w_k + g sum_k B_k cos q_k

with A_k = J_k + L_k^2 M_k and B_k = S_k + L_k M_k: the inertia J_k and the first moment S_k of arm k about its pivot,
and the mass M_k of all arms that it carries. For each arm, the change of its momentum over a short interval is the
integral of its torques. Only rates are needed, no accelerations. Motion shows ratios alone: the first arm weighs 1 kg.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays.types import Array

INTERVAL = 0.2  # s, of one momentum balance
UNIFORM = 4.0 / 3.0  # mass over first_moment^2/inertia of a uniform rod
LEAST, MOST = 1.1, 0.8  # of first_moment^2/inertia, an arm's mass at least; of what its carrier has room for, at most
PERCUSSION = 0.97  # of first_moment times length, the inertia of an arm that carries another at most (see `add_arm`)


@dataclass(frozen=True, eq=False)
class Moments:
    """(arms,) mass kg, and first moment kg m and inertia kg m^2 about the pivot; (arms,) viscosity N m s/rad of the
    hinges."""

    mass: Array
    first: Array
    inertia: Array
    viscosity: Array


@dataclass(frozen=True, eq=False)
class Swing:
    """A part of a motion: times (frames,) s, angles (arms, frames) rad from straight down and rates rad/s, smooth, and
    (frames,) whether all of it is seen there."""

    times: Array
    angles: Array
    rates: Array
    seen: Array


def moments(parts: Sequence[Swing], lengths: Array, gravity: float) -> Moments:
    """Of each arm, from how it swings; those of uniform rods, alike per length, where that is not how arms swing.

    Args:
        parts: of the motion.
        lengths: (arms,) m, from hinge to hinge, and of the last arm to its marker.
        gravity: m/s^2.
    """
    rows = np.concatenate([_balances(part, lengths, gravity) for part in parts])
    unknown = rows.shape[1] - 1
    found = np.full(unknown + 1, np.nan)
    if len(rows) > unknown:
        found = np.concatenate([[1.0], np.linalg.lstsq(rows[:, 1:], -rows[:, 0])[0]])
    inertia, first, viscosity = found.reshape(3, -1)
    return _shared(inertia, first, viscosity, lengths) or _rods(lengths)


def _balances(part: Swing, lengths: Array, gravity: float) -> Array:
    """Coefficients (rows, 3 * arms) of A, B and the viscosity of each hinge in sums that are zero: what the momentum of
    an arm changes by in an interval, less the impulse of the torques on it."""
    times, angles, rates = part.times, part.angles, part.rates
    arms = len(lengths)
    inertia, first, viscosity = np.eye(3 * arms).reshape(3, arms, 3 * arms)
    momentum = np.einsum("kf,kc->kfc", rates, inertia)
    torque = np.einsum("kf,kc->kfc", -gravity * np.sin(angles), first)
    for j in range(arms):
        for k in range(j + 1, arms):
            apart, coupled = angles[j] - angles[k], lengths[j] * first[k]
            momentum[j] += np.outer(np.cos(apart) * rates[k], coupled)
            momentum[k] += np.outer(np.cos(apart) * rates[j], coupled)
            turned = np.outer(np.sin(apart) * rates[j] * rates[k], coupled)
            torque[j] -= turned
            torque[k] += turned
    for k in range(arms):
        slip = rates[k] - (rates[k - 1] if k else 0.0)
        torque[k] -= np.outer(slip, viscosity[k])
        if k:
            torque[k - 1] += np.outer(slip, viscosity[k])
    lost = np.concatenate([[0], np.cumsum(~part.seen)])
    step = np.diff(times)[None, :, None]
    impulse = np.zeros_like(torque)
    impulse[:, 1:] = np.cumsum(0.5 * step * (torque[:, 1:] + torque[:, :-1]), axis=1)
    stride = max(1, round(INTERVAL / float(np.median(step))))
    whole = lost[stride + 1 :] == lost[: -stride - 1]
    balance = momentum - impulse
    return np.asarray((balance[:, stride:] - balance[:, :-stride])[:, whole].reshape(-1, 3 * arms))


def _shared(inertia: Array, first: Array, viscosity: Array, lengths: Array) -> Moments | None:
    """The arms' own, from the last one up: each weighs what a uniform rod with its moments does, where its carrier has
    room for that. A mass at a hinge moves like a part of either arm, so motion leaves it open."""
    arms = len(lengths)
    mass, own, about, carried = np.zeros(arms), np.zeros(arms), np.zeros(arms), 0.0
    for k in reversed(range(arms)):
        own[k], about[k] = first[k] - lengths[k] * carried, inertia[k] - lengths[k] ** 2 * carried
        if not (own[k] > 0.0 and about[k] > 0.0):
            return None
        if k < arms - 1:
            about[k] = min(about[k], PERCUSSION * own[k] * lengths[k])
        least = own[k] ** 2 / about[k]
        mass[k] = UNIFORM * least
        if k:
            above = lengths[k - 1]
            room = MOST * min(first[k - 1] / above, inertia[k - 1] / above**2) - carried
            mass[k] = min(mass[k], room)
        if mass[k] < LEAST * least:
            return None
        carried += mass[k]
    return Moments(mass / mass[0], own / mass[0], about / mass[0], viscosity / mass[0])


def _rods(lengths: Array) -> Moments:
    mass = lengths / lengths[0]
    return Moments(mass, mass * lengths / 2.0, mass * lengths**2 / 3.0, np.zeros(len(lengths)))
