"""How well the laws of a strip follow a pull, in numbers that can be compared: posterior draws and evidence.

No law is the fabric's own. The logarithm of the load is taken to wander about a law as a Brownian path against the
logarithm of the strain, so that only its growth from level to level is compared. The errors of neighboring strains
then go together, the levels near the end of the range weigh most, and more levels tell hardly more.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..optional import require
from .curve import Curve, chosen, mean_curve
from .strip_laws import STRIP_LAWS, StripLaw

_LEVELS, _FEWEST = 8, 5
_NEAR_END = 2  # levels at which specimens are compared: slack shows where the load grows fastest
_SCATTER, _SCATTER_FREEDOM = 0.07, 3  # of the logarithm of the load, before specimens are seen
_WANDER, _WANDER_FREEDOM = 0.08, 4  # of the logarithm of the load, per root of an e-fold of strain; before a fit
_DRAWS = 1000  # of a law
_TAIL = 5  # degrees of freedom of Student's t, from which draws are proposed
_STARTS = (0.0, 1.0, -1.0)
_STEP = 1e-5  # of the differences


@dataclass(frozen=True)
class Levels:
    """Mean load of some specimens at even shares of the strain that all reach.

    Attributes:
        strain, log_load: (n,); the load is the whole one, N/m, pretension and all.
        pretension: N/m.
        specimens: their number.
        scatter: standard deviation of the logarithm of a specimen's load, and its degrees of freedom.
    """

    strain: Array
    log_load: Array
    pretension: float
    specimens: int
    scatter: float
    freedom: int

    @property
    def reach(self) -> float:
        """Largest strain of the fit."""
        return float(self.strain[-1])

    @classmethod
    def of(cls, curves: Sequence[Curve], way: str, cycle: int, up_to: float | None) -> Levels:
        """Levels of checked curves of tension; strains beyond `up_to` are left out.

        Raises:
            InputError: slack where levels are read off, or a strain that the curves do not reach.
        """
        mean = mean_curve(curves, way, cycle=cycle)
        start, top = max(float(mean.deformation[0]), 0.0), float(mean.deformation[-1])
        if up_to is not None:
            if not start < up_to <= top:
                raise InputError("up_to", "is not a strain of the curves", up_to, f"choose one up to {top:.4g}")
            top = up_to
        strain = start + (top - start) * np.arange(1, _LEVELS + 1) / _LEVELS
        ways = [chosen(c, cycle).way(way) for c in curves]
        loads = np.array([[w.load_at(s) for s in strain] for w in ways])
        pretension = curves[0].pretension
        borne = np.nanmin(loads, axis=0) > pretension
        first = _LEVELS if not borne[-1] else int(np.flatnonzero(~borne)[-1] + 1) if (~borne).any() else 0
        if _LEVELS - first < _FEWEST:
            fix = "cut the slack off by from_pretension"
            raise InputError("curves", f"bear nothing in more than {_LEVELS - _FEWEST} of {_LEVELS} levels", first, fix)
        loads = loads[:, first:]
        off = np.log(loads[:, -_NEAR_END:])
        squares = float(((off - off.mean(axis=0)) ** 2).sum() / off.shape[1])
        freedom = _SCATTER_FREEDOM + len(ways) - 1
        scatter = math.sqrt((_SCATTER_FREEDOM * _SCATTER**2 + squares) / freedom)
        return cls(strain[first:], np.log(loads.mean(axis=0)), pretension, len(ways), scatter, freedom)

    def log_total(self, law: StripLaw, u: Array, strain: Array) -> Array:
        """Logarithm of a law's whole load at strains (n,), for u (..., 1 + d)."""
        beyond = law.log_load(strain, u, self.reach)
        return np.logaddexp(beyond, math.log(self.pretension)) if self.pretension > 0.0 else beyond

    def residuals(self, law: StripLaw, u: Array, wander: float) -> Array:
        """(..., n + d) of unit variance: the growth from level to level, the last level, and the law's prior."""
        off = self.log_total(law, u, self.strain) - self.log_load
        growth = np.diff(off) / (wander * np.sqrt(np.diff(np.log(self.strain))))
        last = off[..., -1:] * math.sqrt(self.specimens) / self.scatter
        mean, sd = np.array(law.prior).reshape(-1, 2).T
        return np.concatenate([growth, last, (u[..., 1:] - mean) / sd], axis=-1)

    def foreseen(self, law: str, power: float) -> float:
        """Root mean square error of the logarithm of the load above two thirds of the strain, of a law's most probable
        fit to the levels below, whose errors grow with (largest fitted load / load)^power."""
        strip, solver = STRIP_LAWS[law], require("scipy.optimize", "fit").least_squares
        kept = int((self.strain <= self.reach * (2.0 / 3.0 + 1e-9)).sum())
        below = replace(self, strain=self.strain[:kept], log_load=self.log_load[:kept])
        loose = np.exp(power * (below.log_load[-1] - below.log_load)) * self.scatter
        mean, sd = np.array(strip.prior).reshape(-1, 2).T

        def residuals(u: Array) -> Array:
            off = (below.log_total(strip, u, below.strain) - below.log_load) / loose
            return np.concatenate([off, (u[1:] - mean) / sd])

        u = np.array([below.log_load[-1] - strip.log_shape(below.strain, mean, below.reach)[-1], *mean])
        end = solver(residuals, u).x
        off = below.log_total(strip, end, self.strain[kept:]) - self.log_load[kept:]
        return float(np.sqrt(np.mean(off**2)))


@dataclass(frozen=True)
class Weighed:
    """Laws against one pull.

    Attributes:
        levels: that they were compared with.
        shares: posterior probability of each law, by name; before the pull they are equal.
        draws: (m, 1 + d) of each law's numbers, by name.
        chances: (m,) of each draw, by law; all together sum to one.
        wander, freedom: standard deviation of the logarithm of the load about the law that follows it best, per root of
            an e-fold of strain, and its degrees of freedom.
    """

    levels: Levels
    shares: dict[str, float]
    draws: dict[str, Array]
    chances: dict[str, Array]
    wander: float
    freedom: int


def weigh(levels: Levels, laws: Sequence[str], seed: int = 0) -> Weighed:
    """Posterior draws of each law by importance sampling about its best fit, and the laws' evidence as its mean weight.

    Raises:
        InputError: no law, or one that is no strip's.
    """
    unknown = [name for name in laws if name not in STRIP_LAWS]
    if unknown or not laws:
        problem = "name no law of a strip" if unknown else "is empty"
        raise InputError("laws", problem, unknown or list(laws), f"use names of: {', '.join(STRIP_LAWS)}")
    ends = {name: _best(levels, STRIP_LAWS[name]) for name in dict.fromkeys(laws)}
    best = min(ends, key=lambda name: ends[name][1])
    growth = levels.residuals(STRIP_LAWS[best], ends[best][0], _WANDER)[: len(levels.strain) - 1] * _WANDER
    freedom = _WANDER_FREEDOM + max(1, len(growth) - len(STRIP_LAWS[best].prior))
    wander = math.sqrt((_WANDER_FREEDOM * _WANDER**2 + float(growth @ growth)) / freedom)
    random, draws, logs = np.random.default_rng(seed), {}, {}
    for name in ends:
        draws[name], logs[name] = _sampled(levels, STRIP_LAWS[name], ends[name][0], wander, random)
    highest = max(float(log.max()) for log in logs.values())
    total = sum(float(np.exp(log - highest).sum()) for log in logs.values())
    chances = {name: np.exp(log - highest) / total for name, log in logs.items()}
    return Weighed(levels, {name: float(c.sum()) for name, c in chances.items()}, draws, chances, wander, freedom)


def best_numbers(levels: Levels, law: str) -> Array:
    """(1 + d,) the most probable u of a law, see `StripLaw.log_load`."""
    return _best(levels, STRIP_LAWS[law])[0]


def _best(levels: Levels, law: StripLaw) -> tuple[Array, float]:
    """Numbers of the best fit from several starts, and half the sum of its squares."""
    found = []
    for shift in _STARTS if law.prior else (0.0,):
        u = np.array([0.0, *(mean + shift * sd for mean, sd in law.prior)])
        u[0] = levels.log_load[-1] - law.log_load(levels.strain, u, levels.reach)[-1]
        found.append(_descended(levels, law, u, _WANDER))
    end, cost, _ = min(found, key=lambda one: one[1])
    return end, cost


def _descended(levels: Levels, law: StripLaw, start: Array, wander: float) -> tuple[Array, float, Array]:
    """Numbers of the best fit near a start, half the sum of its squares, and its Jacobian, computed with central
    differences."""

    def jacobian(u: Array) -> Array:
        steps = _STEP * np.eye(len(u))
        ends = levels.residuals(law, np.concatenate([u + steps, u - steps]), wander)
        by: Array = ((ends[: len(u)] - ends[len(u) :]) / (2.0 * _STEP)).T
        return by

    solver = require("scipy.optimize", "fit").least_squares
    end = solver(lambda u: levels.residuals(law, u, wander), start, jacobian, xtol=1e-8, ftol=1e-8)
    return end.x, float(end.cost), jacobian(end.x)


def _sampled(
    levels: Levels, law: StripLaw, start: Array, wander: float, random: np.random.Generator
) -> tuple[Array, Array]:
    """Draws of a law's numbers, and the logarithm of each draw's weight in the evidence."""
    center, _, jacobian = _descended(levels, law, start, wander)
    d, gammaln = len(center), require("scipy.special", "fit").gammaln
    factor = np.linalg.cholesky(np.linalg.inv(jacobian.T @ jacobian))
    z = random.normal(size=(_DRAWS, d)) / np.sqrt(random.chisquare(_TAIL, size=_DRAWS) / _TAIL)[:, None]
    draws = center + z @ factor.T
    target = -0.5 * (levels.residuals(law, draws, wander) ** 2).sum(axis=-1)
    target -= sum(math.log(sd) + 0.5 * math.log(2.0 * math.pi) for _, sd in law.prior)
    proposed = gammaln((_TAIL + d) / 2.0) - gammaln(_TAIL / 2.0) - 0.5 * d * math.log(_TAIL * math.pi)
    proposed = proposed - np.log(np.diag(factor)).sum() - 0.5 * (_TAIL + d) * np.log1p((z**2).sum(axis=1) / _TAIL)
    return draws, target - proposed - math.log(_DRAWS)
