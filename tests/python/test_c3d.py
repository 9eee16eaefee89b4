"""C3D files, written here byte by byte as the format says, with the numbers of each processor."""

from __future__ import annotations

import contextlib
import struct
from pathlib import Path

import numpy as np
import pytest
from sheetbend.errors import RecordingError
from sheetbend.recording.io import told_unit
from sheetbend.recording.recording import Recording

INTEL, DEC, MIPS = 84, 85, 86
BLOCK = 512
FRAMES, RATE = 4, 120.0
LABELS = ("towel:a", "towel:b", "LKneeAngles", "*9")
X = np.random.default_rng(4).uniform(-900, 900, (FRAMES, len(LABELS), 3)).round(1)  # mm
SEEN = np.ones((FRAMES, len(LABELS)), dtype=bool)
SEEN[2, 1] = SEEN[:, 3] = False


def floats(values: np.ndarray, processor: int) -> bytes:
    values = np.asarray(values, dtype=float)
    if processor == DEC:
        return values.ravel().__mul__(4).astype("<f4").view("<u2").reshape(-1, 2)[:, ::-1].tobytes()
    return values.astype(">f4" if processor == MIPS else "<f4").tobytes()


def words(values: np.ndarray | list[int], processor: int) -> bytes:
    return np.asarray(values).astype(">i2" if processor == MIPS else "<i2").tobytes()


def parameter(group: int, name: str, kind: int, shape: list[int], body: bytes, processor: int) -> bytes:
    tail = struct.pack("bB", kind, len(shape)) + bytes(shape) + body + b"\x00"
    return struct.pack("bb", len(name), group) + name.encode() + words([2 + len(tail)], processor) + tail


def written(folder: Path, processor: int = INTEL, scale: float = -0.1, units: str = "mm", analog: int = 0) -> Path:
    """Integers times the scale where it is positive, else floats."""
    order = ">" if processor == MIPS else "<"
    texts = [label.ljust(12) for label in LABELS]
    group = struct.pack("bb", 5, -1) + b"POINT" + words([3], processor) + b"\x00"
    said = group + parameter(1, "LABELS", -1, [12, 4], "".join(texts).encode(), processor)
    said += parameter(1, "UNITS", -1, [len(units)], units.encode(), processor)
    said += parameter(1, "RATE", 4, [], floats(np.array([RATE]), processor), processor)
    said += parameter(1, "ANGLES", -1, [12, 1], b"LKneeAngles ", processor)
    said += parameter(1, "USED", 2, [], words([len(LABELS)], processor), processor)
    said = bytes([1, 0x50, 2, processor]) + said + b"\x00\x00"
    head = bytes([2, 0x50]) + struct.pack(f"{order}5H", len(LABELS), analog, 11, 10 + FRAMES, 10)
    head += floats(np.array([scale]), processor) + words([4, 1], processor) + floats(np.array([RATE]), processor)
    body = b""
    for x, seen in zip(X, SEEN, strict=True):
        four = np.column_stack([np.where(seen[:, None], x, 0.0), np.where(seen, 0.0, -1.0)])
        if scale > 0:
            four[:, :3] /= scale
        extra = np.full(analog, 7)
        body += (
            floats(np.r_[four.ravel(), extra], processor)
            if scale < 0
            else words(np.r_[four.ravel(), extra].round(), processor)
        )
    path = folder / "trial.c3d"
    path.write_bytes(head.ljust(BLOCK, b"\x00") + said.ljust(2 * BLOCK, b"\x00") + body)
    return path


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
@pytest.mark.parametrize("scale", [-0.1, 0.1])
@pytest.mark.parametrize("analog", [0, 6])
def test_points_of_every_processor(tmp_path: Path, processor: int, scale: float, analog: int) -> None:
    trial = Recording.load(written(tmp_path, processor, scale, analog=analog))
    assert trial.markers == ("towel:a", "towel:b")
    assert trial.times == pytest.approx(np.arange(FRAMES) / RATE)
    assert np.array_equal(trial.mask, SEEN[:, :2])
    assert trial.positions[SEEN[:, :2]] == pytest.approx(1e-3 * X[:, :2][SEEN[:, :2]], abs=1e-7)
    assert trial.gravity is None and trial.name == "trial"


def test_lost_points_at_zero(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some systems write no residual of points that they lost: these were markers at the origin."""
    x = np.tile(X[:1], (30, 1, 1)) + np.array([2000.0, 0.0, 0.0])
    x[7, 1] = 0.0
    for name, value in {"X": x, "SEEN": np.ones(x.shape[:2], dtype=bool), "FRAMES": 30}.items():
        monkeypatch.setitem(globals(), name, value)
    trial = Recording.load(written(tmp_path))
    assert np.argwhere(~trial.mask).tolist() == [[7, 1]]


def test_more_frames_than_the_header_counts(tmp_path: Path) -> None:
    """Eleven minutes at 100 Hz: what came later was left out without a word."""
    count = 0x10000 + 4
    path = written(tmp_path)
    data = path.read_bytes()
    trial = struct.pack("bb", 5, -2) + b"TRIAL" + words([3], INTEL) + b"\x00"
    trial += parameter(2, "ACTUAL_START_FIELD", 2, [2], words([1, 0], INTEL), INTEL)
    trial += parameter(2, "ACTUAL_END_FIELD", 2, [2], words([count - 0x10000, 1], INTEL), INTEL)
    head = data[:6] + struct.pack("<HH", 1, 0xFFFF) + data[10 : BLOCK + 4]
    said = (trial + data[BLOCK + 4 :])[: 2 * BLOCK - 4]
    path.write_bytes(head + said + (count // FRAMES) * data[3 * BLOCK :])
    assert len(Recording.load(path).times) == count


def test_its_unit_holds_and_the_json_tells_the_rest(tmp_path: Path) -> None:
    path = written(tmp_path, units="m")
    path.with_suffix(".json").write_text('{"gravity": [0, -9.81, 0], "clamped": ["towel:a"]}')
    trial = Recording.load(path)
    assert trial.positions[0, 0] == pytest.approx(X[0, 0]) and trial.clamped == (0,)
    with pytest.raises(RecordingError, match="differ from the file's, m"):
        Recording.load(path, units="mm")
    with pytest.raises(RecordingError, match="ends in what is only read"):
        trial.save(tmp_path / "copy.c3d")
    assert not (tmp_path / "copy.json").exists()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda data: b"RIFF" + data[4:], "is not a C3D file"),
        (lambda data: data[:600], "is damaged or cut off"),
        (lambda data: data[:-9], "is damaged or cut off"),
        (lambda data: data[:515] + b"\x63" + data[516:], "is damaged or cut off"),
        (lambda data: data.replace(b"\x02mm", b"\x02em"), "names no known length unit"),
        (lambda data: data[:20] + b"\x00" * 4 + data[24:].replace(b"RATE", b"RAVE"), "no frames per second"),
    ],
)
def test_what_is_damaged_is_refused(tmp_path: Path, damage, words: str) -> None:
    path = written(tmp_path)
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(RecordingError, match=words):
        Recording.load(path)


def test_its_unit_is_told(tmp_path: Path) -> None:
    assert told_unit(written(tmp_path)) == "mm"
    bare = tmp_path / "bare.csv"
    bare.write_text("time,a.x,a.y,a.z\n0,0,0,0\n0.1,0,0,0.1\n", encoding="utf-8")
    assert told_unit(bare) is None
    bare.with_suffix(".json").write_text('{"units": "cm"}', encoding="utf-8")
    assert told_unit(bare) == "cm"


@pytest.mark.parametrize("seed", range(40))
def test_random_damage_is_refused_or_read(tmp_path: Path, seed: int) -> None:
    """Never an error that is none of ours."""
    rng = np.random.default_rng(seed)
    path = written(tmp_path)
    data = bytearray(path.read_bytes())
    for at in rng.integers(0, len(data), 12):
        data[at] = rng.integers(0, 256)
    path.write_bytes(bytes(data))
    with contextlib.suppress(RecordingError):
        Recording.load(path)
