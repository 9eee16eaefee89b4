"""jax: gather and scatter per color, scans over sweeps, substeps and frames, a checkpoint per substep, vmap over
scenes."""

from __future__ import annotations

import harness
import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)
p, _ = harness.load()
where = {"unique_indices": True, "mode": "promise_in_bounds"}
COLORS = [(p.links[a:b, 0], p.links[a:b, 1], jnp.asarray(p.rest[a:b, None]), int(p.bend[a])) for a, b in p.color_ranges]
FACTOR = jnp.asarray(p.inverse_mass_factor[:, None])
FALL = jnp.asarray(p.gravity) * p.h * (FACTOR > 0)
TARGET = jnp.asarray(p.target)


def sweep(q, multipliers, w, alpha):
    after = []
    for (i, j, rest, kind), old in zip(COLORS, multipliers, strict=True):
        d = q.at[i].get(**where) - q.at[j].get(**where)
        length = jnp.sqrt(jnp.sum(d * d, axis=1, keepdims=True))
        wi, wj, a = w[i], w[j], alpha[kind]
        change = (rest - length - a * old) / (wi + wj + a)
        push = d * (change / length)
        q = q.at[i].add(wi * push, **where).at[j].add(-wj * push, **where)
        after.append(old + change)
    return q, after


@jax.checkpoint
def substep(x, v, w, alpha):
    q = x + p.h * (v + FALL)
    start = (q, [jnp.zeros_like(rest) for _, _, rest, _ in COLORS])
    (q, _), _ = jax.lax.scan(lambda s, _: (sweep(*s, w, alpha), None), start, None, length=p.iterations)
    return q, (q - x) / p.h


def loss(parameters, x):
    alpha, w = parameters[:2] / p.h**2, FACTOR / parameters[2]

    def frame(state, target):
        state, _ = jax.lax.scan(lambda s, _: (substep(*s, w, alpha), None), state, None, length=p.substeps)
        return state, 0.5 * jnp.sum((state[0] - target) ** 2)

    _, losses = jax.lax.scan(frame, (x, jnp.zeros_like(x)), TARGET)
    return jnp.sum(losses)


value_and_gradient = jax.value_and_grad(loss, (0, 1))
if len(p.parameters) == 1:
    arguments = jnp.asarray(p.parameters[0]), jnp.asarray(p.start)
else:
    loss, value_and_gradient = jax.vmap(loss), jax.vmap(value_and_gradient)
    arguments = jnp.asarray(p.parameters), jnp.tile(jnp.asarray(p.start), (len(p.parameters), 1, 1))
loss, value_and_gradient = jax.jit(loss), jax.jit(value_and_gradient)


def forward():
    return np.atleast_1d(loss(*arguments).block_until_ready())


def gradient():
    losses, (by_parameters, by_start) = jax.block_until_ready(value_and_gradient(*arguments))
    return np.atleast_1d(losses), np.atleast_2d(by_parameters), np.reshape(by_start, (-1, *p.start.shape))


harness.run("jax", jax.__version__, forward, gradient)
