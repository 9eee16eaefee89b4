"""The start of a motion as numbers that a fit finds on the way, with a prior.

A recording that begins in the middle of a motion shows where some markers are. Where the rest of a rope or cloth is,
and how fast all of it moves, has to be estimated along with the parameters. What is unknown are two fields over each
rope and cloth, added to the places and the velocities that its scene starts with: sums of smooth modes (eigenvectors of
the Laplace operator, zero at what is held) with independent priors, whose deviations fall as 1/(1 + length^2
eigenvalue), as those of stiffness fields do. Size and length are the most likely ones for what the markers show: how
far, over the fitted part, they are from where the scene starts, and how much their velocities differ from its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..objects.markers import Place
from ..objects.rod import Rod
from ..objects.stiffness_field import laplacian_of_triangles, modes_of_laplacian, shares
from ..recording.recording import Recording
from ..scene.scene import Scene

LEAST = 0.01  # of the widest deviation: finer modes do not count
LENGTHS = 0.5 ** np.arange(6)  # of a piece's extent: lengths of the prior that are tried
SIZES = 1.5 ** np.arange(-6, 13)  # likewise, of the root mean square of what the markers show
FRAMES = 3  # fewest, for velocities


@dataclass(frozen=True, eq=False)
class EstimatedStart:
    """Numbers in units of their priors' deviations.

    Attributes:
        kinds: (numbers,) whether each is of the velocities.
        first: (numbers + 1,) per number the places of what it moves, and one past the last.
        target: coordinates that are moved, in the array "position" or "velocity" over all nodes.
        weight: m or m/s, by which each is moved.
    """

    kinds: Array
    first: Array
    target: Array
    weight: Array

    @classmethod
    def of(cls, name: str, scene: Scene, places: Sequence[Place], fitted: Recording, sigma: float) -> EstimatedStart:
        """Of an experiment's scene with markers at places, as the fitted part of its recording shows them, to sigma m.

        Raises:
            InputError: too few frames, or no marker on a rope or cloth that can move.
        """
        if len(fitted.times) < FRAMES:
            fix = "give a longer part, or start = 'given'"
            raise InputError(f"{name}.start", f"cannot be estimated from fewer than {FRAMES} frames", "estimated", fix)
        kinds, length, target, weight = [], [], [], []
        moved, rates = _offsets(scene, places, fitted)
        between = float(np.mean(fitted.times[2:] - fitted.times[:-2]))
        for nodes, values, shapes, extent in _pieces(scene):
            own = [k for k, place in enumerate(places) if place.body is None and set(place.particles) <= set(nodes)]
            if not own or not len(values):
                continue
            every = np.zeros((max(nodes) + 1, len(values)))
            every[nodes] = shapes
            at = np.array([_interpolated(places[k], every) for k in own])
            for kind, shown, noise in ((0, moved[:, own], sigma), (1, rates[:, own], np.sqrt(2.0) * sigma / between)):
                deviations = _likeliest(values, at, shown, noise, extent)
                kept = deviations >= LEAST * deviations.max()
                inner = np.flatnonzero(shapes.any(axis=1))
                slots = 3 * scene.places_of(np.array(nodes)[inner])
                for column in (shapes[inner][:, kept] * deviations[kept]).T:
                    for axis in range(3):
                        kinds.append(kind)
                        length.append(len(slots))
                        target.append(slots + axis)
                        weight.append(column)
        if not kinds:
            fix = "place a marker on a rope (not a rod) or cloth that can move, or use start = 'given'"
            raise InputError(
                f"{name}.start", "cannot be estimated without markers on ropes or cloths", "estimated", fix
            )
        first = np.concatenate([[0], np.cumsum(length)])
        return cls(np.array(kinds, dtype=bool), first, np.concatenate(target), np.concatenate(weight))

    @property
    def count(self) -> int:
        return len(self.kinds)

    def core(self, layout: Mapping[str, tuple[int, int]]) -> dict[str, Any]:
        """For the compiled core, whose inputs are laid out so."""
        offset = np.repeat(np.where(self.kinds, layout["velocity"][0], layout["position"][0]), np.diff(self.first))
        return {
            "sigma": np.ones(self.count),
            "given": np.zeros(self.count),
            "first": self.first,
            "target": offset + self.target,
            "weight": self.weight,
        }

    def added(self, numbers: Array, nodes: int) -> tuple[Array, Array]:
        """(nodes, 3) m and m/s that numbers add to the places and the velocities of all nodes."""
        fields = np.zeros((2, 3 * nodes))
        kind = np.repeat(self.kinds.astype(int), np.diff(self.first))
        np.add.at(fields, (kind, self.target), self.weight * np.repeat(numbers, np.diff(self.first)))
        return fields[0].reshape(nodes, 3), fields[1].reshape(nodes, 3)


def _pieces(scene: Scene) -> Iterator[tuple[list[int], Array, Array, float]]:
    """Of every rope and cloth its particles, the eigenvalues (k,) 1/m^2 and modes (particles, k) of its Laplace
    operator, zero at what is held, and its extent, m."""
    held = scene.pinned | set(scene.boundary.driven)
    for rope in scene.ropes.values():
        if isinstance(rope, Rod):
            continue
        n, links = len(rope.particles), np.diff(rope.arc_length)
        laplacian, length = np.zeros((n, n)), np.zeros(n)
        for k, link in enumerate(links):
            laplacian[k : k + 2, k : k + 2] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / link
            length[k : k + 2] += 0.5 * link
        yield _modes(rope.particles.tolist(), laplacian, length, held, rope.length)
    for cloth in scene.cloths.values():
        known, _, laplacian, area = laplacian_of_triangles(cloth.mesh.corners, cloth.mesh.triangles)
        extent = float(np.linalg.norm(np.ptp(cloth.mesh.vertices, axis=0)))
        yield _modes(np.asarray(cloth.particles)[known].tolist(), laplacian, area, held, extent)


def _modes(
    nodes: list[int], laplacian: Array, sizes: Array, held: set[int], extent: float
) -> tuple[list[int], Array, Array, float]:
    """Modes of mean square 1, smoothest first."""
    free = np.array([node not in held for node in nodes])
    values, moving = modes_of_laplacian(laplacian[np.ix_(free, free)], sizes[free], float(sizes.sum()))
    shapes = np.zeros((len(nodes), len(values)))
    shapes[free] = moving
    return nodes, values, shapes, extent


def _interpolated(place: Place, field: Array) -> Array:
    """What a marker shows of a field (nodes, ...)."""
    return np.asarray(np.array(place.weights) @ field[list(place.particles)])


def _offsets(scene: Scene, places: Sequence[Place], r: Recording) -> tuple[Array, Array]:
    """(frames, markers, 3) m, how far markers are from where the scene starts, and (frames - 2, markers, 3) m/s, how
    much their velocities differ from those that it starts with; NaN where they are not seen."""
    compiled, inputs = scene.compiled, scene.compiled.inputs()

    def seen(array: str) -> Array:
        field = compiled.part(inputs, array).reshape(-1, 3)
        return np.array([_interpolated(place, field) for place in places])

    rates = (r.positions[2:] - r.positions[:-2]) / (r.times[2:] - r.times[:-2])[:, None, None]
    return np.asarray(r.positions - seen("position")), np.asarray(rates - seen("velocity"))


def _likeliest(values: Array, at: Array, shown: Array, noise: float, extent: float) -> Array:
    """(modes,) deviations of the most likely prior for what markers show (frames, markers, 3), whose noise is given.
    Frames that do not show all of them are left out, unless none shows all: then NaN count as zero."""
    whole = shown[np.isfinite(shown).all(axis=(1, 2))]
    y = np.moveaxis(whole if len(whole) else np.nan_to_num(shown), 1, 0).reshape(shown.shape[1], -1)
    rms = max(float(np.sqrt(np.mean(y**2))), noise)
    best, found = np.inf, np.zeros(len(values))
    for length in LENGTHS * extent:
        falls = shares(values, length)
        spread, axes = np.linalg.eigh((at * falls**2) @ at.T)
        square = np.mean((axes.T @ y) ** 2, axis=1)
        for size in SIZES * rms:
            variance = size**2 * np.maximum(spread, 0.0) + noise**2
            height = float(np.sum(square / variance + np.log(variance)))
            if height < best:
                best, found = height, size * falls
    return found


def together(first: dict[str, Any] | None, second: dict[str, Any] | None) -> dict[str, Any] | None:
    """Two blocks of numbers as one, for the compiled core."""
    if first is None or second is None:
        return second if first is None else first
    joined = {key: np.concatenate([first[key], second[key]]) for key in ("sigma", "given", "target", "weight")}
    return {**joined, "first": np.concatenate([first["first"], first["first"][-1] + second["first"][1:]])}
