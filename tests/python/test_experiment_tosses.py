"""A tossed cube: gravity from four free flights, a prediction of the others, and where tosses come to rest."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "experiments" / "tosses"))


def test_gravity_of_a_few_flights_predicts_the_others_from_their_first_frames() -> None:
    from cube import experiment, flights, parameters, turning
    from tosses import predicted

    every = flights()
    assert len(every) == 61
    rate, half = turning(every[:30])
    assert rate == pytest.approx(turning(every[30:])[0], abs=0.01) and half < 0.004  # rad/s
    group = [experiment(f.steady(rate)) for f in every[:6:2]]
    found = sb.fit(group, parameters=parameters(["gravity", "cube_inertia_2", "cube_inertia_3"]), refine=False)
    gravity = found["gravity"]
    assert gravity.value == pytest.approx(9.62, abs=0.06)
    assert found.values["cube_inertia_2"] == pytest.approx(found.values["cube_inertia_3"], rel=0.15)
    assert "cube_inertia_1" in found.report()  # what the ratios rest on
    errors = np.array([predicted(f, gravity.value, 0.02, (0.0, 0.0, 0.006), rate) for f in every[30:45]])
    assert np.median(errors[:, 0]) < 0.4e-3
    assert np.median(errors[:, 1]) < 0.5
    assert errors[:, 0].max() < 1.6e-3
    assert errors[:, 1].max() < 2.0


def test_tosses_come_to_rest_as_predicted() -> None:
    from landings import FROM, INERTIA, errors, scene_of, tosses, without_physics

    every = tosses()
    assert len(every) == 63
    group = every[1:16:2]
    found = FROM | {"table_friction": 0.1805, "table_contact_dissipation": 3.36, "rounding": 3.1e-3, "stretch": 3e-4}
    found |= {f"cube_inertia_{axis}": 1.6 * INERTIA for axis in (1, 2, 3)} | {"cube_center_z": 6.4e-3}
    off = np.array([errors(toss, found, scene_of(toss, toss.free)) for toss in group])  # as in expected/landings.txt
    assert off[:, 0].mean() < 10.0  # mm
    assert off[:, 1].mean() < 18.0
    assert off[:, 0].mean() < 0.07 * np.mean([without_physics(toss)[1, 0] for toss in group])
    centered = np.array([errors(toss, found | {"cube_center_z": 0.0}, scene_of(toss, toss.free)) for toss in group])
    assert off[:, 2].mean() < centered[:, 2].mean()  # the attitude tells where the center of mass is


def test_tosses_of_another_folder_are_cut_as_the_shipped_ones(tmp_path: Path) -> None:
    """Each begins two frames later here, in the columns of the source."""
    from landings import tosses

    shipped = tosses()[:3]
    ends = np.cumsum([0] + [len(toss.times) - 2 for toss in shipped])
    turns = np.concatenate([toss.quaternions[2:] for toss in shipped])[:, [3, 0, 1, 2]]
    places = np.concatenate([toss.positions[2:] for toss in shipped])
    columns = {"starts": ends, "toss": np.array([7, 8, 9]), "position": places, "quaternion": turns}
    np.savez(tmp_path / "cube_tosses.npz", **columns)
    for old, new, number in zip(shipped, tosses(tmp_path), (7, 8, 9), strict=True):
        frames = len(new.times)
        assert new.name == f"toss {number}" and 0 <= len(old.times) - 2 - frames <= 3
        assert np.array_equal(new.positions, old.positions[-frames:])
        assert np.array_equal(new.quaternions, old.quaternions[-frames:])
        assert len(old.times) - old.free == frames - new.free  # the same first contact


def nasty(x: np.ndarray, q: np.ndarray, free: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """What a folder may hold beside good tosses, from a good one with `free` frames before contact."""
    hole, still, zero = x.copy(), x.copy(), q.copy()
    hole[3, 1] = np.nan
    still[:] = x[-1]
    zero[5] = 0.0
    return [
        (x[:1], q[:1]),  # one frame
        (x[:0], q[:0]),
        (hole, q),
        (x, zero),
        (x[:free], q[:free]),  # no contact
        (x[free + 2 :], q[free + 2 :]),  # begins in contact
        (still, np.tile(q[-1], (len(q), 1))),
        (x + np.array([0.01, 0.0, 0.0]), -3.0 * q),  # not normalized, of the other sign
        (x, q),  # twice
    ]


def in_columns(parts: list[tuple[np.ndarray, np.ndarray]], numbers: np.ndarray) -> dict[str, np.ndarray]:
    """Of the source: quaternions as (w, x, y, z)."""
    places, turns = (np.concatenate(column) for column in zip(*parts, strict=True))
    starts = np.cumsum([0, *(len(x) for x, _ in parts)])
    return {"starts": starts, "toss": numbers, "position": places, "quaternion": turns[:, [3, 0, 1, 2]]}


def test_what_a_folder_may_hold_is_left_out_with_a_word(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from cube import flights
    from landings import errors, scene_of, tosses
    from toss_files import again

    shipped = tosses()[:10]
    good = [(toss.positions, toss.quaternions) for toss in shipped]
    parts = [*good, *nasty(*good[0], shipped[0].free)]
    columns = in_columns(parts, 1000 - np.arange(len(parts)))
    np.savez(tmp_path / "cube_tosses.npz", **columns)
    found = tosses(tmp_path)
    told = capsys.readouterr().out
    assert f"{tmp_path}: 14 tosses, 12 free flights, 11 landings" in told
    for number, why in (
        (990, "1 frames"),
        (989, "0 frames"),
        (988, "no numbers"),
        (987, "no numbers"),
        (986, "never touches the table"),
        (985, "begins on the table"),
        (984, "begins on the table"),
        (982, "is toss 1000 again"),
    ):
        assert any(line.endswith(why) and f"toss {number}:" in line for line in told.splitlines()), (number, why)
    assert "quaternions were not of length one" in told
    assert [toss.name for toss in found] == [f"toss {n}" for n in (*range(1000, 990, -1), 983)]
    known = [toss.positions for toss in shipped]
    assert [again(toss.positions, known) for toss in found] == [True] * 10 + [False]  # by its poses, not by its number
    assert np.isfinite(errors(found[-1], {}, scene_of(found[-1], found[-1].free))).all()
    assert len(flights(tmp_path)) == 12

    np.savez(tmp_path / "cube_tosses.npz", **columns, rate_hz=120.0)
    with pytest.raises(SystemExit, match="states 120 Hz"):
        tosses(tmp_path)
    np.savez(tmp_path / "cube_tosses.npz", **columns | {"position": columns["position"][:, :2]})
    with pytest.raises(SystemExit, match="position has the shape"):
        tosses(tmp_path)
    (tmp_path / "cube_tosses.npz").write_bytes(b"no archive")
    with pytest.raises(SystemExit, match="cannot be read"):
        tosses(tmp_path)
    every_second = in_columns([(x[::2], q[::2]) for x, q in good], np.arange(10))
    np.savez(tmp_path / "cube_tosses.npz", **every_second)
    capsys.readouterr()
    tosses(tmp_path)
    assert "flights fall with 3" in capsys.readouterr().out  # as 148 Hz would have it: the frames are of 74 Hz


def test_first_frames_after_contact_tell_that_the_cube_is_hollow(monkeypatch: pytest.MonkeyPatch) -> None:
    """With half as many substeps as the experiment."""
    import landings
    from landings import INERTIA, SOLVER, fitted, tosses

    monkeypatch.setattr(landings, "SOLVER", replace(SOLVER, h=2 * SOLVER.h))
    found = fitted(tosses()[:16:2])
    for axis in (1, 2, 3):
        estimate = found[f"cube_inertia_{axis}"]
        assert 1.3 < estimate.value / INERTIA < 1.9
    assert 0.15 < found.values["table_friction"] < 0.19
    assert 2e-3 < found.values["cube_center_z"] < 10e-3
