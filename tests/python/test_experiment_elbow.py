"""Free flights of two blocks on a hinge: what the recording says of them, and predictions from the first frames."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments" / "elbow"))


def test_the_scene_starts_as_the_recording_shows() -> None:
    from blocks import flights, scene_of

    flight = flights()[2]
    scene, _, second = scene_of(flight)
    origin, frame = second.pose(sb.simulate(scene, [0.0, 1 / 148], sb.Solver(h=1 / 592)))
    centers, turned = flight.second()
    assert np.abs(origin - centers[:2]).max() < 1e-3
    assert np.abs(frame - turned[:2]).max() < 0.02


def test_flights_are_predicted_from_their_first_frames() -> None:
    from blocks import flights
    from elbow import predicted
    from turning_axes import turning

    every = flights()
    assert len(every) == 18
    halves = [every[:9], every[9:]]
    rates = [turning([(f.times, f.middle(), ()) for f in half]) for half in halves]
    assert all(abs(rate - 0.037) < half < 0.02 for rate, half in rates)  # rad/s
    errors = np.array(
        [
            predicted(f.steady(rate), 9.63, 3e-4)
            for half, (rate, _) in zip(halves, rates[::-1], strict=True)
            for f in half
        ]
    )
    assert (np.median(errors, axis=0) < [0.8e-3, 0.8, 0.8e-3, 0.9]).all()
    assert (errors.max(axis=0) < [2e-3, 1.4, 2e-3, 2.0]).all()


def test_the_model_follows_the_flight_that_is_predicted_worst() -> None:
    """What toss 67 is off by is noise of its first four frames: from the best start for all frames little is left."""
    from blocks import flights
    from elbow import predicted, start_of_all

    flight = flights()[1].steady(0.048)
    assert flight.name == "toss 67"
    assert predicted(flight, 9.664, 4e-4)[0] > 1.9e-3
    left = predicted(flight, 9.664, 4e-4, start_of_all(flight, 9.664))
    assert max(left[0], left[2]) < 0.3e-3
    assert max(left[1], left[3]) < 0.4


def test_weights_that_know_the_noise_gain_little_over_a_line_through_four_frames() -> None:
    from blocks import flights
    from first_frames import BEGIN, covariances, line, path, spread, weights

    t = np.arange(15.0)
    flat, noise = [np.eye(15)] * 3, covariances(15, BEGIN)
    assert weights(t, 4, flat[0]) == pytest.approx(line(t)[-1] @ np.linalg.pinv(line(t)[:4]))
    assert weights(t, 4, noise[0]) @ line(t)[:4] == pytest.approx([1.0, 14.0])  # of any line, exactly
    ours = path(flights()[1])
    best, plain = (np.linalg.norm(spread(ours, 4, noise, own)) for own in (noise, flat))
    assert 0.97 * plain < best < plain < 0.8  # mm
    drawn = np.linalg.cholesky(noise[0]) @ np.random.default_rng(0).standard_normal((15, 4000))
    assert np.std(weights(t, 4, noise[0]) @ drawn[:4] - drawn[-1]) == pytest.approx(best / np.sqrt(3.0), rel=0.05)


@pytest.mark.slow
def test_gravity_of_two_flights_is_that_of_the_cube() -> None:
    from blocks import experiment, flights, parameters

    every = flights()
    found = sb.fit([experiment(every[k]) for k in (2, 10)], parameters=parameters(["gravity"]), refine=False)["gravity"]
    assert found.half_width is not None
    assert abs(found.value - 9.64) < found.half_width < 0.2


def test_tosses_of_another_folder_are_cut_as_the_shipped_ones(tmp_path: Path) -> None:
    """The shipped ones again, in the columns of the source: a toss begins with its flight already."""
    from block_cutting import cut
    from block_landings import DATA, tosses
    from blocks import flights

    shipped = np.load(DATA)
    columns = {"starts": shipped["starts"], "toss": shipped["toss"], "angle": shipped["angles"].astype(float)}
    columns |= {"position": shipped["positions"].astype(float), "quaternion": shipped["quaternions"][:, [3, 0, 1, 2]]}
    np.savez(tmp_path / "elbow_tosses.npz", **columns)
    for old, new in zip(tosses(), tosses(tmp_path), strict=True):
        assert (new.name, new.free) == (old.name, old.free)
        assert np.array_equal(new.positions, old.positions) and np.array_equal(new.angles, old.angles)
    for old, new in zip(flights(), flights(cut(columns)[0]), strict=True):
        assert new.name == old.name and new.positions == pytest.approx(old.positions, abs=1e-6)


def test_what_a_folder_may_hold_is_left_out_with_a_word(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Numbers that are not those of the source tell nothing of the axes: the blocks that rest flat do."""
    from block_cutting import read_and_cut
    from block_landings import DATA, FOUND, errors, of_both, tosses
    from blocks import flights
    from toss_files import again

    shipped = np.load(DATA)
    keys = {"position": "positions", "quaternion": "quaternions", "angle": "angles"}
    parts = [
        {to: shipped[own][a:b].astype(float) for to, own in keys.items()}
        for a, b in zip(shipped["starts"][:-1], shipped["starts"][1:], strict=True)
    ]
    one, free = parts[0], int(shipped["free"][0])
    hole = {key: np.where(np.arange(len(a)) == 7, np.nan, a.T).T for key, a in one.items()}
    parts += [
        {key: a[:1] for key, a in one.items()},
        hole,
        {key: a[-20:] for key, a in one.items()},  # at rest
        {key: a[:free] for key, a in one.items()},  # never at rest
        one | {"quaternion": -2.0 * one["quaternion"], "position": one["position"] + np.array([0.02, 0.0, 0.0])},
        one,
    ]
    columns = {key: np.concatenate([part[key] for part in parts]) for key in keys}
    columns["quaternion"] = columns["quaternion"][:, [3, 0, 1, 2]]
    columns["starts"] = np.cumsum([0, *(len(part["angle"]) for part in parts)])
    np.savez(tmp_path / "elbow_tosses.npz", **columns, toss=np.arange(5000, 5000 + len(parts)))
    found = tosses(tmp_path)
    told = capsys.readouterr().out
    assert f"{tmp_path}: 63 tosses, 18 free flights, 62 landings" in told
    for number, why in (
        (5060, "1 frames"),
        (5061, "no numbers"),
        (5062, "touches the table"),
        (5065, "toss 5000 again"),
    ):
        assert any(why in line and f"toss {number}:" in line for line in told.splitlines()), (number, why)
    assert "35 of 63 tosses are turned upright, as blocks lie that rest flat" in told
    alike = [np.array_equal(old.recorded_up, new.recorded_up) for old, new in zip(tosses(), found, strict=False)]
    assert sum(alike) == 59 and not alike[35]  # the last one in the axes that lean
    assert sum(again(toss.positions, [old.positions for old in tosses()]) for toss in found) == 59
    assert np.isfinite(errors(found[-1], of_both(FOUND))).all()
    assert len(flights(read_and_cut(tmp_path)[0])) == 18


def test_tosses_come_to_rest_nearer_than_without_physics() -> None:
    from block_landings import FEWEST, FOUND, errors, halves, of_both, without_physics

    seen, others = halves()
    assert (len(seen), len(others)) == (30, 30)
    group = [toss for toss in others if toss.free >= FEWEST]
    assert len(group) == 18
    off = np.array([errors(toss, of_both(FOUND)) for toss in group])
    plain = np.array([without_physics(toss)[1] for toss in group])
    assert off[:, 0].mean() < 0.5 * plain[:, 0].mean()
    assert off[:, 1].mean() < 0.6 * plain[:, 1].mean()


def test_second_block_starts_beside_the_hinge_of_the_first() -> None:
    """The middle between the blocks starts where flight shows it, and with its velocity."""
    from block_landings import DOWN, SOLVER, halves, scene_of
    from blocks import start_of

    toss = next(toss for toss in halves()[1] if toss.free >= 13)
    scene, start = scene_of(toss), start_of(toss, toss.free, DOWN)
    motion = sb.simulate(scene, toss.times[:5], SOLVER)
    middle = np.mean([scene.bodies[block].pose(motion)[0] for block in ("first", "second")], axis=0)
    assert middle[0] == pytest.approx(start.middle, abs=1e-12)
    assert np.abs(middle - toss.middle()[:5]).max() < 1e-3


def test_axes_of_the_tosses_are_those_of_the_table() -> None:
    """Blocks that rest flat do so in the tosses that were recorded in tilted axes as in the others."""
    from block_landings import tosses
    from blocks import LEVELED, UP, level
    from sheetbend.arrays.rotations import matrices_of

    assert level(True) @ UP == pytest.approx([0.0, 0.0, np.linalg.norm(UP)], abs=1e-12)
    leaning: dict[bool, list[float]] = {True: [], False: []}
    for toss in tosses():
        up = np.abs(matrices_of(toss.quaternions)[-1][2]).max()
        if up > 0.99:  # a face lies on the table
            leaning[int(toss.name.split()[1]) < LEVELED].append(float(np.degrees(np.arccos(min(up, 1.0)))))
    assert min(len(some) for some in leaning.values()) > 15
    assert max(np.median(some) for some in leaning.values()) < 1.0  # 2.3 in the axes of the recording


def test_table_is_as_high_as_the_lowest_corner_rests() -> None:
    from block_landings import CORNERS, FOUND, halves, of_both, predicted

    # One that ends where it did before the table was moved to its height.
    toss = next(toss for toss in halves()[1] if toss.free >= 17 and toss.recorded_up[2] < 1.0)
    rest = predicted(toss, of_both(FOUND))
    low = min(float(((x[-1] + CORNERS @ axes[-1].T) @ toss.recorded_up).min()) for x, axes in rest)
    assert abs(low) < 5e-4


def test_flights_between_impacts_are_free() -> None:
    from block_landings import DOWN, halves
    from block_landings_study import PULL, between

    toss = next(toss for toss in halves()[0] if toss.name == "toss 148")
    first, second = between(toss)
    assert len(first.times) == 17 and len(second.times) == 16
    middle = (second.positions + second.second()[0]) / 2.0
    pull = np.linalg.norm(np.diff(middle, 2, axis=0) * 148.0**2 - DOWN, axis=1)
    assert pull.max() <= PULL
