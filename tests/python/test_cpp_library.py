"""The C++ library as others use it: installed, found by CMake, with the bits of the Python package."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from test_memory import net
from test_pickling import cloth, rope
from test_scene_file import FORGED_ARRAYS, FORGED_HEADERS, altered, change, forged

ROOT = Path(__file__).resolve().parents[2]
TREES = [tree for tree in (ROOT / "build/wheel", ROOT / "build/fast") if (tree / "libsheetbend.a").exists()]

pytestmark = pytest.mark.skipif(
    not TREES or shutil.which("cmake") is None,
    reason="no build tree holds the C++ library: ./test builds it with SHEETBEND_LIBRARY=ON",
)


def run(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def programs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the programs lie that were built against an installed copy."""
    folder = tmp_path_factory.mktemp("cpp")
    run("cmake", "--install", TREES[0], "--component", "library", "--prefix", folder / "installed")
    for source in (ROOT / "experiments/cpp", ROOT / "tests/installed"):
        build = folder / f"build_{source.name}"
        run("cmake", "-S", source, "-B", build, f"-DCMAKE_PREFIX_PATH={folder / 'installed'}")
        run("cmake", "--build", build)
    return folder


def numbers(words: list[str]) -> np.ndarray:
    return np.array([int(w, 16) for w in words], dtype=np.uint64).view(np.float64)


def test_the_example_prints_the_gradient_of_python(programs: Path, tmp_path: Path) -> None:
    scene = rope()
    sb.save_scene(scene, tmp_path / "rope.scene")
    lines = run(programs / "build_cpp/rope_gradient", tmp_path / "rope.scene").splitlines()
    shown = {name: float(value) for name, value in (line.split() for line in lines)}
    rollout = sb.rollout(scene, [k / 60 for k in range(61)], sb.Solver(h=1 / 600))
    bar = np.zeros_like(rollout.positions)
    bar[-1, :, 2] = 1 / bar.shape[1]
    expected = rollout.gradient(bar).quantities
    assert shown.pop("height") == pytest.approx(rollout.positions[-1, :, 2].mean(), abs=1e-15)
    assert shown == expected and any(expected.values())


@pytest.mark.parametrize(
    ("make", "method"),
    [(rope, "direct"), (cloth, "implicit"), (cloth, "newton"), (cloth, "newton_cg"), (net, "gauss_seidel")],
)
def test_bits_are_those_of_python(programs: Path, tmp_path: Path, make, method: str) -> None:  # type: ignore[no-untyped-def]
    scene = make()
    sb.save_scene(scene, tmp_path / "a.scene")
    lines = run(programs / "build_installed/probe", tmp_path / "a.scene", method).splitlines()
    shown = {name: rest for name, _, rest in (line.partition(" ") for line in lines)}
    values = {name: 1.1 * q.value for name, q in scene.quantities.items()}
    rollout = sb.rollout(scene, [0.0, 0.05, 0.1], sb.Solver(h=1 / 600, method=method), values)
    gradient = rollout.gradient(rollout.positions)
    assert np.array_equal(numbers(shown["positions"].split()), rollout.positions.ravel())
    assert np.array_equal(numbers(shown["last"].split()), rollout.positions[-1].ravel())
    assert np.array_equal(numbers(shown["quantities"].split()), list(gradient.quantities.values()))
    for name, array in gradient.inputs.items():
        assert np.array_equal(numbers(shown[f"bar.{name}"].split()), np.ravel(array)), name
    tangent = numbers(shown["tangent"].split())
    by_reverse = np.dot(list(gradient.quantities.values()), list(values.values()))
    assert np.dot(tangent, rollout.positions.ravel()) == pytest.approx(by_reverse, rel=1e-9)


def test_damaged_and_forged_files_are_refused(programs: Path, tmp_path: Path) -> None:
    path = tmp_path / "net.scene"
    sb.save_scene(net(), path)
    whole = path.read_bytes()
    bad = [whole[:n] for n in (0, 5, 23, 24, 100, len(whole) // 2, len(whole) - 1)] + [whole + b"\0"]
    rng = np.random.default_rng(0)
    for place in rng.choice(len(whole), 50, replace=False):
        bad.append(whole[:place] + bytes([whole[place] ^ 1 << rng.integers(8)]) + whole[place + 1 :])
    bad += [forged(whole, change(*case)) for case in FORGED_HEADERS]
    bad += [altered(whole, *case) for case in FORGED_ARRAYS]
    for k, content in enumerate(bad):
        path.write_bytes(content)
        done = subprocess.run([programs / "build_cpp/rope_gradient", path], capture_output=True, text=True, check=False)
        assert done.returncode == 1 and str(path) in done.stderr and "Fix: " in done.stderr, (k, done)
