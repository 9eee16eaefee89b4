"""Identifiability: coverage of intervals on simulated problems, gauges in words, every verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from pytest import approx
from scipy import signal, special
from sheetbend.errors import InputError
from sheetbend.quantities.parameters import Parameter, Parameters
from sheetbend.statistics.covariance import covariance
from sheetbend.statistics.gauge import null_space
from sheetbend.statistics.identifiability import identify
from sheetbend.statistics.intervals import widened
from sheetbend.statistics.judge import Floor
from sheetbend.statistics.layout import Layout
from sheetbend.statistics.profile import Profile, Profiler, Wanted, profile_interval

SEEDS = 400


def design(frames: int) -> np.ndarray:
    """Columns like those of a motion: constant, slow, oscillating and decaying, in between."""
    t = np.linspace(0, 1, frames)
    return np.column_stack([np.ones(frames), t - 0.3, np.exp(-2 * t) * np.cos(40 * t), np.sin(7 * t)])


def errors(rng: np.random.Generator, correlation: float, channels: int, frames: int, common: float) -> np.ndarray:
    """(channels, frames) first-order autoregressive errors; `common` is the correlation between channels."""
    own, shared = rng.standard_normal((channels, frames + 200)), rng.standard_normal(frames + 200)
    white = math.sqrt(1 - common) * own + math.sqrt(common) * shared
    return signal.lfilter([1], [1, -correlation], white, axis=1)[:, 200:]


def coverage(correlation: float, frames: int, channels: int = 1, common: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Part of the seeds whose 95 % interval holds the truth: honest, and as if the residuals were white."""
    base, rng = design(frames), np.random.default_rng(7)
    jacobian = np.concatenate([base * (1 + 0.3 * np.sin(np.arange(4) + k)) for k in range(channels)])
    layout = Layout(
        np.zeros(frames * channels, dtype=int),
        np.repeat(np.arange(channels), frames),
        np.tile(np.arange(frames), channels),
    )
    inverse = np.linalg.pinv(jacobian)
    honest, naive = np.zeros(4), np.zeros(4)
    for _ in range(SEEDS):
        error = errors(rng, correlation, channels, frames, common).ravel()
        estimate = inverse @ error  # the truth is zero
        result = covariance(error - jacobian @ estimate, jacobian, layout)
        sd = np.sqrt(np.diag(result.matrix))
        honest += np.abs(estimate) <= special.stdtrit(result.degrees, 0.975) * sd
        naive += np.abs(estimate) <= special.stdtrit(len(error) - 4, 0.975) * sd / np.sqrt(result.inflation)
    return honest / SEEDS, naive / SEEDS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("correlation", "frames", "channels", "common"),
    [(0.0, 100, 1, 0.0), (0.5, 400, 1, 0.0), (0.8, 400, 1, 0.0), (0.6, 200, 4, 0.0), (0.6, 200, 4, 0.7)],
)
def test_intervals_cover_the_truth(correlation: float, frames: int, channels: int, common: float) -> None:
    """95 % intervals cover 92 to 98 % on average over the parameters, and none falls far below."""
    honest, naive = coverage(correlation, frames, channels, common)
    assert 0.92 <= honest.mean() <= 0.98
    assert honest.min() >= 0.90
    if correlation > 0:
        assert naive.mean() < 0.85  # the test can tell the two apart


def test_white_residuals_give_the_textbook_covariance() -> None:
    rng = np.random.default_rng(3)
    jacobian = rng.standard_normal((5000, 3))
    residuals = 0.2 * rng.standard_normal(5000)
    residuals -= jacobian @ np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
    textbook = residuals @ residuals / 4997 * np.linalg.inv(jacobian.T @ jacobian)
    result = covariance(residuals, jacobian)
    np.testing.assert_allclose(np.diag(result.matrix), np.diag(textbook), rtol=0.1)
    assert result.residual_variance == pytest.approx(0.04, rel=0.05)
    assert result.autocorrelation_time == pytest.approx(1.0, abs=0.05)


def test_prior_counts_as_one_observation_of_its_sd() -> None:
    """One direct datum of unit noise and a prior of sd 1 on the same number: half the variance."""
    rng = np.random.default_rng(0)
    jacobian = np.full((10_000, 1), 0.01)  # together they tell the parameter with variance 1
    residuals = rng.standard_normal(10_000)
    residuals -= residuals.mean()
    result = covariance(residuals, jacobian, prior_jacobian=np.ones((1, 1)))
    assert result.matrix[0, 0] == pytest.approx(0.5, rel=0.1)


@pytest.mark.filterwarnings("error")
def test_a_parameter_that_only_its_prior_tells_divides_nothing_by_zero() -> None:
    """The data do not move with it, so its variance from them is zero before and after frames that are alike count."""
    rng = np.random.default_rng(3)
    jacobian = np.column_stack([rng.standard_normal(200), np.zeros(200)])
    found = covariance(rng.standard_normal(200), jacobian, prior_jacobian=np.array([[0.0, 4.0]]))
    assert found.matrix[1, 1] == pytest.approx(1 / 16)
    assert found.inflation[1] == 1.0


def test_covariance_does_not_depend_on_units() -> None:
    rng = np.random.default_rng(5)
    jacobian, size = design(150), np.array([1e-9, 1.0, 1e8, 1e-3])
    residuals = errors(rng, 0.7, 1, 150, 0.0)[0]
    residuals -= jacobian @ np.linalg.lstsq(jacobian, residuals, rcond=None)[0]
    plain = covariance(residuals, jacobian)
    scaled = covariance(residuals, jacobian * size)
    np.testing.assert_allclose(scaled.matrix * np.outer(size, size), plain.matrix, rtol=1e-8)


def test_layout_is_checked() -> None:
    zeros = np.zeros(3, dtype=int)
    with pytest.raises(InputError, match="two rows in one place"):
        Layout(zeros, zeros, zeros)
    with pytest.raises(InputError, match="integer"):
        Layout(zeros, zeros, np.linspace(0, 1, 3))
    with pytest.raises(InputError, match="outnumber"):
        covariance(np.zeros(2), np.eye(2))


def spring(names: tuple[str, ...], powers: tuple[float, ...], rows: int = 200) -> np.ndarray:
    """Jacobian of a motion that sees only a product of `names` to `powers`, and a sound last column."""
    t = np.linspace(0, 1, rows)
    return np.column_stack([power * t * np.cos(12 * t) for power in powers] + [np.sin(5 * t)])


@pytest.mark.parametrize(
    ("names", "powers", "words"),
    [
        (
            ("rope_density", "rope_EA"),
            (-1.0, 1.0),
            "rope_density^+1 * rope_EA^+1 stays free: only the ratio rope_EA/rope_density is known",
        ),
        (
            ("mass", "compliance"),
            (1.0, 1.0),
            "mass^+1 * compliance^-1 stays free: only the product mass * compliance is known",
        ),
        (("length", "EI"), (-3.0, 1.0), "length^+1 * EI^+3 stays free: only EI/length^3 is known"),
    ],
)
def test_gauges_are_named(names: tuple[str, ...], powers: tuple[float, ...], words: str) -> None:
    space = null_space(spring(names, powers), [*names, "sound"], [True, True, True])
    assert [gauge.words for gauge in space.gauges] == [words]
    assert space.rank == 2
    assert space.determined == (2,)


def test_mass_against_compliance_in_a_simulated_oscillator() -> None:
    """x = cos(t sqrt(1/(m a))): from motion alone the product m a is known, each factor is not."""
    t = np.linspace(0, 3, 300)
    frequency = math.sqrt(1 / (0.2 * 0.01))
    column = 0.5 * t * frequency * np.sin(t * frequency)  # d x/d ln m = d x/d ln a
    parameters = Parameters(
        [Parameter(name="mass", initial=0.2, log=True), Parameter(name="compliance", initial=0.01, log=True)]
    )
    residuals = 1e-3 * np.random.default_rng(0).standard_normal(300)
    result = identify(parameters, parameters.initial(), residuals, np.column_stack([column, column]))
    assert [e.verdict for e in result.estimates] == ["not identifiable"] * 2
    assert "only the product mass * compliance is known" in result.estimates[0].words
    held = parameters.replace("mass", fixed=True)
    result = identify(held, held.initial(), residuals, column[:, None])
    assert result.estimates[0].verdict == "identified"
    known = Parameters([Parameter(name="mass", initial=0.2, log=True, prior=(0.2, 0.01)), parameters["compliance"]])
    result = identify(known, known.initial(), residuals, np.column_stack([column, column]))
    assert [e.verdict for e in result.estimates] == ["identified"] * 2
    assert "through its prior" in result.estimates[1].words


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("seed", range(20))
def test_what_only_a_prior_tells_has_the_interval_of_the_prior(seed: int) -> None:
    """Two equal columns and a prior on the first: what the data add to it is rounding, of either sign."""
    rng = np.random.default_rng(seed)
    column = 10 ** rng.uniform(-2, 2) * rng.standard_normal(300)
    parameters = Parameters(
        [Parameter(name="a", initial=2.0, log=True, prior=(2.0, 0.01)), Parameter(name="b", initial=1.0)]
    )
    residuals = np.convolve(rng.standard_normal(309), np.ones(10), "valid")
    found = identify(parameters, parameters.initial(), residuals, np.column_stack([column, column])).estimates[0]
    assert found.verdict == "identified"
    assert found.lower is not None and found.upper is not None
    np.testing.assert_allclose(np.log([found.lower / 2.0, found.upper / 2.0]), [-0.0196, 0.0196], rtol=2e-2)


@pytest.mark.parametrize("far", [800.0, -800.0])
def test_a_gauge_far_off_keeps_its_words_without_numbers(far: float) -> None:
    """The product of two on a log scale, where neither is a number that a computer can hold."""
    two = Parameters([Parameter(name=name, initial=1.0, log=True) for name in ("a", "b")])
    found = identify(two, np.array([far, far]), 1e-3 * np.arange(5.0), np.ones((5, 2)))
    assert [gauge.words for gauge in found.gauges] == ["a^+1 * b^-1 stays free: only the product a * b is known"]


def test_two_gauges_and_linear_parameters() -> None:
    t = np.linspace(0, 1, 100)
    columns = [np.sin(9 * t), np.sin(9 * t), t, -t, np.cos(4 * t)]
    names = ["density", "stiffness", "left", "right", "sound"]
    space = null_space(np.column_stack(columns), names, [True, True, False, False, True])
    assert {gauge.members for gauge in space.gauges} == {("density", "stiffness"), ("left", "right")}
    assert "left +1, right +1 stays free: only right - left is known" in [gauge.words for gauge in space.gauges]
    assert space.rank == 3


def test_sound_parameters_keep_their_interval_beside_a_gauge() -> None:
    rng = np.random.default_rng(2)
    jacobian = spring(("a", "b"), (1.0, 1.0))
    residuals = 0.05 * rng.standard_normal(200)
    residuals -= jacobian @ (np.linalg.pinv(jacobian) @ residuals)
    three = Parameters([Parameter(name=name, initial=1.0, log=True) for name in ("a", "b", "c")])
    two = Parameters([Parameter(name=name, initial=1.0, log=True) for name in ("a", "c")])
    with_gauge = identify(three, np.zeros(3), residuals, jacobian).estimates[2]
    without = identify(two, np.zeros(2), residuals, jacobian[:, 1:]).estimates[1]
    assert with_gauge.lower == pytest.approx(without.lower, rel=1e-6)
    assert with_gauge.upper == pytest.approx(without.upper, rel=1e-6)


def one(noise: float, column: np.ndarray | None = None, **fields: object) -> tuple[Parameters, np.ndarray, np.ndarray]:
    """A problem with one parameter p at its value 1 and white residuals."""
    column = np.ones(400) if column is None else column
    rng = np.random.default_rng(11)
    residuals = noise * rng.standard_normal(len(column))
    if column.any():
        residuals -= column * (column @ residuals) / (column @ column)
    return Parameters([Parameter(**{"name": "p", "initial": 1.0, **fields})]), residuals, column[:, None]


def judge(problem: tuple[Parameters, np.ndarray, np.ndarray], **options: object):
    parameters, residuals, jacobian = problem
    return identify(parameters, parameters.initial(), residuals, jacobian, **options).estimates[0]


def test_identified_and_weak() -> None:
    """The half-width is 2 sd/sqrt(400) = 0.1 sd: 20 % lies at sd 2."""
    tight, loose = judge(one(1.0)), judge(one(4.0))
    assert tight.verdict == "identified"
    assert tight.half_width == pytest.approx(0.1, rel=0.15)
    assert loose.verdict == "weak"
    assert loose.half_width == pytest.approx(0.4, rel=0.15)
    assert "known only to" in loose.words


def test_scale_judges_a_parameter_that_may_be_zero() -> None:
    assert judge(one(1.0, initial=0.0)).verdict == "weak"
    assert judge(one(1.0, initial=0.0, scale=1.0)).verdict == "identified"


def test_log_intervals_are_asymmetric_and_positive() -> None:
    estimate = judge(one(8.0, log=True))
    assert 0 < estimate.lower < 1 < estimate.upper
    assert estimate.lower * estimate.upper == pytest.approx(1.0)
    assert estimate.upper - 1 > 1 - estimate.lower


def test_flat() -> None:
    estimate = judge(one(1.0, column=np.zeros(400)))
    assert estimate.verdict == "not identifiable"
    assert "moves no residual" in estimate.words
    assert estimate.lower is None
    assert estimate.upper is None


@pytest.mark.parametrize(("start", "words"), [(1e6, "smaller values"), (1e-6, "larger values")])
def test_a_parameter_that_ran_off_is_told_from_one_that_the_data_never_contained(start: float, words: str) -> None:
    """Its column is flat because of where it went."""
    parameters, residuals, jacobian = one(1.0, column=np.zeros(400), log=True, initial=start, unit="N")
    estimate = identify(parameters, np.zeros(1), residuals, jacobian).estimates[0]
    assert estimate.verdict == "not identifiable" and "moves no residual" not in estimate.words
    assert f"ran off from {start:g} N to 1 N" in estimate.words.replace("1000000", "1e+06") and words in estimate.words


def test_an_end_as_far_as_a_search_looks_is_no_identified_value() -> None:
    parameters, residuals, jacobian = one(1.0, log=True, initial=1e6)
    estimate = identify(parameters, np.zeros(1), residuals, jacobian).estimates[0]
    assert estimate.verdict == "at a bound" and "ran off" in estimate.words


def test_at_a_bound() -> None:
    estimate = judge(one(1.0, upper=1.0))
    assert estimate.verdict == "at a bound"
    assert estimate.upper == 1.0
    assert "upper bound 1" in estimate.words


def test_at_its_floor() -> None:
    below = {"p": Floor(1.2, "BDF1 damps by omega h/2")}
    assert judge(one(1.0), floors=below).verdict == "at its floor"
    assert "BDF1" in judge(one(1.0), floors=below).words
    assert judge(one(1.0), floors={"p": Floor(0.5, "no matter")}).verdict == "identified"
    assert judge(one(1.0), floors={"p": Floor(0.5, "few sweeps", ceiling=True)}).verdict == "at its floor"
    with pytest.raises(InputError, match="no free parameter"):
        judge(one(1.0), floors={"q": Floor(0.5, "")})


def by_refits(log: bool, cost: Callable[[float], float]) -> Profiler:
    """Ends where a known cost has risen by that at the end of the linear interval, of residuals that are white."""

    def profiles(wanted: Sequence[Wanted]) -> list[Profile]:
        assert [w.name for w in wanted] == ["p"]
        reach = wanted[0].reach
        rise = 0.5 * 400 * reach**2  # of the linear picture
        return [Profile(profile_interval(cost, 1.0, rise, step=min(reach, 1.0), log=log), (0.0,), (0.0,), reach)]

    return profiles


def test_one_sided_by_the_profile() -> None:
    problem = one(16.0, log=True)
    base = 0.5 * problem[1] @ problem[1]

    def cost(value: float) -> float:
        return base * (1 + max(0.0, -math.log(value)) ** 2)

    estimate = judge(problem, profiler=by_refits(True, cost))
    assert estimate.verdict == "one-sided"
    assert estimate.upper is None
    assert 0 < estimate.lower < 1
    assert estimate.words.startswith("at least")
    assert judge(problem, profiler=by_refits(True, lambda value: base)).verdict == "not identifiable"


def test_every_interval_is_profiled_of_many_the_weak_ones() -> None:
    """A lopsided cost moves the ends of a precise parameter too; nothing is asked at a bound."""

    def lopsided(wanted: Sequence[Wanted]) -> list[Profile]:
        return [Profile((1.0 - w.reach, 1.0 + 1.5 * w.reach)) for w in wanted]

    linear, found = judge(one(1.0)), judge(one(1.0), profiler=lopsided)
    assert found.verdict == linear.verdict == "identified"
    assert found.lower == approx(linear.lower) and found.upper - 1.0 == approx(1.5 * (linear.upper - 1.0))
    assert judge(one(1.0, lower=1.0), profiler=lopsided) == judge(one(1.0, lower=1.0))

    asked: list[str] = []
    names = [f"p{k}" for k in range(61)]
    size = np.where(np.arange(61) == 5, 0.01, 1.0)  # that one is weak
    jacobian = np.tile(np.eye(61) * size, (6, 1))
    residuals = 0.1 * np.tile([[1.0], [-1.0]], (3, 61)).ravel()

    def told(wanted: Sequence[Wanted]) -> list[Profile]:
        asked.extend(w.name for w in wanted)
        return [Profile((0.0, 2.0)) for _ in wanted]

    identify(
        Parameters([Parameter(name=n, initial=1.0) for n in names]), np.ones(61), residuals, jacobian, profiler=told
    )
    assert asked == ["p5"]


def test_profile_interval_of_known_costs() -> None:
    assert profile_interval(lambda p: (p - 3) ** 2, 3.0, 4.0, step=0.1) == pytest.approx((1.0, 5.0), rel=5e-3)
    log = profile_interval(lambda p: math.log(p / 3) ** 2, 3.0, 1.0, step=0.1, log=True)
    assert log == pytest.approx((3 / math.e, 3 * math.e), rel=5e-3)
    assert profile_interval(lambda p: (p - 3) ** 2, 3.0, 4.0, step=0.1, upper=4.0)[1] is None
    lopsided = profile_interval(lambda p: p - 1 - math.log(p), 1.0, 1.0, step=0.5, lower=1e-9)
    assert lopsided == pytest.approx((0.15859, 3.14619), rel=5e-3)


def test_discretization_is_added_and_both_are_reported() -> None:
    statistical = judge(one(1.0))
    both = judge(one(1.0), discretization={"p": 0.05})
    assert both.statistical == pytest.approx(statistical.half_width)
    assert both.discretization == 0.05
    assert both.half_width == pytest.approx(statistical.half_width + 0.05)
    assert judge(one(1.0), discretization={"p": 0.5}).verdict == "weak"


@pytest.mark.parametrize("moved", [math.nan, math.inf, math.expm1(math.log(1e6))])
def test_a_refit_that_diverged_is_named_and_not_counted(moved: float) -> None:
    plain = judge(one(1.0, log=True))
    estimate = judge(one(1.0, log=True), discretization={"p": moved})
    assert (estimate.lower, estimate.upper, estimate.discretization) == (plain.lower, plain.upper, 0.0)
    assert "ran off or diverged is not counted" in estimate.words and "not counted" not in plain.words


def test_a_profile_that_diverges_leaves_the_linear_end_and_says_so() -> None:
    """Above 1.2 the motion has no answer; below, the profile is steeper than the linear picture."""
    problem = one(16.0, log=True)
    base, asked = 0.5 * problem[1] @ problem[1], []

    def cost(value: float) -> float:
        asked.append(value)
        return math.inf if value > 1.2 else base + 4e3 * math.log(value) ** 2

    estimate, linear = judge(problem, profiler=by_refits(True, cost)), judge(problem)
    assert estimate.upper == linear.upper and estimate.lower > linear.lower
    assert "with it held above diverged" in estimate.words
    assert len(asked) < 40
    assert math.isnan(profile_interval(lambda p: p if p < 3 else math.nan, 1.0, 9.0, step=1.0)[1])


def test_residuals_of_zero_leave_intervals_of_no_width_that_are_named() -> None:
    for size in (0.0, 1e-200, 1e-160):  # squares of the second are zero, of the third nearly
        parameters, residuals, jacobian = one(size, log=True)
        estimate = identify(parameters, parameters.initial(), residuals, jacobian).estimates[0]
        assert estimate.lower == estimate.value == estimate.upper == 1.0
        assert "residuals are exactly zero" in estimate.words


def test_nothing_is_known_better_than_to_rounding() -> None:
    parameters, residuals, jacobian = one(10.0)
    estimate = identify(parameters, parameters.initial(), residuals, 1e30 * jacobian).estimates[0]
    assert estimate.verdict == "rough" and estimate.half_width is None


def test_many_nearly_dependent_columns_have_a_covariance() -> None:
    """Their condition number is 1e5: that of the product J'J, 1e10, leaves an inverse with negative eigenvalues."""
    rng, rows = np.random.default_rng(3), 400
    basis = np.linalg.qr(rng.standard_normal((rows, 24)))[0]
    turn = np.linalg.qr(rng.standard_normal((24, 24)))[0]
    jacobian = basis @ np.diag(np.logspace(0, -5.5, 24)) @ turn
    residuals = rng.standard_normal(rows)
    residuals -= basis @ (basis.T @ residuals)
    found = covariance(residuals, jacobian)
    exact = turn.T @ np.diag(np.logspace(0, 11, 24)) @ turn * found.residual_variance
    ratio = np.diag(found.matrix) / np.diag(exact) / found.inflation
    np.testing.assert_allclose(ratio, 1.0, rtol=1e-6)


def test_correlations() -> None:
    rng = np.random.default_rng(4)
    jacobian = rng.standard_normal((3000, 2)) @ np.array([[1.0, 0.8], [0.0, 0.6]])
    parameters = Parameters([Parameter(name="a", initial=1.0), Parameter(name="b", initial=1.0)])
    (pair,) = identify(parameters, np.ones(2), 0.1 * rng.standard_normal(3000), jacobian).correlations
    assert (pair.first, pair.second) == ("a", "b")
    assert pair.value == pytest.approx(-0.8, abs=0.04)


def test_bad_arrays_are_refused() -> None:
    parameters, residuals, jacobian = one(1.0)
    with pytest.raises(InputError, match="finite"):
        judge((parameters, np.where(np.arange(400) == 3, np.nan, residuals), jacobian))
    with pytest.raises(InputError, match="disagrees"):
        judge((parameters, residuals, np.ones((400, 2))))


def test_recordings_of_different_lengths_and_gaps() -> None:
    """Three frames, one frame and sixty with gaps: nothing breaks, and independent recordings add up."""
    rng = np.random.default_rng(1)
    recording = np.repeat([0, 1, 2], [3, 1, 40])
    frame = np.concatenate([np.arange(3), [0], np.sort(rng.permutation(60)[:40])])
    layout = Layout(recording, np.zeros(44, dtype=int), frame)
    residuals = rng.standard_normal(44)
    residuals -= residuals.mean()
    single = covariance(residuals, np.ones((44, 1)), layout)
    assert single.matrix[0, 0] >= residuals @ residuals / 43 / 44 * (1 - 1e-12)
    shifted = Layout(recording, np.zeros(44, dtype=int), frame + 1000)  # only differences of frames matter
    np.testing.assert_allclose(covariance(residuals, np.ones((44, 1)), shifted).matrix, single.matrix)


@pytest.mark.slow
def test_loud_white_channels_do_not_hide_slow_quiet_ones() -> None:
    """A depth camera: along its view large white noise, across it small noise that is slow. What is fitted to the quiet
    channels alone must cover its truth; one autocorrelation for all channels gave 70 %."""
    frames, markers, repeats = 33, 16, 200
    rng = np.random.default_rng(5)
    axis = np.tile(np.arange(3), frames * markers)
    layout = Layout(
        np.zeros_like(axis), np.tile(np.arange(3 * markers), frames), np.repeat(np.arange(frames), 3 * markers), axis
    )
    inside = []
    for _ in range(repeats):
        slow = np.zeros((frames, markers, 3))
        slow[0] = rng.standard_normal((markers, 3))
        for k in range(1, frames):
            slow[k] = 0.88 * slow[k - 1] + np.sqrt(1 - 0.88**2) * rng.standard_normal((markers, 3))
        errors = 2.5 * slow + 1.5 * rng.standard_normal(slow.shape)
        errors[..., 1] = 6.0 * rng.standard_normal((frames, markers))
        one = np.zeros((frames, markers, 3))
        one[..., 0] = 1.0  # a shift along x
        other = np.zeros_like(one)
        other[..., 1] = 1.0
        jacobian = np.stack([one.ravel(), other.ravel()], axis=1)
        estimate, *_ = np.linalg.lstsq(jacobian, errors.ravel(), rcond=None)
        found = covariance(errors.ravel() - jacobian @ estimate, jacobian, layout)
        inside.append(np.abs(estimate) < 1.96 * np.sqrt(np.diag(found.matrix)))
    held = np.mean(inside, axis=0)
    assert held[0] > 0.8, held
    assert held[1] > 0.9, held


def test_an_axis_without_residuals_has_no_spectrum_of_its_own() -> None:
    """A planar motion: nothing is off across it."""
    rng = np.random.default_rng(0)
    axis = np.tile(np.arange(3), 40)
    layout = Layout(np.zeros_like(axis), axis, np.repeat(np.arange(40), 3), axis)
    errors = rng.standard_normal(120)
    errors[axis == 1] = 0.0
    found = covariance(errors, np.ones((120, 1)), layout)
    assert np.isfinite(found.matrix).all() and found.matrix[0, 0] > 0


def test_what_widens_an_interval_keeps_to_the_bounds():
    """Poisson's ratio of 0.45 +- 0.1 with 0.2 of discretization ended at 0.75, where 0.5 is the most."""
    number = Parameter(name="nu", initial=0.3, lower=-0.5, upper=0.5)
    assert widened(number, 0.45, (0.35, 0.48), 0.2) == approx((0.15, 0.5))
    assert widened(number, -0.45, (-0.48, None), 0.2) == (approx(-0.5), None)
    stiff = Parameter(name="k", initial=10.0, log=True, lower=9.0, upper=1e3)
    assert widened(stiff, 10.0, (9.5, 11.0), 5.0) == approx((9.0, 16.5))
    assert widened(stiff, 8.0, (7.0, 9.5), 0.0) == approx((8.0, 9.5))  # one that was moved out holds its own value
