"""Small random scenes with contacts, and three ways to their derivatives: reverse, forward tangents, differences.

    python tests/python/random_contacts.py [--first 0] [--seconds 3600]

draws scenes from consecutive seeds until the time is over and prints a line for each whose derivatives differ.
`tests/python/test_random_contacts.py` runs some seeds.
"""

from __future__ import annotations

import argparse
import time
import warnings
from dataclasses import dataclass, replace

import numpy as np
import sheetbend as sb
from sheetbend.mesh import grid, icosphere
from support import unit_vector

Array = np.ndarray
Draw = np.random.Generator
STEPS = (1e-5, 1e-6, 1e-7)  # of differences, along a direction in the units below
TOLERANCE = 1e-4  # of derivatives from central differences, beyond what differences to both sides differ by
FRICTIONS = (0.0, 0.05, 0.3, 1.0)
# What a direction changes by 1: m, m/s, m/s^2; everything else by its own size.
UNITS = {"position": 1e-2, "velocity": 0.1, "gravity": 0.3, "collider_pose": 1e-2, "boundary": 1e-2}
FIELD = icosphere(0.06, 2)
WIDER = 50_000
"""From this seed on: also dumbbells, flattened meshes and tethered bodies. Earlier ones keep their scenes."""
RINGS = 100_000
"""From this seed on: also rings of balls on rods, which hit each other."""


def shape(rng: Draw, name: str, wider: bool) -> tuple[sb.Collider, str]:
    """A shape whose surface is near the plane z = 0 below the middle."""
    kind = rng.choice(["plane", "tilted", "sphere", "capsule", "cylinder", "box", "field"])
    size = rng.uniform(0.04, 0.15)
    center = np.array([*rng.uniform(-0.03, 0.03, 2), -size])
    axis = np.array([np.cos(a := rng.uniform(0, np.pi)), np.sin(a), rng.uniform(-0.2, 0.2)])
    made: sb.Collider
    if kind == "plane":
        made = sb.Plane(name=name)
    elif kind == "tilted":
        made = sb.Plane(point=(0, 0, 0), normal=unit_vector(rng) * 0.4 + [0, 0, 1], name=name)
    elif kind == "sphere":
        made = sb.Sphere(center=center, radius=size, name=name)
    elif kind == "capsule":
        made = sb.Capsule(start=center - 0.1 * axis, end=center + 0.1 * axis, radius=size, name=name)
    elif kind == "cylinder":
        ends = center - 0.1 * axis, center + 0.1 * axis
        made = sb.Cylinder(*ends, radius=size, edge_radius=rng.choice([0.01, 0.03]), name=name)
    elif kind == "box":
        made = sb.Box(center=(0, 0, -0.05), size=(0.3, 0.2, 0.1), edge_radius=rng.choice([0.01, 0.03]), name=name)
    else:
        mesh = FIELD
        if wider and rng.random() < 0.5:
            kind, flat = "flat field", rng.uniform([0.8, 0.8, 0.4], [1.5, 1.5, 0.9])
            mesh = replace(FIELD, vertices=np.asarray(FIELD.vertices) * flat)
        low = float(np.asarray(mesh.vertices)[:, 2].min())
        made = sb.DistanceField(mesh, spacing=0.012, position=(0, 0, low), name=name)
    if rng.random() < 0.4:
        knots = np.array([[0, 0, 0], rng.uniform(-0.02, 0.02, 3), rng.uniform(-0.04, 0.04, 3)])
        turns = np.array([[0, 0, 0], rng.uniform(-0.2, 0.2, 3), rng.uniform(-0.4, 0.4, 3)])
        made = made.moving([0.0, 0.05, 0.2], knots, turns if rng.random() < 0.5 else None)
        kind += " moving"
    return made, str(kind)


def thrown(rng: Draw, count: int) -> Array:
    """Velocities (count, 3) m/s, down and aside."""
    return rng.uniform(-0.6, 0.6, 3) - [0, 0, rng.uniform(0, 1.0)] + rng.uniform(-0.1, 0.1, (count, 3))


def above(at: Array, by: float) -> Array:
    return at + np.array([0.0, 0.0, by])


@dataclass
class Drawn:
    scene: sb.Scene
    solver: sb.Solver
    frames: list[int]
    told: str


def drawn(seed: int) -> Drawn:
    """The scene of a seed."""
    rng = np.random.default_rng([23, seed])
    told: list[str] = []
    scene = sb.Scene(f"drawn {seed}", gravity=(*rng.uniform(-1, 1, 2), -9.81))
    what = rng.choice(["points", "balls", "rope", "rod", "cloth", "body", "bodies", "ropes", "folded", "mixed"])
    if seed >= WIDER and rng.random() < 0.4:
        what = rng.choice(["dumbbells", "tethered"])
    if seed >= RINGS and rng.random() < 0.2:
        what = "ring"
    swept = what in ("points", "balls", "dumbbells", "ring", "rope", "cloth") and rng.random() < 0.4
    told.append(str(what))
    touching: list[object] = []
    points: dict[int, Array] = {}
    height = rng.uniform(0.006, 0.02)

    def rope(name: str, at: Array, along: Array, links: int, **more: object) -> None:
        made = sb.add_rope(
            scene, name, length=0.03 * links, segments=links, density=0.05, EA=float(rng.choice([20.0, 1e3])),
            EI=1e-4, start=at, direction=along, velocity=thrown(rng, links + 1),
            stretch_damping=[None, 1e-3][rng.integers(2)], **more,
        )  # fmt: skip
        if (held := rng.random()) < 0.2:
            scene.pin([made.particles[0]])
        elif held < 0.4:
            knots = np.cumsum(np.vstack([at[None], rng.uniform(-0.02, 0.02, (3, 3))]), axis=0)[:, None]
            scene.drive([made.particles[0]], [0.0, 0.03, 0.07, 0.3], knots)
        touching.append(made)

    def body(name: str, at: Array) -> None:
        sides = rng.uniform(0.03, 0.08, 3)
        turn = rng.uniform(-1, 1, 3)
        half = np.sqrt((sides**2).sum()) / 2
        made = scene.add_body(
            name, of=sb.Inertia.box(0.2, sides), at=above(at, half), rotation=turn,
            velocity=thrown(rng, 1)[0], spin=rng.uniform(-6, 6, 3),
        )  # fmt: skip
        points[len(touching)] = sb.box_corners(sides)
        touching.append(made)

    up = np.array([0.0, 0.0, height + 0.012])
    if what == "points":
        n = int(rng.integers(1, 5))
        x = np.column_stack([rng.uniform(-0.03, 0.03, (n, 2)), rng.uniform(height, 0.06, n)])
        touching.append(scene.add_particles(x, rng.uniform(0.01, 0.1, n), thrown(rng, n)))
    elif what == "balls":
        n = int(rng.integers(2, 6))
        x = np.column_stack(
            [0.021 * np.arange(n) - 0.03, rng.uniform(-0.004, 0.004, n), 0.02 + rng.uniform(0, 0.02, n)]
        )
        ids = scene.add_particles(x, rng.uniform(0.01, 0.1, n), thrown(rng, n) + rng.uniform(-1, 1, (n, 3)))
        scene.add_collisions(ids, radius=0.01, restitution=float(rng.choice([0.0, 0.5, 0.9, 1.0])))
        if rng.random() < 0.4:
            hooks = scene.add_particles(x + np.array([0, 0, 0.1]), 1.0)
            scene.pin(hooks)
            strings = np.column_stack([hooks, ids])[: int(rng.integers(1, n + 1))]
            compliance = float(rng.choice([0.0, 1e-4]))
            scene.add_constraints("distance", strings, name="strings", compliance=compliance)
            told.append(f"{len(strings)} on strings")
        touching.append(ids)
    elif what == "dumbbells":
        n = int(rng.integers(2, 4))
        aside, high = rng.uniform(-0.004, 0.004, n), rng.uniform(0.02, 0.05, n)
        middle = np.column_stack([0.065 * np.arange(n) - 0.06, aside, high])
        along = 0.013 * (rng.uniform(-0.4, 0.4, (n, 3)) + np.array([1, 0, 0]))
        along *= np.maximum(1.0, 0.0101 / np.linalg.norm(along, axis=1, keepdims=True))  # own balls do not overlap
        x = np.concatenate([middle - along, middle + along])
        apart = np.tile(rng.uniform(-1, 1, (n, 3)) - np.outer(np.arange(n), [2, 0, 0]), (2, 1))
        ids = scene.add_particles(x, rng.uniform(0.01, 0.1, 2 * n), thrown(rng, 2 * n) + apart)
        compliance = float(rng.choice([0.0, 1e-7, 1e-4]))
        scene.add_constraints("distance", np.column_stack([ids[:n], ids[n:]]), name="rods", compliance=compliance)
        scene.add_collisions(ids, radius=0.01, restitution=float(rng.choice([0.0, 0.5, 1.0])))
        told.append(f"compliance {compliance:g}")
        touching.append(ids)
    elif what == "ring":
        n = int(rng.integers(3, 7))
        around = 2 * np.pi * np.arange(n) / n
        out = np.column_stack([np.cos(around), np.sin(around), 0.0 * around])
        x = above(0.024 / np.sin(np.pi / n) / 2 * out + rng.uniform(-1e-3, 1e-3, (n, 3)), 0.03 + height)
        ids = scene.add_particles(x, rng.uniform(0.01, 0.1, n), thrown(rng, n) - rng.uniform(0, 2, (n, 1)) * out)
        compliance, rods = float(rng.choice([0.0, 1e-7, 1e-4])), np.column_stack([ids, np.roll(ids, -1)])
        rods = rods[: n - int(rng.integers(0, 2))]
        scene.add_constraints("distance", rods, name="rods", compliance=compliance)
        scene.add_collisions(ids, radius=0.01, restitution=float(rng.choice([0.0, 0.5, 1.0])))
        told.append(f"{len(rods)} rods of {n} balls, compliance {compliance:g}")
        touching.append(ids)
    elif what == "tethered":
        body("box", up)
        hook = scene.add_particles(above(up, 0.1)[None], 1.0)
        scene.pin(hook)
        box = scene.bodies["box"]
        scene.add_constraints(
            "distance", [[hook[0], box.particles[0]]], name="string", compliance=float(rng.choice([0.0, 1e-4]))
        )
    elif what == "rope":
        rope("rope", up - [0.06, 0, 0], np.array([1, rng.uniform(-0.4, 0.4), rng.uniform(0, 0.5)]), 5)
    elif what == "rod":
        ahead = np.array([1.0, 0.0, rng.uniform(0, 0.4)])
        rod = sb.add_rod(
            scene, "rod", length=0.16, segments=5, density=0.05, EA=500.0, EI=1e-3, GJ=8e-4,
            start=sb.Grip.fixed(up - [0.06, 0, 0], ahead / np.linalg.norm(ahead), (0, 1, 0)),
        )  # fmt: skip
        touching.append(rod)
    elif what == "cloth":
        mesh = grid(0.12, 0.12, 3, 3)
        lifted = np.asarray(mesh.vertices) - [0.06, 0.06, 0] + up
        lifted[:, 2] += 0.003 * rng.random(len(lifted))
        made = sb.add_cloth(
            scene, mesh, "cloth", positions=lifted, velocity=thrown(rng, len(lifted)), density=0.2, warp=40.0,
            shear=10.0, bending=[None, 1e-4][rng.integers(2)], membrane_damping=[None, 1e-3][rng.integers(2)],
        )  # fmt: skip
        touching.append(made)
    elif what in ("body", "bodies"):
        body("box", up)
        if what == "bodies":
            body("other", above(up, 0.12))
            a, b = scene.bodies["box"], scene.bodies["other"]
            if rng.random() < 0.5:
                scene.add_self_contact(
                    a.capsules([[(-0.02, 0, 0), (0.02, 0, 0)]]), b.capsules([[(0, -0.02, 0), (0, 0.02, 0)]]),
                    radius=[0.012, 0.02], friction=float(rng.choice(FRICTIONS)),
                )  # fmt: skip
                told.append("capsules")
    elif what == "ropes":
        rope("lower", up - [0.06, 0, 0], np.array([1.0, 0.1, 0.0]), 4)
        rope("upper", above(up, 0.016) - [0, 0.05, 0], np.array([0.1, 1.0, 0.0]), 4)
        scene.add_self_contact(radius=0.006, friction=float(rng.choice(FRICTIONS)))
    elif what == "folded":
        mesh = grid(0.12, 0.06, 4, 2)
        x = np.array(mesh.vertices)
        bent = np.maximum(0.0, x[:, 0] - 0.06)
        x[:, 2] += 1.0 * bent
        x[:, 0] -= 0.5 * bent
        x = x - [0.06, 0.03, 0] + up
        made = sb.add_cloth(
            scene, mesh, "cloth", positions=x, velocity=thrown(rng, len(x)) - np.outer(bent > 0, [3.0, 0, 4.0]),
            density=0.2, warp=40.0, shear=10.0,
        )  # fmt: skip
        scene.add_self_contact(radius=0.002, friction=float(rng.choice(FRICTIONS)))
        touching.append(made)
    else:
        rope("rope", up - [0.06, 0, 0], np.array([1.0, 0.0, 0.0]), 4)
        body("box", above(up, 0.05))
        box = scene.bodies["box"]
        if rng.random() < 0.7:
            scene.add_self_contact(
                scene.ropes["rope"], box.capsules([[(-0.02, 0, 0), (0.02, 0, 0)]]),
                radius=[0.006, 0.015], friction=float(rng.choice(FRICTIONS)),
            )  # fmt: skip
            told.append("capsules")
    shapes = [shape(rng, f"shape{k}", seed >= WIDER) for k in range(1 + (rng.random() < 0.3))]
    for collider, kind in shapes:
        law = rng.choice(["rigid", "soft", "dissipating", "bouncing"], p=[0.4, 0.15, 0.15, 0.3])
        friction = float(rng.choice(FRICTIONS))
        numbers: dict[str, float] = {"friction": friction}
        if law in ("soft", "dissipating"):
            numbers["stiffness"] = float(rng.choice([100.0, 2e3]))
        if law == "dissipating":
            numbers["dissipation"] = 0.5
        if law == "bouncing":
            numbers["restitution"] = float(rng.choice([0.2, 0.7, 1.0]))
        told.append(f"{kind} {law} {friction:g}")
        for j, thing in enumerate(touching):
            more = {"points": points[j]} if j in points else {}
            radius = 0.0 if j in points else float(rng.choice([0.0, 0.004]))
            scene.add_contact(thing, collider, radius=radius, name=f"{collider.name}_{j}", **numbers, **more)
    if rng.random() < 0.3:
        scene.set_drag(linear=0.01, quadratic=0.02)
    h = float(rng.choice([5e-4, 1e-3, 2e-3, 5e-3]))
    integrator = str(rng.choice(["bdf1", "bdf2"]))
    method = {"method": "gauss_seidel", "iterations": int(rng.integers(1, 5))} if swept else {"method": "implicit"}
    count = int(rng.integers(8, 60))
    told.append(f"h {h:g} {integrator} {method} x {count}")
    return Drawn(scene, sb.Solver(h=h, integrator=integrator, **method), [count // 2, count], ", ".join(told))


def direction(drawing: Drawn, rng: Draw) -> Array:
    """Of all inputs: all quantities, one array of numbers, or all arrays at once."""
    compiled = drawing.scene.compiled
    inputs, along = compiled.inputs(), np.zeros(compiled.core.inputs)
    kind = rng.choice(["quantities", "array", "arrays"])
    if kind == "quantities":
        theta = compiled.theta
        return np.asarray(
            compiled.inputs_dot(theta, rng.standard_normal(len(theta)) * np.where(theta == 0.0, 1e-2, np.abs(theta)))
        )
    places = {name: span for name, span in compiled.layout.items() if span[1]}
    for name in list(places) if kind == "arrays" else [rng.choice(list(places))]:
        first, size = places[name]
        if name in ("position", "velocity"):
            size = 3 * drawing.scene.particle_count  # hidden nodes hold the names of pairs, and axes of bodies
        own = slice(first, first + size)
        along[own] = rng.standard_normal(size) * UNITS.get(name, np.abs(inputs[own]))
    return along


@dataclass
class Derivatives:
    """Along one direction, (frames, numbers)."""

    forward: Array
    by_differences: list[Array]  # by step
    one_sided: list[tuple[Array, Array]]
    reverse: tuple[float, float]  # of a random weighting, and that of `forward`
    size: float  # of the terms that these two sum


def derivatives(drawing: Drawn, rng: Draw, along: Array | None = None) -> Derivatives:
    compiled, frames = drawing.scene.compiled, drawing.frames
    core, inputs = drawing.solver.core(compiled), compiled.inputs()
    along = direction(drawing, rng) if along is None else along
    _, x_dot = core.jvp(inputs, along[None], frames, 0.0)
    x_dot = x_dot[0].reshape(len(frames), -1)
    weights = rng.standard_normal(x_dot.shape)
    bar = core.vjp(inputs, core.record(inputs, frames, 0.0)[1], frames, weights, 0.0)

    def ends(by: float) -> Array:
        return np.asarray(core.simulate(inputs + by * along, frames, 0.0)["positions"]).reshape(len(frames), -1)

    x = ends(0.0)
    pairs = [(ends(d), ends(-d)) for d in STEPS]
    central = [(a - b) / (2 * d) for d, (a, b) in zip(STEPS, pairs, strict=True)]
    sides = [((a - x) / d, (x - b) / d) for d, (a, b) in zip(STEPS, pairs, strict=True)]
    size = float(np.abs(x_dot * weights).sum() + np.abs(bar * along).sum())
    return Derivatives(x_dot, central, sides, (float((x_dot * weights).sum()), float(bar @ along)), size)


def same_bits(drawing: Drawn, rng: Draw) -> str:
    """What changes bits, in words: states that are computed again, or other scenes in the lanes of vectors."""
    compiled, frames = drawing.scene.compiled, drawing.frames
    core, inputs = drawing.solver.core(compiled), compiled.inputs()
    bar = rng.standard_normal((len(frames), np.asarray(core.simulate(inputs, frames, 0.0)["positions"]).shape[1]))
    states, tape = core.record(inputs, frames, 0.0)
    expected = core.vjp(inputs, tape, frames, bar, 0.0)
    told = []
    few = core.record(inputs, frames, 0.0, core.tape_plan(frames).least)[1]
    if not np.array_equal(core.vjp(inputs, few, frames, bar, 0.0), expected):
        told.append("bits of checkpoints")
    others = np.stack([inputs, inputs * (1 + 1e-9 * rng.standard_normal(len(inputs))), inputs])
    beside = np.asarray(core.simulate_batch(others, frames, 0.0))
    if not (np.array_equal(beside[0], states) and np.array_equal(beside[2], states)):
        told.append("bits of motions in lanes")
    bars = np.asarray(core.vjp_batch(others, frames, np.stack([bar] * 3), 0.0))
    if not (np.array_equal(bars[0], expected) and np.array_equal(bars[2], expected)):
        told.append("bits of gradients in lanes")
    return ", ".join(told)


def gap(a: Array, b: Array) -> float:
    """The largest difference over the largest number, worst frame. Numbers that differences with the largest step know
    to fewer digits than TOLERANCE asks for, by the rounding of positions of 0.1 m, are no larger than that."""
    least = np.finfo(float).eps * 0.1 / (STEPS[0] * TOLERANCE)
    return max(float(np.abs(p - q).max() / max(np.abs(q).max(), least)) for p, q in zip(a, b, strict=True))


def judged(found: Derivatives, particles: int) -> str:
    """What is wrong, in words; nothing where a kink is near."""
    forward, reverse = found.reverse
    told = []
    if abs(forward - reverse) > 1e-6 * found.size + 1e-12:
        told.append(f"reverse {reverse:.9g} forward {forward:.9g} off by {abs(forward - reverse) / found.size:.2g}")

    def real(a: Array) -> Array:
        return a[:, : 3 * particles]

    smooth = []
    for d, central, (ahead, behind) in zip(STEPS, found.by_differences, found.one_sided, strict=True):
        if (bend := gap(real(ahead), real(behind))) < 1e-2:
            smooth.append((d, gap(real(found.forward), real(central)) - bend))
    if smooth and min(g for _, g in smooth) > TOLERANCE:
        told.append("differences " + " ".join(f"{d:g}: {g:.2g}" for d, g in smooth))
    if not smooth:
        return ("; ".join(told) + " kink") if told else "kink"
    return "; ".join(told)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=10**9)
    parser.add_argument("--seconds", type=float, default=3600.0)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    counts: dict[str, int] = {}
    for seed in range(given.first, given.first + given.count):
        if time.process_time() > given.seconds:
            break
        drawing = None
        try:
            drawing = drawn(seed)
            rng = np.random.default_rng([7, seed])
            if said := same_bits(drawing, rng):
                print(f"{seed}: {said} [{drawing.told}]", flush=True)
            for k in range(3):
                said = judged(derivatives(drawing, rng), drawing.scene.particle_count)
                key = "kink" if said == "kink" else "wrong" if said else "right"
                counts[key] = counts.get(key, 0) + 1
                if key == "wrong":
                    print(f"{seed}.{k}: {said} [{drawing.told}]", flush=True)
        except Exception as error:
            key = f"{type(error).__name__} {str(error)[:90]}"
            counts[key] = counts.get(key, 0) + 1
            told = drawing.told if drawing else ""
            print(f"{seed}: {type(error).__name__} {str(error)[:200]} [{told}]", flush=True)
        if seed % 100 == 99:
            print(seed, f"{time.process_time():.0f} s", counts, flush=True)
    print(counts)


if __name__ == "__main__":
    main()
