"""A cloth on a robot's bar and the depth camera that sees it: the truth on a fine mesh, and what the camera sees.

The camera is made as nasty as such cameras are: 10 Hz with jitter, a clock that is late, a frame that is turned
against its calibration, depth noise that grows with the distance and at the cloth's edges, points that slip along the
cloth, and a bar whose rod bends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sheetbend as sb
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d
from sheetbend.arrays.rotations import rotated

Array = np.ndarray

# --- the truth

SIZE, CELLS, FINER = 0.4, 6, 2  # m; cells of the fit's mesh along a side, and how much finer the truth's is
TRUE = {"cloth_bending": 6e-4, "cloth_air_normal": 0.6}
FABRIC = {"density": 0.25, "warp": 150.0, "shear": 30.0, "membrane_damping": 5e-3, "bend_damping": 2e-2}
H, SECONDS, REST = 1 / 480, 4.6, 0.3  # s: of the truth's substep, of the motion, of the rest before it
RATE = 100.0  # Hz, of the robot's log
ROD, ROD_DAMPING = 6.0, 0.15  # Hz and share of the critical damping, of the rod that carries the bar

# --- the camera

LATE = 0.31  # s, by which its stamps are late
TURNED = np.radians([1.5, -2.0, 1.7])  # rad, 3 degrees in all, against the calibration
SHIFTED = np.array([0.012, -0.008, 0.010])  # m
ABOUT = np.array([0.0, 1.3, 0.0])  # m: near the bar
FPS, JITTER = 10.0, 0.012  # Hz, s
LATERAL, DEPTH, EDGE = 1.5e-3, 3e-3, 1.7  # m across the view and along it at 1.2 m; factor at the cloth's edges
SLIP, SLIP_TIME = 2.5e-3, 0.8  # m along the cloth, s over which it changes
GRAVITY = (0.0, 0.0, -9.81)
ABOUT_DATA = {"about": "SYNTHETIC: experiments/held_cloth/camera.py"}
GRID = np.linspace(0.04, 0.36, 4)  # m, places of the points along both sides

# --- the robot: its frame stands on its head and aside of the camera's

ROBOT = sb.HandEye("robot", (0.7, 0.4, -0.9), (0.0, 0.0, np.sin(0.6), np.cos(0.6)), ABOUT)
CORRECTION = dict(zip(ROBOT.quantities, [*SHIFTED, *TURNED], strict=True))
TRUTH = {**TRUE, **CORRECTION, "robot_flex": 1 / (2 * np.pi * ROD) ** 2, "clock": -LATE}


def poses() -> tuple[Array, Array, Array]:
    """Times (poses,) s, positions (poses, 3) m and quaternions (poses, 4) of the tool in the robot's frame; its x lies
    along the bar and its z points up."""
    rng = np.random.default_rng(3)
    t = np.arange(-0.3, REST + SECONDS + 0.5, 1 / RATE)
    t = t + rng.uniform(-0.2, 0.2, len(t)) / RATE  # a log is not even
    s = np.maximum(t - REST, 0.0)
    rise = s**3 / (s**3 + 0.3**3)
    rates, phases = np.array([0.55, 0.9, 0.7]), np.array([0.0, 0.4, 1.1])
    size = np.array([0.05, 0.09, 0.04])
    swing = rise[:, None] * size * (np.sin(2 * np.pi * rates * s[:, None] + phases) - np.sin(phases))
    roll = 0.25 * rise * np.sin(2 * np.pi * 0.6 * s)  # about the camera's view, and about the bar
    pitch = 0.3 * rise * np.sin(2 * np.pi * 0.45 * s)
    in_camera = np.array([0.0, 1.3, 0.2]) + swing
    about_y = np.stack([0 * roll, np.sin(roll / 2), 0 * roll, np.cos(roll / 2)], axis=1)
    about_x = np.stack([np.sin(pitch / 2), 0 * pitch, 0 * pitch, np.cos(pitch / 2)], axis=1)
    back = np.array([-1.0, -1.0, -1.0, 1.0]) * ROBOT.quaternion
    return t, rotated(back, in_camera - ROBOT.position), multiplied(back, multiplied(about_y, about_x))


def multiplied(p: Array, q: Array) -> Array:
    """Products of quaternions (..., 4), (x, y, z, w)."""
    xyz = p[..., 3:] * q[..., :3] + q[..., 3:] * p[..., :3] + np.cross(p[..., :3], q[..., :3])
    return np.concatenate([xyz, p[..., 3:] * q[..., 3:] - (p[..., :3] * q[..., :3]).sum(-1, keepdims=True)], axis=-1)


def cloth(tool: sb.Tool, finer: int, row: Array | None = None) -> sb.Scene:
    """The cloth below the bar at the scene's start; its upper row rides on the tool, or moves as `row` (knots, k, 3) m
    says."""
    n = CELLS * finer
    mesh = sb.mesh.grid(SIZE, SIZE, n, n, pattern="one_way")
    hanging = np.stack([mesh.vertices[:, 0] - SIZE / 2, 0 * mesh.vertices[:, 0], mesh.vertices[:, 1] - SIZE], axis=1)
    scene, top = sb.Scene("held_cloth"), mesh.sets["top"]
    x = tool.placed(hanging)
    made = sb.add_cloth(scene, mesh, held=top, positions=x, bending=TRUE["cloth_bending"], **FABRIC)
    k = TRUE["cloth_air_normal"]
    scene.add_air(made.particles[mesh.triangles], k, 0.05, name="cloth")
    if row is None:
        tool.drive(scene, made.particles[top], hanging[top])
        tool.frame.place(scene, made.particles)
    else:
        scene.drive(made.particles[top], tool.times, row)
    return scene


@dataclass(frozen=True)
class Truth:
    """What happened: times (steps,) s and vertices (steps, vertices, 3) m of the fine mesh."""

    times: Array
    positions: Array
    mesh: sb.TriangleMesh


def truth(finer: int = FINER) -> Truth:
    """Simulate what the camera will see, on a mesh that is so much finer than that of the fit."""
    tool = sb.Tool(*poses(), ROBOT)
    scene = cloth(tool, finer, _bent(tool, finer))
    times = np.arange(0.0, REST + SECONDS, 1 / 120)
    start = sb.equilibrium(scene).positions
    motion = sb.simulate(scene, times, sb.Solver(h=H, method="newton"), start=start)
    return Truth(times, motion.positions, scene.cloths["cloth"].mesh)


def _bent(tool: sb.Tool, finer: int) -> Array:
    """(knots, k, 3) m: the true motion of the bar, in the camera's frame. Its rod gives across itself like a damped
    spring, under the bar's weight and inertia."""
    n = CELLS * finer + 1
    line = np.stack([np.linspace(-SIZE / 2, SIZE / 2, n), np.zeros(n), np.zeros(n)], axis=1)
    rigid = ROBOT.corrected(tool.path(line), CORRECTION)
    ends = ROBOT.corrected(tool.path([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0]]), CORRECTION)
    h = 1e-3
    even = np.arange(tool.times[0], tool.times[-1], h)
    hand = CubicSpline(tool.times, rigid.mean(axis=1))(even, 2)
    hand = uniform_filter1d(hand, 40, axis=0)  # the log's rounding
    rod = CubicSpline(tool.times, ends[:, 0] - ends[:, 1])(even)
    load = np.array([0.0, 0.0, -9.81]) - hand
    across = load - (load * rod).sum(axis=1, keepdims=True) * rod
    rate = 2 * np.pi * ROD
    x, v = np.empty_like(across), np.zeros(3)
    x[0] = across[0] / rate**2
    for k in range(1, len(even)):
        v = v + h * (across[k - 1] - rate**2 * x[k - 1] - 2 * ROD_DAMPING * rate * v)
        x[k] = x[k - 1] + h * v
    return np.asarray(rigid + CubicSpline(even, x)(np.clip(tool.times, even[0], even[-1]))[:, None])


def seen(real: Truth, seed: int) -> sb.Recording:
    """What the camera records of it."""
    rng = np.random.default_rng(seed)
    count = int(SECONDS * FPS)
    times = REST / 2 + np.arange(count) / FPS + rng.uniform(-JITTER, JITTER, count)
    flat = places()
    decay = np.exp(-np.diff(times, prepend=times[0] - 10.0) / SLIP_TIME)
    slip = np.zeros((count, *flat.shape))
    last = np.zeros(flat.shape)
    for k in range(count):  # an Ornstein-Uhlenbeck walk
        last = decay[k] * last + SLIP * np.sqrt(1 - decay[k] ** 2) * rng.standard_normal(flat.shape)
        slip[k] = last
    x = exact(real, times, slip)
    edge = ((flat < 0.05) | (flat > SIZE - 0.05)).any(axis=1)
    distance = np.linalg.norm(x, axis=2)
    depth = DEPTH * (distance / 1.2) ** 2 * np.where(edge, EDGE, 1.0)
    view = x / distance[..., None]
    noise = LATERAL * rng.standard_normal(x.shape)
    noise += view * (depth * rng.standard_normal(depth.shape) - (noise * view).sum(axis=2))[..., None]
    names = tuple(f"p{i}" for i in range(len(flat)))
    return sb.Recording(x + noise, times + LATE, names, name=f"seen_{seed}", gravity=GRAVITY, metadata=ABOUT_DATA)


def places() -> Array:
    """(16, 2) m, material coordinates of the points that the camera means to follow, rows along the bar."""
    u, v = np.meshgrid(GRID, GRID)
    return np.stack([u.ravel(), v.ravel()], axis=1)


def exact(real: Truth, times: Array, slip: Array | float = 0.0) -> Array:
    """(frames, 16, 3) m: where the points are at times on the robot's clock, moved by slip (frames, 16, 2) m along the
    cloth."""
    flat = places()
    moved = np.clip(flat + np.broadcast_to(slip, (len(times), *flat.shape)), 0.0, SIZE)
    x = np.empty((len(times), len(flat), 3))
    for k, t in enumerate(times):
        at = real.mesh.at(moved[k])
        frame = int(np.searchsorted(real.times, t)) - 1
        share = (t - real.times[frame]) / (real.times[frame + 1] - real.times[frame])
        x[k] = (1 - share) * at.positions(real.positions[frame]) + share * at.positions(real.positions[frame + 1])
    return x
