"""One particle or one link under BDF1 (implicit Euler) and BDF2: closed forms of the discrete program.

BDF2 always means BDF2 whose first substep is BDF1. h is the substep [s].
"""

import cmath
import math

import numpy as np
from numpy.typing import NDArray


def _require_order(order: int) -> None:
    if order not in (1, 2):
        raise ValueError(f"order: got {order}; give 1 (BDF1) or 2 (BDF2)")


def free_fall(steps: int, h: float, g: float, x0: float = 0.0, v0: float = 0.0, order: int = 1) -> float:
    """O-1: position [m] along gravity after `steps` substeps of free fall. Exact (1e-13).

    BDF1: x = x0 + n h v0 + n(n+1)/2 h^2 g.  BDF2: x = x0 + t v0 + g t^2/2 + 3/4 g h^2 (1 - 3^-n), t = n h.
    The continuous law is x0 + t v0 + g t^2/2.
    """
    _require_order(order)
    return x0 + steps * h * v0 + g * free_fall_dg(steps, h, order)


def free_fall_dg(steps: int, h: float, order: int = 1) -> float:
    """O-1: d(position)/dg [s^2] of `free_fall`. Exact. The derivative with respect to v0 is steps * h, by x0 it is
    1."""
    _require_order(order)
    if order == 1:
        return 0.5 * steps * (steps + 1) * h * h
    return 0.5 * (steps * h) ** 2 + 0.75 * h * h * (1.0 - 3.0**-steps)


def amplification(omega_h: float, order: int = 1) -> complex:
    """O-4: the factor z by which one step multiplies the mode u'' = -omega^2 u. Exact.

    BDF1: z = 1/(1 - i omega h).  BDF2: z = 1/(2 - sqrt(1 + 2 i omega h)), its principal root.
    """
    _require_order(order)
    if order == 1:
        return 1.0 / (1.0 - 1j * omega_h)
    return 1.0 / (2.0 - cmath.sqrt(1.0 + 2j * omega_h))


def numerical_damping(omega_h: float, order: int = 1) -> float:
    """O-4: the damping ratio zeta (dimensionless) that the integrator adds to an undamped mode. Exact.

    zeta = -ln|z| / |ln z|; about omega h/2 for BDF1 and (omega h)^3/4 for BDF2.
    """
    log_z = cmath.log(amplification(omega_h, order))
    return -log_z.real / abs(log_z)


def numerical_frequency(omega: float, h: float, order: int = 1) -> float:
    """O-4: the angular frequency [rad/s] that the integrator shows for an undamped mode: arg(z)/h. Exact."""
    return cmath.phase(amplification(omega * h, order)) / h


def spring_stretch(compliance: float, mass: float, h: float, steps: int, stretch: float) -> float:
    """O-2: stretch [m] after `steps` BDF1 substeps of a mass on a spring, released at rest. Exact (1e-13).

    u_n = u_0 Re z^n, z = 1/(1 - i omega h), omega^2 = 1/(alpha m): XPBD with one distance constraint in one
    dimension is implicit Euler, and one iteration has converged. `compliance` alpha [m/N], `mass` [kg].
    """
    z = amplification(h / math.sqrt(compliance * mass))
    return stretch * (z**steps).real


def spring_stretch_dcompliance(compliance: float, mass: float, h: float, steps: int, stretch: float) -> float:
    """O-2: d(`spring_stretch`)/d(compliance) [N]: u_0 Re(-i h omega n z^(n+1) / (2 alpha)). Exact.

    The derivative with respect to mass is this times compliance/mass.
    """
    omega = 1.0 / math.sqrt(compliance * mass)
    z = amplification(omega * h)
    return stretch * (-1j * h * omega * steps * z ** (steps + 1) / (2.0 * compliance)).real


def damped_spring(
    compliance: float,
    damping: float,
    mass: float,
    h: float,
    steps: int,
    *,
    stretch: float = 0.0,
    velocity: float = 0.0,
    force: float = 0.0,
    order: int = 1,
) -> NDArray[np.float64]:
    """O-3: stretches (steps + 1,) [m] of a mass on a spring with rate damping. Exact (1e-13).

    With a constant `force` f, m u'' = f - u/alpha - beta u', `compliance` alpha [m/N], `damping` beta [N
    s/m]. For BDF1 this is the recurrence u_{n+1} = [(2 + h beta/m) u_n - u_{n-1} + h^2 f/m] / (1 + h^2/(alpha
    m) + h beta/m) with u_{-1} = u_0 - h v_0. Holds for rate damping by C - C_r and for XPBD's equation 26,
    which agree in one dimension, at any iteration count.
    """
    _require_order(order)
    u, v = [stretch], [velocity]
    for n in range(steps):
        if order == 1 or n == 0:
            lead, u_past, v_past = h, u[n], v[n]
        else:
            lead = 2.0 * h / 3.0
            u_past, v_past = (4.0 * u[n] - u[n - 1]) / 3.0, (4.0 * v[n] - v[n - 1]) / 3.0
        # u = u_past + lead v and m (v - v_past) = lead (f - u/alpha - beta v), solved for v.
        impulse = mass * v_past + lead * (force - u_past / compliance)
        v.append(impulse / (mass + lead * damping + lead * lead / compliance))
        u.append(u_past + lead * v[-1])
    return np.array(u)


def spring_sag(compliance: float, mass: float, g: float) -> float:
    """O-3b: stretch at rest [m] of a spring that carries a mass: m g alpha. Exact once at rest.

    Derivatives: m g by compliance, g alpha by mass, m alpha by g.
    """
    return mass * g * compliance


def static_multiplier(tension: float, h: float, order: int = 1) -> float:
    """O-5s: the multiplier lambda [N s^2] of a link under `tension` [N]. Exact once at rest.

    The force on a particle is J^T lambda/h^2 (BDF1) or 9/4 of that (BDF2), so lambda = -T h^2 or -4 T h^2/9:
    a mass hanging at rest shows -m g h^2.
    """
    _require_order(order)
    return -tension * h * h * (1.0 if order == 1 else 4.0 / 9.0)


def rotor_angles(omega_h: float, steps: int) -> NDArray[np.float64]:
    """O-13: angles (steps,) [rad] by which a free rigid pair of particles turns in each BDF1 step. Exact.

    a_0 = atan(omega h), a_{n+1} = atan(sin a_n / (2 - cos a_n)), about a_n - a_n^3. Holds for compliance 0
    and any iteration count, gradients taken at the prediction. The start velocity is omega times the radius;
    d a_0/d omega = h/(1 + omega^2 h^2).
    """
    angles = [math.atan(omega_h)]
    for _ in range(steps - 1):
        angles.append(math.atan2(math.sin(angles[-1]), 2.0 - math.cos(angles[-1])))
    return np.array(angles[:steps])


def rotor_momentum(omega_h: float, steps: int) -> NDArray[np.float64]:
    """O-13: angular momentum (steps,) after steps 1, 2, ... over its start value: sin(a)/(omega h). Exact.

    The first is 1/sqrt(1 + omega^2 h^2). Linear momentum is conserved to 1e-14.
    """
    return np.sin(rotor_angles(omega_h, steps)) / omega_h
