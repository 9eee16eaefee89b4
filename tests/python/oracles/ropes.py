"""Hanging ropes at rest.

A rope of n links has link length l = L/n and lumped masses mu L/n, half of that at each end.
`axial_stiffness` EA [N] is infinite for an inextensible rope; the compliance of a link is l/EA [m/N].
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq


class Hanging(NamedTuple):
    """A rope between two level points: horizontal force [N] and sag [m]."""

    horizontal_force: float
    sag: float


def catenary(span: float, length: float, density: float, g: float) -> Hanging:
    """O-5: inextensible catenary over a level `span` [m], linear `density` [kg/m]. Continuous law.

    2 a sinh(span/2a) = length, sag = a (cosh(span/2a) - 1), H = density g a. The polygon of n = 40 is 2e-4
    off in sag.
    """
    half = _root(lambda x: math.sinh(x) / x - length / span, 1e-6, 700.0)
    a = 0.5 * span / half
    return Hanging(density * g * a, a * (math.cosh(half) - 1.0))


def elastic_catenary(span: float, length: float, density: float, g: float, axial_stiffness: float) -> Hanging:
    """O-6: elastic catenary between level points (Irvine 1981, Cable Structures). Continuous law.

    span = H L/EA + (2H/w) asinh(wL/2H), sag = w L^2/(8 EA) + (H/w)(sqrt(1 + (wL/2H)^2) - 1), w = density g;
    `length` is the unstretched one. Tolerance 3e-4 at n = 40; `polygon_catenary` with the same EA
    is exact.
    """
    weight = density * g

    def excess(h_force: float) -> float:
        slope = 0.5 * weight * length / h_force
        return h_force * length / axial_stiffness + length / slope * math.asinh(slope) - span

    h_force = _root(excess, 1e-9 * weight * length, 1e6 * weight * length)
    ratio = 0.5 * weight * length / h_force
    sag = weight * length**2 / (8.0 * axial_stiffness) + h_force / weight * (math.hypot(1.0, ratio) - 1.0)
    return Hanging(h_force, sag)


def polygon_nodes(
    span: float, length: float, links: int, density: float, g: float, axial_stiffness: float = math.inf
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """O-5d: nodes (n + 1, 2) as (horizontal, up) [m], link tensions (n,) [N] of a chain between level points.

    Link i carries V_i = m g (n - 1 - 2 i)/2 and H, where the sum of l (1 + T_i/EA) H/T_i is the span. Exact
    for the static chain of n distance constraints of compliance l/EA (1e-8 with a direct solver; Gauss-Seidel
    is biased, see O-8).
    """
    link, weight = length / links, density * length / links * g
    vertical = 0.5 * weight * (links - 1.0 - 2.0 * np.arange(links))

    def steps(h_force: float) -> NDArray[np.float64]:
        tension = np.hypot(h_force, vertical)
        stretched = link * (1.0 / tension + 1.0 / axial_stiffness)
        return np.stack([stretched * h_force, -stretched * vertical], axis=1)

    h_force = _root(lambda x: float(np.sum(steps(x)[:, 0])) - span, 1e-9 * weight, 1e6 * weight * links)
    nodes = np.concatenate([np.zeros((1, 2)), np.cumsum(steps(h_force), axis=0)])
    return nodes, np.hypot(h_force, vertical)


def polygon_catenary(
    span: float, length: float, links: int, density: float, g: float, axial_stiffness: float = math.inf
) -> Hanging:
    """O-5d: horizontal force and sag of the chain of `polygon_nodes`. Exact for the discrete chain (1e-8).

    For an odd n the sag is that of the level middle link. H scales with density g, the sag of a rigid chain
    does not.
    """
    nodes, tension = polygon_nodes(span, length, links, density, g, axial_stiffness)
    horizontal = tension[0] * (nodes[1, 0] - nodes[0, 0]) / math.hypot(*(nodes[1] - nodes[0]))
    return Hanging(float(horizontal), float(-nodes[:, 1].min()))


def hanging_extension(length: float, density: float, g: float, axial_stiffness: float) -> float:
    """O-8: how far [m] a rope stretches under its own weight: mu g L^2/(2 EA). Exact if lumped (1e-10).

    Holds for any n because the end node has half a mass. Derivatives: ext/mu, ext/g, 2 ext/L, -ext/EA;
    ext/alpha by the compliance of a link.
    """
    return density * g * length**2 / (2.0 * axial_stiffness)


def hanging_extension_with_mass(length: float, tip_mass: float, g: float, axial_stiffness: float) -> float:
    """O-9: how far [m] a tip mass stretches a rope, besides the rope's own weight: m g L/EA. Exact as O-8.

    Derivatives: drop/m, drop/g, drop/L, -drop/EA.
    """
    return tip_mass * g * length / axial_stiffness


def gauss_seidel_extension_estimate(links: int, h: float, g: float, sweeps: int) -> float:
    """O-8: about the extension [m] that Gauss-Seidel leaves in a rigid hanging rope: (n - 1)^2 g h^2/(2 K).

    It is the artificial compliance (1 - 1/n)^2 h^2/(K m) per link under the rope's weight. Exact for one
    sweep K = 1 from the top down; otherwise use `gauss_seidel_extension`.
    """
    return (links - 1) ** 2 * g * h * h / (2.0 * sweeps)


def gauss_seidel_extension(
    length: float,
    density: float,
    g: float,
    axial_stiffness: float,
    h: float,
    sweeps: int,
    order: Sequence[int],
) -> float:
    """O-8: extension at rest [m] of a hanging rope under BDF1 and `sweeps` of Gauss-Seidel. Exact (1e-10).

    `order` is the sequence in which the links are projected, 0 at the top: range(n) runs down the rope, and
    all even links before all odd ones is a two-coloring. Multipliers restart each substep. The program is
    linear while the rope is taut, so that its rest state solves e = sweeps(e + h^2 g at the top link).
    """
    links = len(order)
    if sorted(order) != list(range(links)):
        raise ValueError(f"order: got {list(order)}; give each link 0 ... {links - 1} once")
    mass = density * length / links
    inverse_mass = np.full(links + 1, 1.0 / mass)
    inverse_mass[0], inverse_mass[-1] = 0.0, 2.0 / mass
    compliance = length / links / axial_stiffness / (h * h)

    def substep(extensions: NDArray[np.float64]) -> NDArray[np.float64]:
        e = extensions.copy()
        multiplier = np.zeros_like(e)
        for _ in range(sweeps):
            for j in order:
                change = -(e[j] + compliance * multiplier[j]) / (inverse_mass[j] + inverse_mass[j + 1] + compliance)
                multiplier[j] += change
                e[j] += (inverse_mass[j] + inverse_mass[j + 1]) * change
                if j > 0:
                    e[j - 1] -= inverse_mass[j] * change
                if j + 1 < links:
                    e[j + 1] -= inverse_mass[j + 1] * change
        return e

    sweep = substep(np.eye(links))
    load = np.zeros(links)
    load[0] = h * h * g
    return float(np.sum(np.linalg.solve(np.eye(links) - sweep, sweep @ load)))


def _root(f: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(f, low, high, xtol=1e-300, rtol=1e-15))
