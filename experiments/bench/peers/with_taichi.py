"""taichi: projections write new slots, a substep is run again before the kernels' own reverses, last first."""

import harness
import numpy as np
import taichi as ti

ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=1, log_level=ti.ERROR, offline_cache=False)
p, _ = harness.load()
scenes, n, m = len(p.parameters), len(p.start), len(p.rest)
frames, substeps, h = p.frames, p.substeps, p.h
projections, steps = m * p.iterations, frames * substeps
fall = ti.Vector((p.h * p.gravity).tolist())
read, last = harness.slots(p)


def constant(values: np.ndarray, kind: object) -> ti.Field:
    field = ti.field(kind, values.shape)
    field.from_numpy(values)
    return field


links, bend, source, final = (constant(a.astype(np.int32), ti.i32) for a in (p.links, p.bend, read, last))
rest, factor = constant(p.rest, ti.f64), constant(p.inverse_mass_factor, ti.f64)
target = ti.Vector.field(3, ti.f64, (frames, n))
target.from_numpy(p.target)
parameters = ti.field(ti.f64, (scenes, 3), needs_grad=True)
losses = ti.field(ti.f64, scenes, needs_grad=True)
x, v = (ti.Vector.field(3, ti.f64, (steps + 1, scenes, n), needs_grad=True) for _ in range(2))
slot = ti.Vector.field(3, ti.f64, (scenes, n + 2 * projections), needs_grad=True)
multiplier = ti.field(ti.f64, (scenes, projections + m), needs_grad=True)
now, before, speed = (ti.Vector.field(3, ti.f64, (scenes, n)) for _ in range(3))
held, value = ti.field(ti.f64, (scenes, m)), ti.field(ti.f64, scenes)


@ti.func
def free(i: int) -> ti.f64:
    return 1.0 if factor[i] > 0 else 0.0


@ti.kernel
def simulate():
    for s in range(scenes):
        value[s] = 0.0
        for step in range(steps):
            for i in range(n):
                speed[s, i] += fall * free(i)
                now[s, i] = before[s, i] + speed[s, i] * h
            for k in range(m):
                held[s, k] = 0.0
            for count in range(projections):
                k = count % m
                i, j = links[k, 0], links[k, 1]
                wi, wj = factor[i] / parameters[s, 2], factor[j] / parameters[s, 2]
                a = parameters[s, bend[k]] / (h * h)
                d = now[s, i] - now[s, j]
                length = d.norm()
                change = (rest[k] - length - a * held[s, k]) / (wi + wj + a)
                held[s, k] += change
                now[s, i] += d * (change / length * wi)
                now[s, j] -= d * (change / length * wj)
            for i in range(n):
                speed[s, i] = (now[s, i] - before[s, i]) / h
                before[s, i] = now[s, i]
            if step % substeps == substeps - 1:
                for i in range(n):
                    value[s] += 0.5 * (now[s, i] - target[step // substeps, i]).norm_sqr()


@ti.kernel
def predict(step: int):
    for s, i in ti.ndrange(scenes, n):
        slot[s, i] = x[step, s, i] + (v[step, s, i] + fall * free(i)) * h


@ti.kernel
def project():
    for s in range(scenes):
        for count in range(projections):
            k = count % m
            wi, wj = factor[links[k, 0]] / parameters[s, 2], factor[links[k, 1]] / parameters[s, 2]
            a = parameters[s, bend[k]] / (h * h)
            d = slot[s, source[count, 0]] - slot[s, source[count, 1]]
            length = d.norm()
            change = (rest[k] - length - a * multiplier[s, count]) / (wi + wj + a)
            multiplier[s, count + m] = multiplier[s, count] + change
            slot[s, n + 2 * count] = slot[s, source[count, 0]] + d * (change / length * wi)
            slot[s, n + 2 * count + 1] = slot[s, source[count, 1]] - d * (change / length * wj)


@ti.kernel
def finish(step: int):
    for s, i in ti.ndrange(scenes, n):
        x[step + 1, s, i] = slot[s, final[i]]
        v[step + 1, s, i] = (slot[s, final[i]] - x[step, s, i]) / h


@ti.kernel
def compare(frame: int):
    for s, i in ti.ndrange(scenes, n):
        losses[s] += 0.5 * (x[(frame + 1) * substeps, s, i] - target[frame, i]).norm_sqr()


@ti.kernel
def begin(start: ti.types.ndarray(), values: ti.types.ndarray()):
    for s, i in ti.ndrange(scenes, n):
        for d in ti.static(range(3)):
            x[0, s, i][d] = start[i, d]
            before[s, i][d] = start[i, d]
            v[0, s, i][d] = 0.0
            speed[s, i][d] = 0.0
    for s in range(scenes):
        for d in ti.static(range(3)):
            parameters[s, d] = values[s, d]


@ti.kernel
def by_start(out: ti.types.ndarray()):
    for s, i in ti.ndrange(scenes, n):
        for d in ti.static(range(3)):
            out[s, i, d] = x.grad[0, s, i][d]


def forward() -> np.ndarray:
    begin(p.start, p.parameters)
    simulate()
    return value.to_numpy()


def gradient() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    begin(p.start, p.parameters)
    losses.fill(0.0)
    losses.grad.fill(1.0)
    for field in (parameters, x, v):
        field.grad.fill(0.0)
    for step in range(steps):
        predict(step)
        project()
        finish(step)
        if (step + 1) % substeps == 0:
            compare(step // substeps)
    for step in reversed(range(steps)):
        if (step + 1) % substeps == 0:
            compare.grad(step // substeps)
        predict(step)
        project()
        slot.grad.fill(0.0)
        multiplier.grad.fill(0.0)
        finish.grad(step)
        project.grad()
        predict.grad(step)
    out = np.empty((scenes, n, 3))
    by_start(out)
    return losses.to_numpy(), parameters.grad.to_numpy(), out


harness.run("taichi", ".".join(map(str, ti.__version__)), forward, gradient)
