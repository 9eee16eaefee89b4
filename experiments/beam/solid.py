"""The bare beam as a solid of bricks: E beside that of the rod with shear, and the loaded run's frequency from it.

Run from the repository's root: python experiments/beam/solid.py. It prints the table of the README, in a few minutes:
for a face whose particles are pinned, and for one that stays plane but may narrow.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
from sheetbend.config import load
from sheetbend.quantities.quantities import Term, product

CONFIG = Path(__file__).with_name("beam.toml")
SIDE, DENSITY, POISSON = 0.03, 1070.0, 0.499  # m, kg/m^3; silicone
E, DAMPING, TILT = 3.0e5, 0.1 / (2 * np.pi * 7.7), 0.113  # Pa, s, rad, where the fits start
CLAMPS = ("pinned", "narrows")
MESHES = ((7, 2, 2), (10, 3, 3))
SOLVER = sb.Solver(h=2.5e-3, method="newton")
FAR = 1.0  # m, of the anchors of links along which a particle keeps its place
SIDEWAYS = 0.01  # m/N, of each link that keeps a face's side: a fortieth of what would keep it from narrowing


def narrowing(out, mesh, beam, face, origin):
    """Hold a face that may narrow: its particles stay in its plane, at the ends of rigid links to anchors far along the
    beam. Their mean, by areas, keeps its height. Soft links keep its side.

    Returns the anchors, placed across the beam alone, and their places in the beam's axes."""
    own, areas = beam.particles[face], mesh.areas(face)
    mean = sb.add_mean(out, own, areas, name="held_mean")
    x = mesh.vertices[face]
    anchors, places = [], []
    for axis, held, at, soft in (
        (0, own, x, 0.0),
        (2, [mean], (areas @ x / areas.sum())[None], 0.0),
        (1, own, x, SIDEWAYS),
    ):
        away = at - FAR * np.eye(3)[axis]
        anchor = out.add_hidden(origin + away * [0.0, 1.0, 0.0], 1.0, pinned=True)
        pairs = np.column_stack([held, anchor])
        rest = np.full(len(held), FAR)
        out.add_constraints("distance", pairs, name=f"held_{'xyz'[axis]}", rest=rest, compliance=soft)
        anchors.append(anchor)
        places.append(away)
    return np.concatenate(anchors), np.concatenate(places)


def scene(section, gravity, cells, pulled, clamp, hung=0.0):
    """A box of bricks whose clamp points down by the quantity `beam_tilt`; `pulled` by a force on its tip, which lets
    go; with a mass [kg] on the upper edge of its tip."""
    length = section.length
    mesh = sb.mesh.bricks((length, SIDE, SIDE), cells, at=(0.0, -SIDE / 2, -SIDE / 2))
    out = sb.Scene("beam", gravity)
    start = np.tile(section.start, (len(mesh.vertices), 1))
    start[:, 1] += mesh.vertices[:, 1]
    still = mesh.sets["x_min"]
    held = still if clamp == "pinned" else ()
    beam = sb.add_solid(
        out, mesh, "beam", density=DENSITY, E=E, poisson=POISSON, damping=DAMPING, held=held, positions=start
    )
    nodes, places = beam.particles, mesh.vertices
    if clamp == "pinned":
        out.pin(beam.particles[still])
    else:
        anchors, away = narrowing(out, mesh, beam, still, section.start)
        nodes, places = np.concatenate([nodes, anchors]), np.concatenate([places, away])
    out.add_quantity("beam_tilt", TILT, "rad", positive=False, scale=0.1)
    x, z = places[:, 0], places[:, 2]
    for axis, function, by in ((0, "cos", x), (0, "sin", z), (2, "sin", -x), (2, "cos", z)):
        out.add_terms([Term("position", 3 * nodes + axis, by, (("beam_tilt", function),))])
    tip = beam.particles[mesh.sets["x_max"]]
    if pulled:
        out.add_force(tip, np.zeros((2, len(tip), 3)), [0.0, 1e-6])
        out.add_quantity("pull_z", -0.3, "N", positive=False, scale=0.3)
        share = 1.0 / len(tip)
        out.add_terms([product("force", 3 * k + 2, share, {"pull_z": "identity"}) for k in range(len(tip))])
    if hung:
        edge = beam.particles[mesh.within((length - 1e-9, -1, SIDE / 2 - 1e-9), (1, 1, 1))]
        for k, particle in enumerate(edge):
            out.add_point_mass(int(particle), hung / len(edge), f"hung{k}")
    return out


def on_tip(beam, offset):
    """A point that moves with the last bricks: weights of the corners of a box over the whole section."""
    mesh = beam.mesh
    xs = np.unique(mesh.vertices[:, 0].round(12))[[-2, -1]]
    lower, upper = np.array([xs[0], -SIDE / 2, -SIDE / 2]), np.array([xs[1], SIDE / 2, SIDE / 2])
    corners = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    own = (np.array([xs[1] + offset[0], offset[1], offset[2]]) - lower) / (upper - lower)
    weights = np.where(corners == 1, own, 1.0 - own).prod(axis=1)
    particles = beam.particles[mesh.nearest(lower + corners * (upper - lower))]
    return sb.Place(tuple(int(p) for p in particles), tuple(weights.tolist()), (0.0,) * 8)


def experiment(given, section, cells, clamp):
    """One of the configuration's experiments with its rope made a solid."""
    made = scene(section, given.recording.gravity, cells, given.start == "equilibrium", clamp)
    beam = made.solids["beam"]
    markers = {name: on_tip(beam, m.offset) for name, m in given.markers.items()}
    return replace(given, scene=made, markers=markers, solver=SOLVER)


def fitted(study, cells, clamp="pinned"):
    """E, damping and the clamp's angle of the bare beam, from its rest and its fall."""
    section, own = study.config.scene.rope[0], [e for e in study.experiments if e.name in ("rest", "fall")]
    parameters = {"beam_E": {}, "beam_damping": {}, "beam_tilt": {}, "pull_z": {"private": True}}
    made = [experiment(e, section, cells, clamp) for e in own]
    return sb.fit(made, parameters=parameters, profiles=False, refine=False)


def frequency(times, z):
    """The highest peak of the spectrum [Hz], between 2 and 12 Hz."""
    n = 64 * len(z)
    power = np.abs(np.fft.rfft((z - z.mean()) * np.hanning(len(z)), n))
    f = np.arange(len(power)) / (n * (times[1] - times[0]))
    inside = (f > 2) & (f < 12)
    return float(f[inside][power[inside].argmax()])


def loaded_frequency(study, cells, values, clamp="pinned", hung=0.052, seconds=1.5):
    """Of the tip's height with the hung mass [kg] after a small pull lets go, with what the bare run gave."""
    given = next(e for e in study.experiments if e.name == "loaded")
    made = scene(study.config.scene.rope[0], given.recording.gravity, cells, True, clamp, hung)
    rest = sb.equilibrium(made, values=values)
    beam = made.solids["beam"]
    times = np.arange(0, seconds, 0.01)
    tip = beam.particles[beam.mesh.sets["x_max"]]
    moved = sb.simulate(made, times, SOLVER, values=values, start=rest.nodes)
    return frequency(times, moved.positions[:, tip, 2].mean(axis=1))


if __name__ == "__main__":
    study = load(CONFIG)
    print("clamp | bricks | E, 95 % interval | damping | cost | rest | fall | next second | loaded", flush=True)
    for clamp, cells in ((clamp, cells) for clamp in CLAMPS for cells in MESHES):
        found = fitted(study, cells, clamp)
        rest, fall = (next(r for r in found.result.recordings if r.name == part) for part in ("rest", "fall"))
        stiff, damping = found["beam_E"], found["beam_damping"]
        errors = " | ".join(f"{1e3 * error:.3f} mm" for error in (rest.rms, fall.rms, fall.held_out))
        values = {name: found[name].value for name in ("beam_E", "beam_damping", "beam_tilt")}
        loaded = loaded_frequency(study, cells, values, clamp)
        print(
            f"{clamp} | {' x '.join(map(str, cells))} | {stiff.value / 1e3:.0f} kPa, {stiff.lower / 1e3:.0f} to "
            f"{stiff.upper / 1e3:.0f} | {1e3 * damping.value:.2f} ms | {found.result.cost:.2f} | "
            f"{errors} | {loaded:.2f} Hz",
            flush=True,
        )
