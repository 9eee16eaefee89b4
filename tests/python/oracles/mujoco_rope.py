"""A rope below a moving pivot in MuJoCo (Todorov, Erez & Tassa 2012, IROS, 5026): another simulator than sheetbend's.

n rigid links of length l = L/n hang on ball joints with springs and dampers. A spring of k = EI/l at each joint is the
lumped model of a beam of bending stiffness EI, and a damper of tau k is one with a damping time tau. The links are
uniform thin rods. The pivot rests in the origin of a frame that moves with the hand: there the acceleration of the hand
is taken from that of gravity, and its place is added to all points. MuJoCo 4 has no plugin for cables, and what its
flexible lines make of a material's modulus is their own convention; a joint's stiffness in N m/rad is not.
"""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Curve = Callable[[Array], Array]
STEP = 5e-4  # s


def links(length: float, count: int, density: float, EI: float, tau: float) -> str:
    """The model's XML: a chain that hangs straight down from the origin."""
    size = length / count
    mass, k = density * size, EI / size
    across = mass * size**2 / 12
    head, tail = [], []
    for i in range(count):
        spring = "" if i == 0 else f' stiffness="{k}" damping="{tau * k}"'
        head.append(
            f'<body pos="0 0 {-size if i else 0}"><joint type="ball"{spring}/>'
            f'<inertial pos="0 0 {-size / 2}" mass="{mass}" diaginertia="{across} {across} {across / 50}"/>'
        )
        tail.append("</body>")
    option = f'<option timestep="{STEP}" integrator="RK4" gravity="0 0 -9.81"/>'
    return f"<mujoco>{option}<worldbody>{''.join(head)}{''.join(tail)}</worldbody></mujoco>"


def hanging_rope(
    times: Array,
    hand: tuple[Curve, Curve, Curve],
    length: float,
    count: int,
    density: float,
    EI: float,
    tau: float,
    drag: float,
) -> Array:
    """Ends of the links (frames, count + 1, 3) in m; the rope hangs at rest at first.

    Args:
        times: (frames,) s, even, from 0.
        hand: place m, velocity m/s and acceleration m/s^2 at given times, each (times, 3).
        density: kg/m.
        EI: N m^2.
        tau: s, of the joints' damping.
        drag: N s/m^2, force over velocity and length, at the middle of each link.
    """
    model = mujoco.MjModel.from_xml_string(links(length, count, density, EI, tau))
    data = mujoco.MjData(model)
    size = length / count
    every = round((times[1] - times[0]) / STEP)
    middles = (np.arange(every * (len(times) - 1) + 1) + 0.5) * STEP
    velocity, gravity = hand[1](middles), [0.0, 0.0, -9.81] - hand[2](middles)
    ends = np.empty((len(times), count + 1, 3))
    mujoco.mj_kinematics(model, data)
    before = data.xipos[1:].copy()
    for k in range(len(middles)):
        if k % every == 0:
            mujoco.mj_kinematics(model, data)
            ends[k // every, :-1] = data.xpos[1:]
            ends[k // every, -1] = data.xpos[-1] + 2.0 * (data.xipos[-1] - data.xpos[-1])
        now = data.xipos[1:].copy()
        data.xfrc_applied[1:, :3] = -drag * size * ((now - before) / STEP + velocity[k])
        before = now
        model.opt.gravity[:] = gravity[k]
        mujoco.mj_step(model, data)
    return ends + hand[0](times)[:, None]
