"""What notebooks show of objects, and that the notebooks of the gallery run."""

from __future__ import annotations

import ast
import html
import json
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.page import show_in_notebooks

pytest.importorskip("jinja2")
ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
SOLVER = sb.Solver(h=1 / 200)
show_in_notebooks()


def shown(thing: Any) -> dict[str, Any]:
    """The data of the page that a notebook gets."""
    framed = thing._repr_html_()
    assert framed.startswith("<iframe") and framed.endswith("</iframe>") and framed.count("<") == 2
    page = html.unescape(re.fullmatch(r'<iframe style="[^"]*" srcdoc="([^"]*)"></iframe>', framed)[1])
    (content,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(content)


def hanging() -> sb.Scene:
    return sb.rope(0.4, 8, density=0.05, EI=1e-3, clamp_start=(1, 0, 0))


def test_motions_scenes_rests_and_recordings_show_themselves() -> None:
    scene = hanging()
    (start,) = shown(scene)["motions"]
    assert not scene.frozen and start["frames"] == 1 and [line["nodes"] for line in start["lines"]] == [9]
    motion = sb.simulate(scene, np.arange(4) / 100, SOLVER)
    assert motion.scene is scene and "scene" not in repr(motion)
    (moving,) = shown(motion)["motions"]
    assert moving["frames"] == 4
    assert replace(motion, scene=None)._repr_html_() is None  # text in its place
    (rest,) = shown(sb.equilibrium(scene))["motions"]
    assert rest["frames"] == 1 and rest["scale"] > 0
    (recorded,) = shown(sb.Recording(motion.positions[:, 3::2], motion.times, name="take"))["motions"]
    assert recorded["name"] == "take" and recorded["measured"] and recorded["frames"] == 4


def test_fits_and_results_show_themselves(monkeypatch: pytest.MonkeyPatch) -> None:
    times, scene = np.arange(20) / 100, hanging()
    seen = scene.ropes["rope"].particles[3::2]
    x = sb.simulate(scene, times, SOLVER).positions[:, seen]
    e = sb.Experiment(
        scene=hanging(), recording=sb.Recording(x, times), markers=[sb.on_particle(int(p)) for p in seen], solver=SOLVER
    )
    found = sb.fit(e, parameters=["rope_EI"], refine=False, profiles=False, beginnings=False)
    assert (
        "height:1060px" in found._repr_html_() and "height:780px" in hanging()._repr_html_()
    )  # the motion is in sight
    assert shown(found)["motions"][0]["simulated"]
    assert shown(found.result)["motions"] == []
    monkeypatch.setitem(sys.modules, "jinja2", None)
    assert found._repr_html_() is None


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook_runs(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its cells in their order; what stands last in a cell shows itself, as IPython would have it."""
    pytest.importorskip("matplotlib").use("agg")
    pyplot = pytest.importorskip("matplotlib.pyplot")
    monkeypatch.chdir(path.parent)
    notebook = json.loads(path.read_text())
    assert notebook["nbformat"] == 4
    space: dict[str, Any] = {"__name__": "notebook"}
    pages = 0
    for number, cell in enumerate(notebook["cells"]):
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [] and cell["execution_count"] is None
        body = ast.parse("".join(cell["source"])).body
        last = body.pop() if isinstance(body[-1], ast.Expr) else None
        exec(compile(ast.Module(body, []), f"{path.name}[{number}]", "exec"), space)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), f"{path.name}[{number}]", "eval"), space)
            if type(value).__module__.startswith("sheetbend"):
                assert shown(value)["motions"]
                pages += 1
    assert all(panel.has_data() for panel in space["figure"].axes)
    pyplot.close("all")
    assert pages >= 2


def test_there_are_two_notebooks() -> None:
    assert len(NOTEBOOKS) >= 2
