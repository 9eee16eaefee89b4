"""The load of another specimen beyond the strain at which the measured pulls ended."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.checks import check_count, finite, is_list, is_number
from ..arrays.types import Array
from ..errors import InputError
from ..quantities.wording import short
from ..report.tables import Section, plain_section
from .curve import Curve
from .pull import checked_pulls
from .strip_fit import Levels, Weighed, weigh
from .strip_laws import STRIP_LAWS

FORECAST_LAWS = ("exponential", "sinh", "limit", "two_regimes")
CHECKED = 1.0 / 0.6
"""Times the largest measured strain up to which intervals were checked against pulls (experiments/knit_uniaxial)."""

_POINTS = 8
_DRAWS = 4000
_QUANTILES = (0.025, 0.5, 0.975)


@dataclass(frozen=True, eq=False)
class PullForecast:
    """Result of `forecast_pull`. Printing it gives the report.

    Attributes:
        strain: (n,) extensions.
        load: (n,) median forecast of a specimen's load, N/m, the pretension included.
        lower, upper: (n,) ends of the 95 % interval for another specimen's load; infinite where more than a fortieth
            of the forecast lies beyond a limit strain.
        reach: largest strain that was fitted.
        shares: posterior probability of each law, by name.
        scatter: standard deviation of the logarithm of a specimen's load.
        wander: standard deviation of the logarithm of the load about a law, per root of an e-fold of strain.
    """

    strain: Array
    load: Array
    lower: Array
    upper: Array
    reach: float
    shares: dict[str, float]
    scatter: float
    wander: float

    @property
    def half_width(self) -> Array:
        """(n,) of the interval, in parts of the median forecast."""
        return (self.upper - self.lower) / 2.0 / self.load

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers for JSON; an end that is infinite is None."""
        ends = {n: [float(v) if np.isfinite(v) else None for v in getattr(self, n)] for n in ("lower", "load", "upper")}
        told = {"reach": self.reach, "scatter": self.scatter, "wander": self.wander, "shares": self.shares}
        return {"strain": self.strain.tolist(), **ends, **told}

    def __str__(self) -> str:
        rows = tuple(
            (f"{s:.4g}", f"{s / self.reach:.2f}", short(load, 3), f"{short(low, 3)} to {short(high, 3)}")
            for s, load, low, high in zip(self.strain, self.load, self.lower, self.upper, strict=True)
        )
        headers = ("strain", "of the fitted", "load [N/m]", "95 % interval of another specimen")
        laws = "; ".join(
            f"{name} {share:.0%} ({STRIP_LAWS[name].words}{'' if STRIP_LAWS[name].simulated else ', not simulated'})"
            for name, share in sorted(self.shares.items(), key=lambda item: -item[1])
        )
        farthest = float(self.strain.max()) / self.reach
        reaches = f"up to {farthest:.2f} times the largest fitted strain of {self.reach:.4g}"
        if farthest > CHECKED * (1.0 + 1e-9):
            reaches += f"; beyond {CHECKED:.2f} times no interval was ever checked"
        rests = (
            f"specimens differ by {self.scatter:.0%} and the load wanders about a law by {self.wander:.0%} per root of "
            "an e-fold of strain (each estimated from these pulls together with a prior)"
        )
        notes = (("laws, by what the pulls support", laws), ("reaches", reaches), ("rests on", rests))
        return "\n".join(plain_section(Section("Forecast", headers, rows, notes)))


def forecast_pull(
    curves: Sequence[Curve],
    strain: ArrayLike | None = None,
    *,
    laws: Sequence[str] = FORECAST_LAWS,
    up_to: float | None = None,
    way: str = "loading",
    cycle: int = 0,
    seed: int = 0,
) -> PullForecast:
    """Forecast pulls beyond their strains, with an interval for the load of another specimen.

    The interval contains the spread of the laws, weighted by how well each follows the growth of the load (`weigh`:
    equal chances before, posterior ones after), the uncertainty of each law's numbers, the wandering of the load about
    its law, and the scatter of specimens. In the range of the fit it is an interval about the mean curve too.

    Args:
        curves: of tension, a specimen each; best from a pretension on (`Curve.from_pretension`).
        strain: where to forecast, positive; eight strains from the largest fitted one to 1/0.6 times it if left out.
        laws: among which evidence decides: "linear", "exponential", "sinh", "limit", "two_regimes".
        up_to: largest strain to fit; the rest of the curves is left out.
        way, cycle: of `pulled`.
        seed: of the draws; the same seed gives the same bits.

    Raises:
        InputError: curves that are no pulls of one kind, slack, an unknown law, or strains that are not positive.
        MissingExtraError: scipy is not installed.
    """
    checked_pulls(curves)
    check_count("seed", seed, 0, sys.maxsize, InputError)
    if not is_list(laws) or not all(isinstance(law, str) for law in laws):
        raise InputError("laws", "must be a list of names", laws, f"use names of: {', '.join(STRIP_LAWS)}")
    if up_to is not None and not is_number(up_to):
        raise InputError("up_to", "must be a strain", up_to, "give the largest strain to fit, or leave it out")
    found = weigh(Levels.of(curves, way, cycle, up_to), laws, seed)
    reach = found.levels.reach
    at = np.linspace(1.0, CHECKED, _POINTS) * reach if strain is None else finite("strain", strain, None, InputError)
    at = np.atleast_1d(at)
    if at.ndim != 1 or not (at > 0.0).all():
        raise InputError("strain", "must be positive", at.tolist(), "forecast loads of strains above zero")
    lower, middle, upper = np.exp(np.quantile(_drawn(found, at, seed), _QUANTILES, axis=0, method="inverted_cdf"))
    return PullForecast(at, middle, lower, upper, reach, found.shares, found.levels.scatter, found.wander)


def _drawn(found: Weighed, strain: Array, seed: int) -> Array:
    """(m, n) logarithms of the whole load of other specimens, drawn from the posterior of all laws."""
    levels, random = found.levels, np.random.default_rng(seed + 1)
    logs = np.concatenate([levels.log_total(STRIP_LAWS[n], found.draws[n], strain) for n in found.shares])
    chances = np.concatenate([found.chances[n] for n in found.shares])
    logs = logs[random.choice(len(logs), size=_DRAWS, p=chances / chances.sum())]
    specimen = levels.scatter * _heavy(random, levels.freedom) * random.normal(size=(_DRAWS, 1))
    # The path beyond the fitted range, at increasing strains; within the range the levels themselves hold it.
    order = np.argsort(strain)
    beyond = np.log(np.maximum(strain[order] / levels.reach, 1.0))
    steps = np.sqrt(np.diff(beyond, prepend=0.0)) * random.normal(size=(_DRAWS, len(strain)))
    path = np.empty_like(steps)
    path[:, order] = np.cumsum(steps, axis=1)
    return logs + specimen + found.wander * _heavy(random, found.freedom) * path


def _heavy(random: np.random.Generator, freedom: int) -> Array:
    """(m, 1) factors that make Student's t of a normal number: a variance is itself only estimated."""
    return np.sqrt(freedom / random.chisquare(freedom, size=(_DRAWS, 1)))
