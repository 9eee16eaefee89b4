"""Gradients of random scenes of bodies, joints and what hangs on them, against complex step.

    python tests/python/random_mechanisms.py [--seconds 600] [--first 0]

Prints the seeds whose gradient differs. A test runs a few seeds.
"""

from __future__ import annotations

import argparse
import time
import warnings

import numpy as np
import sheetbend as sb
from sheetbend.motion.core_terms import divergence
from support import unit_vector

BODIES, ROPES = 4, 2  # at most
H, SUBSTEPS = 2e-3, 6
BOUND = 1e-7
LOOSE = ("rope", "rod", "cloth", "solid", "mean", "load")
Draw = np.random.Generator


def some(rng: Draw, chance: float) -> bool:
    return bool(rng.random() < chance)


def hinge(rng: Draw, upper: sb.Body | None, lower: sb.Body, at: np.ndarray, name: str, smooth: bool) -> sb.Joint:
    more: dict[str, object] = {}
    if some(rng, 0.4):
        more |= {"stiffness": rng.uniform(0.01, 1.0), "rest": rng.uniform(-0.5, 0.5)}
    if some(rng, 0.4):
        more["viscosity"] = rng.uniform(1e-5, 1e-2)
    if some(rng, 0.3) and not smooth:
        more |= {"friction": rng.uniform(1e-4, 1e-2), "slip_angle": rng.uniform(1e-3, 1e-2)}
    if some(rng, 0.3):
        more |= {"limits": (-rng.uniform(1e-3, 0.3), rng.uniform(1e-3, 0.3)), "limit_damping": 1e-3}
    if some(rng, 0.3):
        more |= {"tilt_stiffness": rng.uniform(10.0, 100.0), "tilt_damping": rng.uniform(0.0, 0.1) + 1e-3}
    knots = np.array([0.0, 0.5 * H * SUBSTEPS, H * SUBSTEPS])
    if some(rng, 0.2):
        more |= {"torque": (knots, rng.uniform(-0.05, 0.05, 3)), "rotor": 1e-5}
    elif some(rng, 0.2) and "stiffness" not in more and "viscosity" not in more:
        more["servo"] = (knots, np.append(0.0, rng.uniform(-0.02, 0.02, 2)))
    return sb.hinge(upper, lower, at=at, axis=unit_vector(rng), name=name, rate=rng.uniform(-2, 2), **more)


def joint(rng: Draw, upper: sb.Body | None, lower: sb.Body, at: np.ndarray, name: str, smooth: bool) -> str:
    kind = str(rng.choice(["ball", "hinge", "hinge", "hinge", "universal", "slider", "cylinder", "fixed", "mount"]))
    if kind == "hinge":
        hinge(rng, upper, lower, at, name, smooth)
    elif kind in ("ball", "mount"):
        sb.ball(upper, lower, at=at, name=name, compliance=1e-4 if kind == "mount" else None)
    elif kind == "universal":
        a = unit_vector(rng)
        sb.universal(upper, lower, at=at, axes=(a, np.cross(a, unit_vector(rng))), name=name)
    elif kind == "slider":
        more = {"limits": (-rng.uniform(1e-4, 0.02), rng.uniform(1e-4, 0.02))} if some(rng, 0.5) else {}
        sb.slider(upper, lower, at=at, axis=unit_vector(rng), name=name, rate=rng.uniform(-0.5, 0.5), **more)
    elif kind == "cylinder":
        sb.cylinder(upper, lower, at=at, axis=unit_vector(rng), name=name, rate=0.2, turn_rate=rng.uniform(-2, 2))
    else:
        sb.fixed(upper, lower, at=at, name=name)
    return kind


def hang(rng: Draw, scene: sb.Scene, body: sb.Body, at: np.ndarray, kind: str, name: str) -> None:
    """Something from a point of a body."""
    if kind == "rope":
        rope = sb.add_rope(scene, name, length=0.1, segments=4, density=0.05, EA=50.0, start=at)
        sb.attach(body, rope.particles[:1], name=f"{name}_held")
    elif kind == "rod":
        origin, frame = body.pose(scene.nodes)
        start = body.point(frame.T @ (at - origin), along=frame.T @ unit_vector(rng))
        sb.add_rod(scene, name, length=0.1, segments=4, density=0.05, EI=1e-3, GJ=1e-3, EA=1e2, start=start)
    elif kind == "cloth":
        mesh = sb.mesh.grid(0.1, 0.1, 3, 3)
        given = {"density": 0.2, "warp": 50.0, "shear": 10.0, "bending": 1e-4}
        cloth = sb.add_cloth(scene, mesh, name, positions=mesh.vertices + at, **given)
        sb.attach(body, cloth.particles[mesh.sets["top"]], name=f"{name}_held")
    else:
        mesh = sb.mesh.bricks((0.06, 0.04, 0.04), (2, 1, 1), at=at)
        solid = sb.add_solid(scene, mesh, name, density=500.0, E=1e5, poisson=0.3, damping=1e-3)
        face = solid.particles[mesh.sets["x_min"]]
        if kind == "solid":
            sb.attach(body, face, name=f"{name}_held")
        else:
            mean = sb.add_mean(scene, face, rng.uniform(0.5, 2.0, len(face)), name=f"{name}_mean")
            sb.attach(body, [mean], name=f"{name}_held")


def scene_of(seed: int) -> tuple[sb.Scene, sb.Solver, str]:
    """A scene, how it is solved, and what it is made of."""
    rng = np.random.default_rng(seed)
    method = str(rng.choice(["direct", "direct", "newton", "implicit"]))
    smooth = method != "direct"
    scene, parts, upper = sb.Scene(f"mechanism {seed}"), [method], None
    bodies: list[sb.Body] = []
    for k in range(int(rng.integers(1, BODIES + 1))):
        box = sb.Inertia.box(rng.uniform(0.02, 0.5), rng.uniform(0.02, 0.15, 3))
        at = np.array([0.15 * k, 0.0, 0.0]) + 0.02 * rng.standard_normal(3)
        spin = some(rng, 0.2) and method == "direct"
        drag = {"drag": 0.05, "turn_drag": 1e-4} if some(rng, 0.3) else {}
        body = scene.add_body(
            f"b{k}", of=box, at=at, velocity=0.3 * rng.standard_normal(3), spin=3.0 * rng.standard_normal(3),
            keep_spin=spin, **drag,
        )  # fmt: skip
        parts.append("spin kept" if spin else "body")
        if k == 0 and some(rng, 0.3):
            parts.append("free")
        else:
            place = at + 0.01 * rng.standard_normal(3) - np.array([0.07, 0.0, 0.0])
            if some(rng, 0.1):  # a door on two hinges, of whose rows five follow from the others
                axis = unit_vector(rng)
                for n in (0, 1):
                    sb.hinge(upper, body, at=place + 0.05 * n * axis, axis=axis, name=f"j{k}_{n}")
                parts.append("two hinges")
            else:
                parts.append(joint(rng, upper, body, place, f"j{k}", smooth))
        bodies.append(body)
        upper = body if some(rng, 0.8) else bodies[0]
    if len(bodies) > 2 and some(rng, 0.3):  # a loop; the first joint decides where its last body starts
        sb.ball(None, bodies[-1], at=bodies[-1].pose(scene.nodes)[0] + np.array([0.05, 0.0, 0.0]), name="loop")
        parts.append("loop")
    for k in range(int(rng.integers(0, 3))):
        kind, body = str(rng.choice(LOOSE)), bodies[int(rng.integers(len(bodies)))]
        at = body.pose(scene.nodes)[0] + 0.03 * rng.standard_normal(3)
        parts.append(kind)
        if kind == "load":
            scene.add_force(body.point(0.03 * rng.standard_normal(3)), rng.standard_normal(3), name=f"push{k}")
        else:
            hang(rng, scene, body, at, kind, f"hung{k}")
    return scene, sb.Solver(h=H, method=method), ", ".join(parts)


def differs(seed: int, given: sb.Solver | None = None) -> tuple[dict[str, float], str]:
    """`gaps` of a seed's scene, and what it is made of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene, solver, parts = scene_of(seed)
        return gaps(scene, given or solver, seed), parts


def gaps(scene: sb.Scene, solver: sb.Solver, seed: int = 0) -> dict[str, float]:
    """By input array, how far the adjoint is from the complex step along a direction of all of its entries, relative to
    the largest that the two may be. What moves the positions by less than their rounding is no gap."""
    compiled = scene.compiled
    core, inputs, steps = solver.core(compiled), compiled.inputs(), [1, SUBSTEPS]
    rng = np.random.default_rng(seed)
    with divergence(scene):
        x, tape = core.record(inputs, steps, 0.0)
        weights = rng.standard_normal(x.shape)
        adjoint = core.vjp(inputs, tape, steps, weights, 0.0)
    rounding = np.finfo(float).eps * np.abs(weights * x).sum()
    found = {}
    for name, (first, size) in compiled.layout.items():
        own = slice(first, first + size)
        if size == 0:
            continue
        direction = np.zeros(len(inputs))
        direction[own] = rng.standard_normal(size) * np.where(inputs[own] == 0.0, 1.0, inputs[own])
        exact = float((core.complex_step(inputs, direction, steps, 0.0) * weights).sum())
        shares = adjoint * direction
        found[name] = abs(exact - float(shares.sum())) / max(np.abs(shares).max(), abs(exact), rounding / BOUND)
    return found


def main(seconds: float, first: int) -> None:
    begin, seed, refused, failed, worst = time.monotonic(), first, 0, 0, 0.0
    while time.monotonic() - begin < seconds:
        try:
            found, parts = differs(seed)
        except sb.SheetbendError as error:
            refused += 1
            print(f"seed {seed} refused: {error}", flush=True)
        else:
            worst = max(worst, *found.values())
            wrong = {name: off for name, off in found.items() if not off < BOUND}
            if wrong:
                failed += 1
                print(f"seed {seed} differs: {parts}: {wrong}", flush=True)
        seed += 1
    print(f"{seed - first} scenes, {refused} refused, {failed} with a gradient that differs, largest {worst:.1e}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--first", type=int, default=0)
    given = parser.parse_args()
    main(given.seconds, given.first)
