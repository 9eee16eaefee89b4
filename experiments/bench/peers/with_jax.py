"""jax: scans over sweeps, substeps and frames, and a checkpoint per substep. One scene gathers and scatters the
particles of each color; a batch is mapped over strided slices of the sheet, which took half as long there (and longer
for one scene)."""

from __future__ import annotations

from functools import partial

import harness
import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)
p, _ = harness.load()
where = {"unique_indices": True, "mode": "promise_in_bounds"}


class Indexed:
    """Positions (particles, 3); a piece is a color."""

    def __init__(self):
        self.pieces = [((p.links[a:b, 0], p.links[a:b, 1]), np.arange(a, b)) for a, b in p.color_ranges]
        self.axis = 1

    def enter(self, per_particle):
        return per_particle

    def per_link(self, values):
        return values[:, None]

    def take(self, q, which):
        return q.at[which].get(**where)

    def add(self, q, which, by):
        return q.at[which].add(by, **where)


class Strided:
    """Positions (3, rows, columns); a piece is the part of a color that one pair of strided slices covers."""

    def __init__(self):
        self.shape = (len(p.start) // p.columns, p.columns)
        self.pieces = [piece for a, b in p.color_ranges for piece in self._split(np.arange(a, b))]
        self.axis = 0

    def _split(self, ids):
        first, second = (np.stack(np.divmod(p.links[ids, end], p.columns)) for end in (0, 1))
        along = int(second[0, 0] == first[0, 0])  # the axis of the links' direction; rows for diagonals
        period = 2 * abs(int(second[along, 0] - first[along, 0]))
        residue = first[along] % period
        for r in np.unique(residue):
            mine = residue == r
            rows, columns = (len(np.unique(first[axis, mine])) for axis in (0, 1))
            yield (self._slices(first[:, mine]), self._slices(second[:, mine])), ids[mine].reshape(rows, columns)

    def _slices(self, places):
        found = []
        for axis in (0, 1):
            steps = np.unique(places[axis])
            found.append((int(steps[0]), int(steps[-1]) + 1, int(steps[1] - steps[0]) if len(steps) > 1 else 1))
        return found

    def enter(self, per_particle):
        return per_particle.T.reshape(-1, *self.shape)

    def per_link(self, values):
        return values[None]

    def take(self, q, which):
        low, high, step = zip(*which, strict=True)
        return jax.lax.slice(q, (0, *low), (q.shape[0], *high), (1, *step))

    def add(self, q, which, by):
        edges = [(low, size - high, step - 1) for (low, high, step), size in zip(which, self.shape, strict=True)]
        return q + jax.lax.pad(by, by.dtype.type(0), [(0, 0, 0), *edges])


layout = Indexed() if len(p.parameters) == 1 else Strided()
FACTOR = layout.enter(jnp.asarray(p.inverse_mass_factor[:, None]))
FALL = layout.enter(jnp.asarray((p.inverse_mass_factor > 0)[:, None] * p.gravity * p.h))
TARGET = jax.vmap(layout.enter)(jnp.asarray(p.target))
PIECES = [(*ends, layout.per_link(jnp.asarray(p.rest[ids])), int(p.bend[ids.flat[0]])) for ends, ids in layout.pieces]


def sweep(alpha, w, state, _):
    q, multipliers = state
    after = []
    for (i, j, rest, kind), old in zip(PIECES, multipliers, strict=True):
        d = layout.take(q, i) - layout.take(q, j)
        length = jnp.sqrt(jnp.sum(d * d, axis=layout.axis, keepdims=True))
        wi, wj, a = layout.take(w, i), layout.take(w, j), alpha[kind]
        change = (rest - length - a * old) / (wi + wj + a)
        push = d * (change / length)
        q = layout.add(layout.add(q, i, wi * push), j, -wj * push)
        after.append(old + change)
    return (q, after), None


@jax.checkpoint
def substep(alpha, w, x, v):
    q = x + p.h * (v + FALL)
    start = (q, [jnp.zeros_like(rest) for _, _, rest, _ in PIECES])
    (q, _), _ = jax.lax.scan(partial(sweep, alpha, w), start, None, length=p.iterations)
    return q, (q - x) / p.h


def loss(parameters, start):
    alpha, w, x = parameters[:2] / p.h**2, FACTOR / parameters[2], layout.enter(start)

    def frame(state, target):
        state, _ = jax.lax.scan(lambda s, _: (substep(alpha, w, *s), None), state, None, length=p.substeps)
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
