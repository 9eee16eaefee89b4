"""A fabric's numbers from what a laboratory has read, with intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..arrays.checks import check_each, check_kind, given_by_name, is_list, is_number
from ..arrays.types import Array
from ..errors import InputError, NoEquilibriumError
from ..objects.fabric import Fabric
from ..objects.laws import Spline, Stiffening
from ..optional import require
from ..problem.linear_algebra import one_blas_thread
from ..quantities.parameters import Parameter, Parameters
from ..quantities.wording import figures, short
from ..report.tables import Section, plain_section
from ..result.estimate import Estimate
from ..statistics.gauge import null_space
from ..statistics.intervals import NORMAL, closed_estimate, critical_t, open_estimate
from .reading import Reading

_UNITS = {"density": "kg/m^2", "warp": "N/m", "weft": "N/m", "shear": "N/m", "poisson": ""} | dict.fromkeys(
    ("bending", "bending_weft", "bending_twist"), "N m"
)
_BLIND = (
    2.0 / 30.0
)  # sigmas that a number moves all readings by, per e-fold or per scale: less, and they do not contain it
_FREEDOM = 1e-3  # of readings: what has less is fitted whatever it reads
_OPEN = math.log(1e3)  # of a number on a log scale: not known to this factor, it is open


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What a laboratory has read.

    Attributes:
        name: for reports, such as "bending length, warp".
        test: the test in the computer, such as `lambda fabric: textile.cantilever(fabric).bending_length`.
        value: in the laboratory's unit of that reading (mm, %, gf/(cm deg); see `Reading.laboratory_unit`).
        sigma: standard deviation of `value`, in the same unit: of the mean, where it is one of several specimens.
        specimens: what each specimen read, by its name, in the same unit; the same name in other readings is the same
            specimen. `of_specimens` makes value and sigma of them.
        note: what the test in the computer leaves out, for the report.
    """

    name: str
    test: Callable[[Fabric], Reading]
    value: float
    sigma: float
    specimens: Mapping[str, float] = field(default_factory=dict)
    note: str = ""

    @classmethod
    def of_specimens(
        cls,
        specimens: Mapping[str, float],
        *,
        name: str,
        test: Callable[[Fabric], Reading],
        error: float = 0.0,
        note: str = "",
    ) -> Measured:
        """Mean of several specimens, and its standard deviation: their scatter over the root of their number, and the
        machine's own `error`, in the laboratory's unit, which more specimens do not lessen.

        Raises:
            InputError: fewer than two specimens and no error, or specimens that all read the same and no error.
        """
        values = np.array(list(specimens.values()), dtype=float)
        if not values.size or (values.size == 1 and not error > 0):
            fix = "give two or more, or one and its error"
            raise InputError(f"{name}.specimens", "tell no scatter", len(values), fix)
        scatter = float(values.std(ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else 0.0
        sigma = math.hypot(scatter, error)
        return cls(name=name, test=test, value=float(values.mean()), sigma=sigma, specimens=specimens, note=note)

    def __post_init__(self) -> None:
        if not isinstance(self.name, str):
            raise InputError("name", "must be a text", self.name, "name the test")
        if not callable(self.test):
            raise InputError(f"{self.name}.test", "must be a function of a fabric", self.test, "give such as shear")
        given_by_name(f"{self.name}.specimens", self.specimens)
        if not is_number(self.value):
            raise InputError(f"{self.name}.value", "must be finite", self.value, "give the laboratory's number")
        if not (is_number(self.sigma) and self.sigma > 0):
            raise InputError(
                f"{self.name}.sigma", "must be a positive size", self.sigma, "give the reading's own error"
            )


@dataclass(frozen=True)
class FabricFit:
    """Result of `fit_fabric`. Printing it gives the report.

    Attributes:
        fabric: with the numbers that were found.
        estimates: value, 95 % interval and verdict of each free number.
        measured, readings: what was given, and what the tests of `fabric` read.
        misfit: sum of the squares of (reading - value)/sigma.
        freedom: readings less numbers that they determine; the misfit should be about as large.
    """

    fabric: Fabric
    estimates: tuple[Estimate, ...]
    measured: tuple[Measured, ...]
    readings: tuple[Reading, ...]
    misfit: float
    freedom: int

    def __str__(self) -> str:
        found, read = self.sections()
        return "\n".join([*plain_section(found), "", *plain_section(read)])

    def sections(self) -> tuple[Section, Section]:
        """The report's tables: the numbers found, and each reading beside the fabric's."""
        found = tuple(
            (e.name, f"{values[0]} {e.unit}".rstrip(), f"{values[1]} to {values[2]}" if values[1] else "open", e.words)
            for e in self.estimates
            for values in [_figures(e)]
        )
        read = tuple(
            (
                m.name,
                f"{short(m.value, 4)} +/- {short(m.sigma, 2)}",
                str(r),
                f"{round((r.laboratory - m.value) / m.sigma, 1) + 0.0:+.1f}",  # and not -0.0
            )
            for m, r in zip(self.measured, self.readings, strict=True)
        )
        size = f"{self.misfit:.3g} for {self.freedom} more readings than numbers found"
        if self.freedom == 0:
            size = "none is left: as many numbers were found as there are readings"
        note = (
            "misfit",
            f"{size}; intervals are widened by the misfit of the tests that they rest on"
            if _contradict(self.misfit, self.freedom)
            else size,
        )
        left_out = tuple(("left out", told) for told in dict.fromkeys(m.note for m in self.measured) if told)
        return (
            Section("Fabric", ("number", "value", "95 % interval", "verdict"), found),
            Section("Readings", ("test", "laboratory", "fabric", "off by, sigma"), read, (note, *left_out)),
        )


def _figures(e: Estimate) -> list[str]:
    """Value and ends of the interval. To the digits of a much larger uncertainty, none of the value is left."""
    numbers = (e.value, e.lower, e.upper)
    if e.half_width and 0.0 < 10.0 * e.value < e.half_width:
        return ["" if number is None else short(number, 2) for number in numbers]
    return figures(numbers, e.half_width)


def _contradict(misfit: float, freedom: float) -> bool:
    """Whether readings leave more than their sigmas allow."""
    return freedom > _FREEDOM and misfit > freedom


@one_blas_thread()
def fit_fabric(measured: Sequence[Measured], start: Fabric, free: Sequence[str]) -> FabricFit:
    """Find the parameters of a fabric whose simulated tests give the readings of a laboratory: weighted least squares.

    All readings are fitted together, so parameters that share a test (shear in a bias extension) are found together.
    Parameters that the readings do not determine are named in the result. Intervals come from the sigmas of the
    readings. If the misfit of a test is larger than chance explains, its sigmas are multiplied by the root of that
    misfit (Birge 1932), so a pull that fits poorly does not widen the interval of the weight. Errors of one specimen
    are correlated: if readings name their specimens, each specimen counts as a whole (errors clustered by specimen;
    Liang and Zeger 1986), with Student's t of as many degrees of freedom as the errors of a parameter have (Welch
    1947).

    Args:
        measured: at least one.
        start: starting values, and the parameters that are not free. One that is left out follows the same parameter
            as in `Fabric`.
        free: parameters to find: of `Fabric` ("warp", "poisson", "bending_weft"), or of its law as fits name them
            ("warp_stiffening", "shear_ratio_2"). All but `poisson` are fitted on a log scale.

    Raises:
        InputError: no readings, no or unknown numbers, or numbers that `start` leaves out.
        NoEquilibriumError: a test of `start` comes to no rest.
        MissingExtraError: scipy is not installed.
    """
    check_each("measured", measured, Measured, "give what the laboratory has read")
    check_kind("start", start, Fabric, "give a Fabric to begin with")
    parameters = _parameters(start, free)
    evaluate = _Evaluation(measured, start, parameters)
    u = parameters.initial()
    evaluate(u)
    solver = require("scipy.optimize", "fit").least_squares
    end = solver(evaluate.residuals, u, evaluate.jacobian, bounds=parameters.bounds(), xtol=1e-9, ftol=1e-9, gtol=1e-9)
    readings, r, jacobian = evaluate(end.x)
    estimates, rank = estimates_of(parameters, end.x, r, jacobian, measured)
    fabric = _with(start, parameters, end.x)
    return FabricFit(fabric, estimates, tuple(measured), readings, float(r @ r), len(r) - rank)


def _parameters(start: Fabric, free: Sequence[str]) -> Parameters:
    initial = {name: getattr(start, name) for name in _UNITS} | {n: v for n, v, can in start.law.coefficients() if can}
    if not is_list(free):
        raise InputError("free", "must be a list", free, f"use names of: {', '.join(initial)}")
    unknown = [name for name in free if not isinstance(name, str) or name not in initial]
    if unknown or not free:
        problem = "name no number of the fabric" if unknown else "is empty"
        raise InputError("free", problem, unknown or list(free), f"use names of: {', '.join(initial)}")
    left_out = [name for name in free if initial[name] is None]
    if left_out:
        raise InputError("free", "name what the start leaves out", left_out, "give the start a value of it")
    return Parameters(
        Parameter(name=name, initial=initial[name], unit="", lower=-0.99, upper=0.99, scale=1.0)
        if name == "poisson"
        else Parameter(name=name, initial=initial[name], unit=_UNITS.get(name, ""), log=True)
        for name in free
    )


def _with(start: Fabric, parameters: Parameters, u: Array) -> Fabric:
    law, changes = start.law, {}
    for name, internal in zip(parameters.free, u, strict=True):
        value = parameters[name].to_physical(internal)
        component, _, coefficient = name.partition("_")
        if name in _UNITS:
            changes[name] = value
        elif isinstance(law, Stiffening):
            law = replace(law, **{component: value})
        elif isinstance(law, Spline):
            ratios = list(getattr(law, component))
            ratios[int(coefficient.removeprefix("ratio_")) - 1] = value
            law = replace(law, **{component: tuple(ratios)})
    return replace(start, law=law, **changes)


class _Evaluation:
    """Readings, weighted residuals and their derivatives at a point, the last one kept."""

    def __init__(self, measured: Sequence[Measured], start: Fabric, parameters: Parameters) -> None:
        self._measured, self._start, self._parameters = measured, start, parameters
        self._at = np.zeros(0)
        self._last: tuple[tuple[Reading, ...], Array, Array] = ((), np.zeros(0), np.zeros(0))

    def __call__(self, u: Array) -> tuple[tuple[Reading, ...], Array, Array]:
        if not np.array_equal(u, self._at):
            fabric = _with(self._start, self._parameters, u)
            readings = tuple(m.test(fabric) for m in self._measured)
            by_name = [self._parameters[name] for name in self._parameters.free]
            chain = [p.to_physical(x) if p.log else 1.0 for p, x in zip(by_name, u, strict=True)]
            residuals, jacobian = [], []
            for m, r in zip(self._measured, readings, strict=True):
                weight = r.per / m.sigma
                residuals.append((r.laboratory - m.value) / m.sigma)
                jacobian.append(
                    [weight * r.gradient.get(f"cloth_{p.name}", 0.0) * c for p, c in zip(by_name, chain, strict=True)]
                )
            self._at, self._last = np.array(u), (readings, np.array(residuals), np.array(jacobian))
        return self._last

    def residuals(self, u: Array) -> Array:
        """Infinite where a test has no answer, so that the optimizer takes a shorter step."""
        try:
            return self(u)[1]
        except NoEquilibriumError:
            return np.full(len(self._measured), np.inf)

    def jacobian(self, u: Array) -> Array:
        return self(u)[2]


def estimates_of(
    parameters: Parameters, u: Array, r: Array, jacobian: Array, measured: Sequence[Measured]
) -> tuple[tuple[Estimate, ...], int]:
    """The estimate of each free number, and how many combinations of them the readings determine."""
    free = [parameters[name] for name in parameters.free]
    seen = np.linalg.norm(jacobian, axis=0) > _BLIND
    jacobian = jacobian * seen
    space = null_space(jacobian, parameters.free, [p.log for p in free])
    kept = [column for column in range(len(free)) if column not in space.pivots]
    inverse = np.asarray(np.linalg.pinv(jacobian[:, kept]), dtype=float)
    left = 1.0 - np.einsum("ij,ji->i", jacobian[:, kept], inverse)  # of the freedom of each reading
    tests = _tests(measured)
    half_widths = _half_widths(measured, tests, inverse, _widening(tests, r, left))
    estimates = []
    for column, p in enumerate(free):
        reach = math.inf
        if column in space.determined:
            reach = float(half_widths[kept.index(column)])
        told = [gauge.words for gauge in space.gauges if p.name in gauge.members]
        estimates.append(_estimate(p, u[column], reach, "; ".join(told)))
    return tuple(estimates), space.rank


def _tests(measured: Sequence[Measured]) -> list[list[int]]:
    """The readings of each test, by their numbers: readings of the same specimen are of one test."""
    tests = list(range(len(measured)))
    for row, m in enumerate(measured):
        for other in range(row):
            if m.specimens.keys() & measured[other].specimens.keys():
                tests = [tests[other] if test == tests[row] else test for test in tests]
    return [[row for row, test in enumerate(tests) if test == own] for own in dict.fromkeys(tests)]


def _widening(tests: Sequence[Sequence[int]], r: Array, left: Array) -> Array:
    """(readings,) factors of the sigmas, those of each test alike: the root of what it leaves over what chance does
    (Birge 1932), where readings contradict each other.

    Args:
        left: (readings,) of the freedom of each reading: 1 less its leverage.
    """
    factors = np.ones(len(r))
    if _contradict(float(r @ r), float(left.sum())):
        for own in tests:
            freedom = float(left[own].sum())
            if freedom > _FREEDOM:
                factors[own] = math.sqrt(max(1.0, float(r[own] @ r[own]) / freedom))
    return factors


def _half_widths(
    measured: Sequence[Measured], tests: Sequence[Sequence[int]], inverse: Array, widening: Array
) -> Array:
    """(numbers,) half-widths of 95 % intervals, of the optimizer's numbers.

    Errors of one specimen go together. What the scatter of a few specimens tells counts by Student's t, with the
    degrees of freedom that belong to the errors of a number (Welch 1947, Satterthwaite 1946).

    Args:
        inverse: (numbers, readings) how each number follows a reading, in its sigmas.
    """
    every, scattered = np.zeros((2, len(inverse)))
    for own in tests:
        shared, single = _errors([measured[row] for row in own])
        moved = inverse[:, own] * widening[own]
        scatter = ((moved @ shared) ** 2).sum(axis=1)
        every += scatter + ((moved * single) ** 2).sum(axis=1)
        if shared.shape[1] > 1:
            scattered += scatter**2 / (shared.shape[1] - 1)
    few = scattered > 0.0
    quantile = np.full(len(every), NORMAL)
    if few.any():
        quantile[few] = critical_t(every[few] ** 2 / scattered[few])
    return np.asarray(quantile * np.sqrt(every))


def _errors(measured: Sequence[Measured]) -> tuple[Array, Array]:
    """How many sigmas each source of error moves readings of one test by: (readings, specimens) a specimen, which moves
    all readings that it is part of; and (readings,) what sigma has beyond the scatter of the specimens."""
    names = list(dict.fromkeys(name for m in measured for name in m.specimens if len(m.specimens) > 1))
    shared = np.zeros((len(measured), len(names)))
    for row, m in enumerate(measured):
        count = len(m.specimens)
        if count > 1:
            values = np.array(list(m.specimens.values()), dtype=float)
            parts = (values - values.mean()) / (m.sigma * math.sqrt(count * (count - 1)))
            shared[row, [names.index(name) for name in m.specimens]] = parts
    return shared, np.sqrt(np.maximum(0.0, 1.0 - (shared**2).sum(axis=1)))


def _estimate(p: Parameter, internal: float, reach: float, gauges: str) -> Estimate:
    """`reach`: half-width in the internal coordinate, infinite where the readings leave the number open."""
    value = p.to_physical(internal)
    if p.log and _OPEN < reach < math.inf:
        return open_estimate(p, value, "the readings leave it open by more than a factor of 1,000 either way")
    if math.isinf(reach):
        return open_estimate(p, value, gauges or "moves no reading: fix it, or measure what depends on it")
    return closed_estimate(p, value, p.to_physical(internal - reach), p.to_physical(internal + reach))
