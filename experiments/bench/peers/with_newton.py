"""A solver of newton on springs that touch a plane or a sphere, in single precision; of "semi_implicit" also gradients,
by warp.Tape, beside central differences of the same program.

Run as: PYTHON with_newton.py PROBLEM.npz H SOLVER [forward], where contact_beside.py tells what the problem holds, and
SOLVER is "semi_implicit", or "xpbd" or "vbd" with ten iterations. One line of JSON.
"""

from __future__ import annotations

import json
import os
import sys
import time

import numpy as np
import warp as wp

wp.config.quiet = True
wp.config.kernel_cache_dir = os.environ["WARP_CACHE"]
wp.init()
wp.set_device("cpu")

import newton  # noqa: E402

p = np.load(sys.argv[1])
h, kind = float(sys.argv[2]), sys.argv[3]
steps = round(float(p["seconds"]) / h)
mass, sphere, stiffness = float(p["mass"]), float(p["sphere"]), float(p["contact_stiffness"])
STEPS = {"friction": 1e-2, "stiffness": 1e-2, "start": 1e-4, "velocity": 1e-3}  # of the differences


def colors() -> list[list[int]]:
    """Groups of particles that no spring joins, which VBD moves at once: the builder's coloring knows no springs."""
    joined: dict[int, set[int]] = {}
    for i, j in p["links"]:
        joined.setdefault(int(i), set()).add(int(j))
        joined.setdefault(int(j), set()).add(int(i))
    color: dict[int, int] = {}
    for i in range(len(p["start"])):
        taken = {color[j] for j in joined[i] if j in color}
        color[i] = next(c for c in range(len(taken) + 1) if c not in taken)
    return [[i for i, c in color.items() if c == k] for k in range(max(color.values()) + 1)]


@wp.kernel
def compare(x: wp.array[wp.vec3], along: wp.array[wp.vec3], loss: wp.array[float]):
    i = wp.tid()
    wp.atomic_add(loss, 0, wp.dot(x[i], along[i]))


class Run:
    """The scene at changed inputs, each a share or a length along the problem's direction."""

    def __init__(self, gradient: bool, **changed: float) -> None:
        move = dict.fromkeys(STEPS, 0.0) | changed
        friction = float(p["friction"]) * (1.0 + move["friction"])
        builder = newton.ModelBuilder(gravity=tuple(p["gravity"]), up_axis=newton.Axis.Z)
        start = p["start"] + move["start"] * p["direction"]
        velocity = p["velocity"] + move["velocity"] * p["direction"]
        for x, v in zip(start, velocity, strict=True):
            builder.add_particle(wp.vec3(*x), wp.vec3(*v), mass, radius=0.0)
        for (i, j), k in zip(p["links"], p["stiffness"], strict=True):
            builder.add_spring(int(i), int(j), ke=float(k) * (1.0 + move["stiffness"]), kd=0.0, control=0.0)
        law = {"ke": stiffness, "kd": float(p["contact_damping"]), "kf": float(p["slope"]), "mu": friction}
        material = newton.ModelBuilder.ShapeConfig(**law)
        if sphere > 0.0:
            builder.add_shape_sphere(body=-1, radius=sphere, cfg=material)
        else:
            builder.add_ground_plane(cfg=material)
        if kind == "vbd":
            builder.set_coloring(colors())
        self.model = builder.finalize(requires_grad=gradient)
        self.model.spring_rest_length.assign(p["rest"].astype(np.float32))
        for name, value in law.items():
            setattr(self.model, f"soft_contact_{name}", value)
        self.model.particle_grid = None
        if kind == "semi_implicit":
            self.solver = newton.solvers.SolverSemiImplicit(self.model, enable_tri_contact=False)
        else:
            self.solver = {"xpbd": newton.solvers.SolverXPBD, "vbd": newton.solvers.SolverVBD}[kind](
                self.model, iterations=10
            )
        self.pipeline = newton.CollisionPipeline(
            self.model, broad_phase="explicit", soft_contact_gap=10.0 if sphere == 0.0 else 0.01, requires_grad=gradient
        )
        self.states = [self.model.state() for _ in range(steps + 1 if gradient else 2)]
        # A plane's contacts of the start hold for all times; those of a sphere are found in each step.
        self.contacts = [self.pipeline.contacts() for _ in range(steps if gradient and sphere > 0.0 else 1)]
        self.along = wp.array(p["seed"].astype(np.float32), dtype=wp.vec3)
        self.loss = wp.zeros(1, dtype=float, requires_grad=gradient)

    def forward(self) -> np.ndarray:
        """Positions at the end."""
        states, contacts = self.states, self.contacts
        states[0].particle_q.assign(self.model.particle_q)
        states[0].particle_qd.assign(self.model.particle_qd)
        self.loss.zero_()
        if sphere == 0.0:
            self.pipeline.collide(states[0], contacts[0])
        for k in range(steps):
            now, after = (states[k], states[k + 1]) if len(states) > 2 else (states[k % 2], states[(k + 1) % 2])
            found = contacts[k % len(contacts)]
            if sphere > 0.0:
                self.pipeline.collide(now, found)
            now.clear_forces()
            self.solver.step(now, after, None, found, h)
        end = states[-1] if len(states) > 2 else states[steps % 2]
        wp.launch(compare, len(p["start"]), [end.particle_q, self.along, self.loss])
        return end.particle_q.numpy().astype(float)

    def gradient(self) -> dict[str, float]:
        with wp.Tape() as tape:
            self.forward()
        tape.backward(self.loss)
        model = self.model
        by_spring = model.spring_stiffness.grad.numpy().astype(float) @ model.spring_stiffness.numpy().astype(float)
        # Newton takes the mean of the friction of the shape and that of the particles, which has no gradient.
        found = {
            "friction": 2.0 * float(model.shape_material_mu.grad.numpy()[0]) * float(p["friction"]),
            "stiffness": float(by_spring),
            "start": float((model.particle_q.grad.numpy() * p["direction"]).sum()),
            "velocity": float((model.particle_qd.grad.numpy() * p["direction"]).sum()),
        }
        tape.zero()
        return found


def timed(work) -> tuple[float, object]:
    """Processor time of the faster of two runs, of which the first may compile, and what it returns."""
    seconds = []
    for _ in range(2):
        begin = time.process_time()
        result = work()
        seconds.append(time.process_time() - begin)
    return min(seconds), result


def difference(name: str, step: float) -> float:
    ends = [Run(False, **{name: sign * step}).forward() for sign in (1.0, -1.0)]
    return float((p["seed"] * (ends[0] - ends[1])).sum() / (2 * step))


told = {"version": newton.__version__, "h": h, "steps": steps}
told["forward_s"], end = timed(Run(False).forward)
told["end"] = end.tolist()
if kind == "semi_implicit" and "forward" not in sys.argv:
    told["gradient_s"], told["gradient"] = timed(Run(True).gradient)
    told["differences"] = {name: difference(name, step) for name, step in STEPS.items()}
print(json.dumps(told), flush=True)
