"""Files that were made to hurt: they end in errors of the package that name them, in little time and memory."""

from __future__ import annotations

import json
import pickle
import struct
import time
import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend import config
from sheetbend.errors import ConfigError, InputError, RecordingError
from sheetbend.recording import io
from sheetbend.textile import read_curves
from test_c3d import parameter, words
from test_c3d import written as c3d_file

X, T = np.arange(24.0).reshape(4, 2, 3), np.arange(4.0)


@pytest.fixture(autouse=True)
def quickly() -> Iterator[None]:
    """No file below takes long: at most 1.4 s of processor time on the machine that this was written on."""
    begun = time.process_time()
    yield
    assert time.process_time() - begun < 5.0


def refused(path: Path, expected: str, read: Callable[[Path], Any] = sb.Recording.load) -> InputError:
    with pytest.raises(InputError, match=expected or None) as caught:
        read(path)
    assert path.name in str(caught.value) and "Fix: " in str(caught.value)
    return caught.value


# ---- whatever a reader raises ---------------------------------------------------------------------------

FOREIGN = [
    RecursionError("maximum recursion depth exceeded"),
    KeyError("positions"),
    OSError(5, "Input/output error"),
    PermissionError(13, "Permission denied"),
    UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    MemoryError(),
    OverflowError("int too large to convert to float"),
    AttributeError("'list' object has no attribute 'get'"),
]


@pytest.mark.parametrize("error", FOREIGN, ids=lambda e: type(e).__name__)
def test_what_a_reader_raises_becomes_an_error_of_ours(
    tmp_path: Path, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*arguments: object, **options: object) -> None:
        raise error

    path = tmp_path / "a.npz"
    sb.Recording(X, T).save(path)
    monkeypatch.setattr(io.npz, "read", fails)
    assert refused(path, type(error).__name__).__cause__ is error
    (tmp_path / "a.toml").write_text("[experiment]")
    monkeypatch.setattr("tomllib.loads", fails)
    assert isinstance(refused(tmp_path / "a.toml", type(error).__name__, config.load), ConfigError)
    (tmp_path / "fit.json").write_text("{}")
    monkeypatch.setattr("json.loads", fails)
    refused(tmp_path / "fit.json", "", sb.FitResult.load)
    (tmp_path / "strip.csv").write_text("1;2\n2;3\n")
    monkeypatch.setattr("sheetbend.textile.curve_file.read_tables", fails)
    refused(tmp_path / "strip.csv", type(error).__name__, read_curves)


def test_warnings_that_are_errors_stay_warnings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def warns(path: Path) -> None:
        raise UserWarning("as the caller wishes")

    sb.Recording(X, T).save(tmp_path / "a.npz")
    monkeypatch.setattr(io.npz, "read", warns)
    with pytest.raises(UserWarning, match="as the caller wishes"):
        sb.Recording.load(tmp_path / "a.npz")


def test_folders_that_are_called_by_points(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in (".", ".."):
        with pytest.raises(RecordingError, match="holds no sequence"):
            sb.Recording.load(folder)


# ---- pickles --------------------------------------------------------------------------------------------

ARRAY = pickle.dumps(np.zeros((3, 4)), protocol=4)


def test_lists_of_lists_of_numbers_are_read(tmp_path: Path) -> None:
    """[frames][3][n], as rope data come without NumPy too, in lists and tuples, also of single numbers of NumPy."""
    frames = np.random.default_rng(3).normal(size=(500, 3, 6))
    for k, content in enumerate(
        (
            frames.tolist(),
            tuple(tuple(tuple(row) for row in frame) for frame in frames.tolist()),
            [[list(row) for row in frame] for frame in frames[:20]],
            [frames[0].tolist(), frames[1]],
        )
    ):
        for protocol in range(6):
            path = tmp_path / f"{k}_{protocol}.pkl"
            path.write_bytes(pickle.dumps(content, protocol=protocol))
            loaded = sb.Recording.load(path).positions
            assert np.array_equal(loaded, frames[: len(loaded)].transpose(0, 2, 1))


NESTED: dict[str, tuple[bytes, str]] = {
    "nested tuples": (b"\x80\x04)" + b"\x85" * 1_000_000 + b".", "more than 3 levels"),
    "nested lists": (b"]" * 300_000 + b"a" * 299_999 + b".", "more than 3 levels"),
    "nested tuple as a key": (b"\x80\x04})" + b"\x85" * 300_000 + b"Ns.", "more than 3 levels"),
    "keys that collide": (
        b"\x80\x04}(" + b"".join(b"\x8a\x08" + struct.pack("<q", k << 40) + b"N" for k in range(90_000)) + b"u.",
        "a dict with a int as a key",
    ),
    "a set": (b"\x80\x04\x8f(" + b"K\x01" * 100_000 + b"\x90.", "EMPTY_SET"),
    "a list in itself": (b"\x80\x04]\x94h\x00a.", "not a pickle"),
    "a list that grows later": (b"\x80\x04]\x94]\x94ah\x01]ah\x00e.", "not a pickle"),
    "a chain of lists that grow": (b"\x80\x04]\x94" + b"]\x94a" + b"h\x01]\x94a" * 1000 + b".", "not a pickle"),
    "one array many times": (
        pickle.dumps([np.zeros((3, 9000))] * 100_000, protocol=4),
        "100000 times 27000 numbers",
    ),
    "one row many times": (
        b"\x80\x04](]\x94(" + b"K\x01" * 30_000 + b"e" + b"](" + b"h\x00" * 30_000 + b"ee.",
        "numbers up to entry",
    ),
    "many instructions": (b"\x80\x04](" + b"K\x01" * 1_000_001 + b"e.", "more than 1,000,000 instructions"),
    "a large whole number": (
        b"\x80\x04](\x8b" + struct.pack("<i", 500_000) + b"\x7f" * 500_000 + b"e.",
        "not a pickle",
    ),
    "digits": (b"L" + b"9" * 500_000 + b"L\n.", "not a pickle"),
    "marks": (b"(" * 300_000 + b".", "not a pickle"),
    "shape of large numbers": (
        ARRAY.replace(b"K\x03K\x04\x86", b"\x8a\x08" + b"\xff" * 7 + b"\x7f\x8a\x08" + b"\xff" * 7 + b"\x7f\x86"),
        "an array of shape",
    ),
    "a call of an array": (b"cnumpy\nndarray\n)R.", "not a pickle"),
    "a call of a number": (b"K\x01)R.", "call of a int"),
    "a state of a list": (b"]Nb.", "state of a list"),
    "what is above the mark": (b"](\x86.", "without what it works on"),
}


@pytest.mark.parametrize("name", NESTED)
def test_a_pickle_asks_for_no_more_than_it_is_long(tmp_path: Path, name: str) -> None:
    content, told = NESTED[name]
    path = tmp_path / "a.pkl"
    path.write_bytes(content)
    refused(path, told)


# ---- archives -------------------------------------------------------------------------------------------


def archive(path: Path, method: int = zipfile.ZIP_DEFLATED, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", method) as file:
        for name, content in members.items():
            file.writestr(f"{name}.npy", content)
    return path


def npy(array: np.ndarray, header: str | None = None, version: tuple[int, int] = (1, 0)) -> bytes:
    """The content of an NPY file, with another header where one is given."""
    stream = BytesIO()
    np.save(stream, array)
    content = stream.getvalue()
    if header is None:
        return content
    size = struct.unpack_from("<H", content, 8)[0]
    text = header.encode().ljust(size - 1) + b"\n"
    count = struct.pack("<H" if version == (1, 0) else "<I", len(text))
    return b"\x93NUMPY" + bytes(version) + count + text + content[10 + size :]


def test_an_archive_that_unpacks_to_much_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    zeros = npy(np.zeros((6_000_000, 1, 3)))  # 144 MB in 140 kB
    path = archive(tmp_path / "a.npz", positions=zeros, times=npy(T))
    assert path.stat().st_size < 200_000
    refused(path, r"unpack to 144000\d+ bytes, which is more than 134 MB, or 50 times the size of the file")


def test_an_archive_that_lies_about_its_size_is_refused(tmp_path: Path) -> None:
    path = archive(tmp_path / "a.npz", positions=npy(np.zeros((6_000_000, 1, 3))), times=npy(T))
    content = path.read_bytes().replace(struct.pack("<I", 144_000_128), struct.pack("<I", 300))
    assert content != path.read_bytes()
    path.write_bytes(content)
    refused(path, "cannot be read")


HEADERS = {
    "more than there is": "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000, 2, 3)}",
    "less than there is": "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 3)}",
    "negative": "{'descr': '<f8', 'fortran_order': False, 'shape': (-4, -2, 3)}",
    "huge": f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({'9' * 400}, 0)}}",
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (4, 2, 3)}",
    "brackets": "(" * 5000,
    "minus signs": "-" * 9000 + "1",
    "no type": "{'descr': 'zz', 'fortran_order': False, 'shape': (4, 2, 3)}",
    "a type of types": "{'descr': [('a', [('b', '<f8')])], 'fortran_order': False, 'shape': (4, 2, 3)}",
    "empty type": "{'descr': '|V0', 'fortran_order': False, 'shape': (4, 2, 3)}",
    "null": "\x00" * 60,
    "words": "os.system('true')",
}


@pytest.mark.parametrize("version", [(1, 0), (2, 0), (3, 0), (9, 9)])
@pytest.mark.parametrize("name", HEADERS)
def test_a_forged_header_is_refused(tmp_path: Path, name: str, version: tuple[int, int]) -> None:
    path = archive(tmp_path / "a.npz", positions=npy(X, HEADERS[name], version), times=npy(T))
    with pytest.raises(RecordingError, match=r"Fix: "):
        sb.Recording.load(path)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_what_numpy_does_not_pack_by_is_refused(tmp_path: Path, method: int) -> None:
    path = archive(tmp_path / "a.npz", method, positions=npy(X), times=npy(T))
    refused(path, "not by deflate")


# ---- tables ---------------------------------------------------------------------------------------------


def test_a_long_table_of_many_markers_at_many_times_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("time,marker,x,y,z\n" + "".join(f"{k},m{k},1,2,3\n" for k in range(15_000)))
    assert path.stat().st_size < 360_000  # and would make 5.4 GB
    refused(path, "positions of 15000 frames and 15000 markers, which is more than 134 MB, or 50 times")


def test_many_markers_are_checked_in_linear_time(tmp_path: Path) -> None:
    names = [f"m{k}" for k in range(40_000)]
    recording = sb.Recording(np.zeros((1, 40_000, 3)), [0.0], names, clamped=names[::2])
    assert len(recording.free) == 20_000 and recording.select(names[::-1]).clamped[0] == 1
    recording.save(tmp_path / "a.csv")
    assert sb.Recording.load(tmp_path / "a.csv").clamped == recording.clamped
    with pytest.raises(RecordingError, match="twice"):
        sb.Recording(np.zeros((1, 40_000, 3)), [0.0], [*names[:-1], "m0"])


@pytest.mark.parametrize("cell", ["time" + " " * 4000 + "x", "time" + "_" * 4000 + "x", "timestamp" + " (" * 4000])
def test_a_long_name_of_a_time_is_none(tmp_path: Path, cell: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{cell},a_x,a_y,a_z\n0,1,2,3\n")
    refused(path, "first column is time")


CURVES = {
    "delimiters at the end": "1;2" + ";" * 60_000 + "\n" + "2;3" + ";" * 60_000 + "\n",
    "rows without cells": "Weg [mm];Kraft [N]\n1;2;;;\n;\n2;3;;;\n",
    "many columns": ";".join("1" for _ in range(20_000)) + "\n",
    "a cell without end": 'Weg [mm];Kraft [N]\n1;"' + "2" * 200_000 + "\n",
    "lines that begin with numbers": "1;x\n" * 20_000 + "1;2\n",
    "blanks in a name": "Weg [mm];F" + " " * 3000 + "in x y" + "\n1;2\n2;3\n",
    "brackets in a name": "Weg [mm];" + "(" * 30_000 + "\n1;2\n2;3\n",
    "points behind the words": "Width " + "." * 3000 + "!\nWeg [mm];Kraft [N]\n1;2\n2;3\n",
    "control characters": "\x00;\x1c\x1d;\x85\n1;2\n2;3\n",
    "large numbers": "Weg [mm];Kraft [N]\n" + "".join(f"{k}e305;1e9999\n" for k in range(9)),
}


@pytest.mark.parametrize("name", CURVES)
def test_a_forged_curve_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(CURVES[name])
    with pytest.raises(InputError, match=r"Fix: "):
        read_curves(path, length=0.2, width="Width")
    with pytest.raises(InputError, match=r"Fix: "):
        read_curves(path, length=0.2, width=0.05)


# ---- C3D ------------------------------------------------------------------------------------------------

INTEL = 84
C3D = {
    "points back": lambda data: data.replace(words([3], INTEL) + b"\x00", words([-7], INTEL) + b"\x00", 1),
    "a rate in letters": lambda data: data.replace(
        b"RATE" + parameter(1, "RATE", 4, [], b"\x00\x00\xf0B", INTEL)[6:-1],
        b"RATE" + parameter(1, "RATE", -1, [4], b"fast", INTEL)[6:10] + b"ast",
    ),
    "many dimensions": lambda data: data.replace(b"UNITS\x08\x00\xff\x01\x02mm", b"UNITS\x08\x00\xff\xff\xff\xff\xff"),
}


@pytest.mark.parametrize("name", C3D)
def test_a_forged_trial_is_refused(tmp_path: Path, name: str) -> None:
    path = c3d_file(tmp_path)
    content = C3D[name](path.read_bytes())
    assert content != path.read_bytes()
    path.write_bytes(content)
    refused(path, "is damaged or cut off")


# ---- meshes ---------------------------------------------------------------------------------------------


def test_a_mesh_of_large_numbers_is_refused(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    pytest.importorskip("trimesh")
    for number in ("2147483648", "9" * 5000, "400"):  # a table up to 2147483648 takes 17 GB
        path = tmp_path / "a.obj"
        path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 {number}\n")
        refused(path, "", sb.read_mesh)
    facet = "facet normal 0 0 x\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
    path = tmp_path / "a.stl"
    path.write_text(f"solid a\n{facet}endsolid a\n" + " " * 100)
    assert len(sb.read_mesh(path).triangles) == 1
    assert caplog.records == []  # the library would log tracebacks


# ---- JSON and TOML --------------------------------------------------------------------------------------

JSON = {
    "brackets": "[" * 200_000,
    "nested": '{"a":' * 400 + "1" + "}" * 400,
    "digits": '{"rate": ' + "1" * 5000 + "}",
    "large rate": '{"rate": 1' + "0" * 400 + "}",
    "large gravity": '{"gravity": [0, 0, 1' + "0" * 400 + "]}",
    "no text": b'{"name": "\xff"}',
    "half a pair": '{"name": "\\udc80"}',
    "names of lists": '{"markers": [["a"], ["b"]]}',
    "lists of lists": '{"clamped": [[0]]}',
    "an object": '{"units": {"m": 1}}',
}


@pytest.mark.parametrize("name", JSON)
def test_a_forged_json_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.pkl"
    path.write_bytes(pickle.dumps([np.zeros((3, 2))]))
    content = JSON[name]
    path.with_suffix(".json").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(RecordingError, match=r"Fix: "):
        sb.Recording.load(path)


def test_metadata_that_could_not_be_read_back_are_not_written(tmp_path: Path) -> None:
    deep: list[Any] = []
    for _ in range(60):
        deep = [deep]
    with pytest.raises(RecordingError, match="nested too deeply"):
        sb.Recording(X, T, metadata={"a": deep}).save(tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []


TOML = {
    "brackets": "a = " + "[" * 100_000,
    "nested": "a = " + "[" * 90 + "]" * 90,
    "tables": "a = " + "{a=" * 100_000,
    "parts of a key": "a." * 200_000 + "b = 1",
    "parts of a table": "[" + "a ." * 100_000 + "b]",
    "quoted parts": "'a'." * 100_000 + "b = 1",
    "digits": "a = " + "1" * 5000,
    "hexadecimal digits": '[experiment]\nname = "a"\n[[scene.rope]]\nlength = 0x' + "9" * 5000,
    "no text": b"a = '\xff'",
    "large": b"#" * (2**22 + 1),
    "links": '[experiment]\nname = "a"\n[[scene.rope]]\nlength = 1.0\ndensity = 1.0\nsegments = 1000000000',
    "cells": '[experiment]\nname = "a"\n[scene.cloth.mesh]\nkind = "disk"\nrings = 1000000000',
}


@pytest.mark.parametrize("name", TOML)
def test_a_forged_configuration_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.toml"
    content = TOML[name]
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(ConfigError, match=r"Fix: "):
        config.load(path)


# ---- fit.json -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fit() -> dict[str, Any]:
    scene = sb.rope(0.6, 4, density=0.05, EA=1e3, EI=1e-3)
    motion = sb.simulate(scene, np.arange(6) / 100, sb.Solver(h=1 / 400))
    found = sb.fit(
        sb.rope(0.6, 4, density=0.05, EA=1e3, EI=1.1e-3),
        sb.Recording(motion.positions, motion.times),
        ["rope_EI"],
        solver=sb.Solver(h=1 / 400),
        markers=[sb.on_particle(k) for k in range(motion.positions.shape[1])],
    )
    return found.result.to_dict()


def test_a_fit_whose_refits_lack_a_parameter_is_reported(tmp_path: Path, fit: dict[str, Any]) -> None:
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(fit | {"refits": [{"name": "finer", "to_limit": 2.0, "moved": {}}]}))
    assert "finer" in sb.FitResult.load(path).report()


def test_a_fit_whose_raced_starts_lack_a_parameter_is_reported(tmp_path: Path, fit: dict[str, Any]) -> None:
    path = tmp_path / "fit.json"
    start = {"cost": 1.0, "iterations": 3, "converged": True, "values": {}, "first": {}, "raced": 1.0, "group": 0}
    path.write_text(json.dumps(fit | {"starts": [start, start]}))
    assert "Groups of starts" in sb.FitResult.load(path).report()


def test_a_fit_comes_back(tmp_path: Path, fit: dict[str, Any]) -> None:
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(fit))
    assert sb.FitResult.load(path).to_dict() == fit
    path.write_text(json.dumps(fit).replace(json.dumps(fit["cost"]), "1e999"))
    refused(path, "must be a finite number", sb.FitResult.load)


Forge = Callable[[dict[str, Any]], Any]
FORGED: dict[str, tuple[Forge, str]] = {
    "no parameters": (lambda d: d.pop("parameters"), "parameters: must be an object"),
    "parameters in a list": (lambda d: d.update(parameters=[1]), "parameters: must be an object"),
    "no value": (lambda d: d["parameters"]["rope_EI"].pop("value"), r"parameters\.rope_EI\.value: is missing"),
    "a value in letters": (lambda d: d["parameters"]["rope_EI"].update(value="1"), r"rope_EI\.value: must be a number"),
    "a value in a list": (lambda d: d["parameters"]["rope_EI"].update(value=[]), r"rope_EI\.value: must be a number"),
    "a value of 400 digits": (lambda d: d["parameters"]["rope_EI"].update(value=10**400), "must be a finite number"),
    "a negative width": (lambda d: d["parameters"]["rope_EI"].update(half_width=-1e-3), "must not be negative"),
    "true for a value": (lambda d: d["parameters"]["rope_EI"].update(value=True), r"rope_EI\.value: must be a number"),
    "an open interval": (lambda d: d["parameters"]["rope_EI"].update(interval=[1.0]), r"must be \[lower, upper\]"),
    "no interval": (lambda d: d["parameters"]["rope_EI"].update(interval=None), "interval: must be a list"),
    "a verdict": (lambda d: d["parameters"]["rope_EI"].update(verdict="certain"), "verdict: is unknown"),
    "a field": (lambda d: d["parameters"]["rope_EI"].update(color="red"), "not a field that this version knows"),
    "a number for a parameter": (lambda d: d["parameters"].update(rope_EI=1.0), r"parameters\.rope_EI: must be an obj"),
    "rows in letters": (lambda d: d["recordings"]["recording"].update(rows="9"), "rows: must be a whole number"),
    "no recordings": (lambda d: d.update(recordings=None), "recordings: must be an object"),
    "a text for starts": (lambda d: d.update(starts="none"), "starts: must be a list"),
    "starts of numbers": (lambda d: d.update(starts=[1]), r"starts\[0\]: must be an object"),
    "gauges of numbers": (lambda d: d.update(gauges=[1]), r"gauges\[0\]: must be a text"),
    "no cost": (lambda d: d.pop("cost"), "cost: is missing"),
    "converged in letters": (lambda d: d.update(converged="yes"), "converged: must be true or false"),
    "another format": (lambda d: d.update(format=["sheetbend fit 1"]), "format: is not the one"),
    "an escape": (lambda d: d.update(message="\x1b[2J"), "message: holds a control character"),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_forged_fit_is_refused(tmp_path: Path, fit: dict[str, Any], name: str) -> None:
    forge, told = FORGED[name]
    data = json.loads(json.dumps(fit))
    forge(data)
    path = tmp_path / "fit.json"
    path.write_text(json.dumps(data))
    refused(path, told, sb.FitResult.load)


NO_JSON = ["NaN", '{"cost": NaN}', '{"a": -Infinity}', "[" * 100_000, "1" * 5000, "\ufeff", ""]


@pytest.mark.parametrize("text", NO_JSON)
def test_what_is_no_json_is_no_fit(tmp_path: Path, text: str) -> None:
    path = tmp_path / "fit.json"
    path.write_text(text)
    refused(path, "", sb.FitResult.load)


def test_a_fit_that_is_not_there_is_refused(tmp_path: Path) -> None:
    refused(tmp_path / "fit.json", "cannot be read: No such file", sb.FitResult.load)
    refused(tmp_path, "cannot be read: Is a directory", sb.FitResult.load)
