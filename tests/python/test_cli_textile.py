"""sheetbend textile: from a machine's file to numbers, a law with intervals, and a figure."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from pytest import approx
from sheetbend import textile
from sheetbend.cli.app import app
from typer.testing import CliRunner, Result

STIFFNESS = 400.0  # N/m
LENGTH, WIDTH = 0.2, 0.05  # m


def strip(path: Path, share: float = 1.0) -> str:
    """A strip of a linear fabric up to 5 % of strain and back, where it gives back less: T = k E (1 + e)."""
    out = np.linspace(0.0, 0.05, 60)
    force = STIFFNESS * (out + out**2 / 2) * (1 + out) * WIDTH
    back, less = out[::-1][1:], (force * (out / 0.05))[::-1][1:]
    lines = [
        f"{1e3 * LENGTH * share * e:.6f};{f:.6f}".replace(".", ",")
        for e, f in zip([*out, *back], [*force, *less], strict=True)
    ]
    path.write_text("Width;50;mm\nWeg [mm];Kraft [N]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["textile", *arguments])


def test_a_pull(tmp_path):
    files = [strip(tmp_path / f"{k}.csv", share) for k, share in enumerate((0.98, 1.0, 1.02))]
    out = tmp_path / "out"
    sizes = ["--length", "20 cm", "--width", "Width"]
    done = run(*files, *sizes, "--law", "linear", "--output", str(out), "--figures", "svg", "--json")
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    (estimate,) = told["estimates"]
    assert estimate["value"] == approx(STIFFNESS, rel=0.01)
    assert estimate["lower"] < STIFFNESS < estimate["upper"]
    assert math.log(estimate["upper"] / estimate["lower"]) / 2 == approx(4.30 * 0.02 / math.sqrt(3), rel=0.2)
    middle = told["curves"][1]
    assert middle["EMT"] == approx(0.05) and middle["RT"] + middle["lost"] == approx(1.0)
    assert {path.name for path in out.iterdir()} == {"report.txt", "mean.csv", "curves.svg"}
    report = (out / "report.txt").read_text(encoding="utf-8")
    assert "EMT [%]" in report and "scatter" in report and "95 % interval" in report and "% of the work" in report
    (mean,) = textile.read_curves(out / "mean.csv")
    assert mean.load[-1] == approx(STIFFNESS * 0.05, rel=0.2)


def test_a_forecast_and_a_chosen_law(tmp_path):
    """The same words and figures as in Python."""
    files = [strip(tmp_path / f"{k}.csv", share) for k, share in enumerate((0.98, 1.0, 1.02))]
    out, sizes = tmp_path / "out", ["--length", "20 cm", "--width", "Width"]
    options = ["--law", "chosen", "--weights", "chosen", "--forecast", "--figures", "none", "--json"]
    done = run(*files, *sizes, *options, "--output", str(out))
    assert done.exit_code == 0, done.stderr
    told = json.loads(done.stdout)
    curves = [c for file in files for c in textile.read_curves(file, length=LENGTH, width=WIDTH)]
    found = textile.forecast_pull(curves)
    assert told["forecast"]["load"] == approx(found.load.tolist())
    assert told["forecast"]["shares"] == approx(found.shares)
    report = (out / "report.txt").read_text(encoding="utf-8")
    assert str(found) in report and "law chosen by what the pulls" in " ".join(report.split())
    assert run(*files, *sizes, "--weights", "many", "--output", str(out)).exit_code != 0


def test_a_loop_of_shear(tmp_path):
    angle = np.concatenate([np.linspace(0, 8, 81), np.linspace(8, 0, 81)[1:]])
    force = np.where(np.arange(161) < 81, 1.0, 0.6) * angle
    table = "\n".join(f"{a:.4f}\t{f:.4f}" for a, f in zip(angle, force, strict=True))
    (tmp_path / "shear.txt").write_text(f"{table}\n")
    told = ["--column", "deformation=1", "--column", "load=2", "--unit", "deformation=deg", "--unit", "load=gf/cm"]
    done = run(str(tmp_path / "shear.txt"), "--test", "shear", *told, "--output", str(tmp_path / "out"), "--json")
    assert done.exit_code == 0, done.stderr
    (row,) = json.loads(done.stdout)["curves"]
    assert row["G"] == approx(0.980665 * 180 / math.pi, rel=1e-3)
    assert row["2HG5"] == approx(0.4 * 5 * 0.980665, rel=1e-3)
    assert row["lost"] == approx(0.4, abs=0.01)
    assert "lose 40 %" in (tmp_path / "out/report.txt").read_text(encoding="utf-8")


def test_a_loop_of_shear_tells_a_cloth_that_yields(tmp_path):
    """G = 50 N/m, of which 0.3 slides beyond a shear strain of 2 %, under KES-FB1's tension."""
    angle = np.radians(np.concatenate([np.linspace(0, 8, 101), np.linspace(8, -8, 201)[1:], np.linspace(-8, 0, 101)]))
    slid, rows = 0.0, []
    for s in np.tan(angle):
        slid = min(max(slid, s - 0.02), s + 0.02)
        rows.append(f"{math.degrees(math.atan(s)):.8f}\t{50.0 * (s - 0.3 * slid) + 9.80665 * s:.9f}")
    (tmp_path / "loop.txt").write_text("\n".join(rows) + "\n")
    told = ["--column", "deformation=1", "--column", "load=2", "--unit", "deformation=deg", "--unit", "load=N/m"]
    options = ["--test", "shear", *told, "--figures", "none", "--output", str(tmp_path / "out"), "--json"]
    done = run(str(tmp_path / "loop.txt"), *options)
    assert done.exit_code == 0, done.stderr
    (loop,) = json.loads(done.stdout)["curves"]
    assert [loop[key] for key in ("shear", "yield_shear_share", "yield_shear")] == approx([50.0, 0.3, 0.02], rel=1e-4)
    assert "yield_shear_share" in (tmp_path / "out/report.txt").read_text(encoding="utf-8")


def test_a_loop_of_bending_tells_a_cloth_that_yields(tmp_path):
    """B = 20 uN m, of which 0.3 slides beyond 0.4 1/cm; and a specimen without a way back."""
    curvature = np.concatenate(
        [np.linspace(0, 250, 101), np.linspace(250, -250, 201)[1:], np.linspace(-250, 0, 101)[1:]]
    )
    slid, moment = 0.0, []
    for kappa in curvature:
        slid = min(max(slid, kappa - 40.0), kappa + 40.0)
        moment.append(2e-5 * (kappa - 0.3 * slid))
    for name, count in (("loop", 401), ("out", 101)):
        rows = zip(curvature[:count], moment[:count], strict=True)
        table = "\n".join(f"{k / 100:.6f}\t{m:.9f}" for k, m in rows)
        (tmp_path / f"{name}.txt").write_text(f"{table}\n")
    told = ["--column", "deformation=1", "--column", "load=2", "--unit", "deformation=1/cm", "--unit", "load=N.m/m"]
    files = [str(tmp_path / f"{name}.txt") for name in ("loop", "out")]
    done = run(*files, "--test", "bending", *told, "--figures", "none", "--output", str(tmp_path / "out"), "--json")
    assert done.exit_code == 0, done.stderr
    loop, out = json.loads(done.stdout)["curves"]
    assert loop["B"] == approx(1.4e-5, rel=1e-3)
    assert [loop[key] for key in ("bending", "yield_share", "yield_curvature")] == approx([2e-5, 0.3, 40.0], rel=1e-4)
    assert loop["misfit"] < 1e-3 and out["bending"] is None
    assert "yield_curvature [1/cm]" in (tmp_path / "out/report.txt").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("told", "message"),
    [
        (["--width", "5cm"], "length: is missing"),
        (["--length", "20N", "--width", "5cm"], "--length: must be a length"),
        (["--length", "20cm"], "width: is missing"),
        (["--length", "20cm", "--width", "5cm", "--pretension", "1 kg/N"], "--pretension: must be"),
        (["--length", "20cm", "--width", "5cm", "--pretension", "50N"], "never reaches the pretension"),
        (["--length", "20cm", "--width", "5cm", "--column", "load"], "--column: must be ROLE=VALUE"),
        (["--length", "20cm", "--width", "5cm", "--cycle", "3"], "cycle: is not one of the 1"),
    ],
)
def test_what_is_wrong(told, message, tmp_path):
    done = run(strip(tmp_path / "a.csv"), *told, "--output", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert message in " ".join(done.stderr.split())


@pytest.mark.parametrize(
    ("text", "given", "wanted"),
    [
        ("Ext (mm);Strain (%);Load (N)\n0;0;0\n1;1;1\n2;2;2\n", [], "--column deformation=..."),
        ("Time (s),Ext (mm)\n0,0\n1,1\n2,2\n", [], "--unit load=..."),
        ("Ext (mm);Load (N)\n0;0\n1;1\n2;2\n", ["--column", "load=Kraft"], "--column: name no column"),
        ("Ext (mm);Load (N)\n0;0\n1;1\n2;2\n", ["--decimal", "x"], "--decimal: must be"),
    ],
)
def test_errors_name_options(tmp_path: Path, text: str, given: list[str], wanted: str) -> None:
    """They named the arguments of Python's read_curves, columns={'load': ...}."""
    file = tmp_path / "pull.csv"
    file.write_text(text)
    result = run(str(file), "--length", "20 cm", "--width", "5 cm", "--output", str(tmp_path / "out"), *given)
    assert result.exit_code == 2 and wanted in result.stderr, result.stderr
    assert "={" not in result.stderr
