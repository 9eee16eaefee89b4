"""Exports of motion capture systems as they write them, and time stamps of robots."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import config
from sheetbend.errors import RecordingError
from sheetbend.recording.recording import Recording

FRAMES = 5
GRIPPER = np.array([300.0, 1200.0, -50.0]) + np.arange(FRAMES)[:, None]  # mm, y up
TOWEL = GRIPPER[:, None] - [[0.0, 100.0, 0.0], [0.0, 200.0, 0.0]]
LOST = 3  # frame in which the second marker was not seen


def motive(path: Path, header: str = "Length Units,Millimeters", timecode: bool = False, **changed: str) -> Path:
    """A take with a rigid body, where its solution expects a marker, two markers of the towel, and one never seen."""
    columns = [("Rigid Body", "gripper", "Rotation", axis, np.zeros(FRAMES)) for axis in "XYZW"]
    columns += [("Rigid Body", "gripper", "Position", "XYZ"[k], GRIPPER[:, k]) for k in range(3)]
    columns += [("Rigid Body", "gripper", "Mean Marker Error", "", np.full(FRAMES, 0.2))]
    columns += [("Rigid Body Marker", "gripper:Marker1", "Position", axis, np.zeros(FRAMES)) for axis in "XYZ"]
    columns += [("Rigid Body Marker", "gripper:Marker1", "Marker Quality", "", np.ones(FRAMES))]
    for name, x in {"towel:1": TOWEL[:, 0], "Unlabeled 1000": TOWEL[:, 1], "Unlabeled 7": None}.items():
        for k in range(3):
            values = np.full(FRAMES, np.nan) if x is None else x[:, k].copy()
            if name == "Unlabeled 1000":
                values[LOST] = np.nan
            columns.append(("Marker", name, "Position", "XYZ"[k], values))
    begin = ["Frame", "Time (Seconds)", *["TimeCode"] * timecode]
    blank = [""] * len(begin)
    rows = [
        [*blank[:1], "Type", *blank[2:], *(c[0] for c in columns)],
        [*blank[:1], "Name", *blank[2:], *(f'"{c[1]}"' for c in columns)],
        [*blank[:1], "ID", *blank[2:], *("9F:1" for _ in columns)],
        [*blank, *(c[2] for c in columns)],
        [*begin, *(c[3] for c in columns)],
    ]
    for n in range(FRAMES):
        cells = ["" if np.isnan(c[4][n]) else f"{c[4][n]:.6f}" for c in columns]
        rows.append([f"{n}", f"{n / 120:.6f}", *["15:26:46:12.02"] * timecode, *cells])
    text = f"\ufeffFormat Version,1.23,Take Name,swing 2,{header},Coordinate Space,Global\r\n\r\n"
    text += "".join(",".join(row) + "\r\n" for row in rows)
    for old, new in changed.items():
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("timecode", [False, True])
def test_a_take_of_motive(tmp_path: Path, timecode: bool) -> None:
    take = Recording.load(motive(tmp_path / "take.csv", timecode=timecode))
    assert take.markers == ("gripper", "towel:1", "Unlabeled 1000")
    assert take.positions[:, 0] == pytest.approx(1e-3 * GRIPPER)
    assert take.positions[:, 1] == pytest.approx(1e-3 * TOWEL[:, 0])
    assert take.mask[:, 2].tolist() == [n != LOST for n in range(FRAMES)]
    assert take.times == pytest.approx(np.arange(FRAMES) / 120, abs=1e-6)
    assert take.gravity.tolist() == [0.0, -9.81, 0.0]
    assert take.metadata == {"take": "swing 2"}
    take.save(tmp_path / "saved.npz")
    assert np.array_equal(Recording.load(tmp_path / "saved.npz").positions, take.positions, equal_nan=True)


def test_the_json_beside_a_take_tells_the_rest(tmp_path: Path) -> None:
    path = motive(tmp_path / "take.csv")
    path.with_suffix(".json").write_text(json.dumps({"clamped": ["gripper"], "gravity": [0, 0, -9.81], "units": "mm"}))
    take = Recording.load(path)
    assert take.clamped == (0,) and take.gravity.tolist() == [0.0, 0.0, -9.81]
    with pytest.raises(RecordingError, match="differ from the file's, mm"):
        Recording.load(path, units="m")


@pytest.mark.parametrize(
    ("header", "changed", "words"),
    [
        ("Rotation Type,XYZ", {}, "line 1: names no length unit"),
        ("Length Units,Feet", {}, "export in Meters, Centimeters, Millimeters"),
        ("Length Units,Meters", {"Frame,": "Index,"}, "no rows of types, names and axes"),
        ("Length Units,Meters", {"Position": "Speed"}, "line 7: has no columns X, Y, Z of a marker or rigid body"),
        ("Length Units,Meters", {"1202.000000": "12o2"}, "line 10: holds a cell that is not a number"),
        ("Length Units,Meters", {"3,0.025000,": "3,"}, "line 11: must have"),
    ],
)
def test_a_damaged_take_is_refused(tmp_path: Path, header: str, changed: dict, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(motive(tmp_path / "take.csv", header, **changed))


def turned_by(path: Path, quaternion: str) -> None:
    """Give the body of a take a rotation."""
    zeros = r"(\n\d+,[\d.]+)" + 4 * ",0\\.000000"
    path.write_text(re.sub(zeros, rf"\1,{quaternion}", path.read_text(encoding="utf-8")), encoding="utf-8")


def test_the_pose_of_a_rigid_body(tmp_path: Path) -> None:
    """The rotations of a take were not read: a rope in a hand with a body needed its markers."""
    quaternion = np.array([0.6, 0.0, 0.0, 0.8])
    path = motive(tmp_path / "take.csv")
    turned_by(path, "0.6,0.0,0.0,0.8")
    for tool in (sb.Tool.load(path), sb.Tool.load(path, body="gripper")):
        assert tool.times == pytest.approx(np.arange(FRAMES) / 120, abs=1e-6)
        assert tool.positions == pytest.approx(1e-3 * GRIPPER)
        assert tool.quaternions == pytest.approx(np.tile(quaternion, (FRAMES, 1)))
    with pytest.raises(RecordingError, match="name one of: gripper"):
        sb.Tool.load(path, body="hand")
    turned = motive(tmp_path / "euler.csv", **{",W": ",E"})
    with pytest.raises(RecordingError, match="rotations as quaternions"):
        sb.Tool.load(turned)


def test_a_rope_in_a_rigid_body_of_a_take(tmp_path: Path) -> None:
    """Its end follows the body, 5 cm beside its pivot."""
    path = motive(tmp_path / "take.csv")
    turned_by(path, "0,0,0,1")
    (tmp_path / "rope.toml").write_text(
        """
[experiment]
name = "held"
[[scene.tool]]
name = "hand"
file = "take.csv"
body = "gripper"
[[scene.rope]]
length = 0.2
segments = 4
density = 0.05
EI = 1e-3
start = [0.35, 1.2, -0.05]
direction = [0, -1, 0]
markers = { "towel:1" = 0.1, "Unlabeled 1000" = 0.2 }
[[scene.rope.grip]]
at = "start"
tool = "hand"
position = [0.05, 0.0, 0.0]
[[recording]]
file = "take.csv"
"""
    )
    study = config.load(tmp_path / "rope.toml")
    experiment = study.experiments[0]
    times = 8 * experiment.solver.h * np.arange(4)
    motion = sb.simulate(experiment.scene, times, experiment.solver)
    start = motion.positions[:, experiment.scene.ropes["rope"].particles[0]]
    assert start == pytest.approx(1e-3 * GRIPPER[0] + [0.05, 0.0, 0.0] + 0.12 * times[:, None], abs=1e-5)


ROWS = (
    'comment,"OptiTrack Export Data"\r\ncomment,rows\r\nrighthanded\r\ninfo,version,1.1\r\ninfo,framecount,3\r\n'
    'info,rigidbodycount,1\r\nrigidbody,"hand",1,3,0,0,0\r\n'
    'frame,0,0.0,1,1,0.1,0.2,0.3,0,0,0,1,0,0,0,2,1,2,3,4,"tip",5,6,7,9,""\r\n'
    'rigidbody,0,0.0,"hand",1,0,3,0,0,0\r\n'
    'frame,1,0.01,0,2,1.5,2,3,4,"tip",-1.#IND,-1.#IND,-1.#IND,9,""\r\n'
    'frame,2,0.02,1,1,0.2,0.2,0.3,0,0,0,1,0,0,0,1,5,6,8,9,""\r\n'
)


def test_a_take_of_the_first_motive(tmp_path: Path) -> None:
    path = tmp_path / "take.csv"
    path.write_text(ROWS, newline="")
    take = Recording.load(path)
    assert take.markers == ("hand", "tip", "marker 9") and take.times.tolist() == [0.0, 0.01, 0.02]
    assert take.mask.tolist() == [[True, True, True], [False, True, False], [True, False, True]]
    assert take.positions[0].tolist() == [[0.1, 0.2, 0.3], [1, 2, 3], [5, 6, 7]]
    assert take.gravity.tolist() == [0.0, -9.81, 0.0]
    path.write_text(ROWS.replace("righthanded", "lefthanded"), newline="")
    assert Recording.load(path).positions[0].tolist() == [[0.1, 0.2, -0.3], [1, 2, -3], [5, 6, -7]]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (',9,""\r\nrigidbody', "\r\nrigidbody", "line 8: is cut off"),
        ("0,0.0,1,1", "0,0.0,1.5,1", "line 8: must hold a whole number"),
        ("1.5,2", "x,2", "line 10: .*not a number"),
        ("frame,2,0.02", "frame,2,0.01", "line 11: must have a time later"),
        ('5,6,7,9,""', '5,6,7,9,"tip"', "line 8: repeats a marker"),
    ],
)
def test_a_damaged_take_of_the_first_motive_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in ROWS
    (tmp_path / "take.csv").write_text(ROWS.replace(old, new), newline="")
    with pytest.raises(RecordingError, match=words):
        Recording.load(tmp_path / "take.csv")


VICON = (
    "Segments\r\n100\r\n,,arm:hand,,,,,\r\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\r\n,,deg,deg,deg,mm,mm,mm\r\n"
    "11,0,1,2,3,4,5,6\r\n\r\n"
    "Trajectories\r\n100\r\n,,towel:a,,,towel:b,,,towel:c,,,towel:a,,\r\n"
    "Frame,Sub Frame,X,Y,Z,X,Y,Z,X,Y,Z,X',Y',Z'\r\n,,mm,mm,mm,mm,mm,mm,mm,mm,mm,mm/s,mm/s,mm/s\r\n"
    "11,0,1,2,3,4,5,6,,,,0,0,0\r\n12,0,1.5,2,3,,,,,,,0,0,0\r\n13,0,2,2,3,4,5,7,,,,0,0,0\r\n\r\n"
    "Devices\r\n1000\r\n,,Force\r\nFrame,Sub Frame,Fx\r\n,,N\r\n11,0,1\r\n"
)


def vicon(folder: Path, old: str = "", new: str = "") -> Path:
    path = folder / "trial.csv"
    path.write_text(VICON.replace(old, new) if old else VICON)
    return path


def test_a_trial_of_vicon(tmp_path: Path) -> None:
    trial = Recording.load(vicon(tmp_path))
    assert trial.markers == ("towel:a", "towel:b")
    assert trial.positions[:, 0].tolist() == [[1e-3, 2e-3, 3e-3], [1.5e-3, 2e-3, 3e-3], [2e-3, 2e-3, 3e-3]]
    assert trial.mask[:, 1].tolist() == [True, False, True]
    assert trial.times == pytest.approx([0.0, 0.01, 0.02]) and trial.gravity is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Trajectories", "Model Outputs", "has no section Trajectories"),
        ("11,0,1,2,3,4,5,6,,,,0,0,0\r\n", "\r\n", "has no rate, names, axes, units and frames"),
        ("s\r\n100", "s\r\nfast", "holds a cell that is not a number"),
        (",,mm,mm,mm,mm", ",,mm,mm,mm,in", "must name one length unit"),
        ("12,0,1.5,2,3,", "12,0,1.5,2,", "line 14: must have 14 cells"),
        (",X,Y,Z,X,Y,Z,X,Y,Z,", ",A,Y,Z,A,Y,Z,A,Y,Z,", "has no columns X, Y, Z of a marker"),
    ],
)
def test_a_damaged_trial_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(vicon(tmp_path, old, new))


QTM = (
    "FILE_VERSION\t2.0.0\r\nNO_OF_FRAMES\t3\r\nNO_OF_MARKERS\t2\r\nFREQUENCY\t100\r\nDESCRIPTION\t--\r\n"
    "TIME_STAMP\t2024-03-11, 14:12:11.123\t3501.2\r\nDATA_INCLUDED\t3D\r\nMARKER_NAMES\ttip\tT 2\r\n"
    "TRAJECTORY_TYPES\tMeasured\tMixed\r\nFrame\tTime\ttip X\ttip Y\ttip Z\tT 2 X\tT 2 Y\tT 2 Z\r\n"
    "1\t0.00000\t1.0\t2.0\t3.0\tNULL\tNULL\tNULL\r\n2\t0.01000\t1.5\t2.0\t3.0\t\t\t\r\n3\t0.02000\t2.0\t2.0\t3.0\t4\t5\t6\r\n"
)


def qtm(folder: Path, *changes: tuple[str, str]) -> Path:
    text = QTM
    for old, new in changes:
        assert re.search(old, text)
        text = re.sub(old, new, text)
    path = folder / "measurement.tsv"
    path.write_text(text, newline="")
    return path


NO_TIME = (r"\n\d\t0\.0\d000\t", "\n")
NO_HEAD = (r"Frame\tTime.*?\n", "")


@pytest.mark.parametrize(
    "changes",
    [(), (NO_HEAD,), (("Frame\tTime\t", ""), NO_TIME), (NO_HEAD, NO_TIME), (("\r\n", "\t\r\n"),), ((r"FILE.*\n", ""),)],
)
def test_a_measurement_of_qtm(tmp_path: Path, changes: tuple) -> None:
    """It was refused as a table whose first column is no time."""
    measured = Recording.load(qtm(tmp_path, *changes))
    assert measured.markers == ("tip", "T 2")
    assert measured.positions[:, 0].tolist() == [[1e-3, 2e-3, 3e-3], [1.5e-3, 2e-3, 3e-3], [2e-3, 2e-3, 3e-3]]
    assert measured.mask[:, 1].tolist() == [False, False, True]
    assert measured.times == pytest.approx([0.0, 0.01, 0.02]) and measured.gravity is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("FREQUENCY", "SPEED", "lacks FREQUENCY or MARKER_NAMES"),
        ("FREQUENCY\t100", "FREQUENCY\t0", "line 4: must be the frames per second"),
        ("MARKER_NAMES", "BODY_NAMES", "holds poses of rigid bodies"),
        ("2\t0.01000\t1.5", "2\t0.01000\t1.5\t7", "line 12: must have 6 cells for 2 markers"),
        ("2\t0.01000\t1.5", "2\t0.01000\t1o5", "line 12: holds a cell that is not a number"),
        ("(?s)Frame.*", "", "has a header but no rows"),
    ],
)
def test_a_damaged_measurement_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        Recording.load(qtm(tmp_path, (old, new)))


@pytest.mark.parametrize(
    ("name", "stamps", "seconds"),
    [
        ("%time", ["1709304245123456789", "1709304245133456789"], [0.0, 0.01]),
        ("time_ns", ["1709304245123456789", "1709304245123456790"], [0.0, 1e-9]),
        ("Timestamp [us]", ["5", "10005"], [0.0, 0.01]),
        ("time_ms", ["0.0", "16.7"], [0.0, 0.0167]),
        ("Time (s)", ["1.5", "2.5"], [1.5, 2.5]),
    ],
)
def test_time_stamps_of_other_units(tmp_path: Path, name: str, stamps: list, seconds: list) -> None:
    path = tmp_path / "bag.csv"
    path.write_text(f"{name},field.corner.x,field.corner.y,field.corner.z\n{stamps[0]},1,2,3\n{stamps[1]},4,5,6\n")
    recording = Recording.load(path)
    assert recording.times.tolist() == seconds
    assert recording.markers == ("field.corner",) and recording.positions[1].tolist() == [[4.0, 5.0, 6.0]]


def test_nanoseconds_are_not_taken_for_seconds(tmp_path: Path) -> None:
    path = tmp_path / "bag.csv"
    path.write_text("time,a_x,a_y,a_z\n1709304245123456789,1,2,3\n")
    with pytest.raises(RecordingError, match="name the column time_ns"):
        Recording.load(path)
