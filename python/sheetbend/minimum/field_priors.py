"""The size and the length of the prior of a smooth field, found from the recordings before a fit searches.

They follow from the marginal likelihood: all parameters integrated out of the linear picture at the minimum that
belongs to the last ones, as the gaps of windows are found (`window_loss`). Data count with the variance and the
autocorrelation that their residuals show (empirical Bayes; MacKay 1992, Neural Computation 4).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays.types import Array
from ..problem.parts import expanded_to
from ..problem.problem import FitProblem
from ..problem.smooth import Field
from ..problem.sought import Sought
from ..quantities.parameters import Parameters
from ..statistics.intervals import LIKELY
from ..statistics.spectral import effective_deviation
from .growth import growths
from .optimizers import walked
from .progress import Latest, Observer
from .windows import chosen, through

SIZES, LENGTHS = (1e-3, 10.0), (0.1, 10.0)  # that are looked at; lengths of the shortest wave's and of the extent
LOOKED = 33  # sizes, and as many lengths
FINER = 4  # times closer, about the best
SIZES_FOR_EACH = 8  # times as many sizes for each length: they cost next to nothing (`Picture.heights`)
ROUNDS = 12  # of priors
SETTLED = 0.03  # of the logarithms of both
POSSIBLE = 25.0  # likewise: what is less likely weighs less than 4e-6


def with_likely_priors(
    sought: Sought, threads: int, windows: Sequence[float] | str = (), observe: Observer | None = None
) -> Sought:
    """The same with the priors of its fields that are most likely, and where the search for them ended. If Ctrl-C came,
    all is as it was at the point reached last.

    So many numbers explain a long motion nearly in a wrong minimum, too. So the first walk goes through windows.

    Args:
        windows: s, or "auto", see `fit`.
    """
    if not sought.fields:
        return sought
    wanted, found = sought.wanted, sought.fields
    here = expanded_to(wanted, sought.experiments) if sought.expanded is None else sought.expanded
    at, undone, picture = Latest(observe, here.initial()), "", None
    try:
        for k in range(ROUNDS):
            wanted, here = _carried(found, wanted), _carried(found, here)
            problem = replace(sought, wanted=wanted, expanded=here).problem(threads)
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
            if all(_distance(a, b) < SETTLED for a, b in zip(before, found, strict=True)):
                break
        if picture is not None:
            found = tuple(picture.bounded(found, i) for i in range(len(found)))
    except KeyboardInterrupt:
        undone = "sizes and lengths of smooth priors are those at which the search for them was stopped"
    begins = _carried(found, here).starting_at(at.u)
    return replace(sought, wanted=_carried(found, wanted), expanded=begins, fields=found, undone=undone)


def _carried(fields: Sequence[Field], parameters: Parameters) -> Parameters:
    """The parameters with the priors of all fields."""
    for field in fields:
        parameters = field.carried(parameters)
    return parameters


def _distance(a: Field, b: Field) -> float:
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
            rows[own] /= effective_deviation(r[own], layout.of(layout.recording == i), taken)
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
        size, length = self._near(fields, i, POSSIBLE)
        over = self.heights(fields, i, size, length)
        over -= over.min()
        rows, columns = np.nonzero(over < POSSIBLE)
        weights = np.exp(-0.5 * over[rows, columns])
        each = tuple(fields[i].at(s, t) for s, t in zip(size[rows], length[columns], strict=True))
        return each, np.asarray(weights / weights.sum())

    def likeliest(self, fields: Sequence[Field], i: int) -> Field:
        """One field with the size and the length that are most likely."""
        given = fields[i].wanted
        size, length = _axes(fields[i])
        size = _closer(size)
        heights = self.heights(fields, i, size, length)
        best = np.unravel_index(int(np.argmin(heights)), heights.shape)
        near = [_about(axis, int(k)) for axis, k in zip((size, length), best, strict=True)]
        finer = self.heights(fields, i, *near)
        row, column = np.unravel_index(int(np.argmin(finer)), finer.shape)
        found = given.size or math.exp(near[0][row]), given.length or math.exp(near[1][column])
        return replace(fields[i], size=found[0], length=found[1])

    def bounded(self, fields: Sequence[Field], i: int) -> Field:
        """One field with the intervals of its size and its length.

        A larger size goes with a longer length, on a narrow ridge of the likelihood. So a profile of one needs the
        other at close distances, or it is too high and the interval too narrow.
        """
        size, length = self._near(fields, i, POSSIBLE)
        size, length = self._near(fields, i, 2.0 * LIKELY, (_closer(size), length))
        size = _closer(size)
        heights = self.heights(fields, i, size, length)
        heights -= heights.min()
        given, found = fields[i].wanted, fields[i]
        if given.size is None:
            found = replace(found, size_ends=_ends(size, heights.min(axis=1)))
        return found if given.length is not None else replace(found, length_ends=_ends(length, heights.min(axis=0)))

    def _near(
        self, fields: Sequence[Field], i: int, limit: float, among: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """Logarithms of sizes and lengths of one field, as many as were looked at, between the outermost whose height
        is below a limit and one more on either side."""
        size, length = among or _axes(fields[i])
        over = self.heights(fields, i, size, length)
        over -= over.min()
        return _narrowed(size, over.min(axis=1), limit), _narrowed(length, over.min(axis=0), limit)


def _axes(field: Field) -> tuple[Array, Array]:
    """Logarithms of sizes and of lengths; one of what is given."""
    modes, given = field.modes, field.wanted
    wave = 1.0 / math.sqrt(max(float(modes.eigenvalues[-1]), 1e-300))
    span = (LENGTHS[0] * wave, LENGTHS[1] * modes.extent)
    size = _spaced(*(modes.scale * s for s in SIZES)) if given.size is None else np.array([math.log(given.size)])
    return size, _spaced(*span) if given.length is None else np.array([math.log(given.length)])


def _narrowed(axis: Array, over: Array, limit: float) -> Array:
    """As many points as are looked at, closer together around those whose profile is below a limit."""
    if len(axis) == 1:
        return axis
    inside = np.flatnonzero(over < limit)
    first, last = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(axis) - 1)
    return np.linspace(axis[first], axis[last], LOOKED)


def _closer(size: Array) -> Array:
    """Sizes between the same ends, closer together; one of what is given."""
    return size if len(size) == 1 else np.linspace(size[0], size[-1], SIZES_FOR_EACH * (len(size) - 1) + 1)


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
