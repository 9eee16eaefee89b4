"""Rigid links swinging in gravity or an electric field. Angles in rad, measured from the rest direction."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.special import ellipk


def period_ratio(amplitude: float) -> float:
    """O-7: period of a pendulum over its small-angle period: (2/pi) K(sin^2(amplitude/2)).

    Continuous law. At 30 degrees XPBD with compliance 0 errs by a few tenths of a percent at h = 1/60 s.
    """
    return 2.0 / math.pi * float(ellipk(math.sin(0.5 * amplitude) ** 2))


def pendulum_period(length: float, g: float, amplitude: float = 0.0) -> float:
    """O-7: period [s] of a point mass on a rigid link [m]. Continuous law; BDF1 errs O(h), BDF2 O(h^2).

    Derivatives: T/(2 length) by length, -T/(2 g) by g, exactly 0 by mass.
    """
    return 2.0 * math.pi * math.sqrt(length / g) * period_ratio(amplitude)


def pendulum_steps(
    length: float, g: float, amplitude: float, h: float, steps: int, order: int = 1
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """O-7b: positions and velocities (steps + 1, 2) of a rigid pendulum released at rest. Exact.

    Coordinates are (horizontal, up), the pivot is at 0. The correction of a rigid link to a fixed pivot is
    radial, so that each step scales the prediction to the length: this is implicit Euler itself and XPBD
    alike, at any iteration count. BDF2's first step is BDF1.
    """
    if order not in (1, 2):
        raise ValueError(f"order: got {order}; give 1 (BDF1) or 2 (BDF2)")
    fall = np.array([0.0, -g])
    x = np.zeros((steps + 1, 2))
    v = np.zeros((steps + 1, 2))
    x[0] = length * math.sin(amplitude), -length * math.cos(amplitude)
    for n in range(steps):
        lead, x_past, v_past = h, x[n], v[n]
        if order == 2 and n > 0:
            lead = 2.0 * h / 3.0
            x_past, v_past = (4.0 * x[n] - x[n - 1]) / 3.0, (4.0 * v[n] - v[n - 1]) / 3.0
        predicted = x_past + lead * (v_past + lead * fall)
        x[n + 1] = length * predicted / math.hypot(*predicted)
        v[n + 1] = (x[n + 1] - x_past) / lead
    return x, v


def energy_retained(x: NDArray[np.float64], v: NDArray[np.float64], length: float, g: float) -> NDArray[np.float64]:
    """O-7b: (E - E_bottom)/(E_0 - E_bottom) at each step, from positions and velocities (steps + 1, 2).

    Tolerance 0.005, and the sequence may not rise; against `pendulum_steps` of the same h it is
    exact.
    """
    energy = 0.5 * np.sum(v * v, axis=1) + g * (x[:, 1] + length)
    return energy / energy[0]


def dumbbell_period(charge: float, field: float, mass: float, length: float, amplitude: float = 0.0) -> float:
    """O-12: period [s] of two masses [kg] charged +q and -q [C] on a rigid link [m] in a uniform field [V/m].

    omega^2 = 2 q E/(m L); the field pulls with the constant forces +q E and -q E. Continuous law; BDF1 errs
    O(h). Derivatives: -T/(2 q), -T/(2 E), T/(2 m), T/(2 L).
    """
    omega = math.sqrt(2.0 * charge * field / (mass * length))
    return 2.0 * math.pi / omega * period_ratio(amplitude)


def double_pendulum_tip(
    t: float,
    g: float,
    lengths: tuple[float, float] = (1.0, 1.0),
    masses: tuple[float, float] = (1.0, 1.0),
    angles: tuple[float, float] = (math.pi / 2, math.pi / 2),
) -> NDArray[np.float64]:
    """O-14: tip (2,) as (horizontal, up) [m] of a double pendulum of point masses, released at rest.

    `angles` are measured from the downward vertical. Continuous law, DOP853 at 1e-13; BDF1 converges with
    order 1, BDF2 with order 2, and the energy may not rise. Parameter derivatives: `calculus.derivative`.
    """
    l1, l2 = lengths
    m1, m2 = masses

    def rate(_: float, state: NDArray[np.float64]) -> list[float]:
        q1, q2, w1, w2 = state
        s, c = math.sin(q1 - q2), math.cos(q1 - q2)
        # [(m1 + m2) l1, m2 l2 c; l1 c, l2] (w1', w2') = (a, b), by Cramer's rule.
        a = -m2 * l2 * s * w2 * w2 - (m1 + m2) * g * math.sin(q1)
        b = l1 * s * w1 * w1 - g * math.sin(q2)
        determinant = l1 * l2 * (m1 + m2 * s * s)
        return [
            w1,
            w2,
            (l2 * a - m2 * l2 * c * b) / determinant,
            ((m1 + m2) * l1 * b - l1 * c * a) / determinant,
        ]

    run = solve_ivp(rate, (0.0, t), [*angles, 0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-13)
    if not run.success:
        raise RuntimeError(f"double pendulum: {run.message}")
    q1, q2 = run.y[:2, -1]
    return np.array([l1 * math.sin(q1) + l2 * math.sin(q2), -l1 * math.cos(q1) - l2 * math.cos(q2)])
