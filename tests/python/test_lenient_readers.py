"""Recordings as laboratories write them: other names, units and decimal marks, lost markers at zero, arrays alone."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from sheetbend import Recording, RecordingError

X = np.round(np.random.default_rng(0).normal(size=(4, 2, 3)), 3)
TIMES = [0.0, 0.01, 0.02, 0.03]


def table(header: str, rows: list[list[float]], delimiter: str = ",", comma: bool = False) -> str:
    text = [delimiter.join(f"{v}".replace(".", "," if comma else ".") for v in row) for row in rows]
    return "\n".join([header, *text]) + "\n"


def rows(extra: int = 0) -> list[list[float]]:
    """Times, `extra` further cells, and the places."""
    return [[t, *[7.0] * extra, *frame.ravel().tolist()] for t, frame in zip(TIMES, X, strict=True)]


@pytest.mark.parametrize(
    ("header", "markers", "scale"),
    [
        ("t,x1,y1,z1,x2,y2,z2", ("m1", "m2"), 1.0),
        ("t,1x,1y,1z,2x,2y,2z", ("m1", "m2"), 1.0),
        ("time,M1_X (mm),M1_Y (mm),M1_Z (mm),M2_X (mm),M2_Y (mm),M2_Z (mm)", ("M1", "M2"), 1e-3),
        ("time,a_x_cm,a_y_cm,a_z_cm,b_x_cm,b_y_cm,b_z_cm", ("a", "b"), 1e-2),
        ("time,a_x [in],a_y [in],a_z [in],b_x [in],b_y [in],b_z [in]", ("a", "b"), 0.0254),
        ("Temps [s],X_a,Y_a,Z_a,X_b,Y_b,Z_b", ("a", "b"), 1.0),
    ],
)
def test_columns_as_people_name_them(tmp_path: Path, header: str, markers: tuple, scale: float) -> None:
    """`x1` was refused, and so were units and times in other languages."""
    (tmp_path / "take.csv").write_text(table(header, rows()))
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == markers
    assert np.allclose(got.positions, scale * X, rtol=0, atol=1e-15)
    assert got.times.tolist() == TIMES


def test_semicolons_and_decimal_commas(tmp_path: Path) -> None:
    header = "Zeit [s];a_x [mm];a_y [mm];a_z [mm];b_x [mm];b_y [mm];b_z [mm]"
    (tmp_path / "take.csv").write_text(table(header, rows(), ";", comma=True), encoding="utf-8-sig")
    got = Recording.load(tmp_path / "take.csv")
    assert np.allclose(got.positions, 1e-3 * X, rtol=0, atol=1e-15) and got.times.tolist() == TIMES
    mixed = "time;a_x;a_y;a_z\n0;1,5;2.5;3\n"
    (tmp_path / "take.csv").write_text(mixed)
    with pytest.raises(RecordingError, match=r"line 2: holds a cell that is not a number .*point"):
        Recording.load(tmp_path / "take.csv")


def test_units_in_some_columns_alone_are_refused(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("time,a_x [mm],a_y [mm],a_z\n0,1,2,3\n")
    with pytest.raises(RecordingError, match="must name one length unit in all columns"):
        Recording.load(tmp_path / "take.csv")


def test_poses_of_ros_are_read_as_places(tmp_path: Path) -> None:
    of = [f"field.{n}.{part}" for n in ("left", "right") for part in ("position.x", "position.y", "position.z")]
    header = ",".join(["%time", "field.header.seq", *of[:3], "field.left.orientation.w", *of[3:]])
    first = 1_700_000_000_000_000_000
    lines = [header]
    for k, frame in enumerate(X):
        a, b = (",".join(map(str, place)) for place in frame)
        lines.append(f"{first + 10_000_000 * k},{k},{a},1.0,{b}")
    (tmp_path / "take.csv").write_text("\n".join(lines))
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("left", "right")
    assert np.array_equal(got.positions, X) and np.allclose(got.times, TIMES, rtol=0, atol=1e-12)


def test_columns_beside_coordinates_are_not_read(tmp_path: Path) -> None:
    """A rotation of a tool and errors of cameras were refused as a marker without an x."""
    header = "time,a_x,a_y,a_z,a_qx,a_qy,a_qz,a_qw,b_x,b_y,b_z,b_error,fnum"
    lines = [[t, *a, 0.0, 0.0, 0.0, 1.0, *b, 0.4, k] for k, (t, (a, b)) in enumerate(zip(TIMES, X, strict=True))]
    (tmp_path / "take.csv").write_text(table(header, lines))
    found = Recording.load(tmp_path / "take.csv")
    assert found.markers == ("a", "b") and found.metadata["columns_not_read"][-2:] == ["b_error", "fnum"]
    np.testing.assert_array_equal(found.positions, X)
    (tmp_path / "take.csv").write_text(table("time,a_x,a_y,a_height,b_x,b_y,b_z", rows()))
    with pytest.raises(RecordingError, match="must have the column 'a_z' there"):
        Recording.load(tmp_path / "take.csv")


@pytest.mark.parametrize("header", ["timestamp,marker_id,x,y,z", "Time_Stamp [s],ID,pos_x [m],pos_y [m],pos_z [m]"])
def test_a_row_for_each_marker_under_other_names(tmp_path: Path, header: str) -> None:
    """These were refused, with the advice to name columns that a table of one row per marker does not have."""
    lines = [[t, k, *place] for t, frame in zip(TIMES, X, strict=True) for k, place in enumerate(frame)]
    (tmp_path / "take.csv").write_text(table(header, lines))
    found = Recording.load(tmp_path / "take.csv")
    np.testing.assert_array_equal(found.positions, X)
    np.testing.assert_allclose(found.times, TIMES)


def test_poses_of_a_body_are_refused_with_where_they_go(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text("time,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n")
    with pytest.raises(RecordingError, match=r"poses of a body.*--poses"):
        Recording.load(tmp_path / "take.csv")


@pytest.mark.parametrize("suffix", [".csv", ".txt", ".tsv"])
def test_frames_count_at_the_rate_of_the_json(tmp_path: Path, suffix: str) -> None:
    header = "Frame\ta_x\ta_y\ta_z\tb_x\tb_y\tb_z\t"
    text = table(header, [[k + 10, *frame.ravel().tolist()] for k, frame in enumerate(X)], "\t")
    path = tmp_path / f"take{suffix}"
    path.write_text(text.replace("\n", "\t\n").replace("\t\t\n", "\t\n"))
    with pytest.raises(RecordingError, match=r'first column is time .*write {"rate": 100} .* into take.json'):
        Recording.load(path)
    path.with_suffix(".json").write_text(json.dumps({"rate": 100}))
    got = Recording.load(path)
    assert np.allclose(got.times, TIMES, rtol=0, atol=1e-15) and np.array_equal(got.positions, X)


def test_an_index_before_the_time_is_not_read(tmp_path: Path) -> None:
    text = table(",time,a_x,a_y,a_z,b_x,b_y,b_z", [[k, *row] for k, row in enumerate(rows())])
    (tmp_path / "take.csv").write_text(text)
    assert Recording.load(tmp_path / "take.csv").times.tolist() == TIMES


@pytest.mark.parametrize("lost", [True, False])
def test_zeros_are_lost_markers_where_nothing_else_is_near(tmp_path: Path, lost: bool) -> None:
    """A marker that is at the origin for a while, and moves on from there, is seen."""
    x = np.maximum(np.arange(40) - 8, 0)[:, None] * [0.0, 0.0, 0.01] + (1.0 if lost else 0.0)
    if lost:
        x[5:9] = 0.0
    text = table("time,a_x,a_y,a_z", [[k / 100, *place.tolist()] for k, place in enumerate(x)])
    (tmp_path / "take.csv").write_text(text)
    seen = Recording.load(tmp_path / "take.csv").mask[:, 0]
    assert np.flatnonzero(~seen).tolist() == ([5, 6, 7, 8] if lost else [])


@pytest.mark.parametrize("swapped", [False, True])
def test_an_array_alone(tmp_path: Path, swapped: bool) -> None:
    path = tmp_path / "take.npy"
    np.save(path, np.swapaxes(X, 1, 2) if swapped else X)
    with pytest.raises(RecordingError, match=r'does not say the rate .*write {"rate": 100'):
        Recording.load(path)
    (tmp_path / "take.json").write_text(json.dumps({"rate": 100, "units": "mm"}))
    got = Recording.load(path)
    assert np.array_equal(got.positions, 1e-3 * X) and np.allclose(got.times, TIMES, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((4, 6)), r"shape \(frames, markers, 3\) \(got \(4, 6\)\)"),
        (np.zeros((200, 10, 3)), "far more markers than frames"),
        (np.array([[["a", "b", "c"]]]), "must have the shape"),
    ],
)
def test_an_array_of_another_shape_is_refused(tmp_path: Path, array: np.ndarray, words: str) -> None:
    np.save(tmp_path / "take.npy", array if len(array) < 100 else np.swapaxes(array, 0, 1))
    with pytest.raises(RecordingError, match=words):
        Recording.load(tmp_path / "take.npy")


def take_of_motive(path: Path, times: np.ndarray, markers: dict[str, np.ndarray]) -> None:
    """A take of Motive 3 in m, of markers (frames, 3)."""
    head = "Format Version,1.24,Take Name,take,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global"
    columns = [(name, axis) for name in markers for axis in "XYZ"]
    above = [
        [",Type", *("Marker" for _ in columns)],
        [",Name", *(name for name, _ in columns)],
        [",ID", *("1" for _ in columns)],
        [",Parent", *("" for _ in columns)],
        [",", *("Position" for _ in columns)],
        ["Frame,Time (Seconds)", *(axis for _, axis in columns)],
    ]
    table = np.concatenate(list(markers.values()), axis=1)
    cells = [
        [str(k), f"{t:.6f}", *("" if np.isnan(v) else repr(v) for v in row)]
        for k, (t, row) in enumerate(zip(times, table.tolist(), strict=True))
    ]
    path.write_text("\n".join([head, "", *(",".join(row) for row in above + cells)]) + "\n")


def test_unlabeled_markers_that_come_back_under_another_number_are_joined(tmp_path: Path) -> None:
    """Each piece was a marker of its own: a rope of ten markers had sixteen, and no length."""
    t = np.arange(240) / 120
    whole = np.stack([[0.1 * k + 0.0 * t, 1.0 - 0.05 * k + 0.0 * t, 0.2 * np.sin(4.0 * t + k)] for k in range(3)])
    whole = np.moveaxis(whole, 1, 2)
    pieces = {f"Unlabeled {1000 + k}": whole[k].copy() for k in range(3)}
    pieces["Unlabeled 1001"][100:] = np.nan
    for name, start, stop in (("Unlabeled 1010", 112, 180), ("Unlabeled 1011", 186, 240)):
        pieces[name] = np.full_like(whole[1], np.nan)
        pieces[name][start:stop] = whole[1, start:stop]
    pieces["Hand:Marker1"], pieces["Hand:Marker2"] = (np.full_like(whole[0], np.nan) for _ in range(2))
    pieces["Hand:Marker1"][:100] = whole[0, :100] + [0.0, 0.3, 0.0]
    pieces["Hand:Marker2"][112:] = whole[0, 112:] + [0.0, 0.3, 0.0]  # has a label, and is another one
    take_of_motive(tmp_path / "take.csv", t, pieces)
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("Unlabeled 1000", "Unlabeled 1001", "Unlabeled 1002", "Hand:Marker1", "Hand:Marker2")
    assert got.metadata["joined"] == {"Unlabeled 1001": ["Unlabeled 1010", "Unlabeled 1011"]}
    lost = np.flatnonzero(~got.mask[:, 1])
    assert lost.tolist() == [*range(100, 112), *range(180, 186)]
    assert np.array_equal(got.positions[:100, 1], whole[1, :100]) and np.array_equal(
        got.positions[200, 1], whole[1, 200]
    )


def test_a_marker_that_comes_back_elsewhere_is_another_one(tmp_path: Path) -> None:
    t = np.arange(60) / 120
    far = {
        "Unlabeled 1": np.full((60, 3), 0.5),
        "Unlabeled 2": np.full((60, 3), 0.9),
        "Unlabeled 3": np.full((60, 3), 1.0),
    }
    far["Unlabeled 1"][30:], far["Unlabeled 2"][:40] = np.nan, np.nan
    take_of_motive(tmp_path / "take.csv", t, far)
    got = Recording.load(tmp_path / "take.csv")
    assert len(got.markers) == 3 and "joined" not in got.metadata


def test_zeros_of_a_trc_file_are_lost_markers(tmp_path: Path) -> None:
    head = [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "DataRate\tUnits",
        "100\tmm",
        "Frame#\tTime\ttip\t\t",
        "\t\tX1\tY1\tZ1",
    ]
    rows = [f"{k + 1}\t{k / 100}\t" + ("0\t0\t0" if k in (7, 8) else f"{k}\t900\t100") for k in range(30)]
    (tmp_path / "take.trc").write_text("\n".join([*head, *rows]) + "\n")
    assert np.flatnonzero(~Recording.load(tmp_path / "take.trc").mask[:, 0]).tolist() == [7, 8]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("take.mat", "loadmat"),
        ("take.bag", "export the poses as CSV"),
        ("a.toml", "is a configuration"),
        ("a.json", "json.load"),
    ],
)
def test_files_that_are_not_read_say_how_to_convert_them(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(RecordingError, match=rf"suffix that no reader knows.*{words}"):
        Recording.load(tmp_path / name)


def test_a_cell_of_many_digits_is_refused_at_once(tmp_path: Path) -> None:
    """The search for decimal commas took the square of its length: 22 s for 65,000 digits, found by fuzz.py."""
    (tmp_path / "take.csv").write_text("%time\ta.x\ta.y\ta.z\n1\t1\t2\t3\n" + "1" * 130_000 + "\n")
    with pytest.raises(RecordingError, match="must have 4 cells"):
        Recording.load(tmp_path / "take.csv")


def test_cells_that_say_that_a_marker_is_not_seen(tmp_path: Path) -> None:
    cells = ["NA,NA,NA", "n/a,N/A,null", "None,none,NULL", "1,2,3"]
    text = "time,a_x,a_y,a_z\n" + "".join(f"{t},{row}\n" for t, row in zip(TIMES, cells, strict=True))
    (tmp_path / "take.csv").write_text(text)
    assert Recording.load(tmp_path / "take.csv").mask[:, 0].tolist() == [False, False, False, True]


def test_seconds_under_the_name_of_nanoseconds_are_refused(tmp_path: Path) -> None:
    """`%time` in seconds made a recording at 1e11 Hz, and `sheetbend new` asked for 126 GB."""
    stamps = "".join(f"{1700000000 + k / 100:.2f},{k},2,3\n" for k in range(12))
    (tmp_path / "bag.csv").write_text("%time,a.x,a.y,a.z\n" + stamps)
    with pytest.raises(RecordingError, match=r"line 3: has a time in ns, 1e-11 s after.*name the column"):
        Recording.load(tmp_path / "bag.csv")


@pytest.mark.parametrize("header", ["a_x,a_y,b_x,b_y", "a x [mm],a y [mm],b x [mm],b y [mm]", "xa,ya,xb,yb"])
def test_a_table_of_x_and_y_alone_lies_in_a_plane(tmp_path: Path, header: str) -> None:
    """As one camera tracks it."""
    (tmp_path / "flat.csv").write_text(f"t,{header}\n0,1,2,3,4\n1,,,5,6\n")
    found = Recording.load(tmp_path / "flat.csv")
    scale = 1e-3 if "mm" in header else 1.0
    assert found.markers == ("a", "b")
    assert found.positions[0].tolist() == [[scale, 2 * scale, 0.0], [3 * scale, 4 * scale, 0.0]]
    assert found.mask.tolist() == [[True, True], [False, True]]


def test_a_table_of_two_markers_in_a_plane_and_one_in_space(tmp_path: Path) -> None:
    (tmp_path / "flat.csv").write_text("t,a_x,a_y,b_x,b_y,b_z\n0,1,2,3,4,5\n")
    with pytest.raises(RecordingError, match=r"only x and y of a marker.*x and y of all"):
        Recording.load(tmp_path / "flat.csv")


def test_a_voltage_is_not_in_inches(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("t,voltage_in\n0,1\n1,2\n")
    with pytest.raises(RecordingError, match="does not say that it is a length"):
        Recording.load(tmp_path / "log.csv")
    (tmp_path / "log.csv").write_text("t,distance_in\n0,1\n1,2\n")
    assert Recording.load(tmp_path / "log.csv").positions[1, 0, 2] == pytest.approx(2 * 0.0254)


SHEET = (
    "Test 7: cable in a vise;;;;;;\r\n"
    "# one camera;;;;;;\r\n"
    ";;;;;;\r\n"
    "Zeit [ms];a X [mm];a Y [mm];a Z [mm];b X [mm];b Y [mm];b Z [mm]\r\n"
    "0,0;1,5;2;3;4;5;6\r\n"
    "\r\n"
    "10,0;;;;4;5;6,25\r\n"
    ";;;;;;\r\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_a_sheet_with_a_title_above_its_table(tmp_path: Path, encoding: str) -> None:
    """A title, lines of delimiters alone and Windows' encodings were refused."""
    (tmp_path / "take.csv").write_bytes(SHEET.replace("vise", "Schraubstock, 5 °C").encode(encoding))
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("a", "b") and got.times.tolist() == [0.0, 0.01]
    assert np.allclose(got.positions[0], [[1.5e-3, 2e-3, 3e-3], [4e-3, 5e-3, 6e-3]], rtol=0, atol=1e-18)
    assert got.mask.tolist() == [[True, True], [False, True]]


@pytest.mark.parametrize("above", ["Time;12:30\n", "Subject;7\nTime;12:30\n", "time;a;;;b;;\n"])
def test_a_time_of_day_above_the_header(tmp_path: Path, above: str) -> None:
    """It was taken as the header, because it begins with a time and has numbers below it."""
    header = "time;a_x;a_y;a_z;b_x;b_y;b_z\n"
    (tmp_path / "take.csv").write_text(above + header + "0;1;2;3;4;5;6\n1;1;2;3;4;5;6\n")
    assert Recording.load(tmp_path / "take.csv").markers == ("a", "b")


@pytest.mark.parametrize(
    "header",
    [
        "Messung 7;;;;;;\n;a;;;b;;\nZeit [ms];X [mm];Y [mm];Z [mm];X [mm];Y [mm];Z [mm]\n",
        ";a;a;a;b;b;b\nt / ms;x;y;z;x;y;z\n;mm;mm;mm;mm;mm;mm\n",
        "time;a_x;a_y;a_z;b_x;b_y;b_z\n[ms];[mm];[mm];[mm];[mm];[mm];[mm]\n".replace("time", "time in ms"),
        "Time (msec);a_x / mm;a_y / mm;a_z / mm;b_x in mm;b_y in mm;b_z in mm\n",
    ],
)
def test_a_header_of_several_rows(tmp_path: Path, header: str) -> None:
    text = header + "\n".join(table("", rows(), ";").replace(" ", "").split("\n")[1:])
    (tmp_path / "take.csv").write_text(text.replace("0.01;", "10;").replace("0.02;", "20;").replace("0.03;", "30;"))
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("a", "b")
    assert np.allclose(got.times, TIMES, rtol=0, atol=1e-15)
    assert np.allclose(got.positions, 1e-3 * X, rtol=0, atol=1e-15)


@pytest.mark.parametrize("header", ["Time (s);a_x;a_y;a_z\nms;mm;mm;mm", "Time;a_x [mm];a_y [mm];a_z [mm]\ns;m;m;m"])
def test_units_that_contradict_the_header_are_refused(tmp_path: Path, header: str) -> None:
    """The row below was passed over, and times in ms were taken as s."""
    (tmp_path / "take.csv").write_text(f"{header}\n0;1;2;3\n10;1;2;3\n")
    with pytest.raises(RecordingError, match="line 2: holds a cell that is not a number"):
        Recording.load(tmp_path / "take.csv")
    same = header.replace("\nms", "\ns").replace("s;m;m;m", "s;mm;mm;mm")
    (tmp_path / "take.csv").write_text(f"{same}\n0;1;2;3\n10;1;2;3\n")
    got = Recording.load(tmp_path / "take.csv")
    assert got.times.tolist() == [0.0, 10.0] and got.positions[0, 0] == pytest.approx([1e-3, 2e-3, 3e-3])


@pytest.mark.parametrize("micro", ["u", "\N{MICRO SIGN}", "\N{GREEK SMALL LETTER MU}"])
def test_microseconds(tmp_path: Path, micro: str) -> None:
    """Those of the Greek letter were taken as seconds."""
    (tmp_path / "take.csv").write_text(f"Time [{micro}s],a_x,a_y,a_z\n0,1,2,3\n10000,1,2,3\n", encoding="utf-8")
    assert Recording.load(tmp_path / "take.csv").times.tolist() == [0.0, 0.01]


def test_axes_without_names_are_refused(tmp_path: Path) -> None:
    """Two markers whose names nothing tells."""
    (tmp_path / "take.csv").write_text("t;x;y;z;x;y;z\n0;1;2;3;4;5;6\n")
    with pytest.raises(RecordingError, match="twice"):
        Recording.load(tmp_path / "take.csv")


@pytest.mark.parametrize("title", ["Test 7", "Test 7;", "Time;12:00\nSensor;laser 1", "Time\n12:00\n\nSensor: laser 1"])
@pytest.mark.parametrize("units", ["Zeit [s];Weg [mm]", "Zeit;Weg\ns;mm"], ids=["in one row", "below"])
def test_one_column_below_a_title(tmp_path: Path, title: str, units: str) -> None:
    """The header below a title had to have four cells, and a title that begins with a time was taken for the header."""
    (tmp_path / "take.csv").write_text(f"{title}\n{units}\n0,00;1,5\n0,01;2,5\n")
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == ("Weg",) and got.times.tolist() == [0.0, 0.01]
    assert got.positions[:, 0, 2] == pytest.approx([1.5e-3, 2.5e-3])


@pytest.mark.parametrize(
    ("name", "marker", "axis", "scale"),
    [
        ("distance", "distance", 2, 1.0),
        ("distance [mm]", "distance", 2, 1e-3),
        ("time_distance_mm", "time_distance", 2, 1e-3),
        ("Laser 1 (mm)", "Laser 1", 2, 1e-3),
        ("tip_x", "tip_x", 0, 1.0),
        ("Auslenkung / mm", "Auslenkung", 2, 1e-3),
    ],
)
def test_one_column_is_one_coordinate(tmp_path: Path, name: str, marker: str, axis: int, scale: float) -> None:
    """The file of a laser was refused: three columns per marker."""
    (tmp_path / "take.csv").write_text(f"time,{name}\n0,1\n0.01,2\n0.02,\n0.03,0\n")
    got = Recording.load(tmp_path / "take.csv")
    assert got.markers == (marker,) and got.mask[:, 0].tolist() == [True, True, False, True]
    assert got.positions[got.mask[:, 0], 0, axis] == pytest.approx([scale, 2 * scale, 0.0])
    assert not np.delete(got.positions[got.mask[:, 0], 0], axis, axis=1).any()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("angle", "does not say that it is a length"),
        ("angle [deg]", "must name a length unit"),
        ("distance [um]", "must name a length unit"),
        ("force_n", "must name a length unit"),
        ("laser (V)", "must name a length unit"),
    ],
)
def test_one_column_that_is_no_length_is_refused(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "take.csv").write_text(f"time,{name}\n0,1\n0.01,2\n")
    with pytest.raises(RecordingError, match=words):
        Recording.load(tmp_path / "take.csv")


def test_quoted_decimal_commas_between_commas(tmp_path: Path) -> None:
    """Google's tables in a language with decimal commas export such files."""
    file = tmp_path / "take.csv"
    file.write_text('time,a_x,a_y,a_z\n0,"0,5","0,25",3\n"0,01","0,5","-0,25",3\n')
    got = Recording.load(file)
    assert got.positions[:, 0].tolist() == [[0.5, 0.25, 3.0], [0.5, -0.25, 3.0]] and got.times.tolist() == [0.0, 0.01]
    file.write_text('time,a_x,a_y,a_z\n0,"1,040",250,3\n')  # a thousand, or one and a bit?
    with pytest.raises(RecordingError, match="holds a cell that is not a number"):
        Recording.load(file)


def test_quoted_cells_of_three_decimals_and_names_with_commas(tmp_path: Path) -> None:
    """A file that is written to the millimeter was refused as one of thousands, and a marker "arm,1" became arm.1."""
    file = tmp_path / "take.csv"
    file.write_text('time,a_x,a_y,a_z\n0,"0,512","1,250",3\n1,"0,513","1,251",3\n')
    assert Recording.load(file).positions[0, 0].tolist() == [0.512, 1.25, 3.0]
    file.write_text('time,marker,x,y,z\n0,"arm,1",1,0,0\n1,"arm,1",1,0,1\n')
    assert Recording.load(file).markers == ("arm,1",)


def test_decimal_commas_that_split_cells_are_named(tmp_path: Path) -> None:
    file = tmp_path / "take.csv"
    file.write_text("time,a_x,a_y,a_z\n0,00,0,50,0,25,3,00\n")
    with pytest.raises(RecordingError, match=r"must have 4 cells, like the header \(got 8\).*semicolons"):
        Recording.load(file)
