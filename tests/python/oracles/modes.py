"""Small vibrations of chains, strings and cantilevers: angular frequencies [rad/s], lowest first.

An integrator shows these at `integration.numerical_frequency`.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jn_zeros, roots_laguerre


def hanging_rope_frequencies(length: float, g: float, count: int) -> NDArray[np.float64]:
    """O-10a: transverse modes (count,) of a hanging inextensible rope: j_{0,k}/2 sqrt(g/L). Continuous law.

    Derivatives: -omega/(2L) by length, omega/(2g) by g, exactly 0 by density.
    """
    return 0.5 * jn_zeros(0, count) * math.sqrt(g / length)


def hanging_beads_frequencies(length: float, links: int, g: float) -> NDArray[np.float64]:
    """O-10a: transverse modes (n,) of a chain of n rigid links and n equal masses, the last one free.

    omega^2 = x_k g n/L with x_k the roots of the Laguerre polynomial L_n. Exact for the linearized chain; by
    zero crossings at an amplitude of 1e-3 L 1e-4 is the tolerance after the integrator's shift. The end
    mass is a whole one: for the half mass of a lumped rope use `chain_frequencies`. Derivatives as in
    `hanging_rope_frequencies`.
    """
    roots, _ = roots_laguerre(links)
    return np.sqrt(roots * g * links / length)


def chain_frequencies(masses: Sequence[float], link: float, g: float) -> NDArray[np.float64]:
    """O-10a: transverse modes (n,) of rigid links [m] below a fixed point, with any node masses (n,) [kg].

    Eigenvalues of K u = omega^2 M u, where link j resists with the weight below it over its length. Exact for
    the linearized chain.
    """
    mass = np.asarray(masses, dtype=float)
    tension = np.cumsum(mass[::-1])[::-1] * g
    stiffness = np.diag(tension + np.append(tension[1:], 0.0)) - np.diag(tension[1:], 1) - np.diag(tension[1:], -1)
    return np.sqrt(eigh(stiffness / link, np.diag(mass), eigvals_only=True))


def beaded_string_frequencies(beads: int, tension: float, density: float, length: float) -> NDArray[np.float64]:
    """O-10b: transverse modes (N,) of N beads on a taut string between fixed ends, a = L/(N + 1) apart.

    omega_k = 2 sqrt(T/(m a)) sin(k pi/(2(N + 1))), bead mass m = mu a; divide by 2 pi for Hz. Exact for the
    linearized string; tolerance 1e-4. The continuous string has pi k/L sqrt(T/mu). Derivatives:
    omega/(2T), -omega/(2 mu), -omega/L.
    """
    spacing = length / (beads + 1)
    k = np.arange(1, beads + 1)
    return 2.0 * math.sqrt(tension / density) / spacing * np.sin(0.5 * math.pi * k / (beads + 1))


def cantilever_frequencies(length: float, density: float, bending_stiffness: float, count: int) -> NDArray[np.float64]:
    """O-16a: modes (count,) of a clamped-free Euler-Bernoulli beam without gravity: b_k^2 sqrt(EI/(mu L^4)).

    cos b cosh b = -1, `density` mu [kg/m], `bending_stiffness` EI [N m^2]. Continuous law; tolerance 5e-3.
    Derivatives: omega/(2 EI), -omega/(2 mu), -2 omega/L.
    """

    def characteristic(b: float) -> float:
        return math.cos(b) + 1.0 / math.cosh(b)

    # cos b = -1/cosh b has exactly one root in each interval ((k - 1) pi, k pi).
    b = [brentq(characteristic, (k - 1) * math.pi, k * math.pi, xtol=1e-15, rtol=1e-15) for k in range(1, count + 1)]
    return np.square(b) * math.sqrt(bending_stiffness / density) / length**2


def cantilever_chain_mode(
    links: int, mode: int, length: float, density: float, bending_stiffness: float
) -> tuple[float, NDArray[np.float64]]:
    """O-16a: frequency and shape (n,) of mode 0, 1, ... of n rigid links, by the heights of nodes 1 ... n, largest 1.

    The clamp is a direction, so that its joint has half a Voronoi length; the last node has half a mass. Exact for the
    linearized chain. Derivatives: omega/(2 EI), -omega/(2 mu).
    """
    link = length / links
    slope = (np.eye(links) - np.eye(links, k=-1)) / link  # of link j
    turn = slope.copy()
    turn[1:] -= slope[:-1]
    voronoi = np.full(links, link)
    voronoi[0] /= 2.0
    mass = np.full(links, density * link)
    mass[-1] /= 2.0
    squared, shapes = eigh(turn.T @ (bending_stiffness / voronoi[:, None] * turn), np.diag(mass))
    shape = shapes[:, mode]
    return math.sqrt(squared[mode]), shape / np.abs(shape).max()
