"""A law that locks from a pull: its numbers, and the fabric that stands in for it in a simulation."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..arrays.types import Array
from ..objects.fabric import Fabric
from ..objects.laws import Spline
from ..optional import require
from ..quantities.parameters import Parameter, Parameters
from .fabric_fit import FabricFit, Measured, estimates_of
from .reading import Reading
from .strip_fit import Levels, best_numbers
from .strip_laws import green

NUMBERS = {"limit": ("limit",), "two_regimes": ("limit", "yarn", "sharpness")}
_UNITS = {"yarn": "N/m"}
_STEP = 1e-30  # of the complex step
_ROOM = 4.0  # of a logarithm, either way from the start: what a pull leaves open must end somewhere
_PIECES, _POINTS = 4, 400


def strains(law: str, log_numbers: Array, loads: Array) -> Array:
    """(n,) strains of a strip under loads (n,) N/m; analytic, so that a complex step gives the derivatives.

    Args:
        law: "limit" or "two_regimes", see `strip_laws`.
        log_numbers: logarithms of the stiffness (N/m) and the limit strain; of `two_regimes` also of the yarn's
            stiffness (N/m) and the sharpness.
    """
    stiffness, limit, *rest = np.exp(log_numbers)
    f = loads / stiffness
    if law == "limit":
        short: Array = limit * (1.0 - (1.0 + 2.0 * f / limit) ** -0.5)
        return short
    yarn, sharpness = rest
    both: Array = f * (1.0 + (f / limit) ** sharpness) ** (-1.0 / sharpness) + loads / yarn
    return both


def fit_locking(
    law: str, measured: Sequence[Measured], loads: Array, levels: Levels, along: str, note: str
) -> FabricFit:
    """Least squares of a locking law's numbers to strains under loads (n,) N/m beyond the pretension.

    Returns:
        The fit; its `fabric` has a `Spline` that follows the law up to the largest fitted strain.
    """
    names = [along, *(f"{along}_{name}" for name in NUMBERS[law])]
    start = _start(law, levels)
    parameters = Parameters(
        Parameter(
            name=name,
            initial=float(value),
            unit="N/m" if name == along else _UNITS.get(name.removeprefix(f"{along}_"), ""),
            lower=float(value) * math.exp(-_ROOM),
            upper=float(value) * math.exp(_ROOM),
            log=True,
        )
        for name, value in zip(names, np.exp(start), strict=True)
    )
    values = np.array([m.value for m in measured])
    per_sigma = 100.0 / np.array([m.sigma for m in measured])

    def residuals(u: Array) -> Array:
        off: Array = (strains(law, u, loads) - values / 100.0) * per_sigma
        return off

    def jacobian(u: Array) -> Array:
        columns = [strains(law, u + 1j * _STEP * axis, loads).imag / _STEP for axis in np.eye(len(u))]
        return np.column_stack(columns) * per_sigma[:, None]

    solver = require("scipy.optimize", "fit").least_squares
    end = solver(residuals, start, jacobian, bounds=parameters.bounds(), xtol=1e-10, ftol=1e-10, gtol=1e-10)
    r, by = residuals(end.x), jacobian(end.x)
    estimates, rank = estimates_of(parameters, end.x, r, by, measured)
    readings = tuple(
        Reading(float(s), "", {f"cloth_{n}": float(d) for n, d in zip(names, row, strict=True)}, "%", 100.0)
        for s, row in zip(strains(law, end.x, loads), by / per_sigma[:, None] / np.exp(end.x), strict=True)
    )
    told = f"{note}; the law '{law}' is known to fit_pull and forecast_pull alone, and no scene has it: `fabric` has a "
    told += f"spline that follows it up to a strain of {levels.reach:.3g} and goes on straight from there"
    fabric = _stand_in(law, end.x, levels.reach, along)
    noted = tuple(replace(m, note=told) for m in measured)
    return FabricFit(fabric, estimates, noted, readings, float(r @ r), len(r) - rank)


def _start(law: str, levels: Levels) -> Array:
    """The most probable numbers under the prior, as logarithms of physical ones."""
    u = best_numbers(levels, law)
    if law == "limit":
        return np.array([u[0], math.log(levels.reach * (1.0 + math.exp(u[1])))])
    return np.array([u[0], math.log(levels.reach) + u[1], u[0] + u[2], u[3]])


def _stand_in(law: str, log_numbers: Array, reach: float, along: str) -> Fabric:
    """A fabric whose tangent passes through the law's at quarters of the fitted Green strain."""
    stiffness = float(np.exp(log_numbers[0]))
    loads = stiffness * np.geomspace(1e-3 * reach, 1e3 * reach, _POINTS)
    s = strains(law, log_numbers, loads)
    tangent = np.gradient(loads / (1.0 + s), green(s))
    spacing = float(green(np.asarray(reach))) / _PIECES
    ratios = np.interp(spacing * np.arange(1, _PIECES + 1), green(s), tangent) / stiffness
    first, second, third, last = (float(ratio) for ratio in ratios)
    law_of = {along: (first, second, third, last)}
    sizes = {"density": 0.1, "bending": 1e-5, "warp": stiffness, "weft": stiffness, "shear": stiffness / 2.0}
    return Fabric(**sizes, law=Spline((spacing,) * 3, **law_of))
