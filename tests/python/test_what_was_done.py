"""What was done to a recording or to a specimen, and shows in what a fit leaves: markers that were filtered, readings
at the end of a sensor's range, yarns that run askew, a pin that stands elsewhere, yarns that slide."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from scipy.signal import butter, filtfilt
from sheetbend.doubts.at_limits import _limits, at_limits
from test_forces_fit import FORCE_NOISE, experiment, twin  # noqa: F401 - a fixture
from test_misread import AT, SIGMA, SOLVER, TRUE, rope

TIMES, FINE = np.arange(101) / 100, sb.Solver(h=1 / 3200)
FRAMES, FRAME_SOLVER = np.arange(49) / 60, sb.Solver(h=1 / 240, method="newton")
CLOTH = {"cloth_warp": 60.0, "cloth_weft": 40.0, "cloth_shear": 6.0, "cloth_bending": 3e-4}
CELLS, PINS = 6, [42, 48]


def fell(seed: int, smooth: Any = None, times: np.ndarray = TIMES, name: str = "fall") -> sb.Experiment:
    """A rope that falls, from substeps eight times shorter."""
    x = sb.simulate(rope(), times, FINE).positions[:, AT]
    x = x + SIGMA * np.random.default_rng(seed).standard_normal(x.shape)
    recording = sb.Recording(x if smooth is None else smooth(x), times, name=name)
    markers = [sb.on_particle(k) for k in AT]
    return sb.Experiment(scene=rope(), recording=recording, markers=markers, solver=SOLVER, sigma=SIGMA)


def low_pass(hertz: float, rate: float = 100.0) -> Any:
    b, a = butter(2, hertz / (rate / 2.0))
    return lambda x: filtfilt(b, a, x, axis=0)


def mean_of(frames: int) -> Any:
    def smooth(x: np.ndarray) -> np.ndarray:
        ends = np.concatenate([x[:1]] * (frames // 2) + [x] + [x[-1:]] * (frames // 2))
        return np.stack([ends[k : k + frames].mean(axis=0) for k in range(len(x))])

    return smooth


@pytest.mark.parametrize(
    ("smooth", "words"),
    [
        (low_pass(6.0), "the markers were filtered, with a cut-off near 5.8 Hz"),
        (low_pass(10.0), "the markers were filtered, with a cut-off near 10 Hz"),
        (mean_of(11), "the markers were averaged over about 1"),
    ],
)
def test_filtered_markers_are_named(smooth: Any, words: str) -> None:
    """6 Hz made bend damping 23 % too large, 1.1 half-widths in all, "identified" without a word."""
    found = sb.fit([fell(0, smooth)], parameters=tuple(TRUE)).result
    (named,) = [w for w in found.warnings if "the markers were" in w]
    assert words in named and "Check that, and correct the model or the recording" in named
    off = abs(found["rope_bend_damping"].value - TRUE["rope_bend_damping"])
    assert found["rope_bend_damping"].verdict == "doubtful" or off < found["rope_bend_damping"].in_all


def test_recordings_that_were_filtered_alike_are_named_together() -> None:
    """Filters of other cut-offs explain most of each, and a cut-off is another part of another frame rate."""
    low, high = fell(1, low_pass(6.0)), fell(2, low_pass(6.0, 200.0), np.arange(201) / 200, "often")
    found = sb.fit([low, high], parameters=tuple(TRUE)).result
    assert [w for w in found.warnings if "the markers were filtered, with a cut-off near 5.8 Hz. Check" in w]


@pytest.mark.parametrize("smooth", [None, lambda x: np.round(x, 4), low_pass(45.0)])
def test_markers_with_their_noise_are_not_said_to_be_filtered(smooth: Any) -> None:
    e = fell(1, smooth)
    for told in (e, replace(e, scene=rope(bend_damping=0.02))):  # and where the model is wrong
        found = sb.fit([told], parameters=("rope_EI", "rope_drag_linear")).result
        assert not [w for w in found.warnings if "the markers were" in w]


@pytest.mark.parametrize("step", [0.0, 2e-3])
def test_readings_at_the_end_of_a_range_are_named_before_a_fit(twin: Any, step: float) -> None:  # noqa: F811
    """Clipped at half of their range they made the density 16 % too small, "identified" without a word."""
    e = experiment(twin, 0)
    (sensor,) = e.forces
    measured = sensor.recording.forces
    most = 0.5 * np.abs(measured).max()

    def read(forces: np.ndarray, axes: str = "xyz") -> sb.Experiment:
        return replace(e, forces=[replace(sensor, recording=replace(sensor.recording, forces=forces), axes=axes)])

    def rounded(x: np.ndarray) -> np.ndarray:
        return np.round(x / step) * step if step else x

    repeated = np.repeat(measured[::3], 3, axis=0)[: len(measured)]  # as a log that is faster than the sensor has them
    assert not [words for right in (rounded(measured), repeated) for words in at_limits(read(right))]
    clipped = rounded(np.clip(measured, -most, most))
    first, *_ = at_limits(read(clipped))
    assert not [words for words in at_limits(read(clipped, "z")) if "along x" in words]  # which does not count
    assert "readings of the force along x of wrist are exactly" in first and "Set these readings to NaN" in first
    if not step:
        names = {
            "rod_density": {"initial": 0.15},
            "rod_EI": {"initial": 5e-3},
            "rod_GJ": {"tied_to": "rod_EI", "factor": 0.8},
        }
        blind, mended = (
            sb.fit([read(x)], parameters=names).result
            for x in (clipped, np.where(np.abs(clipped) < most, clipped, np.nan))
        )
        assert first in blind.warnings and not [w for w in mended.warnings if "of its range" in w]
        assert blind["rod_density"].value < 0.105 and mended["rod_density"].value == approx(0.12, rel=0.03)


def test_forces_at_rest_stand_at_no_limit(twin: Any) -> None:  # noqa: F811
    """Of a simulation, without noise: what does not move reads the same."""
    e = experiment(twin, 0)
    (sensor,) = e.forces
    forces = np.zeros_like(sensor.recording.forces)
    forces[:, 2] = np.minimum(np.linspace(-1.0, 1.0, len(forces)), 0.3)
    still = replace(e, forces=[replace(sensor, recording=replace(sensor.recording, forces=forces), sigma=FORCE_NOISE)])
    assert not list(at_limits(still))


def test_a_log_that_is_zero_where_nothing_touches_stands_at_no_limit() -> None:
    for seed in range(20):
        push = np.maximum(np.sin(np.linspace(0.0, 12.0, 600)), 0.0)
        read = np.where(push > 0.0, push + 2e-3 * np.random.default_rng(seed).standard_normal(600), 0.0)
        assert not list(_limits(np.maximum(read, 0.0), 2e-3))


@pytest.mark.parametrize("noise", [5e-4, 2e-3, 4e-3])
def test_a_pull_that_stops_stands_at_no_limit(noise: float) -> None:
    """Rounded to 0.01 N: with less noise than that most readings at rest are the same, and the largest of all."""
    for seed in range(20):
        pull = np.minimum(np.linspace(0.0, 2.0, 400), 1.0) + noise * np.random.default_rng(seed).standard_normal(400)
        assert not list(_limits(np.round(pull, 2), 0.01))
        clipped = np.minimum(pull + 1e-3 * np.random.default_rng(seed + 20).standard_normal(400), 0.9)
        assert [side for side, *_ in _limits(clipped, 2e-3)] == ["largest"]


def hung(turned: float = 0.0, farther: float = 0.0, **numbers: Any) -> sb.Scene:
    """A cloth that falls from a slope into two pins; its yarns turned away from the weft, a pin farther along x."""
    mesh, scene = sb.mesh.grid(0.3, 0.3, CELLS, CELLS, pattern="one_way"), sb.Scene("cloth")
    c, s = np.cos(turned), np.sin(turned)
    mesh = replace(mesh, material=mesh.material @ np.array([[c, s], [-s, c]]))
    x, y, _ = mesh.vertices.T
    at = np.stack([0.15 + (x - 0.15) * (1 - 0.02 / 0.3), 0.9 * (0.3 - y), 0.4 * (y - 0.3)], axis=1)
    at[PINS[0], 0] += farther
    given = {"density": 0.2, "bend_damping": 0.02, "membrane_damping": 0.02, "drag_linear": 0.1}
    own = {name.removeprefix("cloth_"): value for name, value in CLOTH.items()}
    cloth = sb.add_cloth(scene, mesh, "cloth", held=np.array(PINS), positions=at, **given | own | numbers)
    scene.pin(cloth.particles[PINS])
    return scene


def fitted_cloth(**true: Any) -> Any:
    """A fit of the cloth as it was told, from stiffnesses a fourth too large, to one that is otherwise."""
    told = hung(warp=75.0, weft=50.0, shear=8.0, bending=4e-4)
    own = [int(p) for v, p in enumerate(told.cloths["cloth"].particles) if v not in PINS]
    x = sb.simulate(hung(**true), FRAMES, sb.Solver(h=1 / 960, method="newton")).positions[:, own]
    x = x + SIGMA * np.random.default_rng(0).standard_normal(x.shape)
    recording = sb.Recording(x, FRAMES, name="cloth")
    markers = [sb.on_particle(p) for p in own]
    e = sb.Experiment(scene=told, recording=recording, markers=markers, solver=FRAME_SOLVER, sigma=SIGMA)
    return sb.fit([e], parameters=tuple(CLOTH)).result


@pytest.mark.slow
@pytest.mark.parametrize(
    ("true", "words"),
    [
        ({"turned": np.deg2rad(10.0)}, "the yarns of cloth ran in other directions than its mesh has them"),
        ({"farther": 3e-3}, "cloth were held 2.8 mm farther along x at vertex 42"),
    ],
)
def test_yarns_askew_and_a_pin_elsewhere_are_named(true: dict[str, float], words: str) -> None:
    """Up to 13 and 4 half-widths off; what was told was a turned gravity or a larger cloth, at half of what is left."""
    found = fitted_cloth(**true)
    assert [w for w in found.warnings if words in w and "9" in w[:2]]
    far = [name for name, value in CLOTH.items() if abs(found[name].value - value) > (found[name].in_all or np.inf)]
    assert not far  # whatever is far off is doubtful


@pytest.mark.slow
def test_where_nothing_explains_what_is_left_no_stiffness_is_identified() -> None:
    """Yarns that slide in shear: the shear stiffness was 48 % too small, "identified" beside residuals of 5.5 sigma."""
    found = fitted_cloth(yield_shear=0.01, yield_shear_share=0.5)
    assert found.misfit.reduced_chi_square > 25.0
    assert [found[name].verdict for name in CLOTH] == ["doubtful"] * 4
    assert [w for w in found.warnings if "no single error explains nearly all of that" in w]


@pytest.mark.slow
def test_a_right_cloth_is_identified() -> None:
    found = fitted_cloth()
    assert found["cloth_shear"].verdict == "identified" and not [w for w in found.warnings if "as if" in w]
