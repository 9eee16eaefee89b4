"""Recordings of ropes, beams and cloth with known truth, for `sheetbend new`: markers with noise, and nothing beside
them that says how the thing is held."""

from __future__ import annotations

import numpy as np
import sheetbend as sb

Array = np.ndarray
DENSITY, EI, DAMPING, DRAG, LENGTH = 0.05, 4e-4, 0.01, 5e-3, 0.7
NOISE, SEGMENTS, RATE = 5e-4, 96, 100
MARKERS = 9
OF_HAND = np.array([[0.0, 0.05, 0.02], [0.02, -0.05, 0.01], [-0.04, 0.0, 0.05]])  # m, in the hand's axes


def hand(seconds: float, turning: bool = True) -> tuple[Array, Array, Array]:
    """Times (frames,) s, rotations (frames, 3, 3) and places (frames, 3) m of a hand that rests for 0.3 s and then
    swings, about 1 m above the ground."""
    t = np.arange(round(seconds * RATE) + 1) / RATE
    since = np.maximum(t - 0.3, 0.0)
    ease = 1.0 - np.exp(-((since / 0.3) ** 2))
    place = np.stack([0.12 * np.sin(5.0 * since), 0.05 * np.sin(3.3 * since), 0.06 * np.sin(4.1 * since)], axis=1)
    angle = 0.5 * ease * np.sin(4.0 * since) if turning else np.zeros_like(t)
    c, s, one, zero = np.cos(angle), np.sin(angle), np.ones_like(t), np.zeros_like(t)
    turns = np.moveaxis(np.array([[c, zero, s], [zero, one, zero], [-s, zero, c]]), 2, 0)
    return t, turns, [0.3, 0.2, 1.0] + ease[:, None] * place


def noisy(x: Array, seed: int) -> Array:
    return x + NOISE * np.random.default_rng(seed).standard_normal(x.shape)


def rope_in_hand(held: str, seconds: float = 2.5, stiffness: float = EI) -> sb.Recording:
    """A rope that hangs from a hand, which moves it.

    Args:
        held: "one" marker at the end, about which it turns; "two" in the hand, the second of which is where the rope
            becomes free; "body", three beside the rope.
        stiffness: EI, N m^2.
    """
    t, turns, place = hand(seconds, turning=held != "one")
    scene = sb.Scene("take")
    points = place[0] + np.linspace(0.0, LENGTH, 5)[:, None] * np.array([0.0, 0.0, -1.0])
    down = turns @ np.array([0.0, 0.0, -1.0])
    grip = None if held == "one" else sb.Grip(t, place, down, turns @ np.array([1.0, 0.0, 0.0]))
    rope = sb.add_rope(
        scene,
        length=LENGTH,
        segments=SEGMENTS,
        density=DENSITY,
        EI=stiffness,
        bend_damping=DAMPING,
        drag_linear=DRAG,
        points=points,
        grip_start=grip,
    )
    if grip is None:
        scene.drive(rope.particles[:1], t, place[:, None])
    x = sb.simulate(scene, t, sb.Solver(h=1 / 1000)).positions[:, rope.particles[:: SEGMENTS // (MARKERS - 1)]]
    names = [f"r{k}" for k in range(MARKERS)]
    if held == "two":
        x, names = np.concatenate([(place - 0.06 * down)[:, None], x], axis=1), ["hand_back", "hand_front", *names[1:]]
    if held == "body":
        x = np.concatenate([place[:, None] + np.einsum("fab,kb->fka", turns, OF_HAND), x], axis=1)
        names = ["a", "b", "c", *names]
    return sb.Recording(noisy(x, 1), t, tuple(names), name=f"hand_{held}")


FRICTION, STIFF, TABLE = 0.35, 6e-4, 0.75  # of a table, and m, how high it is; EI, N m^2, of the rope on it


def rope_on_table(held: str, seconds: float = 3.0, flat: bool = False, noise: float = 1e-3) -> sb.Recording:
    """A rope of 0.6 m on a table, in a hand that rests for 0.3 s and then drags it aside slowly and back fast.

    Args:
        held: "one" marker at the end, about which the rope turns; "body", three beside it in a hand that turns too.
        flat: as a camera from above tracks it, in x and y.
        noise: m.
    """
    rest, rate, length, links = 1.0, 50, 0.6, 96  # s, before the recording, in which the rope comes to rest; Hz; m
    t = np.arange(round((rest + seconds) * rate) + 1) / rate
    since = t - rest - 0.3

    def moved(begin: float, lasts: float) -> Array:
        share = np.clip((since - begin) / lasts, 0.0, 1.0)
        return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)

    slow, fast, last = moved(0.0, 0.9), moved(1.0, 0.5), moved(1.7, 0.9)
    away, aside = -0.15 * fast - 0.1 * last, 0.15 * slow - 0.3 * fast + 0.15 * last
    place = np.stack([away, aside, np.full_like(t, TABLE + 0.004)], axis=1)
    angle = 0.0 * t if held == "one" else 0.6 * slow - 1.2 * fast + 0.9 * last
    c, s, one, zero = np.cos(angle), np.sin(angle), np.ones_like(t), np.zeros_like(t)
    turns = np.moveaxis(np.array([[c, -s, zero], [s, c, zero], [zero, zero, one]]), 2, 0)
    way = 0.7 * np.sin(1.3 * np.pi * (np.arange(links) + 0.5) / links) * np.sin(1.3 * np.pi * np.arange(links) / links)
    bends = length / links * np.stack([np.cos(way), np.sin(way), 0.0 * way], axis=1)
    points = place[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(bends, axis=0)])
    grip = None if held == "one" else sb.Grip(t, place, turns @ np.array([1.0, 0, 0]), turns @ np.array([0, 1.0, 0]))
    scene = sb.Scene("take")
    own = {"length": length, "segments": links, "density": DENSITY, "EI": STIFF, "EA": 2e3, "drag_linear": 0.02}
    rope = sb.add_rope(scene, **own, bend_damping=2e-3, points=points, grip_start=grip)
    if grip is None:
        scene.drive(rope.particles[:1], t, place[:, None])
    table = sb.Plane(point=(0, 0, TABLE), name="table")
    scene.add_contact(rope, table, friction=FRICTION, radius=0.004, stiffness=2e3)
    solver = sb.Solver(h=2.5e-4, method="implicit", integrator="bdf1")
    x = sb.simulate(scene, t, solver).positions[:, rope.particles[::8]]
    names = [f"r{k}" for k in range(13)]
    if held == "body":
        of_hand = np.array([[-0.02, 0.03, 0.0], [-0.03, -0.03, 0.0], [-0.07, 0.0, 0.0]])
        x = np.concatenate([place[:, None] + np.einsum("fab,kb->fka", turns, of_hand), x], axis=1)
        names = ["a", "b", "c", *names]
    x = x + noise * np.random.default_rng(1).standard_normal(x.shape)
    x = np.where([True, True, not flat], x, 0.0)[t >= rest - 1e-9]
    return sb.Recording(x, np.arange(len(x)) / rate, tuple(names), name=f"table_{held}")


def let_go(clamped: bool, seconds: float = 1.5) -> sb.Recording:
    """A straight level rope that is let go, held in a clamp or by a pin."""
    t = np.arange(round(seconds * RATE) + 1) / RATE
    clamp = {"clamp_start": (1, 0, 0)} if clamped else {}
    stiff = 5 * EI if clamped else EI
    scene = sb.rope(
        LENGTH, SEGMENTS, density=DENSITY, EI=stiff, bend_damping=DAMPING, drag_linear=DRAG, pinned=(0,), **clamp
    )
    nodes = scene.ropes["rope"].particles[:: SEGMENTS // (MARKERS - 1)]
    return sb.Recording(noisy(sb.simulate(scene, t, sb.Solver(h=1 / 1000)).positions[:, nodes], 2), t, name="let_go")


BEAM = {"length": 0.3, "density": 0.4, "EI": 0.1655, "loss_factor": 0.12, "loss_frequency": 4.0}  # 4 Hz


def beam(seconds: float = 3.0) -> sb.Recording:
    """A beam in a clamp that points up by 0.2 rad, bent by a force and let go: three markers on the clamp, three on
    its end."""
    t = np.arange(round(seconds * 200) + 1) / 200
    way = np.array([np.cos(0.2), 0.0, np.sin(0.2)])
    start = np.array([0.02, 0.03, 0.5])
    scene = sb.Scene("beam")
    rope = sb.add_rope(scene, "beam", segments=40, start=start, direction=way, clamp_start=way, **BEAM)
    scene.pin(rope.particles[:1])
    knots = np.array([0.0, 0.3, 0.301])
    scene.add_force(rope.particles[-1:], np.array([1.0, 1.0, 0.0])[:, None, None] * [[[0.0, 0.0, -1.0]]], knots)
    x = sb.simulate(scene, t, sb.Solver(h=1 / 2000), start=sb.equilibrium(scene).positions).positions
    end, inner = x[:, rope.particles[-1]], x[:, rope.particles[-2]]
    along = (end - inner) / np.linalg.norm(end - inner, axis=1, keepdims=True)
    across = np.array([0.0, 1.0, 0.0])
    upward = np.cross(along, across)
    tips = [end + a * along + b * across + c * upward for a, b, c in ((0, 0.02, 0.01), (0, -0.02, 0.0), (0, 0, -0.015))]
    base = start + np.array([[0.0, 0.02, 0.015], [0.0, -0.02, 0.015], [0.0, 0.0, -0.03]])
    markers = np.concatenate([np.broadcast_to(base, (len(t), 3, 3)), np.stack(tips, axis=1)], axis=1)
    x = markers + 2e-5 * np.random.default_rng(3).standard_normal(markers.shape)
    return sb.Recording(x, t, ("b0", "b1", "b2", "t0", "t1", "t2"), name="beam", gravity=(0, 0, -9.81))


CLOTH = {"density": 0.2, "warp": 80.0, "shear": 15.0, "bending": 2e-4, "bend_damping": 0.02, "drag_linear": 0.2}


def cloth(seconds: float = 1.5, wind: float = 0.0) -> sb.Recording:
    """A cloth that hangs by its upper edge, and swings from a tilt; or in a wind (m/s), in which it comes to rest."""
    t = np.arange(round(seconds * 60) + 1) / 60
    mesh = sb.mesh.grid(0.4, 0.4, 10, 10, pattern="one_way")
    scene = sb.Scene("cloth")
    tilt = 0.3 if not wind else 0.0
    down = [0.0, -np.sin(tilt), np.cos(tilt)]
    places = mesh.vertices @ np.array([[1.0, 0.0, 0.0], down, np.cross([1.0, 0.0, 0.0], down)]) + [0, 0, 0.6]
    sheet = sb.add_cloth(scene, mesh, positions=places, **CLOTH)
    scene.pin(sheet.particles[mesh.sets["top"]])
    if wind:
        scene.add_air(sheet.particles[mesh.triangles], 0.5, 0.05, wind=(0.0, wind, 0.0))
    x = sb.simulate(scene, t, sb.Solver(h=1 / 240, method="newton")).positions
    inner = [11 * row + column for row in range(1, 10, 2) for column in range(1, 10, 2)]
    return sb.Recording(noisy(x[:, sheet.particles[inner]], 4), t, name="cloth", gravity=(0, 0, -9.81))


def towel(named: bool, seconds: float = 1.5) -> sb.Recording:
    """A cloth that hangs by patches of its two upper corners, which grippers swing and bring nearer to each other; 25
    markers on it, and one on each gripper at the corner where `named`."""
    t = np.arange(round(seconds * 60) + 1) / 60
    mesh = sb.mesh.grid(0.4, 0.4, 10, 10, pattern="one_way")
    corners = mesh.sets["corners"][2:][::-1]
    scene = sb.Scene("towel")
    u, v = mesh.vertices[:, 0] / 0.4, mesh.vertices[:, 1]
    places = np.stack([0.04 + 0.32 * u, 0.06 * np.sin(np.pi * u), 0.6 + v - 0.06 * np.sin(np.pi * u)], axis=1)
    sheet = sb.add_cloth(scene, mesh, positions=places, held=corners, **CLOTH)
    ease = 1.0 - np.exp(-((t / 0.3) ** 2))
    swing = 0.06 * ease * np.sin(6.0 * t)
    nearer = 0.03 * ease * np.sin(4.0 * t)
    ways = np.zeros((len(t), 2, 3)) + places[corners]
    ways[:, 0, 0] += nearer
    ways[:, 1, 0] -= nearer
    ways[..., 1] += swing[:, None]
    scene.drive(sheet.particles[corners], t, ways)
    x = sb.simulate(scene, t, sb.Solver(h=1 / 240, method="newton"), start=sb.equilibrium(scene).positions).positions
    inner = [11 * row + column for row in range(1, 10, 2) for column in range(1, 10, 2)]
    markers, names = x[:, sheet.particles[inner]], [f"towel_{k}" for k in range(25)]
    if named:
        markers, names = np.concatenate([markers, ways], axis=1), [*names, "gripper_left", "gripper_right"]
    return sb.Recording(noisy(markers, 5), t, tuple(names), name="towel", gravity=(0, 0, -9.81))


def toss(seconds: float = 0.6, caught: float = 0.4) -> sb.Recording:
    """Five markers on a box that is carried along, let go after 0.1 s, and caught with a jolt at `caught` s."""
    t = np.arange(round(seconds * 200) + 1) / 200
    scene = sb.Scene("toss")
    turned = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    box = scene.add_body(
        "box",
        of=sb.Inertia.box(0.4, (0.12, 0.08, 0.05)),
        at=(0.1, 0.2, 1.0),
        rotation=turned,
        velocity=(0.8, 0.3, 1.6),
        spin=(1.5, 0.5, -1.0),
    )
    free = t - 0.1
    flying = (free >= 0) & (t <= caught)
    motion = sb.simulate(scene, np.concatenate([[0.0], free[flying]]), sb.Solver(h=1 / 4000))
    place, axes = (a[1:] for a in box.pose(motion))
    points = np.array(
        [[0.06, 0.04, 0.025], [-0.06, 0.04, 0.0], [0.02, -0.04, 0.025], [-0.05, -0.03, -0.02], [0, 0, 0.03]]
    )
    x = np.zeros((len(t), 5, 3))
    x[flying] = place[:, None] + np.einsum("fab,kb->fka", axes, points)
    held, late = free < 0, t > caught
    x[held] = x[flying][0] + free[held, None, None] * np.array([0.8, 0.3, 0.2])
    x[late] = x[flying][-1] + np.sqrt(t[late] - caught)[:, None, None] * np.array([0.0, 0.0, 0.3])
    names = tuple(f"box_{k}" for k in range(5))
    return sb.Recording(x + 1e-4 * np.random.default_rng(6).standard_normal(x.shape), t, names, name="toss")
