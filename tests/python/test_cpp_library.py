"""The C++ library as others use it: installed, found by CMake, with the bits of the Python package."""

from __future__ import annotations

import re
import shutil
import subprocess
import zlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from test_memory import net
from test_pickling import cloth, rod, rope
from test_scene_file import FORGED_ARRAYS, FORGED_HEADERS, PREFIX, altered, change, forged

ROOT = Path(__file__).resolve().parents[2]
TREES = [tree for tree in (ROOT / "build/wheel", ROOT / "build/fast") if (tree / "libsheetbend.a").exists()]
EXAMPLES, PROGRAMS = "experiments/cpp", "tests/installed"

pytestmark = pytest.mark.skipif(
    not TREES or shutil.which("cmake") is None,
    reason="no build tree holds the C++ library: ./test builds it with SHEETBEND_LIBRARY=ON",
)


def run(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    run("cmake", "--install", TREES[0], "--component", "library", "--prefix", folder)
    return folder


def built(source: str, installed: Path, folder: Path, *options: str) -> Path:
    """Where the programs of a folder lie, built against an installed copy."""
    run("cmake", "-S", ROOT / source, "-B", folder, f"-DCMAKE_PREFIX_PATH={installed}", *options)
    run("cmake", "--build", folder, "--parallel", "2")
    return folder


@pytest.fixture(scope="module")
def examples(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(EXAMPLES, installed, tmp_path_factory.mktemp("examples"))


@pytest.fixture(scope="module")
def programs(installed: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(PROGRAMS, installed, tmp_path_factory.mktemp("programs"))


def lines_of(text: str) -> dict[str, str]:
    """What follows the first word of each line."""
    return {name: rest for name, _, rest in (line.partition(" ") for line in text.splitlines())}


def numbers(words: str) -> np.ndarray:
    """Of bits in hexadecimal."""
    return np.array([int(w, 16) for w in words.split()], dtype=np.uint64).view(np.float64)


def equal(words: str, array: object) -> bool:
    return np.array_equal(numbers(words), np.ravel(np.asarray(array, dtype=float)))


def saved(scene: sb.Scene, folder: Path) -> Path:
    sb.save_scene(scene, folder / "a.scene")
    return folder / "a.scene"


# Installation.


def files_of(component: str, folder: Path) -> list[str]:
    run("cmake", "--install", TREES[0], "--component", component, "--prefix", folder)
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_the_library_installs_its_public_headers_alone(installed: Path) -> None:
    headers = {p.relative_to(installed / "include").as_posix() for p in installed.glob("include/**/*") if p.is_file()}
    public = {f"sheetbend/{p.name}" for p in (ROOT / "adjoint/library/sheetbend").glob("*.h")}
    assert headers == public | {"sheetbend/version.h"}
    assert not list(installed.rglob("*.so"))
    package = (installed / "lib").rglob("*.cmake")
    assert not [p.name for p in package if str(ROOT) in p.read_text()]


def test_a_wheel_gets_the_modules_alone(tmp_path: Path) -> None:
    files = files_of("python", tmp_path)
    assert files and all(f.startswith("sheetbend/_c") and f.endswith(".so") for f in files), files


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("clang++") is None, reason="clang++ is not on this machine")
def test_clang_builds_the_examples_too(installed: Path, tmp_path: Path) -> None:
    """With warnings of the public headers as errors, those of their documentation included."""
    options = ("-DCMAKE_CXX_COMPILER=clang++", "-DCMAKE_CXX_FLAGS=-Wdocumentation -Wconversion")
    folder = built(EXAMPLES, installed, tmp_path / "examples", *options, "-DCMAKE_NO_SYSTEM_FROM_IMPORTED=ON")
    text = run(folder / "rope_gradient", saved(rope(), tmp_path))
    assert gradient_of(text) == expected_gradient(rope())


def test_the_examples_are_short_and_the_page_shows_the_first() -> None:
    sources = {p.name: p.read_text() for p in (ROOT / EXAMPLES).glob("*.cpp")}
    assert len(sources) == 3 and all(len(text.splitlines()) <= 60 for text in sources.values())
    assert f"```cpp\n{sources['rope_gradient.cpp']}```" in (ROOT / "docs/cpp.md").read_text()


@pytest.mark.slow
def test_the_pages_programs_build_and_run_in_a_project_of_their_own(
    installed: Path, examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what docs/cpp.md says and nothing else: its scene, its programs, its lines for CMake."""
    page = (ROOT / "docs/cpp.md").read_text()
    own = [text for text in re.findall(r"```cpp\n(.*?)```", page, re.DOTALL) if "rope_gradient" not in text][-2:]
    if not (installed / "include/sheetbend/residuals.h").exists():
        pytest.skip("the library was built without Ceres")
    cmake = ["cmake_minimum_required(VERSION 3.25)", "project(mine LANGUAGES CXX)"]
    cmake.append("find_package(sheetbend REQUIRED COMPONENTS ceres)")
    for name, source in zip(("fit", "steps"), own, strict=True):
        (tmp_path / f"{name}.cpp").write_text(source)
        cmake += [f"add_executable({name} {name}.cpp)", f"target_link_libraries({name} PRIVATE sheetbend::ceres)"]
    (tmp_path / "CMakeLists.txt").write_text("\n".join(cmake) + "\n")
    run("cmake", "-S", tmp_path, "-B", tmp_path / "b", f"-DCMAKE_PREFIX_PATH={installed}")
    run("cmake", "--build", tmp_path / "b")

    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    given: dict[str, Any] = {}
    exec(block, given)

    def shown(name: str) -> str:
        return subprocess.run([tmp_path / "b" / name], cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    said = dict(line.split() for line in shown("fit").splitlines()[1:])
    assert float(said["EI"]) == pytest.approx(2e-3, rel=1e-3) and float(said["drag"]) == pytest.approx(8e-3, rel=1e-2)
    end = sb.simulate(given["scene"], [0.0, 0.5], sb.Solver(h=1 / 240)).positions[-1, 20, 2]
    assert f"after 0.5 s the end is at z = {end:.6g} m" in shown("steps")
    (printed,) = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    assert gradient_of(run(examples / "rope_gradient", "rope.scene")) == pytest.approx(gradient_of(printed), rel=1e-6)


# A rope's gradient.


def gradient_of(text: str) -> dict[str, float]:
    return {name: float(value) for name, value in lines_of(text).items()}


def expected_gradient(scene: sb.Scene) -> dict[str, float]:
    rollout = sb.rollout(scene, [k / 60 for k in range(61)], sb.Solver(h=1 / 600))
    bar = np.zeros_like(rollout.positions)  # the mean is that of the particles, without the stub of a clamp
    bar[-1, :, 2] = 1 / bar.shape[1]
    height = 0.0
    for z in rollout.positions[-1, :, 2].tolist():
        height += z * (1 / bar.shape[1])
    return {"height": height, **rollout.gradient(bar).quantities}


@pytest.mark.slow
def test_the_example_prints_the_gradient_of_python(examples: Path, tmp_path: Path) -> None:
    shown = gradient_of(run(examples / "rope_gradient", saved(rope(), tmp_path)))
    assert shown == expected_gradient(rope()) and all(shown.values())


# Motions.

BDF1 = sb.Solver(h=1 / 600, integrator="bdf1")
MOTIONS: list[tuple[Callable[[], sb.Scene], sb.Solver]] = [
    (rope, sb.Solver(h=1 / 600)),
    (rope, BDF1),
    (rod, sb.Solver(h=1 / 600, iterations=3)),
    (cloth, sb.Solver(h=1 / 600, method="implicit", force_tolerance=1e-6)),
    (cloth, sb.Solver(h=1 / 600, method="newton")),
    (cloth, sb.Solver(h=1 / 600, method="newton_cg", cg_tolerance=1e-6)),
    (net, sb.Solver(h=1 / 600, method="gauss_seidel", iterations=2, threads=2, grain=8)),
]
motions = pytest.mark.parametrize(
    ("make", "solver"), MOTIONS, ids=[f"{m.__name__}-{s.method}-{s.integrator}" for m, s in MOTIONS]
)


def settings(solver: sb.Solver) -> list[str]:
    """The fields of a solver that are not as usual."""
    usual = sb.Solver()
    names = [n for n in usual.__dataclass_fields__ if getattr(solver, n) != getattr(usual, n)]
    return [f"{name}={getattr(solver, name)!r}".replace("'", "") for name in names]


@motions
@pytest.mark.slow
def test_bits_are_those_of_python(
    programs: Path, tmp_path: Path, make: Callable[[], sb.Scene], solver: sb.Solver
) -> None:
    scene = make()
    shown = lines_of(run(programs / "motion", saved(scene, tmp_path), *settings(solver)))
    values = {name: 1.1 * q.value for name, q in scene.quantities.items()}
    rollout = sb.rollout(scene, [0.0, 0.05, 0.1], solver, values)
    gradient = rollout.gradient(rollout.nodes)
    assert equal(shown["positions"], rollout.nodes) and equal(shown["last"], rollout.nodes[-1])
    assert equal(shown["times"], rollout.times) and equal(shown["inputs"], scene.compiled.inputs())
    assert equal(shown["quantities"], list(gradient.quantities.values())) and shown["recomputed"] == "0"
    for name, array in gradient.inputs.items():
        assert np.array_equal(numbers(shown[f"bar.{name}"])[: array.size], np.ravel(array)), name  # particles first
    tangent = numbers(shown["tangent"])
    by_reverse = np.dot(list(gradient.quantities.values()), list(values.values()))
    loose = 1e-3 if solver.force_tolerance > 1e-10 or solver.cg_tolerance > 1e-12 else 1e-9
    assert np.dot(tangent, rollout.nodes.ravel()) == pytest.approx(by_reverse, rel=loose)


def test_what_a_scene_holds(programs: Path, tmp_path: Path) -> None:
    scene = rope()
    scene.add_quantity("tilt", 0.1, "rad", positive=False, scale=0.2, limits=(-1.0, np.inf))
    shown = lines_of(run(programs / "motion", saved(scene, tmp_path)))
    assert shown["scene"].split() == ["rope", "7", "8", str(scene.compiled.core.inputs), sb.__version__, sb.__version__]
    assert {n: shown[f"group.{n}"].split() for n in (g.name for g in scene.groups)} == {
        g.name: [g.kind, str(len(g.particles))] for g in scene.groups
    }
    huge = np.finfo(float).max
    for name, q in scene.quantities.items():
        least, most = (0.0, huge) if q.positive else q.limits or (-huge, huge)
        assert equal(shown[f"quantity.{name}"], [q.value, q.scale or 0, least, min(most, huge), q.positive]), name
        assert shown[f"unit.{name}"] == q.unit


def test_a_small_budget_gives_the_same_gradient(programs: Path, tmp_path: Path) -> None:
    scene = net()
    times = [0.0, 0.05, 0.1]
    plan = sb.tape_plan(scene, times, sb.Solver(h=1 / 600))
    path = saved(scene, tmp_path)
    whole, small = (lines_of(run(programs / "motion", path, f"memory={m}")) for m in (plan.total, plan.least))
    assert int(small["recomputed"]) > 0 == int(whole["recomputed"])
    assert {k: v for k, v in small.items() if k != "recomputed"} == {
        k: v for k, v in whole.items() if k != "recomputed"
    }


# Errors.


def refusal(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stdout + done.stderr
    return done.stdout.splitlines()[-1]


def test_errors_tell_what_is_wrong(programs: Path, tmp_path: Path) -> None:
    motion, path = programs / "motion", saved(rope(), tmp_path)
    for setting, words in {
        "h=-1": "solver.h | must be a positive time",
        "h=0.03": "times | 0.050000 s does not lie on the grid",
        "iterations=-1": "solver.iterations | must not be negative",
        "threads=0": "solver.threads",
        "force_tolerance=1": "solver.force_tolerance",
        "memory=1000": "solver.memory",
    }.items():
        said = refusal(motion, path, setting)
        assert said.startswith("input error: ") and words in said and len(said.split(" | ")) == 3, said


def test_a_divergence_says_when_and_where(programs: Path, tmp_path: Path) -> None:
    scene = sb.Scene("far")
    scene.add_particles([[0, 0, 0], [1, 0, 0]], 1.0)
    scene.add_constraints("distance", [[0, 1]], compliance=1e-9)
    scene.add_force([1], [[[1e306, 0.0, 0.0]]])
    said = refusal(programs / "motion", saved(scene, tmp_path), "h=0.05")
    with pytest.raises(sb.DivergenceError) as caught:
        sb.rollout(scene, [0.0, 0.05, 0.1], sb.Solver(h=0.05))
    substep, time, particle, words = said.removeprefix("divergence: ").split(" | ")
    assert (int(substep), float(time), int(particle)) == (
        caught.value.substep,
        caught.value.time,
        caught.value.particle,
    )
    assert "diverged" in words


def test_iterations_that_run_out_are_told(programs: Path, tmp_path: Path) -> None:
    path = saved(cloth(), tmp_path)
    for settings in (["method=newton_cg", "cg_iterations=1"], ["method=implicit", "iterations=1"]):
        assert refusal(programs / "motion", path, *settings).startswith("convergence: ")


def test_damaged_and_forged_files_are_refused(examples: Path, tmp_path: Path) -> None:
    path = saved(net(), tmp_path)
    whole = path.read_bytes()
    bad = [whole[:n] for n in (0, 5, 23, 24, 100, len(whole) // 2, len(whole) - 1)] + [whole + b"\0"]
    rng = np.random.default_rng(0)
    for place in rng.choice(len(whole), 50, replace=False):
        bad.append(whole[:place] + bytes([whole[place] ^ 1 << rng.integers(8)]) + whole[place + 1 :])
    bad += [forged(whole, change(*case)) for case in FORGED_HEADERS]
    bad += [altered(whole, *case) for case in FORGED_ARRAYS]
    for k, content in enumerate(bad):
        path.write_bytes(content)
        done = subprocess.run([examples / "rope_gradient", path], capture_output=True, text=True, check=False)
        assert done.returncode == 1 and str(path) in done.stderr and "Fix: " in done.stderr, (k, done)


def test_no_header_is_too_much(examples: Path, tmp_path: Path) -> None:
    """Bytes at random places of the header, with a check sum that fits: refused, or a scene as good as any other, in
    64 MB of memory."""
    path = saved(net(), tmp_path)
    whole = path.read_bytes()
    magic, version, _, length = PREFIX.unpack_from(whole)
    rng = np.random.default_rng(1)
    heads = [b"[" * 1_000_000, b'{"a":' * 10_000, b'{"name": "\xff"}', b"1e999", b"nul", b'{"name": NaN}', b"[1,]"]
    for _ in range(60):
        head = bytearray(whole[PREFIX.size : PREFIX.size + length])
        for place in rng.choice(length, 3):
            head[place] = rng.integers(256)
        heads.append(bytes(head))
    outcomes = []
    for k, head in enumerate(heads):
        body = head + whole[PREFIX.size + length :]
        path.write_bytes(PREFIX.pack(magic, version, zlib.crc32(body), len(head)) + body)
        command = ["sh", "-c", f"ulimit -v 65536 && exec '{examples / 'rope_gradient'}' '{path}'"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0 or (done.returncode == 1 and "Fix: " in done.stderr), (k, done)
        outcomes.append(done.returncode)
    assert outcomes[:7] == [1] * 7 and sum(outcomes) > len(outcomes) / 2


# Equilibria.


@pytest.mark.parametrize("make", [rope, net])
def test_a_scene_at_rest(programs: Path, tmp_path: Path, make: Callable[[], sb.Scene]) -> None:
    scene = make()
    shown = lines_of(run(programs / "rest", saved(scene, tmp_path)))
    rest = sb.equilibrium(scene)
    assert equal(shown["positions"], rest.nodes)
    energy, unstable, again = numbers(shown["facts"])
    assert (energy, unstable) == (rest.energy, rest.unstable_modes) and again == pytest.approx(energy, rel=1e-9)
    gradient = rest.gradient(rest.nodes)
    assert equal(shown["quantities"], list(gradient.values()))
    by_reverse = sum(gradient[name] * q.value for name, q in scene.quantities.items())
    assert np.dot(numbers(shown["tangent"]), rest.nodes.ravel()) == pytest.approx(by_reverse, rel=1e-8)


# Steps.

STEPS = 24


def tracked() -> sb.Scene:
    """A cloth in a grip that moves and a wind of one corner, with a knot at every substep."""
    scene = cloth()
    times, bend = np.arange(STEPS + 1) * (1 / 600), np.linspace(0, 1, STEPS + 1)[:, None, None] ** 2
    scene.drive([0], times, scene.positions[None, [0]] + bend * [0.02, 0.0, 0.03], interpolation="linear")
    scene.add_force([1], np.sin(9 * bend) * [0.01, 0.0, 0.02], times)
    return scene


def held_rope() -> sb.Scene:
    """The same of a rope between a pin and a grip."""
    scene = sb.rope(
        0.3, 6, density=0.05, EI=1e-3, EA=50.0, stretch_damping=1e-3, bend_damping=3e-3, clamp_start=(1, 0, 0)
    )
    times, bend = np.arange(STEPS + 1) * (1 / 600), np.linspace(0, 1, STEPS + 1)[:, None, None] ** 2
    scene.drive([6], times, scene.positions[None, [6]] + bend * [-0.02, 0.0, 0.03], interpolation="linear")
    scene.add_force([3], np.sin(9 * bend) * [0.01, 0.0, 0.02], times)
    return scene


STEPPED = [
    (held_rope, "direct"),
    (held_rope, "gauss_seidel"),
    (tracked, "implicit"),
    (tracked, "newton"),
    (tracked, "newton_cg"),
    (tracked, "gauss_seidel"),
]


@pytest.mark.parametrize("own", [[], ["own"]], ids=["given", "own"])
@pytest.mark.parametrize(("make", "method"), STEPPED)
def test_steps_are_those_of_a_rollout(
    programs: Path, tmp_path: Path, make: Callable[[], sb.Scene], method: str, own: list[str]
) -> None:
    """Driven positions and forces from outside, step by step; and the same again from a state on the way."""
    scene = make()
    text = refusal_after(programs / "stepping", saved(scene, tmp_path), STEPS, *own, f"method={method}")
    shown = lines_of(text)
    motion = sb.simulate(scene, [0.0, STEPS / 600], sb.Solver(h=1 / 600, method=method))
    assert equal(shown["positions"], motion.nodes[-1]) and equal(shown["velocities"], motion.node_velocities[-1])
    assert shown["positions_again"] == shown["positions"] and equal(shown["time"], STEPS * (1 / 600))
    lifted = numbers(shown["lifted"]).reshape(-1, 3) - scene.nodes
    assert shown["branch_again"] == shown["branch"] != shown["lifted"]
    assert lifted[:, 2].max() > 1e-5 and "state | has" in text.splitlines()[-1]


def refusal_after(*command: object) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)
    assert done.returncode == 3, done.stdout + done.stderr
    return done.stdout


def carried() -> sb.Scene:
    scene = sb.rope(
        0.3, 12, density=0.05, EI=1e-3, EA=50.0, bend_damping=3e-3, drag_linear=0.02, pinned=(), direction=(0, 0, -1)
    )
    scene.drive([0], [0.0], scene.positions[None, [0]])
    return scene


def test_the_controller_reaches_its_target(examples: Path, tmp_path: Path) -> None:
    target = np.array([0.1, 0.05, -0.1])
    text = run(examples / "controller", saved(carried(), tmp_path), 12, *target, 10)
    *_, x, y, z = text.split()
    assert text.startswith("after 10.000 s") and np.abs(np.array([x, y, z], float) - target).max() < 1e-3


def allocations(*command: object) -> int:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=True)
    assert done.stderr.startswith("allocations ")
    return int(done.stderr.split()[1])


def test_the_controllers_loop_allocates_nothing(programs: Path, tmp_path: Path) -> None:
    """As many allocations in ten substeps as in six hundred."""
    command = [programs / "counted_controller", saved(carried(), tmp_path), 12, 0.1, 0.05, -0.1]
    assert allocations(*command, 1 / 60) == allocations(*command, 1.0) > 100


@pytest.mark.parametrize(("make", "method"), [(net, "direct"), *STEPPED])
def test_no_method_allocates_in_a_step(
    programs: Path, tmp_path: Path, make: Callable[[], sb.Scene], method: str
) -> None:
    """Nor do saving to a state and restoring it."""
    command = [programs / "counted_loop", saved(make(), tmp_path)]
    assert allocations(*command, 5, f"method={method}") == allocations(*command, 50, f"method={method}") > 100


def lying() -> sb.Scene:
    """A rope that falls on a table and slides there."""
    scene = sb.rope(0.3, 12, density=0.05, EI=1e-3, EA=50.0, bend_damping=3e-3, pinned=(0,), direction=(1, 0, -0.2))
    scene.add_contact(scene.ropes["rope"], sb.Plane(point=(0, 0, -0.07), name="table"), friction=0.3, radius=2e-3)
    return scene


def bouncing() -> sb.Scene:
    """Balls that hit each other over a table."""
    scene, rng = sb.Scene(), np.random.default_rng(0)
    places = 0.15 * np.stack(np.meshgrid(*3 * [range(3)]), -1).reshape(-1, 3) + [0, 0, 0.3]
    balls = scene.add_particles(places + rng.normal(scale=0.01, size=places.shape), 0.1)
    scene.add_contact(balls, sb.Plane(name="table"), friction=0.1, restitution=0.8, radius=0.05)
    scene.add_collisions(balls, radius=0.05, restitution=0.8)
    return scene


@pytest.mark.parametrize(("make", "method"), [(lying, "gauss_seidel"), (lying, "implicit"), (bouncing, "gauss_seidel")])
def test_contacts_keep_their_memory(programs: Path, tmp_path: Path, make: Callable[[], sb.Scene], method: str) -> None:
    """Once their lists are as long as they get."""
    command, solver = [programs / "counted_loop", saved(make(), tmp_path)], f"method={method}"
    assert allocations(*command, 300, solver) == allocations(*command, 400, solver) > 100


# Residuals.


def swinging(
    make: Callable[[], sb.Scene],
    solver: sb.Solver,
    particles: Iterable[int],
    start: str = "given",
    names: Iterable[str] = (),
    noise: float = 1e-3,
    late: float = 1e-3,
) -> sb.Recording:
    """What a scene with other values (of `names`, or all) shows, with noise, and once without a marker."""
    scene = make()
    places = list(particles)
    values = {n: 1.2 * q.value for n, q in scene.quantities.items() if q.positive and (not names or n in names)}
    times = np.arange(13) / 40 + late
    grid = np.arange(0, 80) / 240
    if start == "static":
        seen = sb.equilibrium(scene, values=values).positions[None, places]
        times = times[:1]
    else:
        motion = sb.simulate(scene, grid, replace(solver, h=1 / 240), values).positions[:, places]
        seen = np.stack(
            [np.interp(times, grid, motion.reshape(len(grid), -1)[:, k]) for k in range(3 * len(places))], -1
        )
    errors = np.random.default_rng(3).normal(size=(len(times), len(places), 3))
    seen = seen.reshape(len(times), -1, 3) + noise * errors
    seen[len(times) // 2, 0] = np.nan if start != "static" else seen[0, 0]
    return sb.Recording(seen, times, markers=[str(p) for p in places])


def observed(recording: sb.Recording, places: list[tuple[int, int, float]]) -> str:
    """As tests/installed/residuals.cpp reads it."""
    head = [len(recording.times), len(recording.markers), *(x for place in places for x in place)]
    return " ".join(repr(float(x)) for x in [*head, *recording.times, *recording.positions.ravel()])


RESIDUALS = [
    (rope, "direct", "given", [], ["rope_EI", "rope_bend_damping", "rope_drag_linear"]),
    (rope, "direct", "given", ["linear", "loss=huber"], ["rope_EI"]),
    (rope, "direct", "equilibrium", ["hanging", "loss=soft_l1"], ["rope_EI", "rope_density"]),
    (rope, "direct", "static", ["rest"], ["rope_EI"]),
    (cloth, "newton", "given", [], ["cloth_warp", "cloth_weft", "cloth_shear", "cloth_density", "cloth_bending"]),
]


@pytest.mark.parametrize(("make", "method", "start", "words", "names"), RESIDUALS)
def test_residuals_are_those_of_a_fit(
    programs: Path,
    tmp_path: Path,
    make: Callable[[], sb.Scene],
    method: str,
    start: str,
    words: list[str],
    names: list[str],
) -> None:
    solver = sb.Solver(h=1 / 240, method=method)
    recording = swinging(make, solver, [3, 5], start)
    (tmp_path / "seen.txt").write_text(observed(recording, [(3, 3, 0.0), (5, 4, 0.25)]))
    scene = make()
    shown = lines_of(
        run(programs / "residuals", saved(scene, tmp_path), tmp_path / "seen.txt", *words, *settings(solver), *names)
    )
    loss = next((w.removeprefix("loss=") for w in words if w.startswith("loss=")), "squares")
    experiment = sb.Experiment(
        scene=scene,
        recording=recording,
        markers={"3": sb.on_particle(3), "5": sb.between(5, 4, 0.25)},
        solver=solver,
        static=start == "static",
        start="equilibrium" if start == "equilibrium" else "given",
        start_time=0.0,
        sigma=2e-3,
        loss=loss,
        loss_scale=1.0 if loss == "squares" else 1.5,
    )
    log = "linear" not in words
    problem = FitProblem([experiment], as_parameters({name: {"log": log} for name in names}, [experiment]))
    for at in ("", "_above"):
        u = numbers(shown[f"u{at}"])
        ok, residual, jacobian = problem.evaluate(u)
        assert ok and equal(shown[f"residual{at}"], residual) and equal(shown[f"jacobian{at}"], jacobian)
        assert equal(shown[f"values{at}"], problem.core.physical(u))
        assert equal(shown[f"simulated{at}"], problem.simulate(u)[0])
    assert np.allclose(numbers(shown["u"]), problem.parameters.initial(), rtol=1e-15)
    assert shown["nowhere"].startswith("0 ") and len(shown["nowhere"]) > 10


def test_the_example_fits_a_cloth_as_python_does(examples: Path, tmp_path: Path) -> None:
    if not (examples / "fit_cloth").exists():
        pytest.skip("built without Ceres")
    solver = sb.Solver(h=1 / 240, method="newton")
    names = ["cloth_warp", "cloth_shear", "cloth_density"]
    recording = swinging(cloth, solver, [1, 2, 4, 5, 7], names=names, noise=1e-5, late=0.0)
    recording.save(tmp_path / "cloth.csv")
    text = run(examples / "fit_cloth", saved(cloth(), tmp_path), tmp_path / "cloth.csv", *names)
    shown = {name: float(value.split()[0]) for name, value in lines_of(text).items()}
    markers = {m: sb.on_particle(int(m)) for m in recording.markers}
    experiment = sb.Experiment(scene=cloth(), recording=recording, markers=markers, solver=solver, start_time=0.0)
    quick: dict[str, Any] = {"windows": (), "refine": False, "profiles": False, "beginnings": False}
    fitted = sb.fit(experiment, parameters=names, optimizer="ceres", tolerance=1e-16, **quick).values
    assert {n: shown[n] for n in names} == {n: pytest.approx(fitted[n], rel=1e-8) for n in names}
    assert all(abs(fitted[n] / cloth().quantities[n].value - 1.0) > 0.01 for n in names)
    problem = FitProblem([experiment], as_parameters(names, [experiment]))
    assert shown["cost"] == pytest.approx(problem.cost(np.log([shown[n] for n in names])), rel=1e-12)


def test_blocks_share_parameters_and_may_be_constant(programs: Path, tmp_path: Path) -> None:
    """Two recordings in one problem of Ceres: its gradient is the sum, and a column that nobody wants stays."""
    if not (programs / "blocks").exists():
        pytest.skip("built without Ceres")
    shown = lines_of(run(programs / "blocks", saved(rope(), tmp_path)))
    assert shown["refused"] == "1" and shown["untouched"] == "1"
    one, two, both = (numbers(shown[name]) for name in ("one", "two", "both"))
    assert np.allclose(one + two, both, rtol=1e-14) and both.all()
