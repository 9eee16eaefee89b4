"""A smoothness prior of a field: its size and its length are found from the recordings before a fit searches.

A field is a stiffness that varies from place to place, or a force or a wind over time that nobody measured. Its modes
are parameters with independent priors, whose deviations follow from a size and a length (`deviations`). These follow
from the marginal likelihood: all parameters integrated out of the linear picture at the minimum that belongs to the
last ones, as the gaps of windows are found (`continuity`). Data count with the variance and the autocorrelation that
their residuals show (empirical Bayes; MacKay 1992, Neural Computation 4).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from dataclasses import field as of_field

import numpy as np

from ..arrays.checks import check_kind, is_number
from ..arrays.timeseries import Array
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..objects.over_time import OverTime
from ..objects.stiffness_field import StiffnessField
from ..quantities.parameters import Parameter, Parameters
from ..statistics.spectral import autocorrelation
from .growth import growths
from .optimizers import walked
from .parts import expanded_to
from .problem import FitProblem
from .progress import Latest, Observer
from .windows import chosen, through

FIRST_SIZE, FIRST_LENGTH = 0.5, 0.25  # of the scale, which is 1 for ln E; of the extent
SIZES, LENGTHS = (1e-3, 10.0), (0.1, 10.0)  # that are looked at; lengths of the shortest wave's and of the extent
LOOKED = 33  # sizes, and as many lengths
FINER = 4  # times closer, about the best
ROUNDS = 12  # of priors
SETTLED = 0.03  # of the logarithms of both
LIKELY = 3.841  # of twice the logarithm of a likelihood: 95 % of a chi-square with one degree
POSSIBLE = 25.0  # likewise: what is less likely weighs less than 4e-6


Modes = StiffnessField | OverTime


@dataclass(frozen=True)
class Smooth:
    """A smoothness prior; what is None is found from the recordings.

    Attributes:
        size: root mean square of ln E about its mean, or of an unknown force (N) or wind (m/s) along each axis.
        length: m, over which neighbors are alike; of a force or wind the time, s.
    """

    size: float | None = None
    length: float | None = None

    def __post_init__(self) -> None:
        for field in ("size", "length"):
            value = getattr(self, field)
            if value is not None and not (is_number(value) and value > 0):
                raise InputError(f"smooth.{field}", "must be positive", value, "give a number, or leave it out")


@dataclass(frozen=True)
class Field:
    """A field with its prior.

    Attributes:
        modes: as the scene has them, of the first scene that does.
        wanted: as it was asked for.
        size, length: of the prior.
        size_ends, length_ends: of their 95 % intervals; (None, None) of what was given.
        own: by recording, its modes, where each has numbers of its own; empty where all share them.
    """

    modes: Modes
    wanted: Smooth
    size: float
    length: float
    size_ends: tuple[float | None, float | None] = (None, None)
    length_ends: tuple[float | None, float | None] = (None, None)
    own: Mapping[str, OverTime] = of_field(default_factory=dict)

    @property
    def each(self) -> Iterator[tuple[Modes, tuple[str, ...]]]:
        """The modes of each recording, or those of all, and the names of their parameters."""
        if not self.own:
            yield self.modes, self.modes.modes
        for recording, modes in self.own.items():
            yield modes, tuple(f"{mode}[{recording}]" for mode in modes.modes)

    @property
    def deviations(self) -> Array:
        """Standard deviations of the priors of all parameters."""
        return np.concatenate([modes.deviations(self.size, self.length) for modes, _ in self.each])

    def at(self, log_size: float, log_length: float) -> Field:
        """With another size and length."""
        return replace(self, size=math.exp(log_size), length=math.exp(log_length))

    def carried(self, parameters: Parameters) -> Parameters:
        """The parameters with this prior."""
        sds: dict[str, float] = {}
        for modes, names in self.each:
            own = modes.deviations(self.size, self.length).tolist()
            sds |= dict(zip((*names, *modes.modes), [*own, *own], strict=True))
        return Parameters(replace(p, prior=(0.0, sds[p.name])) if p.name in sds else p for p in parameters.values())


def with_fields(
    parameters: Parameters, experiments: Sequence[Experiment], smooth: Mapping[str, Smooth]
) -> tuple[Parameters, tuple[Field, ...]]:
    """The parameters with those of all fields, under the prior that a search for sizes and lengths begins with. Those
    of inputs over time need not be named in `smooth`, and are private where there are several recordings.

    Raises:
        InputError: no scene has such a field, a mode is a parameter already, a size or length is not positive, or an
            input over time does not suit a recording.
    """
    scenes = [e.scene for e in experiments]
    objects = [o for s in scenes for o in (*s.solids.values(), *s.cloths.values(), *s.ropes.values())]
    fitted = {e.name for e in experiments if e.predict is None}
    known: dict[str, Modes] = {o.field.name: o.field for o in objects if o.field is not None}
    over_time = inputs_over_time(experiments)
    known |= {name: next(iter(own.values())) for name, own in over_time.items()}
    fields = []
    check_kind("smooth", smooth, Mapping, "give sb.Smooth() by the names of fields")
    for name, wanted in ({name: Smooth() for name in over_time} | dict(smooth)).items():
        check_kind(f"smooth.{name}", wanted, Smooth, "give sb.Smooth()")
        if name not in known:
            none = "none, give a cloth or a solid of clusters stiffness_modes, or a rope softness_modes from 1 on"
            fix = f"name one of: {', '.join(known) or none}"
            raise InputError(f"smooth.{name}", "names no field of the scenes", name, fix)
        own = over_time.get(name, {})
        private = len(own) > 1 or not fitted.issuperset(own)  # what is only predicted has its own, too
        own = own if private else {}
        modes = max(own.values(), key=lambda m: len(m.modes)) if private else known[name]
        if twice := [mode for mode in modes.modes if mode in parameters]:
            fix = "leave them out of the parameters: smooth adds them"
            raise InputError(f"smooth.{name}", "has modes that are parameters already", twice, fix)
        size = wanted.size or FIRST_SIZE * modes.scale
        own = {recording: modes for recording, modes in own.items() if recording in fitted}
        length = wanted.length or FIRST_LENGTH * modes.extent
        field = Field(modes, wanted, size, length, _open(wanted.size), _open(wanted.length), own)
        if own or not private:
            fields.append(field)
        quantities = next(e.scene.quantities for e in experiments if modes.modes[-1] in e.scene.quantities)
        more = [
            Parameter(
                name=m,
                initial=None if private else quantities[m].value,
                scale=quantities[m].scale,
                private=private,
            )
            for m in modes.modes
        ]
        parameters = field.carried(Parameters([*parameters.values(), *more]))
    return parameters, tuple(fields)


def _open(given: float | None) -> tuple[float | None, float | None]:
    """The ends of a size or length before the recordings tell anything of it."""
    return (0.0, None) if given is None else (None, None)


def inputs_over_time(experiments: Sequence[Experiment]) -> dict[str, dict[str, OverTime]]:
    """The unknown inputs over time of the experiments' scenes, by name and recording.

    Raises:
        InputError: one of a recording of an equilibrium, one that ends before its recording, or whose knots are farther
            apart than the recording is long.
    """
    found: dict[str, dict[str, OverTime]] = {}
    for e in experiments:
        for name, own in e.scene.over_time.items():
            if e.static:
                raise InputError(f"{e.name}.static", f"has no time for the unknown {own.kind}", name, "leave it out")
            until = float((e.held() or e.fitted()).times[-1]) - e.t0
            spacing = float(own.times[1])
            if spacing > until:
                raise InputError(
                    f"{name}.spacing", "is longer than the recording", spacing, f"give at most {until:g} s"
                )
            if until > own.times[-1] + spacing:
                fix = f"give at least {until:g} s"
                raise InputError(f"{name}.duration", "ends before the recording", own.extent, fix)
            found.setdefault(name, {})[e.name] = own
    return found


def modes_over_time(experiments: Sequence[Experiment]) -> set[str]:
    """The quantities that make up the unknown inputs over time of the experiments' scenes."""
    return {mode for e in experiments for own in e.scene.over_time.values() for mode in own.modes}


def settled(
    experiments: Sequence[Experiment],
    wanted: Parameters,
    expanded: Parameters | None,
    fields: Sequence[Field],
    threads: int,
    windows: Sequence[float] | str = (),
    observe: Observer | None = None,
) -> tuple[Parameters, Parameters | None, tuple[Field, ...], bool]:
    """The parameters with the priors that are most likely, also expanded where the search begins, the fields, and
    whether Ctrl-C ended this. Then all is as it was at the point reached last.

    So many numbers explain a long motion nearly in a wrong minimum, too. So the first walk goes through windows.

    Args:
        expanded: where the search begins so far; None = at the initial values.
        windows: s, or "auto", see `fit`.
    """
    if not fields:
        return wanted, expanded, (), False
    here, found = expanded_to(wanted, experiments) if expanded is None else expanded, tuple(fields)
    at, interrupted = Latest(observe, here.initial()), False
    try:
        for k in range(ROUNDS):
            wanted, here = _carried(found, wanted), _carried(found, here)
            problem = FitProblem(experiments, wanted, threads=threads, expanded=here)
            if k == 0:
                auto = isinstance(windows, str)
                lengths = chosen(problem, growths(problem, at.u)) if auto else [*map(float, windows)]
                at.u = through(problem, lengths, at.u, at)
            at.u = walked(problem, at.u, at)
            picture = Picture.at(problem, at.u, found)
            if picture is None:
                break
            before = found
            for i in range(len(found)):
                found = (*found[:i], picture.likeliest(found, i), *found[i + 1 :])
            if all(_apart(a, b) < SETTLED for a, b in zip(before, found, strict=True)):
                break
    except KeyboardInterrupt:
        interrupted = True
    return _carried(found, wanted), _carried(found, here).starting_at(at.u), found, interrupted


def _carried(fields: Sequence[Field], parameters: Parameters) -> Parameters:
    """The parameters with the priors of all fields."""
    for field in fields:
        parameters = field.carried(parameters)
    return parameters


def _apart(a: Field, b: Field) -> float:
    return max(abs(math.log(b.size / a.size)), abs(math.log(b.length / a.length)))


@dataclass(frozen=True)
class Picture:
    """The least-squares problem to first order, without the fields' priors, in units of the residuals' own size.

    Attributes:
        triangle: (rows, free + 1) of the Jacobian and the residuals.
        columns: by field, those of its modes.
        u: (free,).
    """

    triangle: Array
    columns: tuple[Array, ...]
    u: Array

    @classmethod
    def at(cls, problem: FitProblem, u: Array, fields: Sequence[Field]) -> Picture | None:
        """None where the problem has no answer."""
        ok, r, J = problem.evaluate(u)
        if not ok:
            return None
        place = {name: k for k, name in enumerate(problem.parameters.free)}
        columns = tuple(np.array([place[n] for _, names in field.each for n in names]) for field in fields)
        rows, prior = np.column_stack([J, r]), problem.prior_rows
        first, layout = problem.core.first_rows, problem.rows_layout()
        for i in range(len(problem.experiments)):
            own = slice(first[i], first[i + 1])
            taken = len(u) * len(r[own]) / max(problem.core.data_rows, 1) + problem.core.absorbed(i)
            variance = float(r[own] @ r[own]) / max(len(r[own]) - taken, 1.0)
            lags = autocorrelation(r[own], layout.of(layout.recording == i))
            positive = lags[: int(np.argmax(lags <= 0))] if (lags <= 0).any() else lags
            rows[own] /= math.sqrt(max(variance, 1e-300) * (1.0 + 2.0 * float(positive.sum())))
        of_fields = np.isin(np.arange(len(u)), np.concatenate(columns))
        theirs = prior[0] + np.flatnonzero(problem.parameters.prior_jacobian()[:, of_fields].any(axis=1))
        kept = np.delete(rows, theirs, axis=0)
        return cls(np.asarray(np.linalg.qr(kept, mode="r")), columns, u)

    def rows_with(self, fields: Sequence[Field], without: int | None = None) -> Array:
        """The triangle of Jacobian and residuals, with the rows of the fields' priors below, but for one field."""
        below = []
        for k, (field, own) in enumerate(zip(fields, self.columns, strict=True)):
            if k == without:
                continue
            weight = 1.0 / field.deviations
            rows = np.zeros((len(own), self.triangle.shape[1]))
            rows[np.arange(len(own)), own] = weight
            rows[:, -1] = weight * self.u[own]
            below.append(rows)
        return np.concatenate([self.triangle, *below])

    def solved(self, fields: Sequence[Field]) -> tuple[Array, Array]:
        """The step to the minimum (free,), and a root (free, free) of the covariance there: root root'."""
        R = np.asarray(np.linalg.qr(self.rows_with(fields), mode="r"))
        p = len(self.u)
        root = np.linalg.pinv(R[:p, :p])
        return -root @ R[:p, -1], root

    def heights(self, fields: Sequence[Field], i: int, size: Array, length: Array) -> Array:
        """(sizes, lengths) minus twice the logarithm of the marginal likelihood, up to a constant, at the logarithms of
        both, of one field.

        With R = [A | c] the triangle of its modes, all other columns eliminated, and D the deviations for a size of 1,
        the residuals c of a field that is zero have the covariance 1 + size^2 A D^2 A'. One decomposition of A D into
        singular values serves all sizes.
        """
        own = self.columns[i]
        rest = np.setdiff1d(np.arange(len(self.u)), own)
        rows = self.rows_with(fields, i)[:, [*rest, *own, -1]]
        R = np.asarray(np.linalg.qr(rows, mode="r"))[len(rest) :, len(rest) :]
        c = R[:, -1] - R[:, :-1] @ self.u[own]
        found = []
        for t in length:
            U, values, _ = np.linalg.svd(R[:, :-1] * fields[i].at(0.0, t).deviations, full_matrices=False)
            gain = np.exp(2.0 * size)[:, None] * values**2
            taken = (U.T @ c) ** 2 * gain / (1.0 + gain)
            found.append(float(c @ c) + np.sum(np.log1p(gain) - taken, axis=1))
        return np.stack(found, axis=1)

    def possible(self, fields: Sequence[Field], i: int) -> tuple[tuple[Field, ...], Array]:
        """One field with each size and length that is possible, and their probabilities, which sum to one.

        Before the recordings all logarithms that are looked at are as probable.
        """
        size, length = _looked_at(fields[i])
        over = self.heights(fields, i, size, length)
        over -= over.min()
        size, length = _narrowed(size, over.min(axis=1)), _narrowed(length, over.min(axis=0))
        over = self.heights(fields, i, size, length)
        over -= over.min()
        rows, columns = np.nonzero(over < POSSIBLE)
        weights = np.exp(-0.5 * over[rows, columns])
        each = tuple(fields[i].at(s, t) for s, t in zip(size[rows], length[columns], strict=True))
        return each, np.asarray(weights / weights.sum())

    def likeliest(self, fields: Sequence[Field], i: int) -> Field:
        """One field with the size and the length that are most likely, and their intervals."""
        field = fields[i]
        given = field.wanted
        size, length = _looked_at(field)
        heights = self.heights(fields, i, size, length)
        best = np.unravel_index(int(np.argmin(heights)), heights.shape)
        near = [_about(axis, int(k)) for axis, k in zip((size, length), best, strict=True)]
        finer = self.heights(fields, i, *near)
        row, column = np.unravel_index(int(np.argmin(finer)), finer.shape)
        least = float(finer[row, column])
        return replace(
            field,
            size=given.size or math.exp(near[0][row]),
            length=given.length or math.exp(near[1][column]),
            size_ends=(None, None) if given.size is not None else _ends(size, heights.min(axis=1) - least),
            length_ends=(None, None) if given.length is not None else _ends(length, heights.min(axis=0) - least),
        )


def _looked_at(field: Field) -> tuple[Array, Array]:
    """Logarithms of sizes and of lengths; one of what is given."""
    modes, given = field.modes, field.wanted
    wave = 1.0 / math.sqrt(max(float(modes.eigenvalues[-1]), 1e-300))
    span = (LENGTHS[0] * wave, LENGTHS[1] * modes.extent)
    size = _spaced(*(modes.scale * s for s in SIZES)) if given.size is None else np.array([math.log(given.size)])
    return size, _spaced(*span) if given.length is None else np.array([math.log(given.length)])


def _narrowed(axis: Array, over: Array) -> Array:
    """An axis with the same number of points, closer together around those that are possible by their profile."""
    inside = np.flatnonzero(over < POSSIBLE)
    first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(axis) - 1)
    return np.linspace(axis[first], axis[last], len(axis))


def _spaced(lower: float, upper: float) -> Array:
    return np.linspace(math.log(lower), math.log(upper), LOOKED)


def _about(axis: Array, k: int) -> Array:
    """Points about one of an axis, closer to each other."""
    if len(axis) == 1:
        return axis
    step = axis[1] - axis[0]
    found = axis[k] + step * np.linspace(-1.0, 1.0, 2 * FINER + 1)
    return np.asarray(found[(found >= axis[0] - 1e-12) & (found <= axis[-1] + 1e-12)])


def _ends(axis: Array, heights: Array) -> tuple[float | None, float | None]:
    """The ends of what is likely by a profile's heights above its lowest, in the unit of the axis; 0 and None for open
    ends."""
    likely = np.flatnonzero(heights < LIKELY)
    if not len(likely):
        k = int(np.argmin(heights))
        likely = np.array([k, k])

    def crossed(inside: int, outside: int) -> float:
        a, b = min(heights[inside], LIKELY), heights[outside]
        return math.exp(axis[inside] + (axis[outside] - axis[inside]) * (LIKELY - a) / max(b - a, 1e-300))

    first, last = int(likely[0]), int(likely[-1])
    return crossed(first, first - 1) if first else 0.0, crossed(last, last + 1) if last + 1 < len(axis) else None
