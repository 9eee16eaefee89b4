"""warp: one thread per scene; projections write new slots, since the reverse of a kernel sees only what is not
overwritten, and a substep is run again before its adjoint."""

from __future__ import annotations

import os

import harness
import numpy as np
import warp as wp

wp.config.quiet = True
wp.config.kernel_cache_dir = os.environ["WARP_CACHE"]
wp.init()
wp.set_device("cpu")

p, _ = harness.load()
scenes, n, m = len(p.parameters), len(p.start), len(p.rest)
projections, steps = m * p.iterations, p.frames * p.substeps


@wp.struct
class Mesh:
    links: wp.array2d(dtype=wp.int32)
    bend: wp.array(dtype=wp.int32)
    rest: wp.array(dtype=wp.float64)
    factor: wp.array(dtype=wp.float64)
    read: wp.array2d(dtype=wp.int32)
    last: wp.array(dtype=wp.int32)
    n: int
    m: int
    projections: int
    h: wp.float64
    fall: wp.vec3d


@wp.func
def held(factor: wp.float64) -> wp.float64:
    return wp.where(factor > wp.float64(0.0), wp.float64(1.0), wp.float64(0.0))


@wp.kernel(enable_backward=False)
def simulate(
    mesh: Mesh,
    parameters: wp.array2d(dtype=wp.float64),
    substeps: int,
    frames: int,
    x: wp.array2d(dtype=wp.vec3d),
    v: wp.array2d(dtype=wp.vec3d),
    q: wp.array2d(dtype=wp.vec3d),
    multiplier: wp.array2d(dtype=wp.float64),
    target: wp.array2d(dtype=wp.vec3d),
    loss: wp.array(dtype=wp.float64),
):
    s = wp.tid()
    for step in range(frames * substeps):
        for i in range(mesh.n):
            v[s, i] = v[s, i] + mesh.fall * held(mesh.factor[i])
            q[s, i] = x[s, i] + v[s, i] * mesh.h
        for k in range(mesh.m):
            multiplier[s, k] = wp.float64(0.0)
        for count in range(mesh.projections):
            k = count % mesh.m
            i = mesh.links[k, 0]
            j = mesh.links[k, 1]
            wi = mesh.factor[i] / parameters[s, 2]
            wj = mesh.factor[j] / parameters[s, 2]
            a = parameters[s, mesh.bend[k]] / (mesh.h * mesh.h)
            d = q[s, i] - q[s, j]
            length = wp.length(d)
            change = (mesh.rest[k] - length - a * multiplier[s, k]) / (wi + wj + a)
            multiplier[s, k] = multiplier[s, k] + change
            push = d * (change / length)
            q[s, i] = q[s, i] + push * wi
            q[s, j] = q[s, j] - push * wj
        for i in range(mesh.n):
            v[s, i] = (q[s, i] - x[s, i]) / mesh.h
            x[s, i] = q[s, i]
        if step % substeps == substeps - 1:
            for i in range(mesh.n):
                off = x[s, i] - target[step // substeps, i]
                loss[s] = loss[s] + wp.float64(0.5) * wp.dot(off, off)


@wp.kernel
def substep(
    mesh: Mesh,
    parameters: wp.array2d(dtype=wp.float64),
    step: int,
    x: wp.array3d(dtype=wp.vec3d),
    v: wp.array3d(dtype=wp.vec3d),
    slot: wp.array2d(dtype=wp.vec3d),
    multiplier: wp.array2d(dtype=wp.float64),
):
    s = wp.tid()
    for i in range(mesh.n):
        slot[s, i] = x[step, s, i] + (v[step, s, i] + mesh.fall * held(mesh.factor[i])) * mesh.h
    for count in range(mesh.projections):
        k = count % mesh.m
        wi = mesh.factor[mesh.links[k, 0]] / parameters[s, 2]
        wj = mesh.factor[mesh.links[k, 1]] / parameters[s, 2]
        a = parameters[s, mesh.bend[k]] / (mesh.h * mesh.h)
        d = slot[s, mesh.read[count, 0]] - slot[s, mesh.read[count, 1]]
        length = wp.length(d)
        change = (mesh.rest[k] - length - a * multiplier[s, count]) / (wi + wj + a)
        multiplier[s, count + mesh.m] = multiplier[s, count] + change
        push = d * (change / length)
        slot[s, mesh.n + 2 * count] = slot[s, mesh.read[count, 0]] + push * wi
        slot[s, mesh.n + 2 * count + 1] = slot[s, mesh.read[count, 1]] - push * wj
    for i in range(mesh.n):
        after = slot[s, mesh.last[i]]
        x[step + 1, s, i] = after
        v[step + 1, s, i] = (after - x[step, s, i]) / mesh.h


@wp.kernel
def compare(
    x: wp.array3d(dtype=wp.vec3d), substeps: int, target: wp.array2d(dtype=wp.vec3d), loss: wp.array(dtype=wp.float64)
):
    frame, s, i = wp.tid()
    off = x[(frame + 1) * substeps, s, i] - target[frame, i]
    wp.atomic_add(loss, s, wp.float64(0.5) * wp.dot(off, off))


mesh, no_mesh = Mesh(), Mesh()
read, last = harness.slots(p)
mesh.links = wp.array(p.links.astype(np.int32), dtype=wp.int32)
mesh.bend = wp.array(p.bend.astype(np.int32), dtype=wp.int32)
mesh.rest = wp.array(p.rest, dtype=wp.float64)
mesh.factor = wp.array(p.inverse_mass_factor, dtype=wp.float64)
mesh.read, mesh.last = wp.array(read.astype(np.int32), dtype=wp.int32), wp.array(last.astype(np.int32), dtype=wp.int32)
mesh.n, mesh.m, mesh.projections = n, m, projections
mesh.h, mesh.fall = wp.float64(p.h), wp.vec3d(*(p.h * p.gravity))
target = wp.array(p.target, dtype=wp.vec3d)
starts = np.tile(p.start, (scenes, 1, 1))


def zeros(*shape: int, dtype: type = wp.vec3d) -> wp.array:
    return wp.zeros(shape, dtype=dtype, requires_grad=True)


parameters, loss = zeros(scenes, 3, dtype=wp.float64), zeros(scenes, dtype=wp.float64)
tape: dict[str, wp.array] = {}
work = [zeros(scenes, n), zeros(scenes, n), zeros(scenes, n), zeros(scenes, m, dtype=wp.float64)]


def forward() -> np.ndarray:
    parameters.assign(p.parameters)
    work[0].assign(starts)
    work[1].zero_()
    loss.zero_()
    wp.launch(simulate, scenes, [mesh, parameters, p.substeps, p.frames, *work, target, loss])
    return loss.numpy()


def gradient() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    if not tape:
        tape["x"], tape["v"] = zeros(steps + 1, scenes, n), zeros(steps + 1, scenes, n)
        tape["slot"] = zeros(scenes, n + 2 * projections)
        tape["multiplier"] = zeros(scenes, projections + m, dtype=wp.float64)
    x, v, slot, multiplier = tape.values()
    parameters.assign(p.parameters)
    x[0].assign(starts)
    v[0].zero_()
    loss.zero_()
    for array in (parameters, *tape.values()):
        array.grad.zero_()
    loss.grad.fill_(1.0)
    for step in range(steps):
        wp.launch(substep, scenes, [mesh, parameters, step, x, v], [slot, multiplier])
    grid, ends = (p.frames, scenes, n), [x, p.substeps, target]
    wp.launch(compare, grid, ends, [loss])
    wp.launch(compare, grid, ends, [loss], adj_inputs=[x.grad, 0, None], adj_outputs=[loss.grad], adjoint=True)
    for step in reversed(range(steps)):
        inputs = [mesh, parameters, step, x, v]
        wp.launch(substep, scenes, inputs, [slot, multiplier])
        adjoints = [no_mesh, parameters.grad, 0, x.grad, v.grad]
        wp.launch(
            substep,
            scenes,
            inputs,
            [slot, multiplier],
            adj_inputs=adjoints,
            adj_outputs=[slot.grad, multiplier.grad],
            adjoint=True,
        )
    return loss.numpy(), parameters.grad.numpy(), x.grad.numpy()[0]


harness.run("warp", wp.config.version, forward, gradient)
