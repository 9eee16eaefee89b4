"""A cloth on a table is folded twice, as a letter is: two of its edges are carried over, one after the other.

Edges are driven and do not yield, so the motion has to leave the layers between them room. A hand that held only the
row of an edge would press it down on its own flap, which still stands upright beneath it. So each hand holds a second
row, and lays both down flat. No edge comes down on a fold, whose loop is about 12 mm high and 30 mm long, or on the
other edge. A flap sags, so that its fold lies farther in than the line about which the hand began to turn. The hand
follows it, as one draws a flap smooth: what it does not draw in lies in wrinkles, which it then presses through the
table. The fabric is a light cotton in air.

    python experiments/bench/folding_cloth.py [--vertices 484] [--wide 0] [--h 6e-3] [--speed 0.5] [--friction 0.3]

Prints processor time per substep, how deep the cloth was pressed into the table, and whether anything passed through:
no edge of the cloth may cross one of its triangles in about 50 of the frames (a test of its own, in NumPy).
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import sheetbend as sb
from sheetbend.mesh import TriangleMesh, grid

THICKNESS, EDGE = 1e-3, 5e-3  # m
CLEARANCE = 1.5 * THICKNESS  # between the middles of layers, where an edge is put down
ROOM = 30e-3  # m, between the fold of one flap and the edge of the other
FOLLOWS = 0.15  # of a flap: how far the line about which it turns moves in
HELD = (0, 2)  # rows of vertices from an edge; the row between them is free, for what is driven as a whole is no cloth
KNOTS = 241  # of the motion
FABRIC = {
    "density": 0.2, "warp": 300.0, "shear": 60.0, "bending": 4e-6,
    "membrane_damping": 3e-3, "bend_damping": 1e-2, "drag_quadratic": 1.0,
}  # fmt: skip


def flap_of(length: float) -> float:
    """How far the line about which a hand begins to turn is from its edge."""
    return (length - ROOM) / (3.0 * (1.0 + FOLLOWS))


def carried(x: np.ndarray, about: float, inward: float, height: float, done: np.ndarray) -> np.ndarray:
    """(times, n, 3) of an edge that goes half a circle about a line, which moves from `about` by `inward` meanwhile.
    The way over the flap to the edge stays as long as it is flat. `done`: the edge's share of the way."""
    ease = 0.5 * (1.0 - np.cos(np.pi * np.clip(done, 0.0, 1.0)))  # starts and ends at rest
    center = about + inward * ease[:, None]
    radius = x[:, 0] - center
    path = np.repeat(x[None], len(done), axis=0)
    path[:, :, 0] = center + radius * np.cos(np.pi * ease)[:, None]
    path[:, :, 2] += np.abs(radius) * np.sin(np.pi * ease)[:, None] + height * ease[:, None]
    return path


def scene_of(vertices: int, speed: float, friction: float, wide: int = 0) -> tuple[sb.Scene, TriangleMesh, float]:
    """The scene, its mesh, and how long both folds take. A square of so many vertices, or a strip of it of `wide`
    edges across the way that hands go."""
    side = round(np.sqrt(vertices)) - 1
    mesh = grid(side * EDGE, (wide or side) * EDGE, side, wide or side, "one_way")
    length = side * EDGE
    flap = flap_of(length)
    x = mesh.vertices + np.array([0.0, 0.0, 0.5 * THICKNESS + 1e-6])
    scene = sb.Scene("folding")
    cloth = sb.add_cloth(scene, mesh, positions=x, **FABRIC)
    seconds = np.pi * flap / speed
    end = 2.2 * seconds
    row = np.rint(mesh.vertices[:, 0] / EDGE).astype(int)
    right, left = (np.flatnonzero(np.isin(from_edge, HELD)) for from_edge in (side - row, row))
    times = np.linspace(0.0, end, KNOTS)
    ways = [
        carried(x[edge], about, inward, height, (times - begin) / seconds)
        for edge, about, inward, height, begin in (
            (right, length - flap, -FOLLOWS * flap, CLEARANCE, 0.0),
            (left, flap, FOLLOWS * flap, 2 * CLEARANCE, 1.1 * seconds),
        )
    ]
    scene.drive(cloth.particles[np.concatenate([right, left])], times, np.concatenate(ways, axis=1), "linear")
    scene.add_contact(cloth, sb.Plane(name="table"), friction=friction, radius=0.5 * THICKNESS)
    scene.add_self_contact(cloth, radius=0.5 * THICKNESS, **({"friction": friction} if friction else {}))
    return scene, mesh, end


def crossings(x: np.ndarray, edges: np.ndarray, triangles: np.ndarray) -> int:
    """How many edges cross triangles with which they share no vertex (Moeller & Trumbore 1997). An edge that lies in
    the plane of a triangle, to a thousandth of the thickness, crosses nothing: much of the cloth is flat."""
    count = 0
    low, high = x[triangles].min(axis=1), x[triangles].max(axis=1)
    for a, b in edges:
        p, q = x[a], x[b]
        near = (low <= np.maximum(p, q)).all(1) & (high >= np.minimum(p, q)).all(1)
        near &= ((triangles != a) & (triangles != b)).all(1)
        t = triangles[near]
        if not len(t):
            continue
        e, f, d, r = x[t[:, 1]] - x[t[:, 0]], x[t[:, 2]] - x[t[:, 0]], q - p, p - x[t[:, 0]]
        h = np.cross(d, f)
        det = (e * h).sum(1)
        normal = np.cross(e, f)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        sides = (normal * r).sum(1), (normal * (r + d)).sum(1)
        through = (np.sign(sides[0]) != np.sign(sides[1])) & (np.minimum(*np.abs(sides)) > 1e-3 * THICKNESS)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (r * h).sum(1) / det
            v = (np.cross(r, e) * d).sum(1) / det
            count += int((through & (u >= 0) & (v >= 0) & (u + v <= 1)).sum())
    return count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--vertices", type=int, default=484)
    parser.add_argument("--wide", type=int, default=0, help="edges across; as many as along when left out")
    parser.add_argument("--h", type=float, default=6e-3)
    parser.add_argument("--speed", type=float, default=0.5, help="mean speed of an edge, m/s")
    parser.add_argument("--friction", type=float, default=0.3)
    parser.add_argument("--substeps", type=int, default=0, help="how many at most; all when left out")
    given = parser.parse_args()
    scene, mesh, end = scene_of(given.vertices, given.speed, given.friction, given.wide)
    solver = sb.Solver(h=given.h, method="implicit", integrator="bdf1")
    count = given.substeps or int(np.ceil(end / given.h))
    edges = scene.contacts.pieces[0].edges
    start = time.process_time()
    motion = sb.simulate(scene, np.arange(count + 1) * given.h, solver)
    seconds = (time.process_time() - start) / count
    print(f"{scene.particle_count} vertices, {count} substeps: {seconds:.3f} s a substep")
    print(f"deepest in the table: {1e3 * max(0.0, 0.5 * THICKNESS - motion.positions[..., 2].min()):.3f} mm")
    passed = [crossings(x, edges, mesh.triangles) for x in motion.positions[:: max(1, count // 50)]]
    print(f"crossings: {max(passed)}")


if __name__ == "__main__":
    main()
