"""A rope of another simulator: rigid links and ball joints in MuJoCo, the upper end in a hand that moves in space.

The uppermost joint turns in every direction. Only inertia and drag of the links keep the rope from spinning with a bend
that goes round (docs/decisions/a-hand-holds-the-spin-of-a-rope.md). The links move in the frame of the hand, where its
acceleration is a gravity and its velocity a wind.
"""

from __future__ import annotations

import mujoco
import numpy as np

Array = np.ndarray
LENGTH, DENSITY, EI, DAMPING, DRAG = 0.7, 0.05, 1e-3, 0.01, 0.01
LINKS, RATE = 24, 100
STEP = 4e-5  # s; with Runge-Kutta of order 4, stable where joints are damped so much
THICK = 0.016  # m, of the spin of a link about its own axis: little where a bend stays in a plane
SWING, ANGULAR, EASE = np.array([0.06, 0.03, 0.03]), np.array([5.0, 3.3, 4.1]), 0.3  # m, rad/s, s


def hand(t: Array) -> tuple[Array, Array, Array]:
    """Places, velocities and accelerations (times, 3) of a hand that rests for 0.3 s and then swings."""
    s = np.maximum(t - 0.3, 0.0)[:, None]
    left = np.exp(-((s / EASE) ** 3))
    share, rate, change = 1 - left, 3 * s**2 / EASE**3 * left, (6 * s / EASE**3 - 9 * s**4 / EASE**6) * left
    sine, cosine = np.sin(s * ANGULAR), np.cos(s * ANGULAR)
    velocity = SWING * (rate * sine + share * ANGULAR * cosine)
    acceleration = SWING * (change * sine + 2 * rate * ANGULAR * cosine - share * ANGULAR**2 * sine)
    return SWING * share * sine, velocity, acceleration


def model() -> mujoco.MjModel:
    """The links below the hand; MuJoCo's viscous drag of a body is that of a sphere of its mean size."""
    h = LENGTH / LINKS
    m = DENSITY * h
    across, spin = m * h**2 / 12, m * THICK**2 / 8
    size = (2 * np.sqrt(6 * spin / m) + np.sqrt(6 * (2 * across - spin) / m)) / 3
    body = ""
    for k in reversed(range(LINKS)):
        joint = f'<joint type="ball" stiffness="{EI / h if k else 0}" damping="{EI * DAMPING / h if k else 0}"/>'
        inertia = f'<inertial pos="0 0 {-h / 2}" mass="{m}" diaginertia="{across} {across} {spin}"/>'
        body = f'<body pos="0 0 {-h if k else 0}">{joint}{inertia}{body}</body>'
    option = f'<option timestep="{STEP}" integrator="RK4" viscosity="{DRAG * h / (3 * np.pi * size)}"/>'
    return mujoco.MjModel.from_xml_string(f"<mujoco>{option}<worldbody>{body}</worldbody></mujoco>")


def motion(seconds: float) -> tuple[Array, Array]:
    """Times (frames,) s, and places (frames, links + 1, 3) m of the ends of the links."""
    rope = model()
    state = mujoco.MjData(rope)
    steps, every = round(seconds / STEP), round(1 / (RATE * STEP))
    _, velocity, acceleration = hand((np.arange(steps) + 0.5) * STEP)
    gravity = [0.0, 0.0, -9.81] - acceleration
    times = np.arange(0, steps + 1, every) * STEP
    found = []
    for k in range(steps + 1):
        if k % every == 0:
            mujoco.mj_kinematics(rope, state)
            down = state.xmat[-1].reshape(3, 3)[:, 2] * LENGTH / LINKS
            found.append(np.vstack([state.xpos[1:], state.xpos[-1] - down]))
        if k < steps:
            rope.opt.gravity[:], rope.opt.wind[:] = gravity[k], -velocity[k]
            mujoco.mj_step(rope, state)
    return times, np.array(found) + hand(times)[0][:, None] + [0.0, 0.0, 1.0]
