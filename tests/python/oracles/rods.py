"""Rods that twist, shear and buckle: closed forms of the continuous rod, isotropic section.

EI bending and GJ torsional stiffness [N m^2], GA shear stiffness [N], angles [rad], `density` mu [kg/m].
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import brentq
from scipy.special import jv


def torsion_torque(angle: float, length: float, torsional_stiffness: float) -> float:
    """O-22b: torque [N m] of a straight rod twisted by an angle: GJ phi/L.

    Exact for joints with the energy GJ/(2 l_v) twist^2, whatever their number. Derivatives: M/phi, M/GJ, -M/L.
    """
    return torsional_stiffness * angle / length


def ring_critical_twist(stiffness_ratio: float) -> float:
    """O-22: twist at which a ring of a rod that is straight at rest leaves its plane: 2 pi sqrt(3)/(GJ/EI) (Michell
    1889; Zajac 1962). Tolerance 3 %. d(twist)/d(EI/GJ) = 2 pi sqrt(3)."""
    return 2.0 * math.pi * math.sqrt(3.0) / stiffness_ratio


def euler_load(length: float, bending_stiffness: float) -> float:
    """O-16b: buckling load [N] of a column with pinned ends: pi^2 EI/L^2; a clamped-free one bears that of 2 L."""
    return bending_stiffness * (math.pi / length) ** 2


def sheared_tip(load: float, length: float, bending_stiffness: float, shear_stiffness: float) -> float:
    """Small deflection [m] of a cantilever under a load on its tip: P L^3/(3 EI) + P L/GA (Timoshenko 1921).

    -EI dw/dEI is the first part, -GA dw/dGA the second.
    """
    return load * length**3 / (3.0 * bending_stiffness) + load * length / shear_stiffness


def engesser_load(euler: float, shear_stiffness: float) -> float:
    """Load [N] at which a column that shears falls: Pe/(1 + Pe/GA) (Engesser 1891), Pe without shear.

    It holds where the load's work sees the slope of the axis and shear is its angle against the section: with
    sections turned by a and edges by a + g, EI a'^2/2 + GA g^2/2 - P (a + g)^2/2 is least for g = P a/(GA - P), which
    leaves EI a'^2/2 - P/(1 - P/GA) a^2/2.
    """
    return euler / (1.0 + euler / shear_stiffness)


def sheared_frequency(
    mode: int, length: float, density: float, bending_stiffness: float, shear_stiffness: float
) -> float:
    """Frequency [rad/s] of a beam on two hinges, without rotary inertia: k^2 sqrt(EI/mu)/sqrt(1 + EI k^2/GA) with
    k = mode pi/L (Timoshenko 1921)."""
    k = mode * math.pi / length
    return k**2 * math.sqrt(bending_stiffness / density / (1.0 + bending_stiffness * k**2 / shear_stiffness))


def self_buckling_length(weight: float, bending_stiffness: float) -> float:
    """O-16b: length [m] at which a clamped column of `weight` per length [N/m] falls: w L^3/EI = 7.837347 (Greenhill).

    The number is 9/4 j^2 with j the first zero of the Bessel function J_{-1/3}. dL/dEI = L/(3 EI).
    """
    zero = brentq(lambda x: jv(-1.0 / 3.0, x), 1.5, 2.5, xtol=1e-15, rtol=1e-14)
    return float((9.0 / 4.0 * zero**2 * bending_stiffness / weight) ** (1.0 / 3.0))


def bar_frequencies(
    length: float, density: float, axial_stiffness: float, count: int, links: int | None = None
) -> NDArray[np.float64]:
    """O-10c: longitudinal modes (count,) [rad/s] of a clamped-free bar: (2k-1) pi/(2 L) sqrt(EA/mu).

    With `links`, of n springs with n masses, the last one half: 2 n/L sqrt(EA/mu) sin((2k-1) pi/(4 n)). Exact for the
    lumped rod. Derivatives: omega/(2 EA), -omega/(2 mu), -omega/L.
    """
    phase = (2.0 * np.arange(1, count + 1) - 1.0) * math.pi / 4.0
    speed = math.sqrt(axial_stiffness / density)
    return 2.0 * speed / length * (phase if links is None else links * np.sin(phase / links))


def whirling_tension(length: float, density: float, rate: float, links: int) -> NDArray[np.float64]:
    """O-10d: tension [N] in the links of an inextensible string that whirls at `rate` [rad/s] about its start.

    mu omega^2 (L^2 - s^2)/2 at the middles s of the links is that of the continuous string; the lumped one, with half
    a mass at its end, carries 1/(4 n^2) of mu omega^2 L^2/2 more. Exact. Derivatives: T/mu, 2 T/omega, 2 T/L.
    """
    s = (np.arange(links) + 0.5) / links
    return 0.5 * density * (rate * length) ** 2 * (1.0 - s**2 + 0.25 / links**2)


class HelicalBuckling(NamedTuple):
    """A long twisted rod with a localized helix in its middle; s runs from -L/2 to L/2 (van der Heijden & Thompson
    2000, Nonlinear Dynamics 21; van der Heijden et al. 2003, Int. J. Solids Struct. 40).

    Attributes:
        torque: M [N m], along the rod.
        tension: T [N].
        min_cosine: cos(phi_0) of the tangent in the middle against the axis.
        width: s* [m]: (cos phi - cos phi_0)/(1 - cos phi_0) = tanh^2(s/s*).
    """

    torque: float
    tension: float
    min_cosine: float
    width: float

    def cosine(self, s: ArrayLike) -> NDArray[np.float64]:
        """Cosine of the tangent against the axis."""
        return self.min_cosine + (1.0 - self.min_cosine) * np.tanh(np.asarray(s) / self.width) ** 2

    def places(self, s: ArrayLike) -> NDArray[np.float64]:
        """The centerline (points, 3) along the third axis: its tangent turns about it at M/(2 EI)."""
        s = np.asarray(s, dtype=float)
        pitch = math.sqrt((1.0 + self.min_cosine) / (1.0 - self.min_cosine)) / self.width
        radius = (1.0 - self.min_cosine) * self.width / np.cosh(s / self.width)
        along = s - (1.0 - self.min_cosine) * self.width * np.tanh(s / self.width)
        return np.stack([radius * np.sin(pitch * s), -radius * np.cos(pitch * s), along], axis=1)


def helical_buckling(
    length: float, bending_stiffness: float, torsional_stiffness: float, rotation: float, slack: float
) -> HelicalBuckling:
    """O-22c: the rod whose clamped ends were turned by `rotation` [rad] and moved together by `slack` [m].

    With m = M L/EI and t = T L^2/EI: slack/L = sqrt(16/t (1 - m^2/(4 t))), rotation = m EI/GJ + 4 acos(m/(2 sqrt t));
    cos phi_0 = m^2/(2 t) - 1, s* = L/sqrt(t - m^2/4). Infinite rod; its ends are straight to exp(-L/s*).
    """

    shortened = slack / length

    def moment(root: float) -> float:  # root = sqrt(t - m^2/4), so that t = 4 root/shortened
        return 2.0 * math.sqrt(4.0 * root / shortened - root**2)

    def turned(root: float) -> float:
        m = moment(root)
        return m * bending_stiffness / torsional_stiffness + 4.0 * math.atan2(2.0 * root, m)

    root = brentq(lambda x: turned(x) - rotation, 1e-9, 2.0 / shortened, xtol=1e-15, rtol=1e-15)
    m, t = moment(root), 4.0 * root / shortened
    return HelicalBuckling(
        float(m * bending_stiffness / length),
        float(t * bending_stiffness / length**2),
        float(m**2 / (2.0 * t) - 1.0),
        float(length / root),
    )
