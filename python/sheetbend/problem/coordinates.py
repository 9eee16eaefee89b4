"""The coordinates in which a search takes its steps: those of the parameters, and others where sums of parameters must
stay positive.

The moments of inertia of a body are the case in point: each must be less than the sum of the two others, so that the
second moments of its mass, J1 = (I2 + I3 - I1)/2 and so on, are positive. In the moments a step that would leave the
possible bodies has no answer, and a search that comes near their limit stops there. In the logarithms of the J's every
point is a possible body (as in the log-Cholesky coordinates of Rucker & Wensing 2022, IEEE Robot. Autom. Lett. 7, 2692,
with the principal axes as parameters of their own). Reports, priors and intervals are of the parameters all the same.

With n parameters in them, n of the sums x = A p + b become the coordinates: log x, and log x/(top - x) where the other
sums set x a top, as where one moment is held and two are fitted. The other sums are then positive by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Self

import numpy as np

from ..arrays.types import Array
from ..quantities.parameters import DEFAULT_RANGE, Parameters
from ..quantities.wording import short
from ..scene.scene import Scene

LOG_STEP = math.log(10.0)
LINEAR_STEP = 1.0  # natural scales
Sum = tuple[Mapping[str, float], float]  # coefficients by free parameter, and a constant: must stay positive
ROUNDING, DIGITS = 1e-12, 12  # of coefficients
OFF = 0.05  # of the size of a sum: where a start that is impossible is moved


def step_limits(parameters: Parameters) -> Array:
    """The longest step of each free parameter in internal coordinates, shape (free,); infinite where a parameter has
    neither a log scale nor a natural one."""
    limits = []
    for name in parameters.free:
        p = parameters[name]
        limits.append(LOG_STEP if p.log else math.inf if p.scale is None else LINEAR_STEP * p.scale)
    return np.array(limits)


@dataclass(frozen=True, eq=False)
class Chart:
    """Coordinates w of a few parameters p: x = A p + b lies between 0 and a top, w = log x or log x/(top - x).

    Attributes:
        columns: (n,) of the parameters, among the free ones.
        A, b: (n, n) and (n,).
        top: (n,), infinite where there is none.
    """

    columns: Array
    A: Array
    b: Array
    top: Array

    @classmethod
    def of(cls, columns: Sequence[int], rows: Array, constants: Array) -> Self | None:
        """Coordinates for sums (rows, n) with constants (rows,) that must stay positive; None where no n of the sums
        bound all others."""
        n = len(columns)
        for chosen in map(list, combinations(range(len(rows)), n)):
            A, b = rows[chosen], constants[chosen]
            if np.linalg.matrix_rank(A) < n:
                continue
            others = np.delete(np.arange(len(rows)), chosen)
            along = np.linalg.solve(A.T, rows[others].T).T  # the other sums are along @ x + left
            left = constants[others] - along @ b
            along[np.abs(along) < ROUNDING] = 0.0
            single = (np.count_nonzero(along, axis=1) == 1) & (along.min(axis=1) < 0.0)
            top = np.full(n, np.inf)
            for weights, rest in zip(along[single], left[single], strict=True):
                k = int(weights.argmin())
                top[k] = min(top[k], rest / -weights[k])
            with np.errstate(invalid="ignore"):
                lowest = left[~single] + np.where(along[~single] < 0.0, along[~single] * top, 0.0).sum(axis=1)
            if (top > 0.0).all() and (lowest >= -ROUNDING * np.abs(constants).max()).all():
                return cls(np.array(columns), A, b, top)
        return None

    def sums(self, p: Array) -> Array:
        """(n,) x."""
        return np.asarray(self.A @ p + self.b)

    @property
    def bounded(self) -> Array:
        """(n,) whether x has a top."""
        return np.isfinite(self.top)

    def size(self, p: Array) -> Array:
        """(n,) what x is counted against: its top, or its parts without their signs."""
        return np.where(self.bounded, self.top, np.abs(self.A) @ np.abs(p) + np.abs(self.b))

    def into(self, p: Array) -> Array:
        """(n,) w of parameters; of impossible ones that of a point inside."""
        x, size = self.sums(p), self.size(p)
        inside = np.where((x > 0.0) & (x < self.top), x, np.clip(x, OFF * size, (1.0 - OFF) * size))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.bounded, np.log(inside / (self.top - inside)), np.log(inside))

    def out(self, w: Array) -> Array:
        """(n,) the parameters."""
        return np.asarray(np.linalg.solve(self.A, self._x(w) - self.b))

    def slope(self, w: Array) -> Array:
        """(n, n) d parameters / d w."""
        x = self._x(w)
        return np.asarray(np.linalg.solve(self.A, np.diag(np.where(self.bounded, x * (1.0 - x / self.top), x))))

    def _x(self, w: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):
            return np.where(self.bounded, self.top / (1.0 + np.exp(-w)), np.exp(w))

    def passed(self, p: Array) -> Iterator[tuple[Array, float]]:
        """The sums, as weights (n,) and a constant, that are not positive at a point p."""
        x = self.sums(p)
        for k in np.flatnonzero(x <= 0.0):
            yield self.A[k], float(self.b[k])
        for k in np.flatnonzero(x >= self.top):
            yield -self.A[k], float(self.top[k] - self.b[k])

    def limits(self, p: Array) -> tuple[Array, Array]:
        """(n,) each: how far a search goes that starts at p."""
        start, size, far = self.into(p), self.size(p), math.log(DEFAULT_RANGE)
        lower = np.where(self.bounded, -far, np.log(size) - far)
        return np.minimum(lower, start), np.maximum(np.where(self.bounded, far, np.log(size) + far), start)


class Coordinates:
    """The coordinates of one problem's search.

    Attributes:
        charts: of the parameters whose sums must stay positive; none where there are no such sums.
        longest: (free,) the longest step.
    """

    def __init__(self, parameters: Parameters, sums: Sequence[Sum] = ()) -> None:
        """Parameters that have a bound of their own, or whose sums allow no such coordinates, keep theirs."""
        self.parameters, self.charts = parameters, tuple(_charts(parameters, sums))
        self.longest = step_limits(parameters)
        for chart in self.charts:
            self.longest[chart.columns] = LOG_STEP

    def into(self, u: Array) -> Array:
        """(free,) w of internal values u (free,)."""
        if not self.charts:
            return u
        w = np.array(u, dtype=float)
        for chart in self.charts:
            w[chart.columns] = chart.into(self._values(chart, u))
        return w

    def out(self, w: Array) -> Array:
        """(free,) internal values."""
        if not self.charts:
            return w
        u = np.array(w, dtype=float)
        for chart in self.charts:
            names = (self.parameters.free[c] for c in chart.columns)
            u[chart.columns] = [
                self.parameters[name].to_internal(value)
                for name, value in zip(names, chart.out(w[chart.columns]), strict=True)
            ]
        return u

    def jacobian(self, J: Array, w: Array) -> Array:
        """(rows, free) a Jacobian in internal values, at w, as one in w."""
        if not self.charts:
            return J
        turned, per_value = np.array(J), 1.0 / self.parameters.diagonal(self.out(w))
        for chart in self.charts:
            c = chart.columns
            turned[:, c] = J[:, c] @ (per_value[c, None] * chart.slope(w[c]))
        return turned

    def bounds(self) -> tuple[Array, Array]:
        """(free,) each: those of the user, see `Parameters.bounds`."""
        lower, upper = self.parameters.bounds()
        for chart in self.charts:
            lower[chart.columns], upper[chart.columns] = -np.inf, np.inf
        return lower, upper

    def limits(self) -> tuple[Array, Array]:
        """(free,) each: see `Parameters.limits`."""
        lower, upper = self.parameters.limits()
        start = self.parameters.initial()
        for chart in self.charts:
            lower[chart.columns], upper[chart.columns] = chart.limits(self._values(chart, start))
        return lower, upper

    def beyond(self, u: Array) -> dict[str, str]:
        """The free parameters in sums that are not positive at internal values u (free,), each with the limit that it
        has passed in words, such as "inertia_3 = inertia_1 + inertia_2"."""
        found: dict[str, str] = {}
        for chart in self.charts:
            names = [self.parameters.free[c] for c in chart.columns]
            for weights, constant in chart.passed(self._values(chart, u)):
                parts = [(abs(w), name, w > 0.0) for w, name in zip(weights, names, strict=True) if abs(w) > ROUNDING]
                sides = [
                    [name if abs(w - 1.0) < ROUNDING else f"{short(w)} {name}" for w, name, up in parts if up == side]
                    for side in (False, True)
                ]
                if constant:
                    sides[constant > 0.0].append(short(abs(constant)))
                words = " = ".join(" + ".join(side) or "0" for side in sides)
                found |= {name: words for _, name, _ in parts}
        return found

    def _values(self, chart: Chart, u: Array) -> Array:
        return np.array(
            [self.parameters[n].to_physical(u[c]) for c in chart.columns for n in [self.parameters.free[c]]]
        )


def sums_of(scene: Scene, keys: Mapping[str, str], parameters: Parameters) -> list[Sum]:
    """What must stay positive in a scene.

    Args:
        keys: name of the parameter of each quantity, whether or not it is one.
    """
    found: list[Sum] = []
    for parts, constant in scene.compiled.domain.sums():
        weights: dict[str, float] = {}
        for name, weight in parts.items():
            if keys[name] not in parameters:
                constant += weight * scene.quantities[name].value
                continue
            root, factor = parameters.roots[keys[name]]
            if parameters[root].free:
                weights[root] = weights.get(root, 0.0) + weight * factor
            else:
                constant += weight * factor * float(parameters[root].initial or 0.0)
        found.append((weights, constant))
    return found


def _charts(parameters: Parameters, sums: Sequence[Sum]) -> list[Chart]:
    """One for each set of parameters that sums tie together."""
    column = {name: k for k, name in enumerate(parameters.free)}
    rows = np.zeros((len(sums), len(column)))
    for row, (weights, _) in zip(rows, sums, strict=True):
        for name, weight in weights.items():
            row[column[name]] = weight
    constants = np.array([constant for _, constant in sums])
    charts, left = [], set(np.flatnonzero(rows.any(axis=0)).tolist())
    while left:
        own: set[int] = set()
        more = {min(left)}
        while more != own:
            own = more
            touched = rows[:, sorted(own)].any(axis=1)
            more = set(np.flatnonzero(rows[touched].any(axis=0)).tolist())
        left -= own
        columns = sorted(own)
        mine = [parameters[parameters.free[c]] for c in columns]
        if any(p.lower > 0.0 or math.isfinite(p.upper) for p in mine):
            continue
        positive = np.column_stack([rows[touched][:, columns], constants[touched]])
        each = np.column_stack([np.eye(len(columns)), np.zeros(len(columns))])
        every = np.concatenate([positive, each])
        every /= np.abs(every[:, :-1]).max(axis=1, keepdims=True)
        scaled = every / np.append(np.ones(len(columns)), np.abs(every[:, -1]).max() or 1.0)
        distinct = np.unique(np.round(scaled, DIGITS), axis=0, return_index=True)[1]
        chart = Chart.of(columns, every[distinct, :-1], every[distinct, -1])
        if chart is not None and not _is_plain(chart):
            charts.append(chart)
    return charts


def _is_plain(chart: Chart) -> bool:
    """Whether it does no more than keep each parameter positive."""
    diagonal = np.count_nonzero(chart.A) == len(chart.A) and (chart.A >= 0.0).all()
    return bool(diagonal and not chart.b.any() and not chart.bounded.any())
