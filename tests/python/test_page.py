"""The HTML pages of fits and motions: what they hold, that they need no network, and that a browser draws them."""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.cli.app import app
from sheetbend.mesh import grid
from sheetbend.objects.arm import add_arm, add_pendulum
from sheetbend.page import Shown, fit_page, motion_page, of_recording, of_trajectory
from sheetbend.page.packed import MISSING, packed_motions
from sheetbend.page.render import table
from sheetbend.report.fit_result import FitResult
from sheetbend.report.report import sections
from sheetbend.report.tables import Section
from sheetbend.result.estimate import Correlation
from typer.testing import CliRunner

pytest.importorskip("jinja2")
ROOT = Path(__file__).resolve().parents[2]
VENDOR = ROOT / "python" / "sheetbend" / "page" / "vendor"
LARGEST = 5_000_000  # bytes of a page


def swinging(**changed: float) -> sb.Scene:
    return sb.rope(0.4, 8, density=0.05, clamp_start=(1, 0, 0), **{"EI": 1e-3, "bend_damping": 3e-3, **changed})


@pytest.fixture(scope="module")
def fitted() -> sb.Fit:
    times = np.arange(40) / 100
    true = swinging()
    seen = true.ropes["rope"].particles[3::2]
    x = sb.simulate(true, times, sb.Solver(h=1 / 200)).positions[:, seen]
    x += 1e-3 * np.random.default_rng(4).standard_normal(x.shape)
    x[7, 1] = np.nan
    return sb.fit(
        swinging(EI=2e-3),
        sb.Recording(x, times, name="take"),
        {"rope_EI": {}, "rope_bend_damping": {}},
        markers=[sb.on_particle(int(p)) for p in seen],
        solver=sb.Solver(h=1 / 200),
        fit=(0.0, 0.3),
        held_out=(0.3, 0.4),
    )


def test_the_page_draws_the_cost_along_each_parameter(fitted: sb.Fit) -> None:
    page = fit_page(fitted, "swing")
    lines = re.findall(r'<polyline class="(\w+)" points="([^"]+)"', page)
    assert [kind for kind, _ in lines] == ["parabola", "curve"] * 2
    for kind, points in lines:
        places = np.array([[float(x) for x in point.split(",")] for point in points.split()])
        assert (np.diff(places[:, 0]) > 0).all() and places[0, 0] == 0.0 and places[-1, 0] == 200.0
        if kind == "curve":
            assert places[[0, -1], 1] == pytest.approx(90 * 0.3 / 1.3, abs=0.06)
            assert places[:, 1].max() == 90.0
    assert "<figcaption>rope_EI [N m²]</figcaption>" in page
    for ends in re.findall(r'<div class="ends"><span>(.*?)</span><span>(.*?)</span><span>(.*?)</span>', page):
        first, middle, last = map(float, ends)  # which were alike where the interval is narrow
        assert first < middle < last


def test_tables_have_no_empty_columns_and_raised_powers() -> None:
    section = Section("t", ("given", "value", "unit"), (("a", "", "N m^2"), ("b", "", "kg")), (("gauge", "x^0.5 y^2"),))
    shown = table(section)
    assert shown["headers"] == ["given", "unit"] and shown["rows"] == [["a", "N m²"], ["b", "kg"]]
    assert shown["left"] == [True, True] and shown["notes"] == [("gauge", "x^0.5 y²")]


def data_of(page: str) -> dict[str, Any]:
    (content,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(content)


def places_of(motion: dict[str, Any], packed: str) -> np.ndarray:
    """(frames, n, 3) m, as the page's script decodes it."""
    numbers = np.frombuffer(base64.b64decode(packed), "<i2").reshape(motion["frames"], -1, 3).astype(float)
    numbers[numbers == MISSING] = np.nan
    return np.array(motion["middle"]) + motion["scale"] * numbers


class TestFitPage:
    def test_holds_the_report_and_the_result(self, fitted: sb.Fit) -> None:
        page = fit_page(fitted, "swing", about="a rope", configuration="a = 1", command="sheetbend fit a.toml")
        for section in sections(fitted.result):
            assert f"<h2>{section.title.replace('<', '&lt;')}</h2>" in page
        for estimate in fitted.result.estimates:
            assert f'<td class="left">{estimate.name}</td>' in page
        packed = base64.b64decode(data_of(page)["fit"])
        assert FitResult.from_dict(json.loads(gzip.decompress(packed))) == fitted.result

    def test_motion_and_markers_are_those_of_the_fit(self, fitted: sb.Fit) -> None:
        (motion,) = data_of(fit_page(fitted, "swing"))["motions"]
        (c,) = fitted.comparisons
        exact = c.recording.positions
        found = places_of(motion, motion["measured"])
        np.testing.assert_array_equal(np.isnan(found), np.isnan(exact))
        assert np.nanmax(np.abs(found - exact)) <= 0.51 * motion["scale"]
        assert motion["scale"] < 1e-5 * np.ptp(exact[:, :, 2][np.isfinite(exact[:, :, 2])]) * 10
        # the rope passes through the simulated markers, which are its own nodes
        rope = places_of(motion, motion["lines"][0]["places"])
        assert motion["lines"][0]["kind"] == "rope"
        away = np.linalg.norm(rope[:, None] - c.simulated[:, :, None], axis=-1).min(axis=-1)
        assert away.max() < 3 * motion["scale"]
        assert motion["heldOut"] == c.held_out.astype(int).tolist()

    def test_residuals_are_distances(self, fitted: sb.Fit) -> None:
        (motion,) = data_of(fit_page(fitted, "swing"))["motions"]
        (c,) = fitted.comparisons
        numbers = np.frombuffer(base64.b64decode(motion["residual"]["distances"]), "<u2").reshape(40, -1)
        exact = np.linalg.norm(c.recording.positions - c.simulated, axis=2)
        assert (numbers == 65535).sum() == 1 and numbers[7, 1] == 65535
        seen = np.isfinite(exact)
        np.testing.assert_allclose(numbers[seen] / 65534 * motion["residual"]["largest"], exact[seen], atol=1e-7)

    def test_texts_are_escaped(self, fitted: sb.Fit) -> None:
        evil = "</script><script>alert(1)</script>"
        page = fit_page(fitted, evil, about=evil, configuration=evil, command=evil)
        assert "<script>alert(1)" not in page
        shown = replace(of_recording(sb.Recording(np.zeros((2, 1, 3)), [0, 1]), evil), markers=(evil,))
        assert "<script>alert(1)" not in motion_page([shown], evil, evil, evil)
        warned = replace(fitted.result, warnings=(f"give `sigma` {evil}",))
        page = fit_page(replace(fitted, result=warned), "warned")
        assert "give <code>sigma</code> &lt;/script" in page and "<script>alert(1)" not in page

    def test_its_headline_warns_of_how_the_fit_ended_and_not_of_doubtful_values(self, fitted: sb.Fit) -> None:
        doubtful = tuple(replace(one, verdict="doubtful") for one in fitted.result.estimates)
        ended = replace(fitted.result, estimates=doubtful, converged=True, interrupted=False)
        for result, tone in ((ended, "mixed"), (replace(ended, converged=False), "bad")):
            assert f'<header class="{tone}">' in fit_page(replace(fitted, result=result), "ended")

    def test_400_parameters_fit_into_it(self, fitted: sb.Fit) -> None:
        one = fitted.result.estimates[0]
        names = [f"cloth_stiffness_{k}" for k in range(400)]
        pairs = tuple(Correlation(first=a, second=b, value=0.123) for i, a in enumerate(names) for b in names[:i])
        result = replace(
            fitted.result,
            estimates=tuple(replace(one, name=n) for n in names),
            profiles=tuple(replace(fitted.result.profiles[0], name=n) for n in names),
            correlations=pairs,
            premises=(),
        )
        page = fit_page(replace(fitted, result=result), "many")
        assert len(page.encode()) < LARGEST and names[-1] in page

    def test_a_motion_that_diverges_leaves_its_markers(self, fitted: sb.Fit, monkeypatch: pytest.MonkeyPatch) -> None:
        def diverges(*_: object) -> Shown:
            raise sb.SheetbendError("the motion diverged")

        monkeypatch.setattr("sheetbend.page.of_fit.fitted_motion", diverges)
        page = fit_page(fitted, "lost")
        (motion,) = data_of(page)["motions"]
        assert motion["lines"] == [] and motion["measured"] and "only its markers are drawn" in page


class TestMotionPage:
    def test_the_arm_of_a_pendulum_is_no_rope(self) -> None:
        scene = sb.Scene()
        add_pendulum(scene, length=0.2, angle=1.0)
        shown = of_trajectory(scene, sb.simulate(scene, [0.0, 0.01], sb.Solver(h=1 / 200)))
        (motion,) = data_of(motion_page([shown], "pendulum"))["motions"]
        assert [line["kind"] for line in motion["lines"]] == ["link"]

    def test_an_arm_is_a_line_from_its_pivot_to_its_end(self) -> None:
        """Two arms were drawn as the two rhombi of the distances that keep them rigid."""
        scene = sb.Scene()
        upper = add_arm(scene, "upper", mass=1.0, first_moment=0.1, inertia=0.02, length=0.3, angle=1.0)
        add_arm(scene, "lower", mass=1.0, first_moment=0.1, inertia=0.02, length=0.3, pivot=upper)
        shown = of_trajectory(scene, sb.simulate(scene, [0.0, 0.01], sb.Solver(h=1 / 200)))
        (motion,) = packed_motions([shown])
        assert [line["nodes"] for line in motion["lines"]] == [2, 2] and motion["masses"] is None
        np.testing.assert_array_equal(*(list(shown.lines.values())[k][:, 1 - k] for k in (0, 1)))  # they share a hinge

    def test_what_a_rigid_body_is_drawn_as_is_said(self) -> None:
        """A flag's pole was a large box, and nothing said why."""
        scene = sb.Scene("box")
        scene.add_body("box", of=sb.Inertia.box(1.0, (0.1, 0.2, 0.3)), at=(1.0, 2.0, 3.0))
        motion = sb.simulate(scene, [0.0, 0.01], sb.Solver(h=1 / 200))
        (packed,) = packed_motions([of_trajectory(scene, motion)])
        assert packed["hasBodies"] and [tick["name"] for tick in packed["ticks"]] == ["box"]

    def test_masses_on_particles_are_drawn(self) -> None:
        """The weight at the end of a rope was missing."""
        scene = sb.rope(0.3, 6, density=0.05, EI=1e-3, direction=(0, 0, -1), pinned=(0,))
        scene.add_point_mass(6, 0.02, "weight")
        motion = sb.simulate(scene, [0.0, 0.05], sb.Solver(h=1 / 200))
        (packed,) = packed_motions([of_trajectory(scene, motion)])
        found = places_of(packed, packed["masses"])[:, 0]
        assert np.abs(found - motion.positions[:, 6]).max() <= 0.51 * packed["scale"]

    def test_a_cloth_has_its_strain(self) -> None:
        scene = sb.Scene()
        mesh = grid(0.2, 0.2, 4, 4)
        sb.add_cloth(scene, mesh, density=0.1, warp=20.0, weft=20.0, shear=5.0, bending=1e-5, held=[0, 1, 2])
        scene.pin([0, 1, 2])
        motion = sb.simulate(scene, np.arange(5) / 50, sb.Solver(h=1 / 200))
        (packed,) = packed_motions([of_trajectory(scene, motion, "cloth")])
        (sheet,) = packed["sheets"]
        assert np.abs(places_of(packed, sheet["places"]) - motion.positions).max() <= 0.51 * packed["scale"]
        triangles = np.frombuffer(base64.b64decode(sheet["triangles"]), "<u4").reshape(-1, 3)
        np.testing.assert_array_equal(triangles, mesh.triangles)
        strain = np.frombuffer(base64.b64decode(sheet["strain"]), "u1").reshape(5, -1)
        assert strain[0].max() == 0 and strain.max() == 255 and sheet["largestStrain"] > 0

    def test_a_twisted_rod_shows_its_directors(self) -> None:
        scene = sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, start=sb.Grip.fixed((0, 0, 0), (1, 0, 0)))
        motion = sb.simulate(scene, [0.0, 0.05], sb.Solver(h=1 / 200))
        shown = of_trajectory(scene, motion)
        (ticks,) = shown.ticks.values()
        rope = shown.lines["rod"]
        np.testing.assert_allclose(ticks[:, -1, 0], rope[:, -2:].mean(axis=1), atol=1e-12)
        along, across = rope[:, -1] - rope[:, -2], ticks[:, -1, 1] - ticks[:, -1, 0]
        assert np.abs((along * across).sum(axis=1)).max() < 1e-3 * np.linalg.norm(along) * np.linalg.norm(across)

    def test_56_long_recordings_fit_into_it(self) -> None:
        rng = np.random.default_rng(0)
        x = rng.standard_normal((500, 13, 3))
        every = [
            Shown(
                f"take {k}", np.arange(500) / 100, {"rope": rng.standard_normal((500, 49, 3))}, measured=x, simulated=x
            )
            for k in range(56)
        ]
        page = motion_page([replace(s, markers=tuple(f"m{k}" for k in range(13))) for s in every], "all")
        assert len(page.encode()) < LARGEST

    def test_nothing_is_fetched(self) -> None:
        page = motion_page([of_recording(sb.Recording(np.zeros((2, 1, 3)), [0, 1]), "still")], "still")
        own = page.replace((VENDOR / "three.min.js").read_text(), "").replace((VENDOR / "uplot.min.js").read_text(), "")
        assert len(own) < 0.2 * len(page)
        assert not re.search(r"https?://|\bsrc=|<link|@import|url\(|fetch\(|XMLHttpRequest|import\(", own)

    def test_the_surface_of_a_solid_is_called_one(self) -> None:
        scene = sb.solid(sb.mesh.bricks((0.1, 0.1, 0.1), (1, 1, 1)), name="block", density=1e3, E=1e6, poisson=0.3)
        motion = sb.simulate(scene, [0.0, 1e-3], sb.Solver(h=1e-3, method="newton"))
        (drawn,) = packed_motions([of_trajectory(scene, motion)])
        assert [sheet["kind"] for sheet in drawn["sheets"]] == ["solid"]

    def test_points_of_a_cloud_are_marked_as_such(self) -> None:
        """Curves of one point over time, which is another one in every frame, were drawn."""
        cloud = sb.Cloud.of([np.zeros((3, 3)), np.ones((3, 3))], [0.0, 0.1])
        (motion,) = packed_motions([of_recording(cloud, "points")])
        assert motion["isCloud"] and len(motion["markers"]) == 3
        (motion,) = packed_motions([of_recording(sb.Recording(np.ones((2, 1, 3)), [0, 1]), "markers")])
        assert not motion["isCloud"]


class TestCommands:
    def test_view_of_a_recording(self, tmp_path: Path) -> None:
        sb.Recording(np.random.default_rng(1).standard_normal((5, 2, 3)), np.arange(5) / 10).save(tmp_path / "a.npz")
        done = CliRunner().invoke(
            app, ["view", str(tmp_path / "a.npz"), "--output", str(tmp_path / "a.html"), "--json"]
        )
        assert done.exit_code == 0, done.output
        (motion,) = data_of((tmp_path / "a.html").read_text())["motions"]
        assert motion["frames"] == 5 and len(motion["markers"]) == 2

    def test_what_hangs_along_y_is_drawn_upright(self, tmp_path: Path) -> None:
        hanging = np.linspace([0, 1, 0], [0, 0.2, 0], 5) + 1e-3 * np.random.default_rng(1).standard_normal((20, 5, 3))
        for gravity, up in ((None, [0, 1, 0]), ((0, 0, -9.81), [0, 0, 1])):
            sb.Recording(hanging, np.arange(20) / 10, gravity=gravity).save(tmp_path / "a.npz")
            page = tmp_path / "a.html"
            assert CliRunner().invoke(app, ["view", str(tmp_path / "a.npz"), "--output", str(page)]).exit_code == 0
            assert data_of(page.read_text())["motions"][0]["up"] == up
            assert ("y, a guess" in page.read_text()) == (gravity is None)

    def test_views_of_a_recording_and_of_its_configuration_are_two_files(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(tmp_path)
        sb.Recording(np.random.default_rng(1).standard_normal((5, 2, 3)), np.arange(5) / 10).save("a.csv")
        Path("a.toml").write_text(
            '[experiment]\nname = "a"\n[[scene.rope]]\nlength = 1.0\nsegments = 4\ndensity = 1.0\n'
        )
        assert [CliRunner().invoke(app, ["view", file]).exit_code for file in ("a.csv", "a.toml")] == [0, 0]
        assert {path.name for path in Path("out").iterdir()} == {"a.html", "a_simulated.html"}

    @pytest.mark.parametrize(
        ("arguments", "words"),
        [
            (["a.npz", "--output", "a.txt"], "is not an HTML file"),
            (["a.toml", "--units", "mm"], "is for recordings"),
            (["b.npz"], "b.npz"),
        ],
    )
    def test_bad_input(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str) -> None:
        monkeypatch.chdir(tmp_path)
        sb.Recording(np.zeros((2, 1, 3)), [0, 1]).save("a.npz")
        done = CliRunner().invoke(app, ["view", *arguments])
        assert done.exit_code == 2 and words in done.output.replace("\n", " ")

    def test_a_fit_without_jinja2_is_told_before_the_work(
        self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        from sheetbend.cli import pages
        from sheetbend.cli.screen import Screen

        monkeypatch.setitem(sys.modules, "jinja2", None)
        assert not pages.page_possible(Screen())
        assert "no report.html will be written" in capsys.readouterr().out


def test_vendored_scripts_are_as_they_were_made() -> None:
    from hashlib import sha256

    lines = (VENDOR / "SHA256SUMS").read_text().split("\n")[:-1]
    assert len(lines) == 3
    for line in lines:
        digest, name = line.split()
        assert sha256((VENDOR / name).read_bytes()).hexdigest() == digest, name
    versions = json.loads((ROOT / "tools" / "page" / "package.json").read_text())["devDependencies"]
    told = (ROOT / "licenses" / "README.md").read_text()
    assert f"three.js {versions['three']}" in told and f"uPlot {versions['uplot']}" in told
    assert all(
        "Permission is hereby granted" in (ROOT / "licenses" / f"{n}-MIT.txt").read_text() for n in ("three", "uplot")
    )


def drawn_by_chromium(page: Path, folder: Path, at: str = "") -> str:
    """The page's elements as the browser leaves them, without a network."""
    command = ["chromium", "--headless", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    command += ["--host-resolver-rules=MAP * ~NOTFOUND", "--window-size=1400,1000", f"--user-data-dir={folder / 'u'}"]
    command += ["--virtual-time-budget=3000", "--dump-dom", page.as_uri() + at]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


@pytest.mark.skipif(shutil.which("chromium") is None, reason="Chromium is not installed")
@pytest.mark.slow
def test_a_browser_draws_it_without_a_network(fitted: sb.Fit, tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text(fit_page(fitted, "swing"))
    page = drawn_by_chromium(tmp_path / "report.html", tmp_path, "#t=0.2")
    assert "<title>swing \u2713</title>" in page  # set when all is drawn
    assert re.search(r'<div id="space">\s*<canvas', page) and "0.200 s" in page
    assert page.count('class="uplot') >= 4
    assert "Drag to turn, scroll to zoom. A cell of the floor is 10 cm." in page and "rows from m0 to" in page
    assert re.search(r'<ul id="pairs"[^>]*><li>rope_EI</li><li>rope_bend_damping</li>', page)
    assert '<span id="controls">' in page and "<h2>Motion</h2>" in page


@pytest.mark.skipif(shutil.which("chromium") is None, reason="Chromium is not installed")
@pytest.mark.slow
def test_a_shape_at_rest_has_nothing_to_play(tmp_path: Path) -> None:
    """A wire at rest had a button, a slider and a choice of speeds at 0.000 s."""
    x = np.linspace([0.0, 0.0, 0.0], [0.4, 0.0, -0.1], 5)[None]
    page = motion_page([of_recording(sb.Recording(x, [0]), "wire")], "wire")
    (tmp_path / "wire.html").write_text(page)
    page = drawn_by_chromium(tmp_path / "wire.html", tmp_path)
    assert "<title>wire \u2713</title>" in page
    assert re.search(r'<span id="controls" hidden="">', page) and "<h2>Shape at rest</h2>" in page


def test_a_late_camera_s_motion_is_drawn_where_its_markers_are() -> None:
    times, late, solver = np.arange(30) / 100, 0.1, sb.Solver(h=1 / 200)
    scene = swinging()
    scene.add_quantity("clock", -late, "s", positive=False, scale=0.1)
    seen = scene.ropes["rope"].particles[3::2]
    x = sb.simulate(swinging(), np.arange(30) / 100, solver).positions[:, seen]
    recording = sb.Recording(x, times + late, name="late")
    places = [sb.on_particle(int(p)) for p in seen]
    e = sb.Experiment(
        scene=scene, recording=recording, markers=places, solver=solver, start_time=0.0, time_offset="clock"
    )
    found = sb.fit(e, parameters={"rope_EI": {}}, refine=False, profiles=False)
    (motion,) = data_of(fit_page(found, "late"))["motions"]
    rope, measured = (places_of(motion, part) for part in (motion["lines"][0]["places"], motion["measured"]))
    away = np.linalg.norm(rope[:, None] - measured[:, :, None], axis=-1).min(axis=-1)
    assert away.max() < 5 * motion["scale"]


# Measures a page in a frame of 400 pixels, which a headless window cannot be; a table that scrolls may be wider.
_MEASURE = """<body style="margin:0"><iframe style="border:0;width:400px;height:3000px" srcdoc="%s"></iframe><script>
addEventListener("load", () => setTimeout(() => {
  const inner = document.querySelector("iframe").contentDocument, found = [];
  const box = (e) => e.getBoundingClientRect();
  const named = (e) => `${e.tagName}.${e.className} ${e.textContent.slice(0, 30)}`;
  for (const e of inner.querySelectorAll("main *"))
    if (box(e).right > 400.5 && !e.closest(".scroll > table:not(.judged)")) found.push(`wide: ${named(e)}`);
  for (const row of inner.querySelectorAll(".judged tbody tr"))
    for (const a of row.cells) for (const b of row.cells) {
      const p = box(a), q = box(b), across = Math.min(p.right, q.right) - Math.max(p.left, q.left);
      const down = Math.min(p.bottom, q.bottom) - Math.max(p.top, q.top);
      if (a !== b && across > 0.5 && down > 0.5) found.push(`covered: ${named(a)}`);
    }
  const told = document.createElement("pre");
  told.id = "found";
  told.textContent = `${inner.title}; ${inner.querySelectorAll(".judged tbody tr").length} rows; ${found.join("; ")}`;
  document.body.append(told);
}, 1500));
</script></body>"""


@pytest.mark.skipif(shutil.which("chromium") is None, reason="Chromium is not installed")
@pytest.mark.slow
def test_nothing_is_cut_off_or_covered_on_a_telephone(fitted: sb.Fit, tmp_path: Path) -> None:
    """The column of verdicts covered the numbers beside it."""
    first, second = fitted.result.estimates
    long = replace(second, name="cloth_of_the_left_sleeve_bending_stiffness_along_warp", verdict="not identifiable")
    page = fit_page(replace(fitted, result=replace(fitted.result, estimates=(first, long))), "swing")
    (tmp_path / "narrow.html").write_text(_MEASURE % html.escape(page))
    drawn = drawn_by_chromium(tmp_path / "narrow.html", tmp_path)
    (told,) = re.findall(r'<pre id="found">(.*?)</pre>', drawn, re.S)
    assert told == "swing \u2713; 2 rows; "
