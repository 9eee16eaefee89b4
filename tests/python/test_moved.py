"""Old names of modules lead to what they held, with a warning, and pickles that name them load."""

from __future__ import annotations

import ast
import importlib.util
import pickle
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from importlib import import_module
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.moved import CONTENTS, MODULES, RENAMED
from sheetbend.result.estimate import Estimate
from sheetbend.result.motions import RecordingFit

NOW = {f"sheetbend.{n}": f"sheetbend.{package}.{n}" for package, names in MODULES.items() for n in names.split()}
HELD = {
    (f"sheetbend.{new}", n): f"sheetbend.{p}"
    for p, by in CONTENTS.items()
    for new, ns in by.items()
    for n in ns.split()
}


def as_before(content: bytes) -> tuple[bytes, set[str]]:
    """A pickle of protocol 2 with the names of modules as they were, and which of them it names."""
    old = {new: name for name, new in NOW.items()}
    named = set()

    def renamed(found: re.Match[bytes]) -> bytes:
        module, name = found[1].decode(), found[2].decode()
        before = HELD.get((module, name), old.get(module, module))
        named.add(before)
        return f"c{before}\n{name}\n".encode()

    return re.sub(rb"c(sheetbend[\w.]*)\n(\w+)\n", renamed, content), named


def result() -> sb.FitResult:
    told = Estimate(
        name="rope_EI", value=1e-3, unit="N m^2", lower=9e-4, upper=1.1e-3, half_width=1e-4, statistical=1e-4,
        discretization=0.0, verdict="identified", words="identified",
    )  # fmt: skip
    return sb.FitResult(
        estimates=(told,), recordings=(RecordingFit(name="swing", rows=9),), cost=1.0, rows=9, optimizer="ceres",
        iterations=3, seconds=0.1, converged=True,
    )  # fmt: skip


def recording() -> sb.Recording:
    return sb.Recording(np.arange(24.0).reshape(4, 2, 3), np.arange(4) * 0.1, clamped=(0,), name="swing")


def experiment() -> sb.Experiment:
    scene = sb.rope(0.3, 6, density=0.05, EI=1e-3)
    scene.pin([0])
    places = {"m1": sb.on_particle(6)}
    return sb.Experiment(scene=scene, recording=recording(), markers=places, solver=sb.Solver(h=1e-3))


def trajectory() -> sb.Trajectory:
    return sb.simulate(experiment().scene, np.arange(3) * 1e-2, sb.Solver(h=1e-2))


def content(a: Any) -> Any:
    return np.asarray(a.positions).tolist() if hasattr(a, "positions") else a


@pytest.mark.parametrize(
    ("make", "names"),
    [
        (result, {"sheetbend.result"}),
        (recording, {"sheetbend.recording"}),
        (lambda: experiment().scene, {"sheetbend.scene", "sheetbend.group", "sheetbend.quantities"}),
        (experiment, {"sheetbend.experiment", "sheetbend.solver", "sheetbend.markers"}),
        (trajectory, {"sheetbend.simulate"}),
    ],
    ids=["result", "recording", "scene", "experiment", "trajectory"],
)
def test_pickles_of_earlier_versions_load(make: Any, names: set[str]) -> None:
    held = make()
    old, named = as_before(pickle.dumps(held, protocol=2))
    assert names <= named
    with pytest.warns(DeprecationWarning, match="load it and save it again"):
        loaded = pickle.loads(old)
    assert type(loaded) is type(held)
    if isinstance(held, sb.Experiment):
        assert loaded.solver == held.solver and content(loaded.recording) == content(held.recording)
        held, loaded = held.scene, loaded.scene
    if isinstance(held, sb.Scene):
        assert loaded.quantities == held.quantities and np.array_equal(loaded.compiled.inputs(), held.compiled.inputs())
    else:
        assert content(loaded) == content(held)


def test_every_old_module_leads_to_one_that_is_there() -> None:
    assert [new for new in NOW.values() if importlib.util.find_spec(new) is None] == []
    for (new, name), old in HELD.items():
        with pytest.warns(DeprecationWarning, match=re.escape(f"{old} has moved")):
            assert getattr(import_module(old), name) is getattr(import_module(new), name)


def test_an_old_import_warns_where_it_stands() -> None:
    with pytest.warns(DeprecationWarning, match="use sheetbend.motion.solver.ITERATIONS") as told:
        from sheetbend.solver import ITERATIONS  # type: ignore[import-not-found]
    assert ITERATIONS["implicit"] == 100 and told[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="from sheetbend import Recording") as told:
        from sheetbend.recording import Recording
    assert Recording is sb.Recording and told[0].filename == __file__


def test_a_function_with_the_name_of_an_old_module_stays() -> None:
    with pytest.warns(DeprecationWarning, match="from sheetbend import Fit"):
        from sheetbend.fit import Fit  # type: ignore[import-not-found]
    import sheetbend.simulate  # type: ignore[import-not-found]

    assert Fit is sb.Fit and sb.fit.__module__ == "sheetbend.fitting.fit" and callable(sheetbend.simulate)


def test_what_an_old_module_never_held_is_an_error() -> None:
    for old in ("sheetbend.solver", "sheetbend.scene"):
        with pytest.raises(AttributeError, match="no attribute 'nothing'"):
            _ = import_module(old).nothing
    with pytest.raises(ImportError):
        import_module("sheetbend.never")


@pytest.mark.parametrize("name", RENAMED)
def test_a_renamed_name_warns_and_is_the_same(name: str) -> None:
    assert name not in sb.__all__
    with pytest.warns(DeprecationWarning, match=re.escape(f"use sheetbend.{RENAMED[name]}")) as told:
        found = getattr(sb, name)
    assert found is attrgetter(RENAMED[name])(sb) and told[0].filename == __file__
    assert RENAMED[name].partition(".")[0] in sb.__all__


def test_a_function_that_is_renamed_is_found_in_its_old_module() -> None:
    with pytest.warns(DeprecationWarning, match="use sheetbend.baseline"):
        from sheetbend.baseline import no_physics  # type: ignore[import-not-found]
    assert no_physics is sb.baseline
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = sb.nothing


@pytest.mark.parametrize("name", ["contact", "self_contact"])
def test_an_old_method_warns_and_is_the_same(name: str) -> None:
    scene, now = sb.rope(0.2, 4, density=0.05), f"add_{name}"
    with pytest.warns(DeprecationWarning, match=f"^Scene.{name} goes in version 0.2: use Scene.{now}$") as told:
        assert getattr(scene, name) == getattr(scene, now) and getattr(sb.Scene, name) is getattr(sb.Scene, now)
    assert {one.filename for one in told} == {__file__} and len(told) == 2


def names_of(text: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names)


def test_nothing_here_uses_an_old_name() -> None:
    root = Path(__file__).resolve().parents[2]
    files = [p for top in ("experiments", "tests", "tools") for p in (root / top).rglob("*.py") if p != Path(__file__)]
    assert len(files) > 100
    sources, old = {p: p.read_text() for p in files}, re.compile("|".join(map(re.escape, NOW)))
    named = {p: text for p, text in sources.items() if old.search(text)}  # to parse all of them takes seconds
    assert [(p.name, name) for p, text in named.items() for name in names_of(text) if name in NOW] == []
    texts = [*files, *root.glob("*.md"), *(root / "docs").rglob("*.md"), *(root / "experiments").rglob("*.md")]
    told = re.compile(rf"\b(sb|sheetbend)\.({'|'.join(RENAMED)})\b")
    here = [(p.name, m[0]) for p in texts if p.name != "CHANGELOG.md" for m in told.finditer(p.read_text())]
    assert here == []
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        subprocess.run([sys.executable, "-W", "error", "-c", "import sheetbend, sheetbend.config"], check=True)
