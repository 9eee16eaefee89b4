"""Configurations: what they build, and what they say about every wrong key."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.config import load, parse
from sheetbend.config.named_files import named_files
from sheetbend.config.reference import fabric_tables, renewed
from sheetbend.config.values import with_finer, with_values, write

ROOT = Path(__file__).parents[2]

ROPE = """\
[experiment]
name = "swing"
about = "A synthetic rope."

[solver]
substeps = 4

[scene]
gravity = [0, 0, -9.81]

[[scene.rope]]
name = "rope"
length = 0.6
segments = 6
density = 0.05
EA = 1e3
EI = 2e-3
bend_damping = 0.02
points = "recording"
pinned = [0]

[[recording]]
file = "swing.npz"
fit = [0.0, 0.2]
held_out = [0.2, 0.31]
sigma = 1e-4

[parameters.rope_EI]
lower = 1e-5
upper = 1.0

[parameters.rope_bend_damping]

[published]
rope_EI = 1e-3
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a recording of a rope, one marker per node."""
    scene = sb.rope(0.6, 6, density=0.05, EA=1e3, EI=1e-3, bend_damping=0.01)
    motion = sb.simulate(scene, np.arange(31) / 100, sb.Solver(h=1 / 800))
    noise = 1e-4 * np.random.default_rng(1).standard_normal(motion.positions.shape)
    sb.Recording(positions=motion.positions + noise, times=motion.times, name="swing").save(tmp_path / "swing.npz")
    return tmp_path


def written(folder: Path, text: str) -> Path:
    path = folder / "my.toml"
    path.write_text(text)
    return path


def changed(folder: Path, old: str, new: str) -> Path:
    assert ROPE.count(old) == 1, old
    return written(folder, ROPE.replace(old, new))


def extended(folder: Path, scene: str, recording: str = "", parameters: str = "") -> Path:
    """ROPE with more tables in the scene, and more keys in the recording."""
    text = ROPE.replace("[[recording]]", f"{scene}\n[[recording]]").replace(
        "sigma = 1e-4", f"sigma = 1e-4\n{recording}"
    )
    return written(folder, text + parameters)


class TestBuild:
    def test_one_scene_per_recording(self, folder: Path) -> None:
        second = '\n[[recording]]\nfile = "swing.npz"\nname = "again"\n'
        study = load(changed(folder, "[parameters.rope_EI]", f"{second}\n[parameters.rope_EI]"))
        assert [e.name for e in study.experiments] == ["swing", "again"]
        assert study.experiments[0].scene is not study.experiments[1].scene

    def test_substep_divides_the_frame_interval(self, folder: Path) -> None:
        (e,) = load(written(folder, ROPE)).experiments
        assert e.solver.h == pytest.approx(0.01 / 4, rel=1e-12)

    def test_points_from_the_recording_at_the_start_of_the_fit(self, folder: Path) -> None:
        (e,) = load(changed(folder, "fit = [0.0, 0.2]", "fit = [0.1, 0.2]")).experiments
        measured = sb.Recording.load(folder / "swing.npz")
        frame = int(np.searchsorted(measured.times, 0.1 - 1e-9))
        # Resampled to equal links along the measured polyline, whose links differ by the noise.
        np.testing.assert_allclose(e.scene.positions[:7], measured.positions[frame], atol=2e-3)
        assert np.abs(e.scene.positions[:7] - measured.positions[0]).max() > 0.05

    @pytest.mark.parametrize("marker", [0, 6], ids=["first", "last"])
    def test_points_need_both_ends_at_the_start(self, folder: Path, marker: int) -> None:
        recording = sb.Recording.load(folder / "swing.npz")
        positions = recording.positions.copy()
        positions[:3, marker] = np.nan
        sb.Recording(positions, recording.times).save(folder / "swing.npz")
        with pytest.raises(sb.ConfigError, match=r"points: .*not seen at the start.*such as at 0\.03 s") as caught:
            load(written(folder, ROPE))
        assert caught.value.got == [f"m{marker}"]
        assert len(load(changed(folder, "[0.0, 0.2]", "[0.03, 0.2]")).experiments) == 1

    def test_a_marker_between_the_ends_may_be_unseen_at_the_start(self, folder: Path) -> None:
        recording = sb.Recording.load(folder / "swing.npz")
        positions = recording.positions.copy()
        positions[0, 3] = np.nan
        sb.Recording(positions, recording.times).save(folder / "swing.npz")
        (experiment,) = load(written(folder, ROPE)).experiments
        np.testing.assert_allclose(experiment.scene.positions[-1], positions[0, 6])

    @pytest.mark.parametrize("units", ["mm", "cm"])
    def test_points_of_another_unit_than_the_length_are_refused(self, folder: Path, units: str) -> None:
        with pytest.raises(sb.ConfigError, match=r"points: are .* m long at the start") as caught:
            load(changed(folder, "sigma = 1e-4", f'sigma = 1e-4\nunits = "{units}"'))
        assert caught.value.got == 0.6 and "`units`" in caught.value.fix

    def test_points_of_an_equilibrium_are_the_mean_of_its_frames(self, folder: Path) -> None:
        text = ROPE.replace("held_out = [0.2, 0.31]", "static = true")
        (e,) = load(written(folder, text)).experiments
        measured = sb.Recording.load(folder / "swing.npz").piece(0.0, 0.2)
        np.testing.assert_allclose(e.scene.positions[-1], measured.positions.mean(axis=0)[-1], atol=1e-12)

    def test_pinned_end_is_not_compared(self, folder: Path) -> None:
        (e,) = load(written(folder, ROPE)).experiments
        assert e.names == ("m1", "m2", "m3", "m4", "m5", "m6")

    def test_particles_constraints_masses(self, folder: Path) -> None:
        scene = """
        [[scene.particles]]
        name = "bob"
        positions = [[0.6, 0, -0.1]]
        [[scene.constraints]]
        name = "string"
        kind = "distance"
        particles = [["rope:end", "bob"]]
        compliance = 1e-4
        [[scene.point_mass]]
        name = "load"
        particle = "bob:0"
        mass = 0.02
        """
        (e,) = load(extended(folder, scene, "values = { load_mass = 0.03 }")).experiments
        assert e.scene.particle_count == 8
        assert e.scene.quantities["load_mass"].value == 0.03
        assert e.scene.quantities["string_compliance"].value == 1e-4
        group, _, _ = e.scene.group("string")
        assert group.particles.tolist() == [[6, 7]]
        mass = e.scene.compiled.unpack(e.scene.compiled.inputs())["mass"]
        assert mass[7] == pytest.approx(0.03)

    def test_named_force_acts_with_its_factors(self, folder: Path) -> None:
        scene = """
        [[scene.force]]
        particles = ["rope:1"]
        force = [0, 0, 3]
        times = [0.0, 0.001]
        [[scene.force]]
        name = "pull"
        particles = ["rope:-1"]
        force = [0, 0.5, -0.2]
        times = [0.0, 0.001]
        factors = [1.0, 0.25]
        """
        (e,) = load(extended(folder, scene)).experiments
        compiled = e.scene.compiled
        force = compiled.unpack(compiled.inputs(compiled.values({"pull_x": 0.1})))["force"].reshape(2, 2, 3)
        np.testing.assert_allclose(force[:, 0], [[0, 0, 3], [0, 0, 3]])
        np.testing.assert_allclose(force[:, 1], [[0.1, 0.5, -0.2], [0.025, 0.125, -0.05]])

    def test_driven_particles_follow_their_markers_on_the_scenes_clock(self, folder: Path) -> None:
        drive = '[[scene.drive]]\nparticles = ["rope:0"]\nmarkers = ["m0"]\noffset = [0, 0.01, 0]\n'
        text = (
            ROPE.replace("pinned = [0]\n", "")
            .replace("fit = [0.0, 0.2]", "fit = [0.05, 0.2]")
            .replace("[[recording]]", f"{drive}\n[[recording]]")
        )
        (e,) = load(written(folder, text)).experiments
        measured = sb.Recording.load(folder / "swing.npz").piece(0.05)
        np.testing.assert_allclose(e.scene.boundary.times, measured.times - 0.05, atol=1e-12)
        boundary = e.scene.base_arrays()["boundary"]
        np.testing.assert_allclose(boundary[:, 0], measured.positions[:, 0] + [0, 0.01, 0], atol=1e-12)

    def test_pendulum_and_arm_chain(self, folder: Path) -> None:
        text = """
        [experiment]
        name = "arms"
        [scene]
        [[scene.pendulum]]
        name = "single"
        length = 0.2
        [[scene.arm]]
        name = "upper"
        mass = 0.1
        first_moment = 0.01
        inertia = 0.0015
        length = 0.2
        angle = 0.3
        [[scene.arm]]
        name = "lower"
        mass = 0.1
        first_moment = 0.01
        inertia = 0.0015
        length = 0.2
        pivot = "upper"
        [[scene.constraints]]
        name = "spring"
        kind = "distance"
        particles = [["single:end", "upper:end"]]
        compliance = 1.0
        rest = 0.05
        """
        from sheetbend.config import scene_alone

        scene, _ = scene_alone(parse(written(folder, text)))
        assert {"single_angle", "upper_angle", "lower_inertia", "spring_compliance"} <= set(scene.quantities)

    def test_markers_on_rope_particle_and_between(self, folder: Path) -> None:
        markers = """
        [[recording.marker]]
        marker = 1
        arc_length = 0.1
        offset = [0, 0.01, 0]
        normal = [0, 0, 2]
        [[recording.marker]]
        marker = "m3"
        particle = "rope:3"
        [[recording.marker]]
        marker = "m5"
        between = ["rope:4", "rope:6"]
        fraction = 0.5
        """
        text = ROPE.replace("sigma = 1e-4\n", f"sigma = 1e-4\n{markers}\n").replace('points = "recording"\n', "")
        (e,) = load(written(folder, text)).experiments
        assert e.names == ("m1", "m3", "m5")
        first, third, fifth = (e.places[i] for i in (1, 3, 5))
        assert first is not None and third is not None and fifth is not None
        assert first.offset == (0.0, 0.01, 0.0) and first.normal == (0.0, 0.0, 1.0)
        assert third.particles == (3,) and fifth.particles == (4, 6) and fifth.weights == (0.5, 0.5)

    def test_shared_markers_serve_all_recordings(self, folder: Path) -> None:
        shared = '[[marker]]\nmarker = "m6"\nparticle = "rope:end"\n\n[parameters.rope_EI]'
        text = ROPE.replace("[parameters.rope_EI]", shared).replace('points = "recording"\n', "")
        (e,) = load(written(folder, text)).experiments
        assert e.names == ("m6",)

    def test_offset_and_clock_quantities(self, folder: Path) -> None:
        scene = '[scene.quantities.off]\nunit = "m"\nscale = 0.01\n[scene.quantities.clock]\nunit = "s"\nscale = 0.01\n'
        recording = 'offsets = { m6 = ["", "off", ""] }\ntime_offset = "clock"'
        (e,) = load(extended(folder, scene, recording)).experiments
        assert e.offsets == {"m6": (None, "off", None)} and e.time_offset == "clock"

    def test_private_parameters_start_at_each_recordings_value(self, folder: Path) -> None:
        second = '\n[[recording]]\nfile = "swing.npz"\nname = "again"\nvalues = { rope_EI = 5e-3 }\n'
        text = ROPE.replace("[parameters.rope_EI]", f"{second}\n[parameters.rope_EI]\nprivate = true")
        study = load(written(folder, text))
        from sheetbend.experiment.wanted import as_parameters
        from sheetbend.problem.problem import FitProblem

        problem = FitProblem(study.experiments, as_parameters(study.parameters, study.experiments))
        values = problem.parameters.to_physical(problem.parameters.initial())
        assert values["rope_EI[swing]"] == pytest.approx(2e-3) and values["rope_EI[again]"] == pytest.approx(5e-3)

    def test_tied_parameters_start_where_their_ties_lead(self, folder: Path) -> None:
        text = ROPE + '\n[parameters.rope_EA]\ntied_to = "rope_EI"\nfactor = 1e6\n'
        (e,) = load(written(folder, text)).experiments
        assert e.scene.quantities["rope_EA"].value == pytest.approx(2e3)

    def test_refinement_doubles_segments_and_keeps_node_numbers(self, folder: Path) -> None:
        scene = (
            '[[scene.point_mass]]\nname = "a"\nparticle = "rope:2"\nmass = 1.0\n'
            '[[scene.point_mass]]\nname = "b"\nparticle = "rope:-2"\nmass = 1.0\n'
        )
        study = load(extended(folder, scene, parameters="\n[fit]\ndouble_segments = true\n"))
        refine = study.options["refine"]
        (finer,) = refine.finer()
        assert finer.scene.particle_count == 13 and not refine.linear
        heavy = {t.index for t in finer.scene.terms if t.array == "mass" and "_mass" in t.factors[0][0]}
        assert heavy == {4, 10}

    def test_a_recording_shows_some_of_the_ropes(self, folder: Path) -> None:
        other = '[[scene.rope]]\nname = "other"\nsegments = 3\ndensity = 0.1\npoints = "recording"\npinned = [0]\n'
        study = load(
            extended(
                folder,
                other,
                'ropes = ["rope"]',
                '[[recording]]\nfile = "swing.npz"\nname = "second"\nropes = ["other"]\n',
            )
        )
        first, second = study.experiments
        assert set(first.scene.ropes) == {"rope"} and set(second.scene.ropes) == {"other"}
        assert first.places[2] is not None and len(second.names) == 6

    def test_frames(self, folder: Path) -> None:
        (e,) = load(changed(folder, "sigma = 1e-4", "sigma = 1e-4\nframes = [0, 31, 2]")).experiments
        assert len(e.recording.times) == 16
        assert e.solver.h == pytest.approx(0.02 / 4)

    def test_a_recording_leaves_out_what_it_does_without(self, folder: Path) -> None:
        scene = """
        [[scene.point_mass]]
        name = "load"
        particle = "rope:end"
        mass = 0.02
        [[scene.force]]
        name = "pull"
        particles = ["rope:end"]
        force = [0, 0, -1]
        [scene.quantities.delay]
        unit = "s"
        """
        second = '\n[[recording]]\nfile = "swing.npz"\nname = "bare"\nleave_out = ["load", "pull", "delay"]\n'
        text = extended(folder, scene).read_text().replace("[parameters.rope_EI]", f"{second}\n[parameters.rope_EI]")
        loaded, bare = load(written(folder, text)).experiments
        assert set(loaded.scene.quantities) - set(bare.scene.quantities) == {
            "load_mass",
            "pull_x",
            "pull_y",
            "pull_z",
            "delay",
        }
        assert not bare.scene.forces.particles
        with pytest.raises(sb.ConfigError, match="delay, load, pull"):
            load(written(folder, text.replace('leave_out = ["load"', 'leave_out = ["lord"')))


class TestValues:
    def test_written_configuration_starts_at_the_values(self, folder: Path) -> None:
        text = ROPE.replace("[parameters.rope_bend_damping]", "[parameters.rope_bend_damping]\nprivate = true")
        study = load(written(folder, text))
        new = with_values(study.config, {"rope_EI": 3e-3, "rope_bend_damping[swing]": 0.05, "unheard_of": 1.0})
        finer = with_finer(new, {"rope_EI": 1e-4, "rope_bend_damping[swing]": -0.01})
        assert finer.parameters["rope_EI"].finer == pytest.approx(3.1e-3)
        write(finer, folder / "finer.toml", folder)
        (e,) = load(folder / "finer.toml", finer=2).experiments
        assert e.scene.quantities["rope_bend_damping"].value == pytest.approx(0.04)
        again = with_values(finer, {"rope_EI": 3e-3})  # of an earlier fit
        assert again.parameters["rope_EI"].finer is None and not again.recording[0].finer
        (folder / "deeper").mkdir()
        write(new, folder / "deeper" / "fitted.toml", folder)
        (e,) = load(folder / "deeper" / "fitted.toml").experiments
        assert e.scene.quantities["rope_EI"].value == 3e-3
        assert e.scene.quantities["rope_bend_damping"].value == 0.05
        assert tomllib.loads((folder / "deeper" / "fitted.toml").read_text())["recording"][0]["file"] == "../swing.npz"

    def test_every_file_that_is_named_is_found_from_a_written_configuration(self, folder: Path) -> None:
        """Those of force sensors, of colliders and of solids were left as they were."""
        times = np.arange(1, 21) / 100
        sb.ForceRecording(times, np.zeros((20, 3))).save(folder / "force.npz")
        force = '\n[[recording.force]]\nfile = "force.npz"\nat = ["rope:start"]\nsigma = 0.01'
        study = load(extended(folder, "", force))
        (folder / "deeper").mkdir()
        write(study.config, folder / "deeper" / "fitted.toml", folder)
        assert len(load(folder / "deeper" / "fitted.toml").experiments[0].forces) == 1
        content = {"a": [{"file": "x", "tools": {"robot": "y", "file": "z"}}], "file": {"file": 1.0, "cloud": "w"}}
        assert [table[key] for table, key in named_files(content)] == ["x", "y", "z", "w"]

    def test_short_windows_are_for_the_first_start_only(self, folder: Path) -> None:
        study = load(written(folder, ROPE + "\n[fit]\nwindows = [0.1, 0.2]\nthreads = 2\n"))
        assert study.options["windows"] == [0.1, 0.2]
        write(with_values(study.config, {"rope_EI": 3e-3}), folder / "fitted.toml", folder)
        again = load(folder / "fitted.toml")
        assert again.options["windows"] == [] and again.options["threads"] == 2

    def test_a_parameter_that_is_named_like_a_mode_stays_one(self, folder: Path) -> None:
        force = '\n[[scene.unknown_force]]\nname = "rope"\nrope = "rope"\nscale = 0.01\nspacing = 0.05\n'
        new = with_values(parse(written(folder, ROPE + force)), {"rope_EI": 3e-3, "rope_x_1": 0.002})
        assert new.parameters["rope_EI"].initial == 3e-3
        assert [r.values for r in new.recording] == [{"rope_x_1": 0.002}]

    def test_a_value_on_its_bound_stays_inside(self, folder: Path) -> None:
        new = with_values(parse(written(folder, ROPE)), {"rope_EI": 1.0 + 2e-16 * 8})
        assert new.parameters["rope_EI"].initial == 1.0


BAD = [
    # section, old, new, field, problem or fix
    ('name = "swing"\n', "", "experiment.name", "add name to [experiment]"),
    ('name = "swing"\n', 'name = "a b"\n', "experiment.name", "letters, digits"),
    ("[solver]", "[solvr]", "solvr", "did you mean 'solver'"),
    ("substeps = 4", "substeps = 0", "solver.substeps", "at least 1"),
    ("substeps = 4", "substeps = 4\nh = 0.1", "solver", "give one of them"),
    ("substeps = 4", "h = -1.0", "solver.h", "greater than 0"),
    ("substeps = 4", "integrator = 'rk4'", "solver.integrator", "'bdf1' or 'bdf2'"),
    ("substeps = 4", "memory = '2 XB'", "solver.memory", "units are B, kB, MB"),
    ("substeps = 4", "memory = 0", "solver.memory", "give bytes"),
    ("gravity = [0, 0, -9.81]", "gravity = [0, -9.81]", "scene.gravity", "must be 3 numbers"),
    ("gravity = [0, 0, -9.81]", "gravity = 9.81", "scene.gravity", "[0, 0, -9.81] if z points up"),
    ("gravity = [0, 0, -9.81]", "gravity = -1.62", "scene.gravity", "[0, 0, -1.62] if z points up"),
    ("substeps = 4", "h = 480", "solver.h", "give 0.002083 for 480 substeps in a second"),
    ("substeps = 4", "h = 1e-12", "solver.h", "substeps of"),
    ("substeps = 4", 'h = "1/480"', "solver.h", "write 0.00208333"),
    ("substeps = 4", "dt = 1e-3", "solver.dt", "did you mean 'h'?"),
    ("EI = 2e-3", "E = 2e6", "scene.rope[0].E", "EI = E * I"),
    ("density = 0.05", "mass = 0.03", "scene.rope[0].mass", "the mass over the length"),
    ("[[scene.rope]]", "[[rope]]", "rope", "[[scene.rope]]"),
    ("pinned = [0]", "pinned = 0", "scene.rope[0].pinned", "write pinned = [0]"),
    ("pinned = [0]", "clamp_start = true", "scene.rope[0].clamp_start", "write clamp_start = [x, y, z]"),
    ('name = "swing"\n', 'name = "my swing"\n', "experiment.name", 'write "my_swing"'),
    ("gravity = [0, 0, -9.81]", "gravty = [0, 0, 1]", "scene.gravty", "did you mean 'gravity'"),
    ("gravity = [0, 0, -9.81]", 'pin = ["wire:0"]', "scene.pin", "use one of: rope"),
    ("gravity = [0, 0, -9.81]", 'pin = ["rope"]', "scene.pin", "write such as 'rope:0'"),
    ("gravity = [0, 0, -9.81]", 'pin = ["rope:middle"]', "scene.pin", "rope:start"),
    ("EA = 1e3", "EAA = 1e3", "scene.rope[0].EAA", "did you mean 'EA'"),
    ("EA = 1e3", "EA = -1", "scene.rope[0].EA", "greater than 0"),
    ("EA = 1e3", "EA = '1e3'", "scene.rope[0].EA", "a number"),
    ("EA = 1e3", "EA = nan", "scene.rope[0].EA", "finite"),
    ("EA = 1e3", "EA = true", "scene.rope[0].EA", "a number"),
    ("segments = 6", "segments = 6.5", "scene.rope[0].segments", "whole number"),
    ("density = 0.05\n", "", "scene.rope[0].density", "add density to [[scene.rope]]"),
    ("EI = 2e-3\n", "", "scene.rope[0].bend_damping", "give EI"),
    ("pinned = [0]", "pinned = [7]", "scene.rope[0].pinned", "0 to 6"),
    ("pinned = [0]", "clamp_angles = true", "scene.rope[0].plane", "normal"),
    ('points = "recording"', 'points = "measured"', "scene.rope[0].points", "recording"),
    ("length = 0.6", "length = inf", "scene.rope[0].length", "finite"),
    (
        "[[recording]]",
        '[[scene.particles]]\nname = "a"\npositions = []\n[[recording]]',
        "scene.particles[0].positions",
        "at least 1",
    ),
    (
        "[[recording]]",
        '[[scene.particles]]\nname = "rope"\npositions = [[0, 0, 1]]\n[[recording]]',
        "scene.particles[0].name",
        "name of its own",
    ),
    (
        "[[recording]]",
        '[[scene.particles]]\nname = "a"\npositions = [[0, 0, 1]]\nmass = -1.0\n[[recording]]',
        "scene.particles[0].mass",
        "give kg",
    ),
    (
        "[[recording]]",
        '[[scene.particles]]\nname = "a"\npositions = [[0, 0, 1]]\n[[recording]]',
        "scene.mass",
        "give them a mass",
    ),
    (
        "[[recording]]",
        '[[scene.constraints]]\nkind = "spring"\nparticles = [["rope:0", "rope:2"]]\n[[recording]]',
        "scene.constraints[0].kind",
        "distance",
    ),
    (
        "[[recording]]",
        '[[scene.constraints]]\nkind = "distance"\nparticles = [["rope:0"]]\n[[recording]]',
        "scene.constraints[0].particles",
        "(count, 2)",
    ),
    (
        "[[recording]]",
        '[[scene.point_mass]]\nname = "a"\nparticle = "rope:9"\nmass = 1.0\n[[recording]]',
        "scene.point_mass[0].particle",
        "0 to 6",
    ),
    (
        "[[recording]]",
        '[[scene.force]]\nparticles = ["rope:1"]\nforce = [0, 0, 1]\nfactors = [1, 0]\n[[recording]]',
        "scene.force[0].factors",
        "give 1",
    ),
    (
        "[[recording]]",
        '[[scene.force]]\nparticles = ["rope:1"]\nforce = [0, 0, 1]\ntimes = [1, 0]\n[[recording]]',
        "scene.force[0].add_force.times",
        "sort",
    ),
    (
        "[[recording]]",
        '[[scene.drive]]\nparticles = ["rope:1"]\nmarkers = ["m0", "m1"]\n[[recording]]',
        "scene.drive[0].markers",
        "give 1",
    ),
    (
        "[[recording]]",
        '[[scene.drive]]\nparticles = ["rope:1"]\nmarkers = ["x"]\n[[recording]]',
        "scene.drive[0].select",
        "choose from m0",
    ),
    (
        "[[recording]]",
        "[[scene.arm]]\nmass = 1\nfirst_moment = 1\ninertia = 1\nlength = 0.5\n[[recording]]",
        "scene.arm[0].mass",
        "give more than",
    ),
    (
        "[[recording]]",
        '[[scene.pendulum]]\nlength = 1.0\npivot = "no"\n[[recording]]',
        "scene.pendulum[0].pivot",
        "name one of",
    ),
    (
        "[[recording]]",
        "[scene.quantities.a]\nvalue = -1.0\npositive = true\n[[recording]]",
        "scene.quantities.a.a",
        "positive",
    ),
    ('file = "swing.npz"', 'file = "no.npz"', "recording[0].file", "relative to the configuration"),
    ('file = "swing.npz"\n', "", "recording[0].file", "add file to [[recording]]"),
    ('file = "swing.npz"', 'file = "my.toml"', "recording[0].", "it is a configuration"),
    ("fit = [0.0, 0.2]", "fit = [0.2, 0.0]", "recording[0].fit", "smaller number first"),
    ("fit = [0.0, 0.2]", "fit = [5.0, 6.0]", "recording[0].fit", "within the recording"),
    ("held_out = [0.2, 0.31]", "held_out = [0.2, 3.0]", "recording[0].held_out", "end at 0.31 s"),
    ("fit = [0.0, 0.2]\nheld_out = [0.2, 0.31]", "fit = [0.0, 9.0]", "recording[0].fit", "end at 0.31 s"),
    (
        "fit = [0.0, 0.2]\nheld_out = [0.2, 0.31]",
        "fit = [0.2, 0.31]\nheld_out = [0.1, 0.2]",
        "recording[0].held_out",
        "start_time = 0.1",
    ),
    ("held_out = [0.2, 0.31]", "held_out = [5.0, 6.0]", "recording[0].held_out", "within the recording"),
    ("held_out = [0.2, 0.31]", "static = true\nheld_out = [0.2, 0.3]", "recording[0].held_out", "predict = 'mean'"),
    ("sigma = 1e-4", "sigma = 0", "recording[0].sigma", "greater than 0"),
    ("sigma = 1e-4", "axes = 'xw'", "recording[0].axes", "x, y, z"),
    ("sigma = 1e-4", "axes = 'xx'", "recording[0].axes", "'xz'"),
    ("sigma = 1e-4", "loss = 'cauchy'", "recording[0].loss", "'huber'"),
    ("sigma = 1e-4", "units = 'inch'", "recording[0].units", "'mm'"),
    ("sigma = 1e-4", "ropes = ['wire']", "recording[0].ropes", "name some of: rope"),
    ("sigma = 1e-4", "start_time = 0.1", "recording[0].start_time", "start earlier"),
    ("sigma = 1e-4", "frames = [40, 50]", "recording[0].frames", "31 frames"),
    ("sigma = 1e-4", "time_offset = 'clock'", "recording[0].time_offset", "[scene.quantities.clock]"),
    ("sigma = 1e-4", "offsets = { m9 = ['', '', ''] }", "recording[0].offsets.m9", "m0"),
    ("sigma = 1e-4", "offsets = { m1 = ['off', '', ''] }", "recording[0].offsets.m1", "[scene.quantities.off]"),
    ("sigma = 1e-4", "offsets = { m1 = ['off'] }", "recording[0].offsets.m1", "tangent"),
    ("sigma = 1e-4", "values = { rope_EI = 1.0 }", "recording[0].values.rope_EI", "private = true"),
    ("sigma = 1e-4", "values = { rope = 1.0 }", "recording[0].values.rope", "rope_EI"),
    ("sigma = 1e-4", "values = { EI = 1.0 }", "recording[0].values.EI", "did you mean 'rope_EI'"),
    ("sigma = 1e-4", "values = { rope_EA = -1.0 }", "recording[0].values.rope_EA", "positive"),
    ("sigma = 1e-4", "marker = [{ marker = 'm0' }]", "recording[0].marker[0]", "arc_length"),
    ("sigma = 1e-4", "marker = [{ marker = 'x', arc_length = 0.1 }]", "recording[0].marker[0].marker", "m0"),
    ("sigma = 1e-4", "marker = [{ marker = 'm1', arc_length = 0.1 }]", "scene.rope[0].points", "place markers on it"),
    (
        "sigma = 1e-4",
        "marker = [{ marker = 'm0', arc_length = 9.1 }, { marker = 'm1', arc_length = 0.1 }]",
        "recording[0].marker[0].arc_length",
        "0 to 0.6",
    ),
    (
        "sigma = 1e-4",
        "marker = [{ marker = 'm0', arc_length = 0.0 }, { marker = 'm1', arc_length = 0.1 }, "
        "{ marker = 'm2', rope = 'wire', arc_length = 0.1 }]",
        "recording[0].marker[2].rope",
        "name one of: rope",
    ),
    (
        "sigma = 1e-4",
        "marker = [{ marker = 'm0', arc_length = 0.0 }, { marker = 'm1', arc_length = 0.1 }, "
        "{ marker = 'm2', arm = 'a', radius = 0.1 }]",
        "recording[0].marker[2].arm",
        "none",
    ),
    ("sigma = 1e-4", "marker = [{ marker = 'm0', arm = 'a' }]", "recording[0].marker[0]", "give both"),
    ("[parameters.rope_EI]", "[parameters.rope_IE]", "parameters.rope_IE", "did you mean 'rope_EI'"),
    ("[parameters.rope_EI]", "[parameters.EI]", "parameters.EI", "did you mean 'rope_EI'"),
    ("[parameters.rope_EI]", "[parameters.stiffness]", "parameters.stiffness", "name one of: rope_EA"),
    (
        "[parameters.rope_EI]",
        "[parameters.rope_drag_linear]",
        "parameters.rope_drag_linear",
        "give drag_linear in the [[scene.rope]] named 'rope'",
    ),
    ("[[scene.rope]]", "[scene.rope]", "scene.rope", "write [[scene.rope]] in place of [scene.rope]"),
    ("length = 0.6", 'length = "0.6"', "scene.rope[0].length", "write 0.6 without quotes"),
    ("length = 0.6", 'length = "60 cm"', "scene.rope[0].length", "without quotes and unit"),
    ("fit = [0.0, 0.2]", "fit = [-1.0, 0.2]", "recording[0].fit", "begin at 0 s"),
    ("lower = 1e-5", "lower = 0.1", "parameters.rope_EI.initial", "inside the bounds"),
    ("lower = 1e-5\nupper = 1.0", "lower = 0.1\nupper = 0.01", "parameters.rope_EI.lower", "raise upper"),
    ("lower = 1e-5", "minimum = 0.1", "parameters.rope_EI.minimum", "lower"),
    ("lower = 1e-5", "initial = -1.0", "parameters.rope_EI", "positive"),
    ("lower = 1e-5\nupper = 1.0", "tied_to = 'x'", "parameters.rope_EI.tied_to", "name one of"),
    ("lower = 1e-5", "prior = [1.0]", "parameters.rope_EI.prior", "write prior = [mean, sd]"),
    ("[parameters.rope_EI]", "[parameters.rope.EI]", "parameters.rope.EI", "write [parameters.rope_EI]"),
    ("fit = [0.0, 0.2]", "fit = 0.2", "recording[0].fit", "write fit = [start, stop]"),
    ("sigma", "noise", "recording[0].noise", "did you mean 'sigma'?"),
    ("[published]", "[fit]\noptimizer = 'adam'\n[published]", "fit.optimizer", "'scipy'"),
    ("[published]", "[fit]\nthreads = 0\n[published]", "fit.threads", "at least 1"),
    ("[published]", "[output]\nfigures = 'gif'\n[published]", "output.figures", "'png'"),
    ("rope_EI = 1e-3", "rope_EJ = 1e-3", "published.rope_EJ", "did you mean 'rope_EI'"),
    ("rope_EI = 1e-3", "rope_EI = [2.0, 1.0]", "published.rope_EI", "smaller number first"),
]


@pytest.mark.parametrize(
    ("old", "new", "field", "fix"), BAD, ids=[f"{field}-{i}" for i, (_, _, field, _) in enumerate(BAD)]
)
def test_bad_input_is_named_with_its_fix(folder: Path, old: str, new: str, field: str, fix: str) -> None:
    with pytest.raises(sb.ConfigError) as caught:
        load(changed(folder, old, new))
    assert caught.value.field.startswith(field) if field.endswith(".") else caught.value.field == field
    assert fix in f"{caught.value.problem} {caught.value.fix}"


def test_every_problem_is_reported_at_once(folder: Path) -> None:
    text = ROPE.replace("EA = 1e3", "EA = -1").replace("substeps = 4", "substep = 4")
    with pytest.raises(sb.ConfigError) as caught:
        load(written(folder, text))
    told = [str(caught.value), *caught.value.__notes__]
    assert len(told) == 2
    assert any("scene.rope[0].EA" in t for t in told) and any("solver.substep" in t for t in told)


def test_two_recordings_of_one_name(folder: Path) -> None:
    with pytest.raises(sb.ConfigError, match=r"recording\[1\]\.name"):
        load(changed(folder, "[parameters.rope_EI]", '[[recording]]\nfile = "swing.npz"\n\n[parameters.rope_EI]'))


def test_broken_toml_names_the_line(folder: Path) -> None:
    with pytest.raises(sb.ConfigError, match="line 2"):
        load(written(folder, '[experiment]\nname = "swing\n'))


def test_a_path_with_backslashes_says_how_to_write_it(folder: Path) -> None:
    with pytest.raises(sb.ConfigError, match="write / in place of"):
        load(changed(folder, 'file = "swing.npz"', r'file = "data\swing.npz"'))


def test_a_scene_starts_before_its_recording_where_start_time_says_so(folder: Path) -> None:
    (e,) = load(changed(folder, "fit = [0.0, 0.2]", "fit = [-0.1, 0.2]\nstart_time = -0.1")).experiments
    assert e.t0 == -0.1
    (e,) = load(changed(folder, "fit = [0.0, 0.2]", "fit = [-0.01, 0.2]")).experiments  # no more than a frame
    assert e.t0 == -0.01


def test_missing_and_binary_files(folder: Path) -> None:
    with pytest.raises(sb.ConfigError, match=r"is a recording.*sheetbend new swing\.npz"):
        load(folder / "swing.npz")
    with pytest.raises(sb.ConfigError, match="is not a file"):
        load(folder / "nowhere.toml")
    (folder / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(sb.ConfigError, match="UTF-8"):
        load(folder / "binary.toml")
    (folder / "empty.toml").write_text("")
    with pytest.raises(sb.ConfigError, match="experiment: is missing"):
        load(folder / "empty.toml")


def test_document_holds_every_key() -> None:
    text = (ROOT / "docs" / "configuration.md").read_text()
    assert text == renewed(text), "run: python -m sheetbend.config.reference docs/configuration.md"
    fabric = (ROOT / "docs" / "fabric.md").read_text()
    assert fabric == renewed(fabric, fabric_tables()), "run: python -m sheetbend.config.reference docs/fabric.md"


@pytest.mark.parametrize(
    ("line", "fix"),
    [
        ("EI = 1,3", "write a point as decimal mark"),
        ("name = twin", "put text in quotes"),
        ("length = 60 cm", "without its unit"),
        ("length 0.6", "write key = value"),
        ('name = "twin', "correct that line"),
    ],
)
def test_a_line_that_is_no_toml_is_shown_with_its_cure(tmp_path: Path, line: str, fix: str) -> None:
    (tmp_path / "slip.toml").write_text(f"[experiment]\n{line}\n")
    with pytest.raises(sb.ConfigError, match=fix) as refused:
        parse(tmp_path / "slip.toml")
    assert refused.value.got == line
