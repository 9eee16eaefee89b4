"""sheetbend fabric: from all tests of a laboratory to one fabric that scenes can name."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from sheetbend.cli.app import app
from sheetbend.config import parse, scene_alone
from sheetbend.errors import ConfigError, InputError, RecordingError
from sheetbend.objects.laws import Exponential
from sheetbend.textile.drape import Plates
from sheetbend.textile.laboratory import bias_pulled, draped, extensions
from sheetbend.textile.whole_fabric import FabricTests, supported_law
from typer.testing import CliRunner, Result

LENGTH, WIDTH = 0.2, 0.05  # m
PLATES: Plates = {"diameter": 0.3, "plate": 0.18, "friction": None, "cover": True}


def pull(path: Path, stiffness: float, b: float, share: float, reach: float = 0.06) -> str:
    """A free strip of Fung's law: T = k E exp(b E^2) (1 + e)."""
    e = np.linspace(0.0, reach, 50)
    green = e + e**2 / 2
    force = stiffness * green * np.exp(b * green**2) * (1 + e) * WIDTH
    rows = "\n".join(f"{1e3 * LENGTH * share * x:.6f};{f:.6f}" for x, f in zip(e, force, strict=True))
    path.write_text(f"Weg [mm];Kraft [N]\n{rows}\n", encoding="utf-8")
    return path.name


def wavy(folds: int = 5, mean: float = 0.13, wave: float = 0.01) -> np.ndarray:
    angle = 2 * np.pi * np.arange(400) / 400
    radius = mean + wave * np.cos(folds * angle)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("laboratory")
    warp = [pull(at / f"warp{k}.csv", 500.0, 150.0, s) for k, s in enumerate((0.98, 1.0, 1.02))]
    (at / "tests.toml").write_text(
        f"""
[fabric]
name = "twill"
about = "synthetic"
[weight]
specimens = [199, 200, 201]
[[pull]]
files = {warp}
along = "warp"
length = "20cm"
width = "5cm"
[[bending]]
bending_length = [24.9, 25.0, 25.1]
[given]
shear = 25.0
"""
    )
    return at


def run(file: Path, *more: str) -> Result:
    return CliRunner().invoke(app, ["fabric", str(file), *more])


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, object]:
    done = run(folder / "tests.toml", "--output", str(folder / "out"), "--json")
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_one_command_finds_the_fabric(folder: Path, told: dict[str, object]) -> None:
    found = {e["name"]: e for e in told["estimates"]}
    assert set(found) == {"warp", "warp_stiffening", "density", "bending"}
    true = {"warp": 500.0, "warp_stiffening": 150.0, "density": 0.2, "bending": 0.2 * 9.81 * 0.025**3}
    for name, value in true.items():
        assert found[name]["lower"] < value < found[name]["upper"], name
        assert found[name]["value"] == approx(value, rel=0.06), name
    assert told["law"] == "exponential"
    (why,) = [reason for reason in told["reasons"] if "the law is" in reason]
    assert "support most" in why
    assert any(reason == "shear was given as 25" for reason in told["reasons"])
    assert any("weft" in reason and "as stiff as the warp" in reason for reason in told["reasons"])


def test_nothing_is_given_that_was_not_reached(folder: Path, told: dict[str, object]) -> None:
    report = (folder / "out" / "report.txt").read_text()
    (row,) = [line for line in report.splitlines() if line.split()[:2] == ["warp", "3"]]
    assert row.endswith("not reached  not reached") and "the law is not extrapolated to it" in report
    curves = textile.read_curves(folder / "warp1.csv", length=LENGTH, width=WIDTH)
    read = extensions(curves, 0, {"low": 10.0, "high": 98.07})
    assert read["high"] is None and 0.0 < read["low"] < 0.06


def test_scenes_name_the_file(folder: Path, told: dict[str, object]) -> None:
    with (folder / "out" / "fabric.toml").open("rb") as file:
        fabric = tomllib.load(file)
    assert fabric["intervals"]["warp"][0] < fabric["fabric"]["warp"] < fabric["intervals"]["warp"][1]
    scene = """
[experiment]
name = "flag"
[[scene.cloth]]
fabric_file = "out/fabric.toml"
MORE
[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.2
nx = 4
ny = 4
"""
    text = scene.replace("MORE", "")
    (folder / "flag.toml").write_text(text)
    built, _ = scene_alone(parse(folder / "flag.toml"), folder)
    found = {e["name"]: e["value"] for e in told["estimates"]}
    assert built.quantities["cloth_warp"].value == found["warp"]
    assert built.quantities["cloth_warp_stiffening"].value == found["warp_stiffening"]
    (folder / "flag.toml").write_text(scene.replace("MORE", "warp = 3.0"))
    with pytest.raises(ConfigError, match="stands beside warp"):
        parse(folder / "flag.toml")
    (folder / "flag.toml").write_text(text.replace("out/fabric.toml", "tests.toml"))
    with pytest.raises(ConfigError, match="holds no fabric"):
        parse(folder / "flag.toml")


def test_the_page_has_what_the_report_has(folder: Path, told: dict[str, object]) -> None:
    page = (folder / "out" / "report.html").read_text()
    assert "<h2>What the pulls reached</h2>" in page and "data:image/png;base64," in page and "known to" in page
    assert {"fabric.toml", "report.html", "report.txt", "warp.png"} == set(told["files"])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[given]\nshear = 25.0", "", "shear: is told by no test"),
        ("[given]\nshear = 25.0", "[given]\nshear = 25.0\nwarp = 1.0", "given.warp: is measured too"),
        ('along = "warp"', 'along = "up"', "pull[0].along"),
        ("[[bending]]\nbending_length = [24.9, 25.0, 25.1]", "[[bending]]", "give files or bending_length"),
        ("warp0.csv", "none.csv", "none.csv"),
        ('length = "20cm"', 'length = "20 turns"', "length"),
        ('length = "20cm"', "length = 200", 'pull[0].length: must be a text in "quotes" (got 200)'),
        ('length = "20cm"', "length = 200", 'with its unit: "20cm"'),
        ("[24.9, 25.0, 25.1]", "[2.49, 2.5, 2.51]", "give mm, such as [24.9, 25.0, 25.1] for cm"),
        ("[199, 200, 201]", "[0.2, 0.201]", "give g/m^2, such as [200.0, 201.0] for kg/m^2"),
    ],
)
def test_bad_files_of_tests(folder: Path, old: str, new: str, words: str) -> None:
    text = (folder / "tests.toml").read_text()
    assert old in text
    (folder / "bad.toml").write_text(text.replace(old, new))
    done = run(folder / "bad.toml", "--output", str(folder / "bad"))
    assert done.exit_code == 2 and words in " ".join(done.output.split()), done.output


@pytest.mark.parametrize(("name", "first"), [("a.xlsx", b"PK\x03\x04\x14"), ("a.xls", b"\xd0\xcf\x11\xe0\xa1")])
def test_workbooks_are_refused_by_their_name(tmp_path: Path, name: str, first: bytes) -> None:
    """They were called text without a table of numbers."""
    (tmp_path / name).write_bytes(first + bytes(100))
    with pytest.raises(RecordingError, match=r"is a workbook of a spreadsheet.*save the sheet"):
        textile.read_curves(tmp_path / name)


class TestLaw:
    def curves(self, folder: Path, b: float) -> list[textile.Curve]:
        pull(folder / "one.csv", 500.0, b, 1.0, 0.12)
        return list(textile.read_curves(folder / "one.csv", length=LENGTH, width=WIDTH))

    def test_is_the_one_that_the_pulls_of_all_directions_support(self, tmp_path: Path) -> None:
        straight, stiffening = self.curves(tmp_path, 0.0), self.curves(tmp_path, 120.0)
        assert supported_law(FabricTests(pulls={"warp": straight}, readings={}, given={}))[0] == "linear"
        law, why = supported_law(FabricTests(pulls={"warp": straight, "weft": stiffening}, readings={}, given={}))
        assert law != "linear" and law in why
        assert supported_law(FabricTests(pulls={"warp": straight}, readings={}, given={}, law="sinh"))[0] == "sinh"
        with pytest.raises(InputError, match="none that scenes have"):
            supported_law(FabricTests(pulls={}, readings={}, given={}, law="limit"))

    def test_a_law_that_locks_is_named_where_it_follows_better(self, tmp_path: Path) -> None:
        e = np.linspace(0.0, 0.3, 80)
        force = 5.0 * e / (1.0 - e / 0.32)
        rows = "\n".join(f"{200 * x:.5f};{f:.5f}" for x, f in zip(e, force, strict=True))
        (tmp_path / "knit.csv").write_text(f"Weg [mm];Kraft [N]\n{rows}\n")
        curves = textile.read_curves(tmp_path / "knit.csv", length=LENGTH, width=WIDTH)
        law, why = supported_law(FabricTests(pulls={"warp": curves}, readings={}, given={}))
        assert law in ("linear", "exponential", "sinh") and "which no scene has, would follow them better" in why


class TestOutlines:
    def test_of_points(self, tmp_path: Path) -> None:
        points = wavy()
        np.savetxt(tmp_path / "d.csv", 1e3 * (points + np.array([0.3, -0.1])), "%.4f", ";", header="x;y", comments="")
        outline = textile.read_outline(tmp_path / "d.csv", units="mm")
        assert outline.area == approx(np.pi * (0.13**2 + 0.01**2 / 2), rel=1e-3) and outline.nodes == 5
        ring = (outline.area - np.pi * 0.09**2) / (np.pi * (0.15**2 - 0.09**2))
        assert outline.coefficient(0.3, 0.18) == approx(100 * ring)
        with pytest.raises(InputError, match="units"):
            textile.read_outline(tmp_path / "d.csv")
        with pytest.raises(InputError, match="smaller than the plate or larger"):
            textile.read_outline(tmp_path / "d.csv", units="cm").coefficient(0.3, 0.18)
        (tmp_path / "bad.csv").write_text("x,y\n1,2\n3,four\n")
        with pytest.raises(RecordingError, match="line 3: is not a point"):
            textile.read_outline(tmp_path / "bad.csv", units="m")

    @pytest.mark.parametrize("dark", [True, False])
    def test_of_a_picture(self, tmp_path: Path, dark: bool) -> None:
        image = pytest.importorskip("PIL.Image")
        pytest.importorskip("contourpy")
        y, x = (np.mgrid[0:400, 0:500] - [[[210]], [[240]]]) * 0.4 / 500  # m, of a picture 0.4 m wide
        inside = np.hypot(x, y) < 0.13 + 0.01 * np.cos(6 * np.arctan2(y, x))
        gray = np.where(inside == dark, 60, 200) + np.random.default_rng(0).integers(-20, 20, inside.shape)
        image.fromarray(gray.astype(np.uint8)).save(tmp_path / "shadow.png")
        outline = textile.read_outline(tmp_path / "shadow.png", width=0.4)
        assert outline.area == approx(inside.sum() * (0.4 / 500) ** 2, rel=2e-3) and outline.nodes == 6
        with pytest.raises(InputError, match="how many m"):
            textile.read_outline(tmp_path / "shadow.png")

    def test_a_large_picture_is_traced_on_fewer_pixels(self, tmp_path: Path) -> None:
        """Of 100 million pixels the array alone took 0.8 GB."""
        image = pytest.importorskip("PIL.Image")
        pytest.importorskip("contourpy")
        y, x = np.mgrid[0:4000, 0:6001] - [[[2000]], [[3000]]]
        image.fromarray(np.where(np.hypot(x, y) < 1500, 60, 200).astype(np.uint8)).save(tmp_path / "shadow.png")
        outline = textile.read_outline(tmp_path / "shadow.png", width=0.6001)
        assert outline.area == approx(np.pi * 0.15**2, rel=1e-3)

    def test_a_drape_is_a_reading_of_the_state_with_as_many_folds(self) -> None:
        fabric = sb.Fabric(density=0.2, warp=600.0, shear=30.0, bending=3e-5)
        reading = draped([textile.Outline("a", wavy()), textile.Outline("b", wavy(5, 0.129))], PLATES)
        assert reading.sigma > 3.0 and "5 folds" in reading.note
        own = reading.test(fabric)
        assert own.laboratory == textile.drape(fabric, folds=(5,)).coefficient.laboratory
        assert own.gradient["cloth_bending"] > 0.0

    def test_a_drape_may_touch_its_plate_instead(self) -> None:
        fabric = sb.Fabric(density=0.2, warp=600.0, shear=30.0, bending=3e-5)
        outlines = [textile.Outline("a", wavy())]
        held, touching = draped(outlines, PLATES), draped(outlines, {**PLATES, "friction": 0.3, "cover": False})
        lower = held.test(fabric).laboratory - touching.test(fabric).laboratory
        assert 1.0 < lower < 3.0


def test_bias_pulls_tell_shear() -> None:
    fabric = sb.Fabric(density=0.2, warp=600.0, shear=30.0, bending=3e-5)
    extension = np.linspace(0.0, 0.02, 4)
    tests = [textile.bias_extension(fabric, extension=e, length=0.2, width=0.1) for e in extension[1:]]
    force = np.array([0.0, *(test.force.value for test in tests)])
    curve = textile.Curve("bias", "tension", extension / 0.2, force / 0.1, length=0.2, width=0.1)
    readings = bias_pulled([curve])
    assert len(readings) == 3 and readings[-1].test(fabric).laboratory == approx(readings[-1].value, rel=1e-6)
    assert readings[0].test(fabric).gradient["cloth_shear"] > 0.0
    with pytest.raises(InputError, match="unknown size"):
        bias_pulled([textile.Curve("bias", "tension", extension, force)])


def test_fung_is_what_the_curves_follow() -> None:
    """The strips of this file are those of the law that scenes have."""
    fabric = sb.Fabric(density=0.2, warp=500.0, shear=250.0, bending=1e-5, law=Exponential(150.0, 150.0, 150.0))
    green = 0.05 + 0.05**2 / 2
    load = 500.0 * green * np.exp(150.0 * green**2) * 1.05
    assert textile.uniaxial(fabric, load=load, width=WIDTH, gauge=LENGTH).extension.value == approx(0.05, rel=0.02)
