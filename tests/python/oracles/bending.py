"""Large deflections of a cantilever and roll-up by an end moment, continuous and for a chain with `bend`.

The chain's bend constraint is the curvature binormal |kappa b| = 2 tan(phi/2) at turning angle phi with the
energy EI/(2 l_v) |kappa b|^2, so that its moment is M(phi) = (EI/l_v) 2 tan(phi/2)/cos^2(phi/2); l_v is the
Voronoi length (Bergou et al. 2008, Discrete Elastic Rods). Angles in rad, below the horizontal clamp.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc


class Deflection(NamedTuple):
    """Shape of a cantilever: angle at the tip [rad], drop and reach (horizontal extent) of the tip over L."""

    tip_angle: float
    drop: float
    reach: float

    @property
    def chord_angle(self) -> float:
        """Angle [rad] of the line from clamp to tip below the horizontal."""
        return math.atan2(self.drop, self.reach)


def tip_load_elastica(load: float) -> Deflection:
    """O-15: clamped inextensible strip with a dead load at the tip, `load` a = P L^2/EI. Continuous law.

    sqrt(a) = K(k) - F(phi, k), k^2 = (1 + sin theta_0)/2, sin phi = 1/(k sqrt 2); drop/L = 1 - 2/sqrt(a)
    (E(k) - E(phi, k)), reach/L = sqrt(2 sin theta_0/a). Small loads: drop/L = a/3. A chain of 40 links
    is within 3e-3 L, one of 160 within 3e-4 L; `bend_chain` is exact. d(drop)/dEI = -(a/EI) d(drop)/da.
    """

    def elliptic(tip: float) -> tuple[float, float]:
        m = 0.5 * (1.0 + math.sin(tip))
        phi = math.asin(1.0 / math.sqrt(2.0 * m))
        return float(ellipk(m) - ellipkinc(phi, m)), float(ellipe(m) - ellipeinc(phi, m))

    root = math.sqrt(load)
    tip = brentq(lambda x: elliptic(x)[0] - root, 1e-9, 0.5 * math.pi - 1e-7, xtol=1e-15, rtol=1e-15)
    drop = 1.0 - 2.0 / root * elliptic(tip)[1]
    return Deflection(tip, drop, math.sqrt(2.0 * math.sin(tip) / load))


def heavy_elastica(weight: float) -> Deflection:
    """O-17: level clamped inextensible strip under its own `weight` gamma = w L^3/B. Continuous law.

    theta'' = -gamma (1 - s) cos theta, theta(0) = 0, theta'(1) = 0, integrated from the tip, where it is well
    conditioned, by DOP853 at 1e-13; B = EI and w the weight per length, or B per width and w per area.
    Tolerance 5e-3 L for 20 rows of cloth (Poisson ratio 0 or a narrow strip) and 1e-3 for 100 links;
    `bend_chain` is exact. d(drop)/dB = -(gamma/B) d(drop)/d gamma.
    """

    def rate(r: float, state: NDArray[np.float64]) -> list[float]:
        theta, slope = state[:2]  # r = 1 - s runs from the tip to the clamp
        return [slope, -weight * r * math.cos(theta), math.cos(theta), math.sin(theta)]

    def at_clamp(tip: float) -> NDArray[np.float64]:
        run = solve_ivp(rate, (0.0, 1.0), [tip, 0.0, 0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-14)
        if not run.success:
            raise RuntimeError(f"heavy elastica at weight {weight}: {run.message}")
        return run.y[:, -1]

    tip = brentq(lambda x: at_clamp(x)[0], 0.0, 0.5 * math.pi, xtol=1e-15, rtol=1e-15)
    _, _, reach, drop = at_clamp(tip)
    return Deflection(tip, float(drop), float(reach))


def bend_moment(turning_angle: float, bending_stiffness: float, voronoi_length: float) -> float:
    """O-21: moment [N m] of one bend joint at `turning_angle` phi: (EI/l_v) 2 tan(phi/2)/cos^2(phi/2)."""
    half = 0.5 * turning_angle
    return bending_stiffness / voronoi_length * 2.0 * math.tan(half) / math.cos(half) ** 2


def roll_up_ratio(links: int) -> float:
    """O-21: moment that rolls a chain of n equal links into a regular n-gon, over the continuous 2 pi EI/L.

    The bend law at phi = 2 pi/n with l_v = L/n. Exact (static 1e-6), dM/dEI = M/EI.
    """
    return bend_moment(2.0 * math.pi / links, 1.0, 1.0 / links) / (2.0 * math.pi)


def sine_roll_up_ratio(links: int) -> float:
    """O-21: `roll_up_ratio` for the quaternion rods of Kugelstadt and Schoemer (2016): M = (EI/l) sin phi."""
    phi = 2.0 * math.pi / links
    return math.sin(phi) / phi


def bend_chain(
    links: int,
    length: float,
    bending_stiffness: float,
    clamp_voronoi: float,
    node_weights: NDArray[np.float64],
) -> NDArray[np.float64]:
    """O-15, O-17: nodes (n + 1, 2) as (horizontal, down) [m] of n rigid links with `bend`, at rest. Exact.

    Node 0 is fixed and its clamp direction horizontal; the joint there has Voronoi length `clamp_voronoi`
    [m]: L/n if the clamp is a fixed link of the same length, L/(2n) if it is a direction only. All others
    have L/n. `node_weights` (n + 1,) [N] hang on the nodes, m g and a tip load alike; that of node 0 does
    nothing. The static chain agrees to 1e-6 with a direct solver. The shape is built from the tip angle,
    which is found so that the clamp is level.
    """
    link = length / links
    below = np.cumsum(np.asarray(node_weights, dtype=float)[::-1])[::-1]
    voronoi = np.full(links, link)
    voronoi[0] = clamp_voronoi

    def link_angles(tip: float) -> NDArray[np.float64]:
        angles = np.empty(links + 1)
        angle, moment = tip, 0.0
        for j in range(links - 1, -1, -1):
            angles[j + 1] = angle
            moment += link * math.cos(angle) * below[j + 1]
            angle -= turning_angle(moment * voronoi[j] / bending_stiffness)
        angles[0] = angle
        return angles

    tip = brentq(lambda x: link_angles(x)[0], 0.0, 0.5 * math.pi, xtol=1e-15, rtol=1e-15)
    theta = link_angles(tip)[1:]
    steps = link * np.stack([np.cos(theta), np.sin(theta)], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def turning_angle(moment: float) -> float:
    """O-21: angle of a joint under a `moment` over EI/l_v: the inverse of `bend_moment`.

    t = tan(phi/2) solves t^3 + t = moment/2.
    """
    scale = 2.0 / math.sqrt(3.0)
    return 2.0 * math.atan(scale * math.sinh(math.asinh(0.75 * moment * math.sqrt(3.0)) / 3.0))
