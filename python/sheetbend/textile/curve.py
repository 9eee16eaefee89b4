"""Curves of testing machines: what was imposed on a specimen, and the load that it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..arrays.checks import check_count, check_kind, finite, is_list
from ..arrays.types import Array
from ..errors import InputError

TESTS = ("tension", "shear", "bending")
_TURN = 0.05  # of the whole range: what a specimen must go back by before it counts as unloading
_SLACK = 0.05  # of the largest load: below it a specimen counts as unloaded
_POINTS = 100  # of a skeleton
_MOST_POINTS = 10**6  # of a mean


@dataclass(frozen=True, eq=False)
class Curve:
    """One specimen's test, in the order in which it was read.

    Attributes:
        name: for reports.
        test: "tension", "shear" or "bending".
        deformation: (n,) strain of the length between the jaws; shear angle, rad; curvature, 1/m.
        load: (n,) force per width, N/m; of bending the moment per width, N.
        time: (n,) s, or None.
        length, width: between the jaws and across, m; None where not known.
        pretension: N/m, under which the specimen counts as unstretched; `load` still contains it.

    Raises:
        InputError: an unknown test, fewer than three points, arrays of different length, numbers that are not finite,
            or a pull that counts as negative.
    """

    name: str
    test: str
    deformation: Array
    load: Array
    time: Array | None = None
    length: float | None = None
    width: float | None = None
    pretension: float = 0.0

    def __post_init__(self) -> None:
        if self.test not in TESTS:
            raise InputError("test", "is unknown", self.test, f"use one of {', '.join(TESTS)}")
        count = np.size(self.deformation)
        if count < 3:
            raise InputError(self.name, "has too few points for a curve", count, "give three or more")
        for field in ("deformation", "load", *(("time",) if self.time is not None else ())):
            checked = finite(f"{self.name}.{field}", getattr(self, field), (count,), InputError)
            object.__setattr__(self, field, checked)
        if not np.ptp(self.deformation) > 0.0:
            raise InputError(f"{self.name}.deformation", "never changes", self.deformation[0], "give a test that moves")
        farthest = float(self.load[self.deformation.argmax()])
        if self.test == "tension" and farthest <= 0.0:
            fix = "turn the sign of the column that counts pulling as negative"
            raise InputError(f"{self.name}.load", "is not positive at the largest strain", farthest, fix)

    @property
    def work(self) -> float:
        """Work of the load along the whole path, J/m^2."""
        return float(np.sum(np.diff(self.deformation) * (self.load[1:] + self.load[:-1]) / 2.0))

    def piece(self, start: int, stop: int) -> Curve:
        """Points start to stop - 1."""
        time = None if self.time is None else self.time[start:stop]
        return replace(self, deformation=self.deformation[start:stop], load=self.load[start:stop], time=time)

    def from_pretension(self, load: float) -> Curve:
        """The test from where the load first reaches a pretension, N/m; strains count from the length there, as in
        strip tests (ISO 13934-1). That point is interpolated, and what comes before is left out.

        Raises:
            InputError: no test of tension, or one that never reaches the pretension, or starts above it.
        """
        if self.test != "tension":
            raise InputError(self.name, "has no pretension", self.test, "give a test of tension")
        above = np.flatnonzero(self.load >= load)
        if not above.size or self.load[0] > load:
            problem = "starts above the pretension" if above.size else "never reaches the pretension"
            bounds = f"{self.load[0]:.4g} to {self.load.max():.4g} N/m"
            raise InputError(self.name, f"{problem} of {load:.4g} N/m", bounds, "choose one that the test passes")
        k = max(int(above[0]), 1)
        rise = float(self.load[k] - self.load[k - 1])
        share = (load - float(self.load[k - 1])) / rise if rise else 0.0

        def cut(values: Array) -> Array:
            return np.concatenate([[values[k - 1] + share * (values[k] - values[k - 1])], values[k:]])

        strain = cut(self.deformation)
        return replace(
            self,
            deformation=(1.0 + strain) / (1.0 + strain[0]) - 1.0,
            load=cut(self.load),
            time=None if self.time is None else cut(self.time),
            length=None if self.length is None else self.length * float(1.0 + strain[0]),
            pretension=load,
        )

    def branches(self) -> tuple[Curve, ...]:
        """Pieces between the turning points of the deformation; neighbors share the point at which it turns. Going back
        by less than 5 % of the whole range is no turn."""
        ends = _turns(self.deformation, _TURN * float(np.ptp(self.deformation)))
        return tuple(self.piece(a, b + 1) for a, b in pairwise(ends))

    def cycles(self) -> tuple[Cycle, ...]:
        """Each way out and back, in their order; in shear and bending out is away from zero, to either side."""
        pieces = [p for b in self.branches() for p in (b._sides() if self.test != "tension" else (b,))]
        found: list[Cycle] = []
        for piece in pieces:
            if piece.outward:
                found.append(Cycle(piece))
            elif found and found[-1].unloading is None:
                found[-1] = replace(found[-1], unloading=piece)
        return tuple(found)

    @property
    def outward(self) -> bool:
        """Whether a branch grows: in tension in strain, in shear and bending away from zero."""
        first, last = float(self.deformation[0]), float(self.deformation[-1])
        return last > first if self.test == "tension" else abs(last) > abs(first)

    def _sides(self) -> tuple[Curve, ...]:
        """A branch, cut where it passes zero; what reaches less than a turn beyond it is no side."""
        d = self.deformation
        if d[0] * d[-1] >= 0.0 or min(abs(d[0]), abs(d[-1])) < _TURN * max(abs(d[0]), abs(d[-1])):
            return (self,)
        k = int(np.flatnonzero(np.sign(d) == np.sign(d[-1]))[0])
        share = d[k - 1] / (d[k - 1] - d[k])

        def cut(values: Array) -> Array:
            return np.insert(values, k, values[k - 1] + share * (values[k] - values[k - 1]))

        time = None if self.time is None else cut(self.time)
        both = replace(self, deformation=cut(d), load=cut(self.load), time=time)
        return both.piece(0, k + 1), both.piece(k, len(d) + 1)

    def load_at(self, deformation: float) -> float:
        """N/m or N, of a branch; NaN where it does not go."""
        return _crossing(self.deformation, self.load, deformation)

    def deformation_at(self, load: float) -> float:
        """Deformation of a branch at a load; NaN where the branch does not reach it."""
        return _crossing(self.load, self.deformation, load)


@dataclass(frozen=True)
class Cycle:
    """A way out, and the way back where the test has one."""

    loading: Curve
    unloading: Curve | None = None

    @property
    def lost(self) -> float | None:
        """Part of the work of loading that unloading does not give back; None where there is no way back."""
        if self.unloading is None:
            return None
        return 1.0 + self.unloading.work / self.loading.work

    def way(self, name: str) -> Curve:
        """One curve of the loop: "loading", "unloading", or "skeleton", the mean of both at equal deformation in 100
        points. Where unloading has ended the specimen is slack and bears nothing but its pretension.

        Raises:
            InputError: an unknown name, or a way that needs an unloading that is not there.
        """
        if name not in ("loading", "unloading", "skeleton"):
            raise InputError("way", "is unknown", name, "use 'loading', 'unloading' or 'skeleton'")
        if name == "loading":
            return self.loading
        if self.unloading is None:
            raise InputError(self.loading.name, f"has no unloading, so no {name}", "a pull", "use 'loading'")
        if name == "unloading":
            return self.unloading
        end, pretension = float(self.unloading.load[-1]), self.loading.pretension
        if end - pretension > _SLACK * float(self.loading.load.max() - pretension):
            raise InputError(self.loading.name, "is not unloaded to the end", f"{end:.4g} N/m left", "use 'loading'")
        d = np.linspace(self.loading.deformation[0], self.loading.deformation[-1], _POINTS)
        out, back = (np.array([b.load_at(x) for x in d]) for b in (self.loading, self.unloading))
        back[np.isnan(back)] = pretension
        return replace(self.loading, deformation=d, load=(out + back) / 2.0, time=None)


@dataclass(frozen=True, eq=False)
class MeanCurve:
    """Several specimens on one grid.

    Attributes:
        deformation, load: (k,) as of `Curve`.
        scatter: (k,) standard deviation of the specimens' load; NaN of a single one.
        count: of specimens.
    """

    deformation: Array
    load: Array
    scatter: Array
    count: int


def mean_curve(curves: Sequence[Curve], way: str = "loading", *, cycle: int = 0, points: int = 50) -> MeanCurve:
    """Mean and scatter of the load on an even grid, up to where the first of the specimens ends.

    Args:
        way: "loading", "unloading" or "skeleton", see `Cycle.way`.
        cycle: which one, from 0; -1 is the last.
        points: of the grid.

    Raises:
        InputError: no curves, curves of different tests, or without that cycle or way.
    """
    check_count("points", points, 2, _MOST_POINTS, InputError)
    ways = [chosen(curve, cycle).way(way) for curve in same_test(curves)]
    low = max(float(w.deformation.min()) for w in ways)
    high = min(float(w.deformation.max()) for w in ways)
    grid = np.linspace(low, high, points)
    load = np.array([[w.load_at(x) for x in grid] for w in ways])
    scatter = load.std(axis=0, ddof=1) if len(ways) > 1 else np.full(points, np.nan)
    return MeanCurve(grid, load.mean(axis=0), scatter, len(ways))


def chosen(curve: Curve, cycle: int) -> Cycle:
    """A cycle of a curve by its number.

    Raises:
        InputError: it has fewer.
    """
    check_kind("curve", curve, Curve, "read the file with textile.read_curves")
    cycles = curve.cycles()
    if isinstance(cycle, bool) or not isinstance(cycle, int | np.integer):
        raise InputError("cycle", "must be a whole number", cycle, "count from 0; -1 is the last")
    if not -len(cycles) <= cycle < len(cycles):
        raise InputError(
            "cycle", f"is not one of the {len(cycles)} of {curve.name}", cycle, "count from 0; -1 is the last"
        )
    return cycles[cycle]


def same_test(curves: Sequence[Curve]) -> Sequence[Curve]:
    """The curves, at least one, all of one test."""
    if not is_list(curves) or not all(isinstance(curve, Curve) for curve in curves):
        raise InputError("curves", "must be a list of curves", curves, "read the files with textile.read_curves")
    if not len(curves):
        raise InputError("curves", "is empty", 0, "give at least one curve")
    tests = sorted({curve.test for curve in curves})
    if len(tests) > 1:
        raise InputError("curves", "are of different tests", tests, "give curves of one test")
    return curves


def _turns(x: Array, least: float) -> list[int]:
    """Indices of the first point, of the extremes from which x goes back by more than `least`, and of the last one."""
    ends, extreme, rising = [0], 0, 0
    for k in range(1, len(x)):
        step = x[k] - x[extreme]
        if rising == 0:
            if abs(x[k] - x[0]) > least:
                rising, extreme = (1 if x[k] > x[0] else -1), k
        elif rising * step >= 0.0:
            extreme = k
        elif -rising * step > least:
            ends.append(extreme)
            rising, extreme = -rising, k
    return [*ends, extreme]


def _crossing(a: Array, b: Array, level: float) -> float:
    """b where a passes a level; the middle between the first and the last time where it does so several times, since it
    is noisy or stands still."""
    low = a < level
    passes = np.flatnonzero(low[1:] != low[:-1])
    if not passes.size:
        touches = np.flatnonzero(a == level)
        return float(b[touches].mean()) if touches.size else np.nan
    k = passes[[0, -1]]
    share = (level - a[k]) / (a[k + 1] - a[k])
    return float((b[k] + share * (b[k + 1] - b[k])).mean())
