"""The way up the ladder: bounds, divergence, ends, and the spread between models that predict equally well."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.gripped import GrippedMotion, RopeModel, descent, fit_rope
from sheetbend.gripped.bounds import at_bounds, bounded
from sheetbend.gripped.carried import carry, slopes_of
from sheetbend.gripped.climb import Climb
from sheetbend.gripped.conclusion import checked, model_spread, spread_words
from sheetbend.gripped.descent import descend, negligible
from sheetbend.gripped.first_order import first_order
from sheetbend.gripped.judging import Errors, Split, errors_of, predict
from sheetbend.gripped.ladder import (
    BESIDE,
    LADDER,
    MARKERS,
    REST,
    SHIFTS,
    TILTS,
    TWIST,
    VARYING,
    YIELD,
    Rung,
    smooth,
    together,
)
from sheetbend.gripped.model import place_of
from sheetbend.gripped.pieces import experiments_of, problem_of
from sheetbend.gripped.search import Search
from sheetbend.gripped.start import about, started, whole
from sheetbend.gripped.steps import Rope
from sheetbend.minimum.optimizers import minimize
from sheetbend.problem.evaluator import Evaluator
from sheetbend.problem.problem import FitProblem
from test_gripped_motion import carried_about, model_of

MOTION = GrippedMotion.of(carried_about(), 0.0)
MODEL = model_of(MOTION, smoothing=0.0)
STIFFNESS = tuple(p for p in TWIST.parameters if p.name == "rope_EI")
TRUE = {"rope_EI": 0.03}
Array = np.ndarray


@cache
def shown(name: str = "shown", **values: float) -> GrippedMotion:
    """The rope as the model moves it with these quantities."""
    model = replace(MODEL, places="rope_place_5" in values)
    (x,) = predict(model, [MOTION], {**TRUE, **values})
    return replace(MOTION, recording=replace(MOTION.recording, positions=x, name=name))


def shaken(name: str) -> GrippedMotion:
    """A recording whose last grip jumps away and back, which no rope follows."""
    x = carried_about().positions.copy()
    x[40:43, -2:] += [3.0, 0.0, 0.0]
    return GrippedMotion.of(carried_about(positions=x, name=name), 0.0)


class TestLadder:
    def test_fine_modes_have_narrow_priors(self) -> None:
        assert smooth(2.0, 0) == 2.0 and smooth(2.0, 2) == 1.0 and smooth(2.0, 8) == pytest.approx(0.4)
        sds = {p.name: p.prior[1] for p in (*REST.parameters, *VARYING.parameters) if p.prior is not None}
        assert len(REST.parameters) == 18 and len(VARYING.parameters) == 6
        assert sds["rope_curvature_1_8"] == pytest.approx(sds["rope_curvature_1_0"] / 5.0)
        assert sds["rope_softness_6"] < sds["rope_softness_1"]

    def test_everything_that_the_rungs_add_has_its_derivative(self) -> None:
        motion = MOTION.frames(slice(0, 31))
        e, parameters = whole(started(MODEL, [motion], 0.25), LADDER, motion, 0.3)
        problem = FitProblem([e], parameters)
        u = problem.parameters.initial() + 0.01
        _, _, J = problem.evaluate(u)
        names = problem.parameters.free
        for name in (place_of(4), "rope_curvature_2_8", "rope_softness_6", "rope_yield_share"):
            k, h = names.index(name), 1e-5
            step = h * (np.arange(len(u)) == k)
            (_, above, _), (_, below, _) = (problem.evaluate(u + s, jacobian=False) for s in (step, -step))
            slope = (above - below) / (2 * h)
            assert np.abs(slope - J[:, k]).max() < 1e-4 * np.abs(J[:, k]).max(), name

    def test_the_places_of_markers_come_back(self) -> None:
        true = {place_of(5): 0.004, place_of(8): -0.003}
        motion = shown(**true)
        model = replace(MODEL.with_values(EI=TRUE["rope_EI"]), **MARKERS.options)
        wanted = [replace(p, prior=None) for p in MARKERS.wanted(motion)]
        assert [p.name for p in wanted] == [place_of(k) for k in motion.free]
        end = descend(problem_of(experiments_of(model, [motion], (1.0, 1.0), {}), wanted, {}), 20)
        assert end.ended
        for name, value in true.items():
            assert end.values[name] == pytest.approx(value, rel=0.03), name

    def test_the_shifts_of_the_grips_come_back(self) -> None:
        """Markers of grips sit beside the rope as others do."""
        true = {"rope_start_shift_1": 0.004, "rope_end_shift_2": -0.005}
        model = replace(MODEL.with_values(EI=TRUE["rope_EI"]), **SHIFTS.options)
        (x,) = predict(model, [MOTION], {**TRUE, **true})
        motion = replace(MOTION, recording=replace(MOTION.recording, positions=x))
        wanted = [replace(p, prior=None) for p in SHIFTS.parameters if p.name in true]
        end = descend(problem_of(experiments_of(model, [motion], (1.0, 1.0), {}), wanted, {}), 20)
        assert end.ended
        for name, value in true.items():
            assert end.values[name] == pytest.approx(value, rel=0.03), name

    def test_the_prior_of_the_length_is_about_the_measured_one(self) -> None:
        """Once 1 m for every rope."""
        model = started(MODEL, [MOTION], 0.25)
        (p,) = (p for p in about(TWIST.parameters, model) if p.name == "rope_length")
        assert p.prior == (pytest.approx(MOTION.length), 0.02)
        assert [q.name for q in about(TWIST.parameters, model)] == [q.name for q in TWIST.parameters]

    @pytest.mark.parametrize("rung", LADDER, ids=lambda rung: rung.name)
    def test_what_a_rung_adds_can_be_taken_back(self, rung: Rung) -> None:
        larger = rung.added_to(MODEL)
        assert rung.within(larger) and rung.taken_from(larger) == MODEL
        rope = Rope(
            larger, (*STIFFNESS, *rung.wanted(MOTION)), {"rope_x": 1.0, **{p.name: 0.1 for p in rung.wanted(MOTION)}}
        )
        smaller = rope.without(rung, MOTION)
        assert smaller.model == MODEL and smaller.values == {"rope_x": 1.0}
        assert smaller.parameters == tuple(p for p in STIFFNESS if rung is not TWIST)


class TestBounds:
    def test_damping_stays_within_what_the_windows_show(self) -> None:
        wide = replace(TWIST.parameters[2], initial=50.0, prior=None)
        (p,) = bounded([wide], MODEL, [MOTION], 5.0)[:1]
        assert (p.lower, p.upper) == pytest.approx((0.001, 10.0))
        within = bounded([wide], MODEL, [MOTION], 1.0)
        end = descend(problem_of(experiments_of(MODEL, [shown()], (1.0, 1.0), {}), within, {}), 3)
        assert end.values["rope_bend_damping"] <= 2.0

    def test_stiffness_and_damping_cannot_trade_without_end(self) -> None:
        """EI times damping = 1 N m^2 s, once given as EI 5e-9 N m^2 and 4e7 s."""
        lower = {p.name: p.lower for p in bounded(TWIST.parameters, MODEL, [MOTION], 5.0)}
        assert lower["rope_EI"] == pytest.approx(0.06 * 9.80665 * (0.01 * MOTION.length) ** 3, rel=1e-3)

    def test_roll_is_a_turn_at_most_either_way(self) -> None:
        roll = next(p for p in TWIST.parameters if p.name == "rope_roll")
        assert (roll.lower, roll.upper) == pytest.approx((-2 * np.pi, 2 * np.pi))

    @pytest.mark.parametrize(
        ("values", "words"),
        [
            ({"rope_bend_damping": 10.0}, "EI times damping at best"),
            ({"rope_roll": -2 * np.pi}, "a fit beyond a turn"),
            ({"rope_roll": 2 * np.pi}, "a fit beyond a turn"),
        ],
    )
    def test_an_end_at_a_bound_is_a_doubt_in_words(self, values: dict[str, float], words: str) -> None:
        (sentence,) = at_bounds(TWIST.parameters, values, MODEL, [MOTION], 5.0)
        assert words in sentence and "ends at its bound" in sentence

    def test_an_end_inside_is_none(self) -> None:
        values = {"rope_EI": 0.02, "rope_bend_damping": 0.02, "rope_roll": 3.0, "rope_drag_linear": 0.01}
        assert at_bounds(TWIST.parameters, values, MODEL, [MOTION], 5.0) == ()


class TestDescent:
    def test_it_ends_within_a_tenth_of_the_intervals(self) -> None:
        experiments = experiments_of(MODEL, [shown()], (1.0, 1.0), {})
        found = descend(problem_of(experiments, TWIST.parameters[:1], {"rope_EI": 0.3}), 30)
        assert found.ended and found.values["rope_EI"] == pytest.approx(0.03, rel=1e-3) and found.iterations <= 10
        problem = problem_of(experiments, TWIST.parameters[:1], {})
        assert negligible(problem) == pytest.approx(0.1**2 * 20 / problem.core.data_rows)

    def test_it_takes_fewer_derivatives_than_steps(self, monkeypatch: pytest.MonkeyPatch) -> None:
        names = ("rope_EI", "rope_bend_damping", "rope_length", "rope_roll")
        wanted = [replace(p, prior=None) for p in TWIST.parameters if p.name in names]
        motion = shown(rope_roll=0.4)
        experiments = experiments_of(MODEL, [motion], (1.0, 1.0), {})
        start = {"rope_EI": 0.06, "rope_bend_damping": 0.06}
        ends, taken = [], []
        for least in (np.inf, 0):
            monkeypatch.setattr(descent, "DEAR", least)
            problem = problem_of(experiments, wanted, start)
            walk = descent.Sparing(problem, problem.parameters.initial())
            ends.append(descend(problem_of(experiments, wanted, start), 30))
            while walk.cost > 1.001 * ends[-1].cost and walk.step():
                pass
            taken.append((walk.iterations, walk.computed))
        assert all(end.ended for end in ends)
        for name in names:
            assert ends[1].values[name] == pytest.approx(ends[0].values[name], rel=2e-3), name
        assert taken[0][0] == taken[0][1] and taken[1][1] < min(taken[1][0], taken[0][1])

    def test_a_start_that_diverges_costs_infinitely_much(self) -> None:
        end = descend(problem_of(experiments_of(MODEL, [shaken("bad")], (1.0, 1.0), {}), STIFFNESS, {}), 5)
        assert not end.finite and end.iterations == 0 and not end.ended


class TestClimb:
    def climbed(self, motions: list[GrippedMotion], *more: Rung) -> tuple[Climb, list[str]]:
        said: list[str] = []
        climb = Climb(Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, said.append))
        model = RopeModel(density=0.06, nominal=MODEL.nominal, values={}, smoothing=0.0)
        twist = replace(TWIST, parameters=TWIST.parameters[:4])
        climb.run([model], [twist, *more], (0.3,), 12)
        return climb, said

    def test_one_recording_that_flies_apart_is_left_out_with_a_word(self) -> None:
        good = [shown(f"{k}") for k in range(5)]
        climb, said = self.climbed([*good[:2], shaken("bad"), *good[2:]])
        assert climb.rope is not None
        assert climb.rope.values["rope_EI"] == pytest.approx(0.03, rel=0.15)
        assert [m.recording.name for m in climb.search.whole] == ["0", "1", "2", "3", "4"]
        (sentence,) = climb.search.left_out
        assert sentence.startswith("bad is left out of the fit: its prediction diverges") and sentence in said

    def test_of_two_gravities_the_one_that_predicts_better_is_taken(self) -> None:
        climb = Climb(Search([shown("only")], 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        model = RopeModel(density=0.06, nominal=MODEL.nominal, values={}, smoothing=0.0)
        models = [replace(model, gravity=g) for g in ((0.0, -9.81, 0.0), model.gravity)]
        climb.run(models, [replace(TWIST, parameters=TWIST.parameters[:4])], (0.3,), 12)
        assert climb.rope is not None and climb.rope.model.gravity == model.gravity

    def test_from_one_recording_a_rung_is_judged_by_its_end(self) -> None:
        """Once nothing was left to judge by, and every rung stayed."""
        climb, _ = self.climbed([shown("only")], TILTS)
        assert [m.recording.name for m in climb.search.whole] == ["only"] and climb.search.whole[0].seconds == 1.0
        assert len(climb.search.split.fitted[0].recording.times) < 80
        assert climb.steps[0].stays and (climb.steps[1].count, climb.steps[1].ratio is None) == (4, False)

    def test_a_rung_is_tried_again_after_a_later_one_stayed(self, monkeypatch: pytest.MonkeyPatch) -> None:
        told: list[str] = []
        # tilts, rest, yield, varying; tilts again; yield and varying came after what stayed, and are tried together
        answers = iter([False, True, False, False, True, True])

        def climbed(_: Climb, rung: Rung) -> bool:
            told.append(rung.name)
            return next(answers)

        monkeypatch.setattr(Climb, "_climbed", climbed)
        self.climbed([shown("only")], TILTS, REST, YIELD, VARYING)
        names = [TILTS.name, REST.name, YIELD.name, VARYING.name, TILTS.name]
        assert told == [*names, "yield and stiffness along the rope"]
        both = together([YIELD, VARYING])
        assert both.parameters == (*YIELD.parameters, *VARYING.parameters) and both.starts == YIELD.starts
        assert both.options == VARYING.options and both.values == YIELD.values

    def test_what_promises_nothing_is_not_tried(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Places of markers once took as long as the fit itself, to be left out."""
        x, rng, said = shown().recording.positions, np.random.default_rng(0), list[str]()
        noisy = [replace(MOTION.recording, positions=x + 1e-3 * rng.standard_normal(x.shape)) for _ in range(5)]
        motions = [replace(MOTION, recording=replace(r, name=f"{k}")) for k, r in enumerate(noisy)]
        climb = Climb(Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, said.append))
        climb.rope = climb.search.judged(Rope(MODEL.at(TRUE), STIFFNESS, TRUE))
        tried: list[str] = []
        monkeypatch.setattr(Climb, "_long", lambda self, name, *rest: tried.append(name))
        assert not climb._climbed(MARKERS) and tried == []
        (step,) = climb.steps
        assert not step.stays and step.ratio is not None and step.ratio > 0.99 and step.count == 4
        assert "one step predicts" in said[-1]

    def test_what_promises_much_is_tried(self) -> None:
        model = replace(MODEL, shifts=True)
        moved = {"rope_start_shift_1": 0.006, "rope_end_shift_2": -0.006}
        (x,) = predict(model, [MOTION], {**TRUE, **moved})
        motions = [replace(MOTION, recording=replace(MOTION.recording, positions=x, name=f"{k}")) for k in range(5)]
        rope = Rope(MODEL.at(TRUE), STIFFNESS, TRUE)
        climb = Climb(Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        climb.rope = climb.search.judged(rope)
        start = Rope(*climb._with(SHIFTS, rope), rope.values)
        problem = climb.search.problem(start, climb.search.longest)
        told = first_order(problem, start.model, rope.values, climb.search.split)
        assert told is not None and told.ratio < 0.3 and told.fitted < 0.3 and told.stays

    def shifted(self, values: dict[str, float]) -> list[GrippedMotion]:
        """Recordings with noise of a rope with shifted grips."""
        (x,) = predict(SHIFTS.added_to(MODEL), [MOTION], {**TRUE, **values})
        rng = np.random.default_rng(0)
        noisy = [replace(MOTION.recording, positions=x + 3e-4 * rng.standard_normal(x.shape)) for _ in range(5)]
        return [replace(MOTION, recording=replace(r, name=f"{k}")) for k, r in enumerate(noisy)]

    def reconsidered(self, motions: list[GrippedMotion], shifts: dict[str, float]) -> tuple[Climb, Rope]:
        """A rope whose grips were shifted before something else stayed, after a second look, and how it was before."""
        climb = Climb(Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        values = {**TRUE, **{p.name: shifts.get(p.name, 0.0) for p in SHIFTS.parameters}}
        model = SHIFTS.added_to(MODEL).at(values)
        before = climb.rope = climb.search.judged(Rope(model, (*STIFFNESS, *SHIFTS.parameters), values))
        climb._reconsider((TWIST, TILTS, VARYING, SHIFTS, MARKERS), [VARYING])
        return climb, before

    def test_offsets_that_stood_in_for_the_rope_are_taken_back(self) -> None:
        """From one recording of 5 s shifted grips stayed in the place of a rest curvature, and beside it."""
        climb, before = self.reconsidered(self.shifted({}), {"rope_start_shift_1": 0.004})
        rope = climb.rope
        assert rope is not None and not rope.model.shifts and rope.parameters == STIFFNESS
        assert not any("shift" in name for name in rope.values) and rope.errors.typical < before.errors.typical
        assert [(s.name, s.stays) for s in climb.steps] == [(f"without {SHIFTS.name}", True), (SHIFTS.name, False)]

    def test_offsets_that_help_beside_what_stayed_later_come_back(self) -> None:
        moved = {"rope_start_shift_1": 0.006, "rope_end_shift_2": -0.006}
        climb, before = self.reconsidered(self.shifted(moved), moved)
        assert climb.rope is not None and climb.rope.model.shifts and climb.rope.values.keys() == before.values.keys()
        assert [(s.name, s.stays) for s in climb.steps] == [(f"without {SHIFTS.name}", True), (SHIFTS.name, True)]

    def test_all_ends_as_before_where_that_predicts_better(self, monkeypatch: pytest.MonkeyPatch) -> None:
        moved = {"rope_start_shift_1": 0.006, "rope_end_shift_2": -0.006}

        def climbed(climb: Climb, _: Rung) -> bool:
            climb.search.leave_out(np.array([1.0, 1.0, 1.0, 1.0, np.inf]))
            return False

        monkeypatch.setattr(Climb, "_climbed", climbed)
        climb, before = self.reconsidered(self.shifted(moved), moved)
        assert climb.rope is before and climb.search.left_out == [] and len(climb.search.whole) == 5
        assert [(s.name, s.stays) for s in climb.steps] == [(f"without {SHIFTS.name}", False)]

    def test_recordings_go_back_to_where_they_were_and_onto_the_axis_again(
        self, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        recorded = [shown(f"{k}") for k in range(5)]
        climb = Climb(Search(recorded, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        rope = Rope(MODEL.at(TRUE), STIFFNESS, TRUE)
        offsets = ((1e-3, 0.0),) * len(MOTION.free)
        for _ in range(2):
            climb._move(rope, offsets)
        climb.beside, climb.rope = ((2e-3, 0.0),) * len(MOTION.free), climb.search.judged(rope)
        moved, seen = climb.search.given, list[tuple[GrippedMotion, ...]]()
        monkeypatch.setattr(Climb, "_climbed", lambda self, rung: seen.append(self.search.given) or False)
        climb._reconsider((TWIST, VARYING, BESIDE), [VARYING])
        assert seen == [tuple(recorded)] and climb.beside == () and climb.rope is not None
        assert climb.search.split.motions == Split.of(recorded, 0.25).motions and climb.search.given != moved

    def test_recordings_that_wait_are_moved_onto_the_axis_at_last(self) -> None:
        recorded = [replace(MOTION, recording=replace(MOTION.recording, name=f"{k}")) for k in range(26)]
        climb = Climb(Search(recorded, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        climb.rope, offsets = Rope(MODEL.at(TRUE), STIFFNESS, TRUE), ((1e-3, 0.0),) * len(MOTION.free)
        waiting = climb.search.split.waiting
        climb._move(climb.rope, offsets)
        climb.beside = offsets
        assert waiting and climb.search.split.waiting == waiting
        assert sum(m in recorded for m in climb.search.whole) == len(waiting)
        for _ in range(2):
            climb.gather()
            assert not any(m in recorded for m in climb.search.whole)
            free = list(MOTION.free)
            for m in climb.search.split.waiting:
                by = np.linalg.norm((m.recording.positions - MOTION.recording.positions)[:, free], axis=2)
                np.testing.assert_allclose(by, 1e-3, rtol=1e-6)

    def test_a_rung_of_offsets_derives_only_what_it_adds(self, monkeypatch: pytest.MonkeyPatch) -> None:
        wanted = [p for p in TWIST.parameters if p.name in ("rope_EI", "rope_length", "rope_roll")]
        smaller = problem_of(experiments_of(MODEL, [MOTION], (1.0, 1.0), {}), wanted, TRUE)
        slopes = slopes_of(smaller, smaller.evaluate(smaller.parameters.initial())[2])
        model = TILTS.added_to(MODEL)
        larger = [
            problem_of(experiments_of(model, [MOTION], (1.0, 1.0), {}), (*wanted, *TILTS.parameters), TRUE)
            for _ in range(2)
        ]
        asked = list[int]()
        evaluate = FitProblem.evaluate

        def evaluated(self: FitProblem, u: Array, jacobian: bool = True) -> tuple[bool, Array, Array]:
            asked.append(len(u))
            return evaluate(self, u, jacobian)

        monkeypatch.setattr(FitProblem, "evaluate", evaluated)
        carry(larger[0], slopes, TILTS.parameters, TRUE)
        assert asked == [4]
        u = larger[0].parameters.initial()
        (_, r, J), (_, whole, own) = (evaluate(p, u) for p in larger)
        np.testing.assert_allclose(r, whole, atol=1e-12)
        np.testing.assert_allclose(J, own, rtol=1e-9, atol=1e-9)
        carry(larger[1], replace(slopes, windows=((), 0)), TILTS.parameters, TRUE)  # of other windows
        assert asked == [4]

    def test_the_only_recording_that_judges_can_be_left_out(self) -> None:
        """It once stayed, and every rung was judged by the one recording that does not belong."""
        said: list[str] = []
        motions = [replace(MOTION, recording=replace(MOTION.recording, name=f"{k}")) for k in range(4)]
        search = Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, said.append)
        assert search.split.judged == (motions[0],)
        assert search.leave_out(np.array([1.0, 1.1, 0.9, np.inf]))
        assert said == ["0 is left out of the fit: its prediction diverges"]
        assert search.split.fitted == tuple(motions[1:3]) and search.split.judged == (motions[3],)

    def test_a_judged_recording_that_shows_nothing_is_left_out_for_that(self) -> None:
        """Its free markers are lost after the first two frames. Once its prediction was said to diverge."""
        motions = [replace(MOTION, recording=replace(MOTION.recording, name=f"{k}")) for k in range(5)]
        search = Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None)
        (judged,) = search.split.judged
        x = judged.recording.positions.copy()
        x[2:, list(judged.free)] = np.nan
        lost = replace(judged, recording=replace(judged.recording, positions=x))
        search.split = replace(search.split, judged=(lost,))
        assert search.leave_out(errors_of(MODEL, TRUE, search.split).whole)
        name = judged.recording.name
        unseen = "none of its free markers is seen where it would be judged"
        assert search.left_out == [f"{name} is left out of the fit: {unseen}"]
        assert len(search.split.fitted) == 3 and len(search.split.judged) == 1

    def test_what_waited_is_predicted_at_the_end(self) -> None:
        """A recording that does not belong is left out of the fit that counts, whether or not rungs saw it."""
        motions = self.shifted({})
        search = Search(motions, 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None)
        kept, bad = search.split.fitted[:2], shaken("bad")
        search.given = (*motions, bad)
        search.split = replace(search.split, fitted=kept, waiting=(bad, *search.split.fitted[2:]))
        assert bad in search.whole
        search.admit(search.judged(Rope(MODEL.at(TRUE), STIFFNESS, TRUE)))
        assert search.whole == motions and len(search.split.waiting) == 2
        assert search.left_out == ["bad is left out of the fit: its prediction diverges"]

    def test_a_model_that_was_far_off_is_not_predicted_again(self, monkeypatch: pytest.MonkeyPatch) -> None:
        climb = Climb(Search([shown(f"{k}") for k in range(5)], 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        ropes = [Rope(MODEL.at(v), STIFFNESS, v) for v in ({"rope_EI": 0.031}, {"rope_EI": 0.0312}, {"rope_EI": 0.3})]
        climb.rope, *climb.tried = [climb.search.judged(rope) for rope in ropes]
        judged: list[float] = []
        again = Search.judged
        monkeypatch.setattr(Search, "judged", lambda self, r: judged.append(r.values["rope_EI"]) or again(self, r))
        climb.equal()
        assert judged == [0.0312]

    def test_the_derivative_that_promised_is_the_first_of_the_fit(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """It was made twice, which took a third of the time of a rung that was then fitted in three steps."""
        moved = {"rope_start_shift_1": 0.006, "rope_end_shift_2": -0.006}
        climb = Climb(Search(self.shifted(moved), 0.25, ((1.0, 2.0), (1.0, 4.0)), 1, lambda text: None))
        climb.rope = climb.search.judged(Rope(MODEL.at(TRUE), STIFFNESS, TRUE))
        at: list[bytes] = []
        evaluated = Evaluator.__call__

        def counted(self: Evaluator, u: np.ndarray, jacobian: bool) -> object:
            if jacobian:
                at.append(np.asarray(u).tobytes())
            return evaluated(self, u, jacobian)

        monkeypatch.setattr(Evaluator, "__call__", counted)
        assert climb._climbed(SHIFTS) and len(at) > 1 and len(set(at)) == len(at)

    def test_where_everything_diverges_it_says_so(self) -> None:
        with pytest.raises(sb.SheetbendError, match="no start of a straight rope"):
            self.climbed([shaken(f"{k}") for k in range(3)])

    def test_a_rung_that_diverges_does_not_stay(self) -> None:
        climb, said = self.climbed([shown(f"{k}") for k in range(4)])
        before = climb.rope
        assert before is not None
        lost = replace(before, errors=Errors(np.full(3, np.inf), np.full((1, 4), np.inf)))
        climb._keep(YIELD, lost, sb.gripped.judging.verdict(lost.errors, before.errors), 0.0)
        climb._keep(YIELD, None, None, 0.0)
        assert climb.rope is before and [s.stays for s in climb.steps] == [True, False, False]
        assert said[-1] == "yield: diverges, is not kept"


class TestConclusion:
    def test_a_finer_rope_that_diverges_is_not_counted(self) -> None:
        good, bad = (experiments_of(MODEL, [m], (1.0, 1.0), {}) for m in (shown(), shaken("bad")))
        assert checked(good, STIFFNESS, {}, 1) is good
        with pytest.raises(sb.SheetbendError, match="diverges"):
            checked(bad, STIFFNESS, {}, 1)

    @pytest.mark.slow
    def test_the_time_of_many_windows_is_told_also_of_one_recording(self) -> None:
        said: list[str] = []
        windows = ((0.5, 1.0), (0.06, 0.96))
        found = fit_rope(
            [shown("only")], density=0.06, ladder=[TWIST], bending_lengths=(0.3,), windows=windows, say=said.append
        )
        rests_on = {p.name: p.sd for p in found.fit.result.premises}
        assert rests_on["rope_density"] > 0.0 and "mass of each marker" not in rests_on  # which the density's error has
        (at,) = (k for k, text in enumerate(said) if text.startswith("the last fit, to 16 windows of 0.06 s"))
        assert said[at + 1].startswith("which takes about ")

    @pytest.mark.slow
    def test_every_window_is_fitted_after_some(self) -> None:
        """Eighteen steps on 56 windows once took three times as long as all before."""
        said: list[str] = []
        motions = [shown(f"{k}").frames(slice(0, 25)) for k in range(13)]
        given = {"density": 0.06, "ladder": [TWIST], "bending_lengths": (0.3,), "max_segments": 12}
        fit_rope(motions, **given, windows="all", say=said.append)  # type: ignore[arg-type]
        assert any(text.startswith("the last fit, to 13 windows") for text in said)
        few, every = (int(text.split()[2]) for text in said if text.startswith(("ended after", "not ended after")))
        assert every <= few
        first = next(text for text in said if not text.startswith("doubtful"))  # before work starts
        assert first.startswith("the last fit will see 13 windows of ") and "from all 13 recordings: about " in first
        assert float(first.split("about ")[1].split(" s ")[0]) > 0.0

    def test_ctrl_c_in_the_last_fit_costs_no_result(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def stopped(*_: object, **__: object) -> dict[str, float]:
            raise KeyboardInterrupt

        monkeypatch.setattr(sb.gripped.conclusion, "_at_the_end", stopped)
        ladder, windows = [TWIST], [(1.0, 2.0)]
        options = {"density": 0.06, "ladder": ladder, "windows": windows, "smoothing": 0.0, "validate": 0.0}
        found = fit_rope([shown()], bending_lengths=(0.3,), max_segments=12, **options)
        assert found.interrupted and not found.fit.result.converged and found.steps[0].stays
        assert found.values["rope_EI"] == pytest.approx(0.03, rel=0.15)

    def test_no_end_of_an_optimizer_has_a_negative_cost(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Ceres tells a cost of -1 where it cannot begin; that must not win over a real end."""
        ceres = pytest.importorskip("sheetbend._ceres")
        problem = problem_of(experiments_of(MODEL, [shown()], (1.0, 1.0), {}), STIFFNESS, {})
        u = problem.parameters.initial()
        failed = {"u": u, "cost": -1.0, "iterations": 0, "evaluations": 1, "jacobians": 1}
        failed |= {"converged": False, "stopped": False, "message": "no derivatives"}
        monkeypatch.setattr(ceres, "minimize", lambda **_: failed)
        end, _ = minimize(problem, u, "ceres")
        assert end.cost == problem.cost(u) and not end.converged


class TestSpread:
    def rope(self, EI: float) -> Rope:
        return Rope(MODEL, STIFFNESS, {"rope_EI": EI, "rope_GJ": 1.0})

    def test_it_is_the_largest_difference_between_equals(self) -> None:
        spread = model_spread(self.rope(0.10), [self.rope(0.12), self.rope(0.09)])
        assert spread == pytest.approx({"rope_EI": 0.02})  # GJ is not free here
        assert "differ in EI by up to 20 %" in spread_words(spread, {"rope_EI": 0.10})

    def test_one_model_alone_has_none(self) -> None:
        assert model_spread(self.rope(0.1), []) == {} and spread_words({}, {"rope_EI": 0.1}) == ""
