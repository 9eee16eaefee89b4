"""Where nodes that are means of others start: whatever their particles start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays.types import Array
from ..quantities.quantities import Term


def start_terms(means: Mapping[int, tuple[Array, Array]], terms: Sequence[Term], x: Array, v: Array) -> list[Term]:
    """Terms of the initial positions and velocities of means.

    Args:
        means: by node: the (k,) particles and their (k,) weights, of sum one. Those of other means come after them.
        terms: of all else in the scene.
        x, v: (nodes, 3) the plain parts of positions and velocities.
    """
    found: list[Term] = []
    moving = [t for t in terms if t.array in ("position", "velocity") and (t.factors or t.exponents)]
    for node, (particles, weights) in means.items():
        for array, plain in (("position", x), ("velocity", v)):
            off = weights @ plain[particles] - plain[node]
            found.append(Term(array, 3 * node + np.arange(3), off, ()))
        own = [t for term in moving for t in _mean_of(term, node, particles, weights)]
        found += own
        moving += own
    return found


def _mean_of(term: Term, node: int, particles: Array, weights: Array) -> list[Term]:
    """What a term of the particles adds to their mean."""
    whose, axis = np.divmod(np.ravel(term.index), 3)
    entry, one = np.nonzero(whose[:, None] == particles)
    if not len(entry):
        return []
    shares = weights[one] * np.broadcast_to(term.coefficient, whose.shape)[entry]
    if term.exponents:  # their weights differ from entry to entry
        own = [[(q, np.broadcast_to(w, whose.shape)[e]) for q, w in term.exponents] for e in entry]
        index = 3 * node + axis[entry]
        return [Term(term.array, i, c, term.factors, tuple(e)) for i, c, e in zip(index, shares, own, strict=True)]
    by = np.bincount(axis[entry], shares, minlength=3)
    return [Term(term.array, 3 * node + np.flatnonzero(by), by[by != 0.0], term.factors)] if by.any() else []
