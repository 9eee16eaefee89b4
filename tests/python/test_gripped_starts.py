"""Many starts of a gripped rope: where they are drawn, that they are raced, and what a result tells of them."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from sheetbend.errors import InputError
from sheetbend.gripped import RopeFit, RopeReport, fit_rope
from sheetbend.gripped.bounds import bounded
from sheetbend.gripped.descent import Descent
from sheetbend.gripped.ladder import TWIST
from sheetbend.gripped.pieces import experiments_of, problem_of
from sheetbend.gripped.raced import points, rows
from sheetbend.gripped.start import about, started
from sheetbend.minimum.race import Raced, groups_of
from sheetbend.problem.problem import FitProblem
from test_gripped_climb import MODEL, MOTION, shown

LENGTHS = (0.45, 0.25, 0.12)
FIRSTS = [started(MODEL, [MOTION], length) for length in LENGTHS]


@cache
def problem() -> FitProblem:
    own = about(TWIST.wanted(MOTION), FIRSTS[0])
    free = bounded(own, FIRSTS[0], [MOTION], 0.5)
    return problem_of(experiments_of(FIRSTS[0], [shown()], (0.5, 0.5), {}), free, {})


def physical(count: int) -> list[dict[str, float]]:
    firsts = [first.quantities for first in FIRSTS]
    return [problem().parameters.to_physical(u) for u in points(problem(), firsts, count)]


def test_the_starts_of_the_bending_lengths_come_first() -> None:
    found = physical(8)
    assert len(found) == 8
    for first, values in zip(FIRSTS, found, strict=False):
        assert values["rope_EI"] == pytest.approx(first.values["EI"])
        assert values["rope_length"] == pytest.approx(MOTION.length) and values["rope_roll"] == 0.0
    assert [v["rope_EI"] for v in physical(2)] == pytest.approx([v["rope_EI"] for v in found[:2]])
    assert physical(8) == found


def test_others_fill_two_decades_about_the_middle_one() -> None:
    drawn = physical(35)[3:]
    for name in ("rope_EI", "rope_GJ", "rope_bend_damping", "rope_drag_linear"):
        away = np.log10([values[name] / FIRSTS[1].quantities[name] for values in drawn])
        p = problem().parameters[name]
        assert all(p.lower < values[name] < p.upper for values in drawn)
        assert np.abs(away).max() <= 1.0 + 1e-9 and away.min() < -0.85, name
        assert away.max() > (0.6 if name == "rope_drag_linear" else 0.85), name
    assert all(values["rope_twist_damping"] == values["rope_bend_damping"] for values in drawn)
    assert np.ptp([values["rope_roll"] for values in drawn]) > 2.0  # a prior of 1 rad
    assert np.std([values["rope_length"] / MOTION.length for values in drawn]) == pytest.approx(0.02, rel=0.3)


def test_every_start_has_a_row() -> None:
    """Groups by the cost of their fits to whole recordings, not by that of the race; what led nowhere is last."""
    u = problem().parameters.initial()
    made = [(50.0, 2), (4.0, 1), (5.0, 1), (np.inf, 0), (60.0, 3)]
    ended = [Raced(u, u + 0.1 * k, cost, 5, 5, "", group) for k, (cost, group) in enumerate(made)]
    best = {number: min(end.cost for end in group) for number, group in enumerate(groups_of(ended), 1)}
    assert best == {1: 4.0, 2: 50.0, 3: 60.0}
    values = problem().parameters.to_physical(u)
    fits = {1: Descent({**values, "rope_other": 1.0}, 300.0, 6, True), 2: Descent(values, 200.0, 4, False)}
    found = rows(problem(), ended, fits)
    assert [(row.group, row.cost, row.raced) for row in found] == [
        (2, 200.0, 50.0),
        (1, 300.0, 4.0),
        (1, 300.0, 5.0),
        (3, None, 60.0),
        (None, None, None),
    ]
    assert [(row.iterations, row.converged) for row in found] == [
        (4, False),
        (6, True),
        (6, True),
        (0, False),
        (0, False),
    ]
    assert all(row.first == pytest.approx(values) and row.values.keys() == values.keys() for row in found)


@cache
def fitted(weighed: bool) -> tuple[RopeFit, list[str]]:
    """Four starts of a rope, of which the only given one is 200 times too stiff."""
    said: list[str] = []
    found = fit_rope(
        [shown(rope_roll=0.4)],
        density=0.06 if weighed else None,
        ladder=[TWIST],
        bending_lengths=(2.0,),
        starts=4,
        windows=((0.5, 1.0), (1.0, 1.0)),
        max_segments=12,
        smoothing=0.0,
        validate=0.0,
        say=said.append,
    )
    return found, said


def test_the_best_group_goes_on() -> None:
    found, said = fitted(True)
    assert found.values["rope_EI"] == pytest.approx(0.03, rel=0.15)
    starts = found.fit.result.starts
    assert len(starts) == 4 and starts[0].group is not None and starts[0].cost is not None
    assert starts[0].cost == min(start.cost for start in starts if start.cost is not None)
    assert starts[0].values["rope_EI"] == pytest.approx(found.values["rope_EI"], rel=0.1)
    assert any("of 4 starts end alike: EI" in text for text in said)
    text = RopeReport("a", found).plain()
    assert "Groups of starts" in text and "ended within 1 % of the best cost" in text


def test_of_a_rope_that_was_not_weighed_starts_are_over_the_density_too() -> None:
    found, _ = fitted(False)
    assert all("rope_EI/density" in row.values and "rope_EI/density" in row.first for row in found.fit.result.starts)
    assert "Groups of starts" in RopeReport("a", found).plain()


@pytest.mark.parametrize("count", [0, -3, 2.5, True, 5000])
def test_a_number_of_starts_is_checked_before_work_starts(count: int) -> None:
    with pytest.raises(InputError, match=r"starts: must be a number of starts \(got"):
        fit_rope([shown()], density=0.06, starts=count)
