"""Text exports of testing machines: dialects with a known truth, repeats, sizes, and what is refused where."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from pytest import approx
from sheetbend import textile
from sheetbend.errors import RecordingError
from sheetbend.textile.units import quantity, unit

GF = textile.GRAM_FORCE
LENGTH, WIDTH = 0.2, 0.05  # m
STRAIN = np.array([0.0, 0.01, 0.025, 0.05, 0.03, 0.005])
FORCE = np.array([0.0, 1.25, 4.5, 12.125, 5.5, 0.25])  # N
TIME = np.array([0.0, 0.5, 1.25, 2.5, 3.5, 4.75])


def rows(columns: list[np.ndarray], delimiter: str, mark: str = ".") -> str:
    lines = (delimiter.join(f"{value:.14g}" for value in row) for row in zip(*columns, strict=True))
    return "\n".join(lines).replace(".", mark) + "\n"


MM = 1e3 * LENGTH * STRAIN
DIALECTS = {
    "German, decimal commas, umlauts": (
        "Prüfgeschwindigkeit;100;mm/min\nDatum;22.11.2025\n\nZeit [s];Weg [mm];Kraft [N]\n"
        + rows([TIME, MM, FORCE], ";", ",")
    ).encode("cp1252"),
    "quoted, units in a line of their own": (
        '"Test","Fabric, plain"\n"Rate","100"\n"Time","Extension","Load"\n"(s)","(mm)","(cN)"\n'
        + rows([TIME, MM, 100 * FORCE], ",")
    ).encode(),
    "tabs, per width, strain, UTF-16": (
        "KES-FB1\nElongation (%)\tForce (gf/cm)\n" + rows([100 * STRAIN, FORCE / WIDTH / (100 * GF)], "\t")
    ).encode("utf-16"),
    "units of no letters in a line of their own": (
        "Dehnung;Kraft\n%;N\n" + rows([100 * STRAIN, FORCE], ";", ",")
    ).encode(),
    "blanks": ("# strip\ntime_s extension_cm force_kN\n" + rows([TIME, MM / 10, FORCE / 1e3], " ")).encode(),
    "Spanish, semicolons at the ends": (
        "Alargamiento en mm;Carga en N;\n".replace(" en ", " / ") + rows([MM, FORCE], ";", ",").replace("\n", ";\n")
    ).encode("utf-8-sig"),
    "Windows' ends of lines, other order": (
        "Force / N,Strain / mm/mm\n" + rows([FORCE, STRAIN], ",")
    ).replace("\n", "\r\n").encode(),
    "quoted decimal commas between commas": (
        "Dehnung (%),Kraft (N)\n"
        + "".join(f'"{100 * e:g}","{f:g}"\n'.replace(".", ",") for e, f in zip(STRAIN, FORCE, strict=True))
    ).encode(),
    "German, grouped thousands, units in a line of their own": (
        "Einspannlänge;200;mm\nDehnung;Kraft\n%;mN\n"
        + "".join(
            f"{100 * e:.3f};{1e3 * f:_.2f}\n".replace(".", ",").replace("_", ".")
            for e, f in zip(STRAIN, FORCE, strict=True)
        )
    ).encode(),
    "quoted, grouped thousands": (
        "Strain,Load\n%,mN\n"
        + "".join(f'"{100 * e:g}","{1e3 * f:,.1f}"\n' for e, f in zip(STRAIN, FORCE, strict=True))
    ).encode(),
    "Swiss, apostrophes": (
        "Dehnung (%);Kraft (mN)\n"
        + "".join(f"{100 * e:g};{1e3 * f:_.0f}\n".replace("_", "'") for e, f in zip(STRAIN, FORCE, strict=True))
    ).encode(),
    "French, narrow blanks": (
        "Allongement (%);Force (mN)\n"
        + "".join(
            f"{100 * e:g};{1e3 * f:_.1f}\n".replace(".", ",").replace("_", "\u202f")
            for e, f in zip(STRAIN, FORCE, strict=True)
        )
    ).encode(),
}  # fmt: skip


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "strip.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.mark.parametrize("dialect", DIALECTS)
def test_dialects(dialect, tmp_path):
    (curve,) = textile.read_curves(written(tmp_path, DIALECTS[dialect]), length=LENGTH, width=WIDTH)
    assert curve.deformation == approx(STRAIN, abs=1e-12)
    assert curve.load == approx(FORCE / WIDTH, abs=1e-9)
    assert (curve.name, curve.test, curve.length, curve.width) == ("strip", "tension", LENGTH, WIDTH)
    if curve.time is not None:
        assert curve.time == approx(TIME)
    assert (curve.time is not None) == any(word in DIALECTS[dialect].lower() for word in (b"zeit", b"time"))


def test_a_lone_group_of_thousands_wants_its_mark_told(tmp_path):
    path = written(tmp_path, 'Strain (%),Load (mN)\n0,0\n1.5,"1,250"\n2.5,"4,500"\n')
    with pytest.raises(RecordingError, match="tell it by decimal="):
        textile.read_curves(path, width=WIDTH)
    (curve,) = textile.read_curves(path, width=WIDTH, decimal=".")
    assert curve.load * WIDTH == approx([0.0, 1.25, 4.5])


def test_without_a_header_columns_are_told(tmp_path):
    path = written(tmp_path, rows([MM, FORCE], ";", ","))
    told = {"columns": {"deformation": 1, "load": 2}, "units": {"deformation": "mm", "load": "N"}}
    (curve,) = textile.read_curves(path, length=LENGTH, width=WIDTH, **told)
    assert curve.load == approx(FORCE / WIDTH)
    with pytest.raises(RecordingError, match="no column that could be the deformation"):
        textile.read_curves(path, length=LENGTH, width=WIDTH)


BELOW = "Specimen 1\nExt (mm),Load (N)\n{0}\nSpecimen 2\nExt (mm),Load (N)\n{1}"
PAIRS = "Ext 1 (mm);Load 1 (N);Ext 2 (mm);Load 2 (N)\n"


@pytest.mark.parametrize("layout", ["below", "one header", "beside", "numbered"])
def test_repeats(layout, tmp_path):
    short = slice(0, 4)
    if layout == "below":
        text = BELOW.format(rows([MM, FORCE], ","), rows([MM[short], 2 * FORCE[short]], ","))
    elif layout == "one header":
        text = "Ext (mm),Load (N)\nSpecimen,1\n" + rows([MM, FORCE], ",")
        text += "Specimen,2\n" + rows([MM[short], 2 * FORCE[short]], ",")
    elif layout == "beside":
        text = PAIRS + "".join(
            ";".join([f"{MM[k]:g}", f"{FORCE[k]:g}", *([f"{MM[k]:g}", f"{2 * FORCE[k]:g}"] if k < 4 else ["", ""])])
            + "\n"
            for k in range(6)
        )
    else:
        number = np.r_[np.ones(6), np.full(4, 2)]
        columns = [number, np.r_[MM, MM[short]], np.r_[FORCE, 2 * FORCE[short]]]
        text = "Specimen,Ext (mm),Load (N)\n" + rows(columns, ",")
    first, second = textile.read_curves(written(tmp_path, text), length=LENGTH, width=WIDTH)
    assert [first.name, second.name] == ["strip 1", "strip 2"]
    assert first.deformation == approx(STRAIN) and first.load == approx(FORCE / WIDTH)
    assert second.deformation == approx(STRAIN[short]) and second.load == approx(2 * FORCE[short] / WIDTH)


@pytest.mark.parametrize("line", ["Gauge length;200;mm", "Gauge length: 20,0 cm", "gauge length (mm) = 200"])
def test_sizes_from_the_preamble(line, tmp_path):
    path = written(tmp_path, f"Probenbreite 50 mm\n{line}\nWeg [mm];Kraft [N]\n" + rows([MM, FORCE], ";", ","))
    (curve,) = textile.read_curves(path, length="Gauge length", width="Probenbreite")
    assert (curve.length, curve.width) == (approx(0.2), approx(0.05))
    assert curve.deformation == approx(STRAIN)


def test_shear_and_bending(tmp_path):
    path = written(tmp_path, "Displacement (mm),Force (gf/cm)\n" + rows([MM, FORCE], ","))
    (sheared,) = textile.read_curves(path, test="shear", length=LENGTH)
    assert np.tan(sheared.deformation) == approx(STRAIN)
    assert sheared.load == approx(FORCE * 100 * GF)
    path = written(tmp_path, "Curvature (cm-1);Moment (gf·cm/cm)\n" + rows([STRAIN, FORCE], ";"))
    (bent,) = textile.read_curves(path, test="bending")
    assert bent.deformation == approx(100 * STRAIN)
    assert bent.load == approx(FORCE * GF)


TABLE = "Time (s),Ext (mm),Load (N)\n"


@pytest.mark.parametrize(
    ("text", "told", "place", "message"),
    [
        (TABLE + "0,0,0\n2,1,1\n1,2,2\n", {}, r"line 4, column 1 \(Time\)", "a time before"),
        ("Time (s),Ext (mm)\n0,0\n1,1\n2,2\n", {}, "line 1", "no column that could be the load"),
        (TABLE.replace("(N)", "(kp)") + "0,0,0\n1,1,1\n2,2,2\n", {}, r"line 1, column 3 \(Load\)", "'kp'"),
        (TABLE.replace(" (N)", "") + "0,0,0\n1,1,1\n2,2,2\n", {}, "line 1, column 3", "has no unit"),
        ("Ext (mm);Load (N)\n0;0\n1;0.5\n2,5;1.5\n3;2.5\n", {}, r"line 4, column 1 \(Ext\)", "decimal mark ','"),
        ("Ext (mm);Load (mN)\n0,0;0,5\n1,0;1.040\n2,0;2.040\n", {}, r"column 2 \(Load\)", "decimal mark '.'"),
        ("Ext (mm);Load (N)\n0,0;0\n1;0.5\n2.5;1.5\n3;2.5\n", {}, r"line 2, column 1 \(Ext\)", "decimal mark ','"),
        ("Ext (mm),Load (N)\n0,0,0,0\n0,5,1,25\n1,0,2,5\n", {}, "line 2", "twice the cells"),
        ("Ext (mm);Load (N)\n0,0;0,1\n1,0;2,5\n", {"decimal": "."}, "strip.csv", "holds no table"),
        ("Ext (mm);Load (N)\n0;0\n1;--\n2;1\n3;2\n", {}, "line 3, column 2", "is not a number"),
        ("Ext (mm);Load (N)\n0;0\n1;\n2;1\n3;2\n", {}, "line 3, column 2", "empty above"),
        ("Ext (mm);Load (N)\n0;0\nNaN;1\n2;1\n3;2\n", {}, "line 3, column 1", "is not a number"),
        ("Ext (mm);Load (N)\n0;0\n---;---\n2;1\n3;2\n", {}, "line 3, column 1", "is not a number"),
        ("Ext (mm);Load (N)\n0;0\n1;1\n2;1\n3;\n", {}, "line 5, column 2", "not as many numbers"),
        ("Ext (mm);Load (N)\n0;0\n1;1;7\n2;1\n3;2\n", {}, "line 3", "must have 2 cells"),
        ("Ext (mm);Strain (%);Load (N)\n0;0;0\n1;1;1\n2;2;2\n", {}, "line 1", "several columns that could be the def"),
        ("Ext (mm);Load (N)\n0;0\n1;1\n2;2\n", {"test": "bending"}, "line 1", "curvature"),
        ("Breite: ?\nExt (mm);Load (N)\n0;0\n1;1\n2;2\n", {"width": "Breite"}, "line 1", "no width with its unit"),
        ("Ext (mm);Load (N)\n0;0\n1;1\n2;2\n", {"width": "Breite"}, "strip.csv", "starts with 'Breite'"),
        ("nothing\nhere\n", {}, "strip.csv", "no table"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(text, told, place, message, tmp_path):
    with pytest.raises(RecordingError, match=message) as caught:
        textile.read_curves(written(tmp_path, text), **({"length": LENGTH, "width": WIDTH} | told))
    assert caught.match(place)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"width": None}, "width: is missing"),
        ({"length": None}, "length: is missing"),
        ({"length": -1.0}, "length: must be positive"),
        ({"test": "tear"}, "test: is unknown"),
        ({"columns": {"force": 2}}, "columns: name no role"),
        ({"columns": {"load": 7}}, "columns: name no column"),
        ({"columns": {"load": "Kraft"}}, "columns: name no column"),
        ({"units": {"load": "kp"}}, "is not a known unit"),
        ({"decimal": ";"}, "decimal"),
    ],
)
def test_bad_arguments(told, message, tmp_path):
    path = written(tmp_path, "Ext (mm),Load (N)\n" + rows([MM, FORCE], ","))
    with pytest.raises(sb.InputError, match=message):
        textile.read_curves(path, **({"length": LENGTH, "width": WIDTH} | told))


def test_no_file():
    with pytest.raises(RecordingError, match="is not a file"):
        textile.read_curves("nowhere.csv")


@pytest.mark.parametrize(
    ("text", "dimension", "factor"),
    [
        ("cN/cm", "force per width", 1.0),
        ("gf/cm", "force per width", 0.980665),
        ("kgf", "force", 9.80665),
        ("gf.cm/cm", "moment per width", GF),
        ("mN·mm/mm", "moment per width", 1e-3),
        ("cm^-1", "curvature", 100.0),
        ("1/cm", "curvature", 100.0),
        ("mm/mm", "strain", 1.0),
        ("%", "strain", 0.01),
        ("°", "angle", np.pi / 180),
        ("min", "time", 60.0),
    ],
)
def test_units(text, dimension, factor):
    found = unit(text)
    assert found is not None and (found.dimension, found.factor) == (dimension, approx(factor))


@pytest.mark.parametrize("text", ["", "MPa", "N/N", "kp", "m/s", "Nm/", "1/N", "mm2"])
def test_no_units(text):
    assert unit(text) is None


def test_quantities():
    assert quantity("width", "5cm", "length") == (approx(0.05), "length")
    assert quantity("pretension", "2,5 cN/cm", "force", "force per width") == (approx(2.5), "force per width")
    for text in ("5", "cm", "5 N", "5..2 cm"):
        with pytest.raises(sb.InputError, match="width"):
            quantity("width", text, "length")


@pytest.mark.parametrize("pull", ["garter_x", "rib_y", "stockinette_y"])
def test_a_shipped_knit_comes_back(pull, tmp_path):
    """Five repeats side by side, of different length, in mm and cN with decimal commas."""
    data = Path(__file__).resolve().parents[2] / "experiments/knit_uniaxial/data" / f"{pull}.npz"
    arrays = np.load(data)
    bottom, top = (arrays["pins"][:, :, k].astype(float) for k in (2, 3))
    extension, force = np.linalg.norm(top - bottom, axis=2), arrays["force"].astype(float)
    seen = [np.flatnonzero(~np.isnan(f)) for f in force]
    columns = [c[k][seen[k]] * per for k in range(5) for c, per in ((extension, 100.0), (force, 100.0))]
    cells = [[f"{c[row]:.9g}" if row < len(c) else "" for c in columns] for row in range(max(map(len, columns)))]
    header = ";".join(f"Weg {k} [mm];Kraft {k} [cN]" for k in range(1, 6))
    path = written(tmp_path, header + "\n" + "\n".join(";".join(row) for row in cells).replace(".", ","))
    curves = textile.read_curves(path, length=0.1, width=0.1)
    assert len(curves) == 5
    for k, curve in enumerate(curves):
        assert curve.deformation == approx(extension[k][seen[k]], rel=1e-8)
        assert curve.load == approx(force[k][seen[k]] / 0.1, abs=1e-6)
        cut = curve.from_pretension(10.0)  # 1 N
        assert cut.load[0] == approx(10.0) and cut.cycles()[0].lost is None


def test_a_cell_of_many_digits_takes_linear_time(tmp_path):
    """A letter after 30,000 digits: no number, which matching must not try to split in every place."""
    path = tmp_path / "strip.csv"
    path.write_text("Weg [mm];Kraft [N]\n0,0;0,0\n1,0;1,0\n2,0;2,0\n" + f"{'9' * 30_000}x;1,0\n")
    began = time.process_time()
    (curve,) = textile.read_curves(path, length=LENGTH, width=WIDTH)
    assert len(curve.load) == 3 and time.process_time() - began < 2.0
