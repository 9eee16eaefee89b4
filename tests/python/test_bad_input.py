"""Bad input to scenes, ropes, solvers, simulations, experiments and fits: refused by an error that names the field,
what it got and a fix."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
import sheetbend.torch as st
from sheetbend.errors import NoEquilibriumError
from sheetbend.quantities.quantities import term

NAN, INF = math.nan, math.inf


def three() -> sb.Scene:
    """Three particles in a row."""
    scene = sb.Scene("three")
    scene.add_particles([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 1.0)
    return scene


def linked() -> sb.Scene:
    """The same, linked and held at one end."""
    scene = three()
    scene.add_constraints("distance", [[0, 1], [1, 2]], name="links", compliance=1e-3)
    scene.pin([0])
    return scene


def rope(**options: Any) -> sb.Scene:
    return sb.rope(**({"length": 1.0, "segments": 4, "density": 0.05, "EA": 1e3} | options))


def recording(markers: int = 1) -> sb.Recording:
    rng = np.random.default_rng(0)
    return sb.Recording(positions=rng.standard_normal((5, markers, 3)), times=np.arange(5) / 60, name="r")


def experiment(**fields: Any) -> sb.Experiment:
    given = {"scene": linked(), "recording": recording(), "markers": [sb.on_particle(2)], "solver": sb.Solver(h=1 / 60)}
    return sb.Experiment(**(given | fields))


def fit(**options: Any) -> sb.Fit:
    given = {
        "recording": recording(),
        "parameters": ["rope_EA"],
        "markers": [sb.on_particle(2)],
        "solver": sb.Solver(h=1 / 60),
    }
    return sb.fit(rope(), **(given | options))


def link(kind: str = "distance", particles: Any = ((0, 1),), **options: Any) -> Callable[[], Any]:
    return lambda: three().add_constraints(kind, particles, name="g", **options)


def hinge(**options: Any) -> Callable[[], Any]:
    return link("hinge", [[0, 1, 2]], **({"viscosity": 1.0, "normal": (0, 1, 0)} | options))


def drive(particles: Any = (1,), times: Any = (0.0, 1.0), positions: Any = None, **options: Any) -> Callable[[], Any]:
    moved = np.zeros((2, 1, 3)) if positions is None else positions
    return lambda: three().drive(particles, times, moved, **options)


def push(particles: Any = (1,), forces: Any = ((0, 0, 1),), times: Any = (0.0,)) -> Callable[[], Any]:
    return lambda: three().add_force(particles, forces, times)


def after(*steps: Callable[[sb.Scene], Any], scene: Callable[[], sb.Scene] = three) -> Callable[[], Any]:
    """Do the steps to a new scene, one after the other."""

    def run() -> None:
        built = scene()
        for step in steps:
            step(built)

    return run


def frozen(step: Callable[[sb.Scene], Any]) -> Callable[[], Any]:
    return after(lambda s: s.freeze(), step, scene=linked)


SCENE = {
    "gravity of the wrong shape": ("gravity", lambda: sb.Scene(gravity=(0, 0))),
    "gravity not finite": ("gravity", lambda: sb.Scene(gravity=(0, 0, NAN))),
    "positions of the wrong shape": ("positions", lambda: three().add_particles([[0, 0]], 1.0)),
    "no positions": ("positions", lambda: three().add_particles(np.zeros((0, 3)), 1.0)),
    "positions not finite": ("positions", lambda: three().add_particles([[0, NAN, 0]], 1.0)),
    "positions of text": ("positions", lambda: three().add_particles([["a", "b", "c"]], 1.0)),
    "negative mass": ("mass", lambda: three().add_particles([[0, 0, 0]], -1.0)),
    "mass not finite": ("mass", lambda: three().add_particles([[0, 0, 0]], INF)),
    "no mass": ("mass", lambda: three().add_particles([[0, 0, 0]], None)),
    "masses of the wrong shape": ("mass", lambda: three().add_particles([[0, 0, 0]], [1.0, 2.0])),
    "velocities of the wrong shape": ("velocity", lambda: three().add_particles([[0, 0, 0]], 1.0, velocity=[0, 0, 0])),
    "velocity not finite": ("velocity", lambda: three().add_particles([[0, 0, 0]], 1.0, velocity=[[0, NAN, 0]])),
    "pin beyond": ("pin", lambda: three().pin([3])),
    "pin nothing": ("pin", lambda: three().pin([])),
    "pin a fraction": ("pin", lambda: three().pin([0.5])),
    "drive beyond": ("drive", drive(particles=[7])),
    "drive backwards in time": ("drive.times", drive(times=[1.0, 0.0])),
    "drive at no time": ("drive.times", drive(times=[], positions=np.zeros((0, 1, 3)))),
    "drive at NaN": ("drive.times", drive(times=[0.0, NAN])),
    "drive by the wrong shape": ("drive.positions", drive(positions=np.zeros((2, 3)))),
    "drive to NaN": ("drive.positions", drive(positions=np.full((2, 1, 3), NAN))),
    "drive by an unknown interpolation": ("drive.interpolation", drive(interpolation="quintic")),
    "drive twice": ("drive.particles", after(*[lambda s: s.drive([1], [0, 1], np.zeros((2, 1, 3)))] * 2)),
    "drive with other knots": (
        "drive.times",
        after(lambda s: s.drive([1], [0, 1], np.zeros((2, 1, 3))), lambda s: s.drive([2], [0, 2], np.zeros((2, 1, 3)))),
    ),
    "driven and pinned": (
        "drive.particles",
        after(lambda s: s.drive([0], [0, 1], np.zeros((2, 1, 3))), lambda s: s.freeze(), scene=linked),
    ),
    "force beyond": ("add_force.particles", push(particles=[9])),
    "force not finite": ("add_force.forces", push(forces=[[0, 0, NAN]])),
    "force backwards in time": ("add_force.times", push(forces=np.zeros((2, 1, 3)), times=[1.0, 0.0])),
    "force twice": ("add_force.particles", after(*[lambda s: s.add_force([1], [[0, 0, 1]])] * 2)),
    "unknown kind": ("kind", link("spring")),
    "group name taken": ("name", after(lambda s: s.add_constraints("distance", [[0, 1]], name="links"), scene=linked)),
    "stencil of the wrong size": ("g.particles", link(particles=[[0, 1, 2]])),
    "stencil of one dimension": ("g.particles", link(particles=[0, 1])),
    "stencil beyond": ("g.particles", link(particles=[[0, 5]])),
    "no stencil": ("g.particles", link(particles=np.zeros((0, 2), dtype=int))),
    "stencil of fractions": ("g.particles", link(particles=[[0.0, 1.0]])),
    "a particle linked to itself": (
        "g",
        after(lambda s: s.add_constraints("distance", [[0, 0], [1, 2]], name="g", rest=1.0), lambda s: s.compiled),
    ),
    "zero length": (
        "g.rest",
        after(lambda s: s.add_particles([[0, 0, 0]], 1.0), lambda s: s.add_constraints("distance", [[0, 3]], name="g")),
    ),
    "negative rest": ("g.rest", link(rest=-1.0)),
    "rest not finite": ("g.rest", link(rest=NAN)),
    "rests of the wrong shape": ("g.rest", link(rest=[1.0, 1.0])),
    "negative compliance": ("g.compliance", link(compliance=-1e-3)),
    "compliance not finite": ("g.compliance", link(compliance=INF)),
    "compliances of the wrong shape": ("g.compliance", link(compliance=[1.0, 2.0])),
    "negative damping": ("g.damping", link(compliance=1.0, damping=-1.0)),
    "damping not finite": ("g.damping", link(compliance=1.0, damping=NAN)),
    "negative viscosity": ("g.viscosity", hinge(viscosity=-1.0)),
    "viscosity and compliance": ("g.viscosity", hinge(compliance=1.0)),
    "viscosity and damping": ("g.viscosity", hinge(damping=1.0)),
    "no normal": ("g.normal", hinge(normal=None)),
    "normal without length": ("g.normal", hinge(normal=(0, 0, 0))),
    "normal not finite": ("g.normal", hinge(normal=(0, NAN, 0))),
    "quantity taken": (
        "links_compliance",
        after(lambda s: s.add_quantity("links_compliance", 1.0, "m/N"), scene=linked),
    ),
    "quantity of a name that fits use": ("[damping]", lambda: three().add_quantity("[damping]", 1.0, "s")),
    "quantity not finite": ("q", lambda: three().add_quantity("q", NAN, "m")),
    "quantity not positive": ("q", lambda: three().add_quantity("q", 0.0, "m")),
    "term of an unknown quantity": (
        "terms",
        lambda: three().add_terms([term("mass", 0, 1.0, q="identity")]),
    ),
    "point mass beyond": ("add_point_mass.particle", lambda: three().add_point_mass(9, 1.0, "p")),
    "negative point mass": ("p_mass", lambda: three().add_point_mass(1, -1.0, "p")),
    "negative drag": ("drag.linear", lambda: three().set_drag(linear=-1.0)),
    "negative quadratic drag": ("drag.quadratic", lambda: three().set_drag(quadratic=[0, 0, -1])),
    "drags of the wrong shape": ("drag.linear", lambda: three().set_drag(linear=[1.0, 2.0])),
    "unknown group": ("group", lambda: linked().group("ropes")),
    "no particles": ("scene", lambda: sb.Scene().freeze()),
    "everything pinned": ("three", after(lambda s: s.pin([0, 1, 2]), lambda s: s.freeze())),
    "massless and free": ("mass", after(lambda s: s.add_particles([[3, 0, 0]], 0.0), lambda s: s.freeze())),
    "connected to nothing": (
        "particles",
        after(lambda s: s.add_particles([[9, 0, 0]], 1.0), lambda s: s.freeze(), scene=linked),
    ),
    "a link between held particles": ("links", after(lambda s: s.pin([1]), lambda s: s.compiled, scene=linked)),
}

FROZEN = {
    "add_particles": lambda s: s.add_particles([[0, 0, 0]], 1.0),
    "pin": lambda s: s.pin([1]),
    "drive": lambda s: s.drive([1], [0, 1], np.zeros((2, 1, 3))),
    "add_force": lambda s: s.add_force([1], [[0, 0, 1]]),
    "add_constraints": lambda s: s.add_constraints("distance", [[0, 1]]),
    "add_quantity": lambda s: s.add_quantity("q", 1.0, "m"),
    "add_terms": lambda s: s.add_terms([]),
    "add_point_mass": lambda s: s.add_point_mass(1, 1.0, "p"),
    "shift_base": lambda s: s.shift_base(1, (0, 0, 0)),
    "set_drag": lambda s: s.set_drag(linear=1.0),
    "add_rope": lambda s: sb.add_rope(s, length=1.0, density=1.0),
}

ROPE = {
    "no length": ("rope.length", lambda: rope(length=None)),
    "zero length": ("rope.length", lambda: rope(length=0.0)),
    "length not finite": ("rope.length", lambda: rope(length=NAN)),
    "no segments": ("rope.segments", lambda: rope(segments=0)),
    "half a segment": ("rope.segments", lambda: rope(segments=2.5)),
    "zero density": ("rope.density", lambda: rope(density=0.0)),
    "density not finite": ("rope.density", lambda: rope(density=NAN)),
    "negative EA": ("rope.EA", lambda: rope(EA=-1.0)),
    "infinite EA": ("rope.EA", lambda: rope(EA=INF)),
    "EI of text": ("rope.EI", lambda: rope(EI="1e-3")),
    "density per link": ("rope.density", lambda: rope(density=[0.05] * 4)),
    "length with its unit": ("rope.length", lambda: rope(length="0.6 m")),
    "pinned by a name": ("rope.pinned", lambda: rope(pinned="start")),
    "cloth of an array": (
        "cloth.mesh",
        lambda: sb.cloth(np.zeros((4, 3)), density=0.2, warp=60, shear=5, poisson=0.2),  # type: ignore[arg-type]
    ),
    "marker on a scene": ("rope", lambda: sb.on_rope(rope(), 0.5)),  # type: ignore[arg-type]
    "markers along a scene": ("rope", lambda: sb.along_rope(rope(), 3)),  # type: ignore[arg-type]
    "zero EI": ("rope.EI", lambda: rope(EI=0.0)),
    "negative stretch damping": ("rope.stretch_damping", lambda: rope(stretch_damping=-1.0)),
    "stretch damping without EA": ("rope.stretch_damping", lambda: rope(EA=None, stretch_damping=1.0)),
    "loss factor without its frequency": ("rope.loss_frequency", lambda: rope(loss_factor=0.1)),
    "frequency without a loss factor": ("rope.loss_factor", lambda: rope(loss_frequency=7.7)),
    "loss factor beside a time constant": (
        "rope.loss_factor",
        lambda: rope(loss_factor=0.1, loss_frequency=7.7, stretch_damping=1.0),
    ),
    "loss factor of a rope without stiffness": (
        "rope.loss_factor",
        lambda: rope(EA=None, loss_factor=0.1, loss_frequency=7.7),
    ),
    "bend damping without EI": ("rope.bend_damping", lambda: rope(bend_damping=1.0)),
    "drag not finite": ("rope_drag_linear", lambda: rope(drag_linear=NAN)),
    "no joint to bend": ("rope.segments", lambda: rope(segments=1, EI=1e-3)),
    "direction without length": ("rope.direction", lambda: rope(direction=(0, 0, 0))),
    "start not finite": ("rope.start", lambda: rope(start=(0, NAN, 0))),
    "a single point": ("points", lambda: rope(points=[(0, 0, 0)])),
    "points in one place": ("points", lambda: rope(points=[(0, 0, 0), (0, 0, 0)])),
    "clamp without length": ("rope.clamp_start", lambda: rope(EI=1e-3, clamp_start=(0, 0, 0))),
    "clamp not finite": ("rope.clamp_end", lambda: rope(EI=1e-3, clamp_end=(0, NAN, 0))),
    "clamp angles without a plane": ("rope.plane", lambda: rope(EI=1e-3, clamp_start=(1, 0, 0), clamp_angles=True)),
    "a set without a plane": ("rope.plane", lambda: rope(EI=1e-3, set_modes=(1,))),
    "a set that is no list": ("rope.set_modes", lambda: rope(EI=1e-3, set_modes=1)),
    "a set without EI": ("rope.set_modes", lambda: rope(plane=(0, 1, 0), set_modes=(1,))),
    "a mode twice": ("rope_set_1", lambda: rope(EI=1e-3, plane=(0, 1, 0), set_modes=(1, 1))),
    "a rope's name twice": ("rope_length", after(*[lambda s: sb.add_rope(s, length=1.0, density=1.0)] * 2)),
    "everything pinned": ("rope", lambda: rope(segments=1, pinned=(0, 1)).freeze()),
    "a mode below 0": ("rope.set_modes", lambda: rope(EI=1e-3, plane=(0, 1, 0), set_modes=(-1,))),
    "half a mode": ("rope.set_modes", lambda: rope(EI=1e-3, plane=(0, 1, 0), set_modes=(0.5,))),
    "plane without length": ("rope.plane", lambda: rope(EI=1e-3, plane=(0, 0, 0), set_modes=(1,))),
    "pinned beyond the end": ("rope.pinned", lambda: rope(pinned=(9,))),
    "points not finite": ("points", lambda: rope(points=[(0, 0, 0), (0, NAN, 1)])),
    "marker beyond the end": ("arc_length", lambda: sb.on_rope(rope().ropes["rope"], 1.5)),
    "marker by an unknown interpolation": ("interpolation", lambda: sb.on_rope(rope().ropes["rope"], 0.5, "quintic")),
}

SOLVER = {
    "zero substep": ("solver.h", lambda: sb.Solver(h=0.0)),
    "negative substep": ("solver.h", lambda: sb.Solver(h=-1e-3)),
    "substep not finite": ("solver.h", lambda: sb.Solver(h=NAN)),
    "infinite substep": ("solver.h", lambda: sb.Solver(h=INF)),
    "substep of text": ("solver.h", lambda: sb.Solver(h="1/600")),
    "unknown integrator": ("solver.integrator", lambda: sb.Solver(integrator="rk4")),
    "unknown method": ("solver.method", lambda: sb.Solver(method="jacobi")),
    "no iterations": ("solver.iterations", lambda: sb.Solver(iterations=0)),
    "half an iteration": ("solver.iterations", lambda: sb.Solver(iterations=1.5)),
    "no threads": ("solver.threads", lambda: sb.Solver(threads=0)),
    "no grain": ("solver.grain", lambda: sb.Solver(grain=-1)),
    "time off the grid": ("times", lambda: sb.simulate(rope(), [0.0, 0.00037])),
    "negative time": ("times", lambda: sb.simulate(rope(), [-0.1, 0.0])),
    "times backwards": ("times", lambda: sb.simulate(rope(), [0.2, 0.1])),
    "no times": ("times", lambda: sb.simulate(rope(), [])),
    "time not finite": ("times", lambda: sb.simulate(rope(), [0.0, NAN])),
    "unknown value": ("values", lambda: sb.simulate(rope(), [0.0, 0.1], values={"rope_EB": 1.0})),
    "gradient check of no substep": ("times", lambda: sb.check_gradients(rope(), [0.0])),
    "gradient check of no entries": ("samples", lambda: sb.check_gradients(rope(), [0.01], samples=0)),
    "value not finite": ("values.rope_EA", lambda: sb.simulate(rope(), [0.01], values={"rope_EA": NAN})),
    "value of text": ("values.rope_EA", lambda: sb.simulate(rope(), [0.01], values={"rope_EA": "stiff"})),
    "no value": ("values.rope_EA", lambda: sb.equilibrium(rope(), values={"rope_EA": None})),
    "negative stiffness": ("values.rope_EA", lambda: sb.simulate(rope(), [0.01], values={"rope_EA": -1.0})),
    "stiffness of zero": ("values.rope_EA", lambda: sb.simulate(rope(), [0.01], values={"rope_EA": 0.0})),
    "gradient check off the grid": ("times", lambda: sb.check_gradients(rope(), [0.00037])),
    "equilibrium from the wrong shape": ("start", lambda: sb.equilibrium(rope(), start=[[0, 0, 0]])),
    "equilibrium from NaN": ("start", lambda: sb.equilibrium(rope(), start=np.full((5, 3), NAN))),
}

EXPERIMENT = {
    "zero sigma": ("r.sigma", lambda: experiment(sigma=0.0)),
    "sigma with its unit": ("r.sigma", lambda: experiment(sigma="1 mm")),
    "window of a number": ("r.fit", lambda: experiment(fit=0.2)),
    "sigma not finite": ("r.sigma", lambda: experiment(sigma=NAN)),
    "no axes": ("r.axes", lambda: experiment(axes="")),
    "unknown axis": ("r.axes", lambda: experiment(axes="xw")),
    "axis twice": ("r.axes", lambda: experiment(axes="xx")),
    "unknown start": ("r.start", lambda: experiment(start="rest")),
    "unknown loss": ("r.loss", lambda: experiment(loss="cauchy")),
    "negative loss scale": ("r.loss_scale", lambda: experiment(loss_scale=-1.0)),
    "unknown prediction": ("r.predict", lambda: experiment(predict="median")),
    "held-out part of an equilibrium": ("r.held_out", lambda: experiment(static=True, held_out=(0.0, 1.0))),
    "window beyond the recording": ("piece", lambda: experiment(fit=(50.0, 60.0)).fitted()),
    "window backwards": ("piece", lambda: experiment(fit=(0.05, 0.01)).fitted()),
    "too many markers": ("markers", lambda: experiment(markers=[sb.on_particle(2)] * 3).places),
    "unknown marker": ("markers", lambda: experiment(markers={"nose": sb.on_particle(2)}).places),
    "no places and no rope": ("markers", lambda: experiment(markers=None).places),
    "only held markers": ("r.markers", lambda: experiment(markers=[sb.on_particle(0)]).compared),
    "path for a recording": ("recording", lambda: experiment(recording="r.npz")),
    "start at NaN": ("r.start_time", lambda: experiment(start_time=NAN)),
    "window of one time": ("r.fit", lambda: experiment(fit=(0.0,))),
    "held-out part of one time": ("r.held_out", lambda: experiment(held_out=(0.0,))),
    "overlapping windows": ("r.held_out", lambda: experiment(fit=(0.0, 0.05), held_out=(0.03, 0.08))),
    "offset of an unknown marker": (
        "r.offsets",
        lambda: experiment(offsets={"nose": (None, None, None)}).extra_terms(),
    ),
    "offset by an unknown quantity": (
        "r.offsets",
        lambda: experiment(offsets={"m0": ("up", None, None)}).extra_terms(),
    ),
    "unknown clock": ("r.time_offset", lambda: experiment(time_offset="clock").extra_terms()),
    "marker on no particle": ("markers", lambda: experiment(markers=[sb.on_particle(99)]).places),
    "marker before the first particle": ("markers", lambda: experiment(markers=[sb.on_particle(-1)]).places),
    "start after the first frame": ("r.start_time", lambda: fit(start_time=0.05)),
    "offset not finite": ("offset", lambda: sb.on_particle(1).with_offset((0, NAN, 0))),
    "offset about no normal": ("normal", lambda: sb.on_particle(1).with_offset((0, 1, 0), normal=(0, 0, 0))),
}

FIT = {
    "nothing to fit": ("parameters", lambda: fit(parameters=[])),
    "unknown parameter": ("parameters", lambda: fit(parameters=["rope_EB"])),
    "one name without a list": ("parameters", lambda: fit(parameters="rope_EA")),
    "a number for a parameter": ("parameters.rope_EA", lambda: fit(parameters={"rope_EA": 1e3})),
    "bounds without their names": ("parameters.rope_EA", lambda: fit(parameters={"rope_EA": (1.0, 1e6)})),
    "unknown field of a parameter": ("parameters.rope_EA", lambda: fit(parameters={"rope_EA": {"max": 1.0}})),
    "start outside the bounds": ("rope_EA.initial", lambda: fit(parameters={"rope_EA": {"upper": 1.0}})),
    "negative start on a log scale": ("rope_EA.initial", lambda: fit(parameters={"rope_EA": {"initial": -1.0}})),
    "start not finite": ("rope_EA.initial", lambda: fit(parameters={"rope_EA": {"initial": NAN}})),
    "no recording": ("recording", lambda: sb.fit(rope(), parameters=["rope_EA"])),
    "recording with experiments": ("recording", lambda: sb.fit([experiment()], recording(), ["links_compliance"])),
    "no experiments": ("experiments", lambda: sb.fit([], parameters=["links_compliance"])),
    "two of one name": ("experiments", lambda: sb.fit([experiment(), experiment()], parameters=["links_compliance"])),
    "all only predicted": (
        "experiments",
        lambda: sb.fit([experiment(predict="mean")], parameters=["links_compliance"]),
    ),
    "unknown optimizer": ("optimizer", lambda: fit(optimizer="adam")),
    "no iterations": ("max_iterations", lambda: fit(max_iterations=0)),
    "no threads": ("threads", lambda: fit(threads=0)),
    "a start not finite": ("rope_EA", lambda: fit(starts=[{"rope_EA": NAN}])),
    "bounds in the wrong order": ("rope_EA.lower", lambda: fit(parameters={"rope_EA": {"lower": 2e3, "upper": 1.0}})),
    "fit from before the recording": ("r.fit", lambda: fit(fit=(-1.0, 0.05))),
    "fit to long after the recording": ("r.fit", lambda: fit(fit=(0.0, 3.0))),
    "held out until long after it": ("r.held_out", lambda: fit(fit=(0.0, 0.03), held_out=(0.03, 3.0))),
    "held out before the start": ("r.held_out", lambda: fit(fit=(0.03, 0.07), held_out=(0.0, 0.03))),
    "held out before start_time": ("r.held_out", lambda: fit(start_time=0.02, fit=(0.03, 0.07), held_out=(0.0, 0.03))),
    "plan from before the recording": (
        "r.fit",
        lambda: sb.identify(experiment(fit=(-1.0, 0.05)), parameters=["links_compliance"]),
    ),
    "many from before the recording": (
        "r.fit",
        lambda: sb.fit_many([experiment(fit=(-1.0, 0.05))] * 20, ["links_compliance"]),
    ),
    "unknown name in a start": ("starts", lambda: fit(starts=[{"rope_EI": 1.0}])),
}


TIMES = np.arange(3) * 1e-3
UNKNOWN = (  # of a quantity, where a near one exists
    ("values", lambda: sb.simulate(rope(), TIMES, values={"EA": 1.0})),
    ("scales", lambda: sb.rollout(rope(), TIMES).gradient(np.ones((3, 5, 3))).require({"EA": 1.0})),
    ("values.EA", lambda: st.simulate(rope(), TIMES, values={"EA": 1.0})),
    ("learn", lambda: st.SceneModule(rope(), TIMES, learn=["EA"])),
)
WRONG_TYPES = {
    "substep for a solver": ("solver", lambda: sb.simulate(rope(), TIMES, 0.001)),
    "substep in a rollout": ("solver", lambda: sb.rollout(rope(), TIMES, 0.001)),
    "substep in a check": ("solver", lambda: sb.check_gradients(rope(), TIMES, 0.001)),
    "substep in a plan of a tape": ("solver", lambda: sb.tape_plan(rope(), TIMES, "direct")),
    "substep under torch": ("solver", lambda: st.simulate(rope(), TIMES, 0.001)),
    "substep of a stepper": ("solver", lambda: st.Stepper(rope(), 0.001)),
    "nothing to load": ("path", lambda: sb.Recording.load(None)),
    "name of a particle": ("particle", lambda: sb.on_particle("tip")),
    "particle for a place": (
        "markers",
        lambda: (
            sb.Experiment(
                scene=rope(), recording=sb.Recording(np.zeros((2, 1, 3)), np.array([0.0, 0.1])), markers=[3]
            ).places
        ),
    ),
    "particle that is not a number": ("second", lambda: sb.between(0, 1.5, 0.5)),
}


@pytest.mark.parametrize(
    "table",
    [SCENE, ROPE, SOLVER, EXPERIMENT, FIT, WRONG_TYPES],
    ids=["scene", "rope", "solver", "experiment", "fit", "types"],
)
def test_the_error_names_field_value_and_fix(table):
    for case, (field, act) in table.items():
        with pytest.raises(sb.InputError) as caught:
            act()
        error = caught.value
        assert error.field == field, case
        assert error.problem and len(error.fix) > 3 and error.fix != "see above", case
        text = str(error)
        assert text.startswith(f"{field}: ") and "(got " in text and "Fix: " in text, case


@pytest.mark.parametrize(("field", "act"), UNKNOWN)
def test_an_unknown_quantity_is_met_with_the_near_one(field, act):
    with pytest.raises(sb.InputError, match="did you mean 'rope_EA'") as caught:
        act()
    assert caught.value.field == field


def test_the_fix_for_a_substep_alone_is_what_to_write():
    with pytest.raises(sb.InputError, match=r"write sb\.Solver\(h=0\.001\)"):
        sb.simulate(rope(), TIMES, 0.001)


@pytest.mark.parametrize("window", [(0.0, INF), (-1 / 60, 5 / 60), (0.0, 4.5 / 60)])
def test_windows_may_reach_one_frame_beyond_the_recording_or_have_no_end(window):
    assert sb.identify(experiment(fit=window), parameters=["links_compliance"]).estimates


@pytest.mark.parametrize("step", FROZEN.values(), ids=FROZEN)
def test_a_frozen_scene_refuses_additions(step):
    with pytest.raises(sb.SceneError, match="frozen") as caught:
        frozen(step)()
    assert "new scene" in caught.value.fix


@pytest.mark.parametrize("kind", ["bend", "planar_bend"])
@pytest.mark.parametrize("compliance", [None, 0.0, [0.0]])
def test_rigid_bending_is_refused_with_its_reason(kind, compliance):
    normal = (0, 1, 0) if kind == "planar_bend" else None
    with pytest.raises(sb.SceneError, match=r"rank 2 of 3.*EI"):
        three().add_constraints(kind, [[0, 1, 2]], compliance=compliance, normal=normal)


def test_a_rest_curvature_in_space_is_refused_with_its_reason():
    with pytest.raises(sb.SceneError, match=r"planar_bend.*rod for a curve in space"):
        three().add_constraints("bend", [[0, 1, 2]], compliance=1.0, rest=0.1)


@pytest.mark.parametrize(
    "run",
    [lambda s, t, h: sb.simulate(s, t, h), lambda s, t, h: sb.check_gradients(s, t, h)],
    ids=["simulate", "check"],
)
def test_divergence_says_when_and_where(run):
    """A force that leaves the range of numbers on particle 2 half-way through."""
    scene = linked()
    scene.add_force([2], np.array([[[0, 0, 0]], [[0, 0, 0]], [[1e308, 0, 0]]]), times=[0.0, 0.5, 0.51])
    scene.set_drag(quadratic=1.0)
    with pytest.raises(sb.DivergenceError) as caught:
        run(scene, [0.0, 1.0], sb.Solver(h=0.01))
    error = caught.value
    assert 0.5 <= error.time <= 0.55
    assert error.substep == pytest.approx(error.time / 0.01)
    assert error.particle in (1, 2)
    for part in ("diverged", f"particle {error.particle}", f"substep {error.substep}", "t = 0.5", "three", "Fix:"):
        assert part in str(error)


def test_a_fit_that_cannot_start_says_why():
    scene = linked()
    scene.add_force([2], [[1e308, 0, 0]])
    scene.set_drag(quadratic=1.0)
    with pytest.raises(sb.SheetbendError, match=r"cannot start.*diverged"):
        sb.fit(experiment(scene=scene), parameters=["links_compliance"])


def test_no_equilibrium_is_an_error_of_its_own():
    with pytest.raises(NoEquilibriumError, match=r"(?s)no rest.*Fix"):
        sb.equilibrium(rope(pinned=()))


def soft_rod() -> sb.Scene:
    rod = sb.rod(0.3, 6, density=0.05, EI=1e-3, GJ=1e-3, density_modes=(1,))
    rod.pin([0])
    return rod


@pytest.mark.parametrize("run", [sb.simulate, sb.rollout], ids=["simulate", "rollout"])
@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"rod_density_1": -1.5}, r"rod_density_1: makes the mass of particle 0 negative"),
        ({"rod_density": 0.0}, r"rod_density: makes the mass of particle 1 zero"),
        ({"rod_EI": 0.0}, r"rod_EI: makes the compliance of constraint 0 of group 'rod_bend' not finite"),
        ({"rod_EI": -1.0}, r"rod_EI: must be a positive number"),
        ({"rod_EI": np.inf}, r"rod_EI: must be a finite number"),
    ],
)
def test_values_that_make_no_physics_are_refused(run, values, words):
    with pytest.raises(sb.SceneError, match=words):
        run(soft_rod(), [0.0, 0.01], sb.Solver(h=1e-3), values)


def test_values_outside_limits_are_refused():
    mesh = sb.mesh.equilateral(0.3, 0.3, 3)
    scene = sb.Scene()
    sb.add_cloth(scene, mesh, density=0.2, warp=60, weft=50, shear=5, poisson=0.2)
    with pytest.raises(sb.SceneError, match=r"cloth_poisson: must be between -1 and 1 \(got 1.5\)"):
        sb.simulate(scene, [0.0, 0.01], values={"cloth_poisson": 1.5})
