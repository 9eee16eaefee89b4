"""A rope that swings in a plane below a moving pivot, in the angles of its links: another simulator than sheetbend's.

n rigid links of length l = L/n turn against each other by elastic, damped joints. Masses and drag are lumped at the
nodes. With A_ij = l^2 (mass beyond links i and j), B_i = l (mass beyond i), a the acceleration of the pivot, e_i =
(cos, sin) of angle i from straight down:

    sum_j A_ij [cos(t_i - t_j) t_j'' + sin(t_i - t_j) t_j'^2] = -B_i [a_x cos t_i + (a_z + g) sin t_i]
                                                        + bending_i - sum over nodes k beyond i of l drag_k v_k . e_i

Bending is EI/l (d + tau d') for the turn d of each joint. An implicit Runge-Kutta method of order 5 (Hairer and Wanner
1996) with steps of its own choice integrates it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Curve = Callable[[float], Array]


def swinging_rope(
    times: Array,
    pivot: tuple[Curve, Curve, Curve],
    length: float,
    links: int,
    density: float,
    EI: float,
    tau: float,
    drag: float,
    g: float = 9.81,
) -> Array:
    """Nodes (frames, links + 1, 2) in m, as (horizontal, up); the rope hangs at rest at first.

    Args:
        times: (frames,) s.
        pivot: place m, velocity m/s and acceleration m/s^2 of the upper end, each (horizontal, up).
        density: kg/m.
        EI: N m^2.
        tau: s, of the joints' damping.
        drag: N s/m^2, force over velocity and length.
    """
    link = length / links
    share = np.append(np.ones(links - 1), 0.5) * link  # length at each node below the pivot
    beyond = np.cumsum(share[::-1])[::-1]
    A = link**2 * density * beyond[np.maximum.outer(np.arange(links), np.arange(links))]
    B = link * density * beyond

    def rate(t: float, y: Array) -> Array:
        angle, spin = y[:links], y[links:]
        along = np.stack([np.cos(angle), np.sin(angle)])
        v = pivot[1](t)[:, None] + link * np.cumsum(along * spin, axis=1)
        push = np.cumsum((drag * share * v)[:, ::-1], axis=1)[:, ::-1]
        turn = np.diff(angle) + tau * np.diff(spin)
        moment = EI / link * (np.append(turn, 0.0) - np.append(0.0, turn))
        a = pivot[2](t) + np.array([0.0, g])
        between = angle[:, None] - angle[None]
        force = moment - B * (a @ along) - link * (push * along).sum(0) - (A * np.sin(between)) @ spin**2
        return np.concatenate([spin, np.linalg.solve(A * np.cos(between), force)])

    found = solve_ivp(rate, (times[0], times[-1]), np.zeros(2 * links), "Radau", times, rtol=1e-7, atol=1e-9)
    angle = found.y[:links].T
    steps = link * np.stack([np.sin(angle), -np.cos(angle)], axis=2)
    start = np.array([pivot[0](t) for t in times])[:, None]
    return np.concatenate([start, start + np.cumsum(steps, axis=1)], axis=1)
