"""Sizes of a model that its recording contradicts: a length in mm given as m, markers elsewhere than measured.

None of this stops a fit: a rope may be far longer than what its markers show. Where the factor is near 10, 100 or 1000,
the sentence says which slip it looks like.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator

import numpy as np

from ..arrays.types import Array
from ..experiment.experiment import Experiment
from ..quantities.wording import short

SLIPS = {
    10: "as if cm were given as mm, or mm as cm",
    100: "as if cm were given as m",
    1000: "as if mm were given as m",
}
ALIKE = 1.6  # how far a factor may be from that of a slip
APART, NEAR = 3.0, 0.1  # of their distance on the object: how far apart neighboring markers are, at most and at least
UNSEEN = 5.0  # times the part that markers show: how long a rope is hardly ever
COARSE = 0.3  # of the extent of all markers: with a larger sigma they tell nothing
HEAVY = 50.0  # times the mass of all else: what hangs on it hardly ever is
GRAMS = 1.0  # kg: a bob of 100 g on a thread is that heavy, but one that was weighed in grams is told as 1 or more


def other_units(e: Experiment, fitted: Container[str] = ()) -> Iterator[str]:
    """Sentences on sizes in the scene of an experiment that its recording contradicts; `fitted` are no given masses."""
    yield from (words for name, words in _hung(e) if f"{name}_mass" not in fitted)
    if e.is_cloud:
        return
    for name, flat, places in _objects(e):
        ratio = _ratio(places, e.recording.positions[:, flat])
        if ratio is not None and not NEAR < ratio < APART:
            far = [f"recorded in {e.name}", f"placed on {name}"]
            more, less = far if ratio > 1.0 else far[::-1]
            yield (
                f"markers {more} are {short(max(ratio, 1.0 / ratio), 2)} times as far apart as {less}{_slip(ratio)}. "
                f"Check the size of {name}, the places of its markers, and `units` of the recording"
            )
    for name, rope in e.scene.ropes.items():
        last = max((arc for _, arc in _arcs(e, rope.particles, rope.arc_length)), default=0.0)
        if 0.0 < UNSEEN * last < rope.length:
            yield (
                f"`length` of {name} is {short(rope.length)} m, {short(rope.length / last, 2)} times as far as its "
                f"last marker in {e.name}{_slip(rope.length / last)}"
            )
    seen = e.recording.positions[:, list(e.compared)]
    extent = float(np.linalg.norm(np.nanmax(seen, axis=(0, 1)) - np.nanmin(seen, axis=(0, 1))))
    alone = e.static and len(e.compared) == 1  # the place of one marker at rest may tell what its extent does not
    if not alone and 0.0 < COARSE * extent < e.sigma:
        yield (
            f"`sigma` of {e.name} is {short(e.sigma)} m, and its markers stay within {short(extent, 2)} m: they then "
            f"determine nothing. If it is in mm, write {short(1e-3 * e.sigma)}"
        )


def _hung(e: Experiment) -> Iterator[tuple[str, str]]:
    """Point masses that are far heavier than all else, with sentences on them."""
    masses = {n.removesuffix("_mass"): q.value for n, q in e.scene.quantities.items() if n.endswith("_mass")}
    offset, _ = e.scene.compiled.layout["mass"]
    total = float(np.sum(e.scene.compiled.inputs()[offset : offset + e.scene.particle_count]))
    for name, mass in masses.items():
        rest = total - mass
        if name not in e.scene.bodies and mass >= GRAMS and 0.0 < HEAVY * rest < mass:
            times = short(mass / rest, 2)
            yield name, f"`mass` of {name} is {short(mass)} kg, {times} times all else in the scene. Is it in g?"


def _objects(e: Experiment) -> Iterator[tuple[str, list[int], Array]]:
    """Ropes and cloths with two markers or more: the name, the markers, and their places (k, 3) m along or on it."""
    for name, rope in e.scene.ropes.items():
        found = _arcs(e, rope.particles, rope.arc_length)
        if len(found) > 1:
            yield name, [k for k, _ in found], np.array([[arc, 0.0, 0.0] for _, arc in found])
    for name, cloth in e.scene.cloths.items():
        number = {int(p): k for k, p in enumerate(cloth.particles)}
        on = [(k, p) for k, p in enumerate(e.places) if p is not None and set(p.particles) <= number.keys()]
        if len(on) > 1:
            vertices = cloth.mesh.vertices
            at = [np.dot(p.weights, vertices[[number[int(i)] for i in p.particles]]) for _, p in on]
            yield name, [k for k, _ in on], np.array(at)


def _arcs(e: Experiment, particles: Array, arc_length: Array) -> list[tuple[int, float]]:
    """Markers on a rope, and how far each is along it, m."""
    arc = dict(zip(particles.tolist(), arc_length.tolist(), strict=True))
    found = []
    for k, place in enumerate(() if e.is_cloud else e.places):
        if place is not None and set(place.particles) <= arc.keys():
            found.append((k, float(np.dot(place.weights, [arc[i] for i in place.particles]))))
    return found


def _ratio(at: Array, recorded: Array) -> float | None:
    """Distances of neighbors as recorded (frames, k, 3), over those on the object: the median over frames and
    neighbors; None where no two are seen together."""
    apart = np.linalg.norm(at[:, None] - at[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    apart[apart <= 0.0] = np.inf
    near = apart.argmin(axis=1)
    told = np.linalg.norm(recorded - recorded[:, near], axis=2) / apart[np.arange(len(at)), near]
    told = told[np.isfinite(told) & (told > 0.0)]
    return float(np.median(told)) if len(told) else None


def _slip(factor: float) -> str:
    """What a factor near a power of ten looks like."""
    size = max(factor, 1.0 / factor)
    like = min(SLIPS, key=lambda f: abs(math.log(size / f)))
    return f" ({SLIPS[like]})" if abs(math.log(size / like)) < math.log(ALIKE) else ""
