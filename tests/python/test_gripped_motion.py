"""Recordings of gripped ropes become smooth grips, starts and windows; what is no such recording is refused."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.arrays.smoothing import LocalFit, steadiest
from sheetbend.doubts.driven_errors import drawn_noise
from sheetbend.gripped import GrippedMotion, RopeModel
from sheetbend.gripped.judging import predict
from sheetbend.gripped.model import nominal_directions, shared_gravity
from sheetbend.gripped.motion import smoothed
from sheetbend.gripped.pieces import experiments_of, problem_of
from sheetbend.motion.simulate import simulate
from sheetbend.quantities.parameters import Parameter

TIMES = np.arange(101) / 100.0
LENGTH, SPAN, GRIP = 0.9, 0.6, 0.03  # m between the grips: arc, chord; and in each grip
Array = np.ndarray


def arch(s: Array) -> Array:
    """(k, 3) m: a hanging circular arc of `LENGTH` over `SPAN`, at shares s of its length; straight on in the grips."""
    angle = 2.6  # of the arc, roughly: sin(angle/2)/(angle/2) = SPAN/LENGTH
    for _ in range(50):
        half = angle / 2
        angle -= (np.sin(half) / half - SPAN / LENGTH) / ((np.cos(half) * half - np.sin(half)) / half**2 / 2)
    radius, inside = LENGTH / angle, np.clip(s, 0.0, 1.0)
    turn = angle * (inside - 0.5)
    line = np.stack([SPAN / 2 + radius * np.sin(turn), 0 * s, radius * (np.cos(angle / 2) - np.cos(turn))], axis=-1)
    return line + LENGTH * (s - inside)[:, None] * np.stack([np.cos(turn), 0 * s, np.sin(turn)], axis=-1)


def carried_about(markers: int = 12, **fields: object) -> sb.Recording:
    """A rope that keeps its shape and is moved by its grips on a smooth path, as the data sets have it."""
    inner = np.linspace(0.0, 1.0, markers - 2)
    shares = np.concatenate([[-GRIP / LENGTH], inner, [1.0 + GRIP / LENGTH]])
    path = 0.1 * np.stack([np.sin(4 * TIMES), np.cos(3 * TIMES) - 1.0, np.sin(5 * TIMES)], axis=1)
    positions = arch(shares) + path[:, None]
    clamped = (0, 1, markers - 2, markers - 1)
    return sb.Recording(**{"positions": positions, "times": TIMES, "clamped": clamped, "name": "arch", **fields})


def model_of(motion: GrippedMotion, **fields: object) -> RopeModel:
    values = {"EI": 0.02, "GJ": 0.02, "bend_damping": 0.03, "twist_damping": 0.03, "drag_linear": 0.02}
    given = {"density": 0.06, "nominal": nominal_directions([motion]), "values": values, **fields}
    return RopeModel(**given)


def simulated(e: sb.Experiment, motion: GrippedMotion, values: dict[str, float] | None = None) -> Array:
    """(frames, markers, 3) m, the recording's markers, the free ones where the model of an experiment has them."""
    x, out = simulate(e.scene, e.recording.times, e.solver, values).positions, e.recording.positions.copy()
    for k in motion.free:
        place = e.places[k]
        assert place is not None
        out[:, k] = np.tensordot(x[:, list(place.particles)], np.asarray(place.weights), axes=(1, 0))
    return out


def pull(e: sb.Experiment) -> Array:
    """(3,) m/s^2: gravity of an experiment's scene."""
    return e.scene.base_arrays()["gravity"]


class TestSmoothing:
    def test_a_parabola_stays_what_it_is_and_gives_its_slope(self) -> None:
        x = np.stack([1.0 - 2.0 * TIMES + 3.0 * TIMES**2, 0.5 * TIMES**2], axis=1)
        values, slopes = smoothed(TIMES, x, 0.08)
        np.testing.assert_allclose(values, x, atol=1e-12)
        np.testing.assert_allclose(slopes, np.stack([-2.0 + 6.0 * TIMES, TIMES], axis=1), atol=1e-10)

    def test_noise_shrinks_as_least_squares_has_it(self) -> None:
        # The middle weight of a parabola through 2 m + 1 points: (9 m^2 + 9 m - 3) / ((2 m + 1)(4 m^2 + 4 m - 3)).
        noise = np.random.default_rng(3).standard_normal((2001, 40))
        values, _ = smoothed(np.arange(2001) / 100.0, noise, 0.08)
        m = 4
        variance = (9 * m**2 + 9 * m - 3) / ((2 * m + 1) * (4 * m**2 + 4 * m - 3))
        assert values[10:-10].var() == pytest.approx(variance, rel=0.02)

    def test_a_slow_wave_keeps_its_height_and_speed(self) -> None:
        wave, speed = np.sin(2 * np.pi * TIMES), 2 * np.pi * np.cos(2 * np.pi * TIMES)
        values, slopes = smoothed(TIMES, wave, 0.08)
        # A parabola's third order term is lost, one-sided at the ends: (2 pi)^3/6 (0.04 s)^3 and twice that.
        np.testing.assert_allclose(values, wave, atol=(2 * np.pi * 0.04) ** 3 / 6)
        np.testing.assert_allclose(values[4:-4], wave[4:-4], atol=2e-5)
        np.testing.assert_allclose(slopes[4:-4], speed[4:-4], atol=0.05)

    def test_jittering_times_and_lost_frames_make_no_error(self) -> None:
        rng = np.random.default_rng(4)
        times = (TIMES + rng.uniform(-0.004, 0.004, len(TIMES)))[rng.permutation(len(TIMES))[:80]]
        times.sort()
        values, slopes = smoothed(times, 3.0 * times**2 - times, 0.08)
        np.testing.assert_allclose(values, 3.0 * times**2 - times, atol=1e-12)
        np.testing.assert_allclose(slopes, 6.0 * times - 1.0, atol=1e-10)

    @pytest.mark.parametrize("width", [0.0, 0.02])
    def test_too_narrow_a_width_leaves_positions_as_they_are(self, width: float) -> None:
        x = np.random.default_rng(0).standard_normal((101, 2))
        values, slopes = smoothed(TIMES, x, width)
        np.testing.assert_array_equal(values, x)
        np.testing.assert_allclose(slopes[1:-1], (x[2:] - x[:-2]) / 0.02, rtol=1e-9)


SLOW, NOISE = np.arange(301) / 100.0, 5e-4


def wandering(motion: Array) -> Array:
    """(frames, 4, 3) m, four markers that move with a motion (frames, 3), as noisy as those of a camera system."""
    return motion[:, None] + NOISE * np.random.default_rng(6).standard_normal((len(motion), 4, 3))


class TestSteadying:
    def test_a_polynomial_of_its_degree_stays_what_it_is(self) -> None:
        rng = np.random.default_rng(4)
        times = np.sort(TIMES + rng.uniform(-0.004, 0.004, len(TIMES)))
        x = np.polynomial.polynomial.polyval(times, [0.1, -1.0, 2.0, 3.0, -2.0])
        np.testing.assert_allclose(LocalFit(0.4, 4).of(times, x)[0], x, atol=1e-11)
        np.testing.assert_allclose(LocalFit(0.08, 2).of(times, x)[0], smoothed(times, x, 0.08)[0], atol=1e-12)

    def test_slow_motion_is_smoothed_over_more(self) -> None:
        slow = 0.2 * np.sin(2 * np.pi * np.outer(SLOW, [0.4, 0.7, 0.9]))
        found = steadiest(SLOW, wandering(slow), 0.08)
        assert found is not None and found.degree == 4 and found.width >= 0.3
        off = found.of(SLOW, wandering(slow))[0] - slow[:, None]
        assert off[30:-30].std() < 0.35 * NOISE  # 0.5 of it over 0.08 s

    def test_fast_motion_is_not(self) -> None:
        fast = 0.02 * np.sin(2 * np.pi * np.outer(SLOW, [6.0, 7.0, 8.0]))
        assert steadiest(SLOW, wandering(fast), 0.08) == LocalFit(0.08, 2)

    def test_too_few_frames_are_left_as_they_are(self) -> None:
        assert steadiest(SLOW[::4], wandering(0.0 * SLOW[:, None])[::4], 0.08) is None
        assert steadiest(SLOW, wandering(0.0 * SLOW[:, None]), 0.0) is None
        short = steadiest(SLOW[:20], wandering(0.0 * SLOW[:, None])[:20], 0.08)
        assert short is not None and short.frames(SLOW) <= 20

    def test_grips_are_steadied_and_their_noise_is_told(self) -> None:
        """What the grips' noise moves in a simulation is what was left of it, not what was recorded."""
        clean = carried_about()
        noise = NOISE * np.random.default_rng(8).standard_normal(clean.positions.shape)
        motion = GrippedMotion.of(carried_about(positions=clean.positions + noise), 0.08)
        held = [0, 1, -2, -1]
        left = (motion.positions - clean.positions)[:, held]
        assert np.sqrt(np.mean(left**2)) < 0.45 * NOISE
        EI = Parameter(name="rope_EI", initial=0.02, log=True)
        problem = problem_of([model_of(motion).experiment(motion)], [EI], {})
        drawn = drawn_noise(problem, problem.parameters.initial(), 8)
        assert drawn is not None
        assert drawn.size[0] == pytest.approx(np.sqrt(np.mean(left[:, 1:3] ** 2)), rel=0.25)


class TestMotion:
    def test_arc_lengths_and_length_of_a_known_shape(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        assert motion.inner == (1, 10) and list(motion.free) == list(range(2, 10))
        np.testing.assert_allclose(motion.fractions[1:11], np.linspace(0.0, 1.0, 10), atol=1e-12)
        assert motion.fractions[0] < 0.0 and motion.fractions[11] > 1.0
        assert motion.length == pytest.approx(LENGTH, rel=2e-3)
        assert motion.length > np.linalg.norm(np.diff(arch(np.linspace(0, 1, 10)), axis=0), axis=1).sum()

    def test_positions_and_velocities_follow_the_path(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        speed = 0.1 * np.stack([4 * np.cos(4 * TIMES), -3 * np.sin(3 * TIMES), 5 * np.cos(5 * TIMES)], axis=1)
        np.testing.assert_allclose(motion.positions, carried_about().positions, atol=2e-4)
        np.testing.assert_allclose(motion.velocities[5:-5], np.tile(speed[5:-5, None], (1, 12, 1)), atol=0.01)
        points, velocity = motion.start(40)
        assert points[0] == pytest.approx(motion.positions[40, 1]) and points[-1] == pytest.approx(
            motion.positions[40, 10]
        )
        np.testing.assert_allclose(velocity, np.tile(speed[40], (len(velocity), 1)), atol=0.01)

    def test_grips_point_along_the_rope(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        start, end = motion.directions(False), motion.directions(True)
        np.testing.assert_allclose(start, np.tile((arch(np.array([0.0])) - arch(np.array([-0.1])))[0], (101, 1)) / 0.09)
        np.testing.assert_allclose(end, start * [1.0, 1.0, -1.0], atol=1e-9)

    @pytest.mark.parametrize(("marker", "frames"), [(0, 2), (5, 9)], ids=["gripped", "free"])
    def test_short_gaps_are_closed(self, marker: int, frames: int) -> None:
        positions = carried_about().positions.copy()
        positions[50 : 50 + frames, marker] = np.nan
        filled = GrippedMotion.of(carried_about(positions=positions), 0.08)
        np.testing.assert_allclose(filled.positions, GrippedMotion.of(carried_about(), 0.08).positions, atol=1e-4)

    @pytest.mark.parametrize("frames", [slice(50, 80), slice(0, 1), slice(95, 101)], ids=["inside", "first", "last"])
    def test_starts_do_without_a_free_marker_that_is_lost_for_long(self, frames: slice) -> None:
        positions = carried_about().positions.copy()
        positions[frames, 5] = np.nan
        whole, lost = (
            GrippedMotion.of(carried_about(positions=x), 0.08) for x in (carried_about().positions, positions)
        )
        assert lost.length == pytest.approx(whole.length, rel=1e-6)
        np.testing.assert_allclose(lost.fractions, whole.fractions, atol=1e-9)
        frame = frames.start
        assert np.isnan(lost.positions[frame, 5]).all() and lost.shown(frame)
        for expected, found, off in zip(whole.start(frame), lost.start(frame), (5e-4, 0.02), strict=True):
            np.testing.assert_allclose(found, expected, atol=off)

    def test_no_window_starts_where_few_markers_are_seen(self) -> None:
        positions = carried_about().positions.copy()
        positions[45:56, 2:7] = np.nan
        motion = GrippedMotion.of(carried_about(positions=positions), 0.08)
        assert not motion.shown(50)
        starts = [e.start_time for e in experiments_of(model_of(motion), [motion], (0.25, 5.0), {})]
        assert starts == pytest.approx([0.0, 0.25, 0.75])

    def test_a_recording_that_starts_with_few_markers_is_refused_with_a_time_to_start_from(self) -> None:
        positions = carried_about().positions.copy()
        positions[:6, 2:7] = np.nan
        with pytest.raises(sb.RecordingError, match=r"less than half seen in the first frames.*from 0\.1 s on"):
            GrippedMotion.of(carried_about(positions=positions), 0.08)

    def test_neighbors_that_are_never_seen_together_are_refused(self) -> None:
        positions = carried_about().positions.copy()
        positions[:50, 5], positions[50:, 6] = np.nan, np.nan
        with pytest.raises(sb.RecordingError, match="never seen together") as caught:
            GrippedMotion.of(carried_about(positions=positions), 0.08)
        assert caught.value.got == ["m5", "m6"]

    def test_a_hole_in_the_times_is_refused(self) -> None:
        kept = np.r_[0:40, 60:101]
        with pytest.raises(sb.RecordingError, match=r"times: of arch jump by 0\.21 s"):
            GrippedMotion.of(carried_about(positions=carried_about().positions[kept], times=TIMES[kept]), 0.08)

    @pytest.mark.parametrize("frames", [1, 2])
    def test_too_few_frames_are_refused(self, frames: int) -> None:
        short = carried_about(positions=carried_about().positions[:frames], times=TIMES[:frames])
        with pytest.raises(sb.RecordingError, match="fewer than three frames"):
            GrippedMotion.of(short, 0.08)

    @pytest.mark.parametrize(
        "clamped",
        [(), (0, 1), (10, 11), (0, 11), (0, 1, 11), (0, 1, 5, 10, 11), tuple(range(12))],
        ids=["none", "start only", "end only", "one each", "one at the end", "one between", "all"],
    )
    def test_what_is_not_held_by_two_grips_is_refused(self, clamped: tuple[int, ...]) -> None:
        with pytest.raises(sb.RecordingError, match="the last two or more along the rope") as caught:
            GrippedMotion.of(carried_about(clamped=clamped), 0.08)
        assert caught.value.field == "clamped" and "arch" in caught.value.problem

    def test_a_grip_that_is_lost_for_long_is_refused(self) -> None:
        positions = carried_about().positions.copy()
        positions[20:60, 0] = np.nan
        with pytest.raises(sb.RecordingError, match="is lost from"):
            GrippedMotion.of(carried_about(positions=positions), 0.08)


class TestModel:
    def test_a_window_starts_at_its_first_frame_and_sees_the_others(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        e = model_of(motion, substeps=4).experiment(motion, (0.3, 0.5))
        assert e.start_time == pytest.approx(0.3) and e.fit == pytest.approx((0.31, 0.5))
        assert e.solver.h == pytest.approx(1 / 400) and "0.30" in e.name
        assert [e.places[k] is None for k in range(12)] == [k in (0, 1, 10, 11) for k in range(12)]
        rod = e.scene.ropes["rope"]
        assert rod.length == pytest.approx(motion.length)
        np.testing.assert_allclose(e.scene.positions[rod.particles[0]], motion.positions[30, 1], atol=1e-9)

    def test_all_of_a_recording_by_default(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        e = model_of(motion).experiment(motion)
        assert e.start_time == 0.0 and e.fit == pytest.approx((0.01, 1.0))

    @pytest.mark.parametrize("window", [(0.3, 0.31), (2.0, 3.0)])
    def test_a_window_without_frames_is_refused(self, window: tuple[float, float]) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        with pytest.raises(sb.InputError, match="three frames between 0 and 1 s"):
            model_of(motion).experiment(motion, window)

    def test_gravity_is_the_recordings_or_the_models(self) -> None:
        along_y = (0.0, -9.81, 0.0)
        motion = GrippedMotion.of(carried_about(), 0.08)
        assert pull(model_of(motion, gravity=along_y).experiment(motion)) == pytest.approx(along_y)
        told = GrippedMotion.of(carried_about(gravity=(0.0, 0.0, -9.8)), 0.08)
        assert pull(model_of(told, gravity=along_y).experiment(told)) == pytest.approx((0.0, 0.0, -9.8))

    def test_recordings_must_share_their_gravity(self) -> None:
        one, other = carried_about(gravity=(0.0, 0.0, -9.81)), carried_about(gravity=(0.0, -9.81, 0.0))
        assert shared_gravity([carried_about()]) is None
        assert shared_gravity([one, carried_about()]) == pytest.approx((0.0, 0.0, -9.81))
        with pytest.raises(sb.InputError, match="gravity: differs"):
            shared_gravity([one, other])

    def test_a_prediction_keeps_driven_markers_and_starts_where_the_rope_is(self) -> None:
        recording = carried_about()
        motion = GrippedMotion.of(recording, 0.08)
        model = model_of(motion)
        (x,) = predict(model, [motion], {})
        assert x.shape == recording.positions.shape and np.isfinite(x).all()
        held = list(recording.clamped)
        np.testing.assert_array_equal(x[:, held], recording.positions[:, held])
        np.testing.assert_allclose(x[0], recording.positions[0], atol=2e-3)
        (stiffer,) = predict(model.with_values(EI=2.0, GJ=2.0), [motion], {})
        assert np.abs(x - recording.positions).max() > 3e-3  # it does not keep its shape
        assert np.abs(x - stiffer).max() > 3e-3

    def test_a_prediction_that_diverges_is_nan_for_the_free_markers(self) -> None:
        motion = GrippedMotion.of(carried_about(), 0.08)
        for x in predict(model_of(motion), [motion], {"rope_length": 1e200}):
            assert np.isnan(x[:, list(motion.free)]).all()
            assert np.isfinite(x[:, list(motion.recording.clamped)]).all()

    def test_gaps_of_free_markers_are_predicted_through(self) -> None:
        positions = carried_about().positions.copy()
        positions[30:38, 5] = np.nan
        whole = GrippedMotion.of(carried_about(), 0.08)
        lost = GrippedMotion.of(carried_about(positions=positions), 0.08)
        expected, found = (predict(model_of(whole), [motion], {})[0] for motion in (whole, lost))
        np.testing.assert_allclose(found, expected, atol=1e-4)
