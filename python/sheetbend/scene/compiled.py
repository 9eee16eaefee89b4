"""A frozen scene as the compiled core sees it: topology, the flat layout of its inputs, the map from quantities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..errors import SceneError, choices, refusal
from ..quantities.quantities import FUNCTIONS, Term, intermediate_of
from . import pieces
from .balls import Balls
from .collider_speeds import Fastest, fastest
from .domain import Domain
from .kinks import kinks, of_the_state
from .scene_data import SceneData
from .settle import SettledStart, settled

OVER_NODES = ("position", "velocity", "mass", "drag_linear", "drag_quadratic")
VECTORS = ("position", "velocity", "boundary", "force", "wind", "collider_pose")


def specification(scene: SceneData) -> dict[str, Any]:
    """The topology of a scene, as the compiled core is made from it: its particles are all nodes, by their places in
    arrays over them, and -1 stands for none."""
    places = scene.places_of
    return {
        "particles": scene.node_count,
        "directors": places_or_none(scene, [(d, *edge) for d, edge in scene.directors.items()]).tolist(),
        "pinned": sorted(places(list(scene.pinned)).tolist()),
        "driven": places(scene.boundary.driven).tolist(),
        "boundary_times": [] if not scene.boundary.driven else list(scene.boundary.times),
        "boundary_interpolation": scene.boundary.interpolation,
        "loaded": places(scene.forces.particles).tolist(),
        "force_times": scene.forces.times.tolist(),
        "has_drag": scene.has_drag,
        "air": scene.air.triangles.tolist(),
        "wind_times": scene.air.times.tolist(),
        "groups": [
            {"name": g.name, "kind": g.kind, "damped": g.damped, "stencil": places(g.particles).ravel()}
            for g in scene.groups
        ],
        "volumes": [
            {"name": name, "triangles": triangles.tolist()} for name, triangles in scene.volumes.triangles.items()
        ],
        **scene.contacts.specification(places),
        **pieces.specification(scene.contacts.pieces, scene.contacts.pair_friction, places, scene.node_count),
        "bodies": places_or_none(scene, scene.with_axes).tolist(),
    }


def places_or_none(scene: SceneData, rows: Sequence[Sequence[int | None]]) -> np.ndarray:
    """Places (n, width) of rows of nodes in arrays over all nodes; -1 for what is None."""
    none = np.array([[node is None for node in row] for row in rows], dtype=bool)
    nodes = np.array([[node or 0 for node in row] for row in rows], dtype=np.int64)
    return np.where(none, -1, scene.places_of(nodes))


def _has_means(scene: SceneData) -> bool:
    """Also of a scene that was read from a file: `coincide` holds nodes at means, and otherwise two bodies together."""
    centers = [own for own, *_ in scene.with_axes if own is not None]  # the ground's too, which means hang on
    seconds = [g.particles[:, 1] for g in scene.groups if g.kind == "coincide" and centers]
    return not all(np.isin(nodes, centers).all() for nodes in seconds)


class CompiledScene:
    """Built once by `Scene.compiled`.

    Attributes:
        core: the compiled topology.
        layout: input array name -> (offset, size) in the flat input vector.
        given: the same of what users give and get: arrays over nodes begin with the particles, and end there.
        particles, nodes: how many there are.
        name: of the scene.
        kinds: of its constraints.
        names: quantity names in the order of theta.
        theta: their values.
        contacts: names of those that particles may have with colliders.
        has_means: whether it has particles at the mean of others.
        touches_itself: whether any rope or cloth may touch itself or another, or particles may hit each other.
        kinks: what beside contacts makes its motions not smooth in time, in words; empty if nothing.
        bends_over_values: whether any of it makes motions not smooth over quantities, either.
        settled: by contact, what started inside a collider and was moved to its surface.
        fastest: the colliders that move and could pass particles unseen.
        domain: which quantities and inputs make sense.
    """

    def __init__(self, scene: SceneData) -> None:
        try:
            self.core = _core.Scene(**specification(scene))
        except ValueError as error:
            raise refusal(error, SceneError, scene.name) from error
        self.layout: dict[str, tuple[int, int]] = self.core.layout
        self.particles, self.nodes = scene.particle_count, scene.node_count
        self.given = {
            name: (first, size // self.nodes * self.particles if name in OVER_NODES else size)
            for name, (first, size) in self.layout.items()
        }
        self.name = scene.name
        self.kinds = frozenset(g.kind for g in scene.groups)
        self.names = tuple(scene.quantities)
        self.theta = np.array([q.value for q in scene.quantities.values()], dtype=float)
        self.kinks, self.bends_over_values = kinks(scene), bool(of_the_state(scene))
        self.domain = Domain(scene, self.layout)
        self._base = self._pack(scene)
        self._terms = scene.every_term
        self.contacts = tuple(c.name for c in scene.contacts.contacts)
        self.has_means = _has_means(scene)
        self.touches_itself = bool(scene.contacts.pieces) or scene.contacts.balls is not None
        self.settled: dict[str, SettledStart] = {}
        self.fastest: tuple[Fastest, ...] = ()
        if self.contacts:
            self._settle(scene)
            self._expect_apart(scene)
            radii = self.part(self.inputs(), "contact_radius")
            self.fastest = fastest(scene.contacts, radii[: len(self.contacts)])
        if scene.contacts.pieces:
            pieces.expect_apart(self.core, self.inputs(), scene.node_in_words)
        if scene.contacts.balls is not None:
            self._expect_balls_apart(scene, scene.contacts.balls)

    def _settle(self, scene: SceneData) -> None:
        if scene.contacts.settling:
            inputs = _core.ParameterMap(self.map()).inputs(self.theta)
            moved, self.settled = settled(scene, self.core, inputs, self.layout["position"][0])
            self.part(self._base, "position")[:] += moved.ravel()

    def _expect_apart(self, scene: SceneData) -> None:
        inputs = self.inputs()
        scene.contacts.expect_apart(self.core, inputs, self.part(inputs, "mass"), scene.gravity, set(scene.held))

    def _expect_balls_apart(self, scene: SceneData, balls: Balls) -> None:
        inputs = self.inputs()
        places, radii = (self.part(inputs, array) for array in ("position", "contact_radius"))
        own = radii[len(radii) - len(balls.particles) :]
        balls.expect_apart(places.reshape(-1, 3)[balls.particles], own, scene.node_in_words)

    def part(self, flat: np.ndarray, array: str) -> np.ndarray:
        """A view of one input array, over all nodes, in a flat vector of inputs or of their derivatives."""
        offset, size = self.layout[array]
        return flat[offset : offset + size]

    @cached_property
    def map_of_quantities(self) -> _core.ParameterMap:
        """From the scene's own quantities to its inputs, without checks."""
        return _core.ParameterMap(self.map())

    def _pack(self, scene: SceneData) -> np.ndarray:
        base = np.zeros(self.core.inputs)
        arrays = scene.base_arrays()
        self._shapes = {name: np.shape(values) for name, values in arrays.items()}
        for array, values in arrays.items():
            self.part(base, array)[:] = np.ravel(values)
        return base

    def map(self, extra: int = 0, terms: Sequence[Term] = (), names: Sequence[str] | None = None) -> dict[str, Any]:
        """The parameter map as plain arrays, one entry per term and input that it goes to; `extra` more inputs (array
        "extra") may follow the scene's, with their own terms."""
        names = self.names if names is None else tuple(names)
        known = names[: len(self.names)] == self.names
        own = self._entries if known else self._entries_of(self._terms, names)
        if terms:
            own = _followed_by(own, self._entries_of(terms, names, extra))
        return {"base": np.concatenate([self._base, np.zeros(extra)]) if extra else self._base, **own}

    @cached_property
    def _entries(self) -> dict[str, np.ndarray]:
        """Entries of the scene's own terms, which every problem on it takes."""
        return self._entries_of(self._terms, self.names)

    def _entries_of(self, every: Sequence[Term], names: Sequence[str], extra: int = 0) -> dict[str, np.ndarray]:
        """The arrays of some terms, without the base."""
        order = {name: i for i, name in enumerate(names)}
        order |= {name: -1 - k for t in every for name in t.made_of if (k := intermediate_of(name)) is not None}
        arrays = self.layout | {"extra": (self.core.inputs, extra)}
        entries = np.array([np.size(t.index) for t in every], dtype=int)
        lengths = np.array([len(t.made_of) for t in every], dtype=int)
        parameter = np.array([order[name] for t in every for name in t.made_of], dtype=int)
        functions = [(*(f for _, f in t.factors), *("exp" for _ in t.exponents)) for t in every]
        function = np.array([FUNCTIONS[f] for own in functions for f in own], dtype=int)
        # Every entry of a term has all of its factors: where they stand in the two lists above.
        length = np.repeat(lengths, entries)
        first_factor = np.concatenate([[0], np.cumsum(length)])
        first = np.repeat(np.cumsum(lengths) - lengths, entries)
        place = np.repeat(first - first_factor[:-1], length) + np.arange(first_factor[-1])
        coefficients = [_spread(t.coefficient, k) for t, k in zip(every, entries, strict=True)]
        weight = np.ones(len(place))  # of a quantity in an exponential
        for t, k, start in zip(every, entries, first_factor[np.cumsum(entries) - entries], strict=True):
            for e, (_, own) in enumerate(t.exponents, start=len(t.factors)):
                width = len(t.made_of)
                weight[start + e : start + k * width : width] = own
        targets = [-1 - t.places(0, 0) if t.array == "intermediate" else t.places(*arrays[t.array]) for t in every]
        return {
            "target": _joined(targets),
            "coefficient": _joined(coefficients).astype(float),
            "first_factor": first_factor,
            "parameter": parameter[place],
            "function": function[place],
            "weight": weight,
        }

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shapes of the input arrays as users give and get them."""
        return {
            name: (self.particles, *shape[1:]) if name in OVER_NODES else shape for name, shape in self._shapes.items()
        }

    def values(self, changes: Mapping[str, float] | None = None) -> np.ndarray:
        """theta with some quantities changed, shape (quantities,).

        Raises:
            SceneError: an unknown name, no finite number, or one outside the range of its quantity.
        """
        theta = self.theta.copy()
        if not isinstance(changes, Mapping | None):
            raise SceneError("values", "must be a mapping", changes, "give numbers by the names of quantities")
        for name, value in (changes or {}).items():
            if name not in self.names:
                raise SceneError("values", "name no quantity of the scene", name, choices(name, self.names))
            k = self.names.index(name)
            try:
                theta[k] = value
            except (TypeError, ValueError, OverflowError, RuntimeError):
                theta[k] = np.nan
        self.domain.check_quantities(theta[None])
        return theta

    def inputs(self, theta: np.ndarray | None = None) -> np.ndarray:
        """Flat inputs, shape (core.inputs,).

        Raises:
            SceneError: some are not finite, or negative where that makes no sense; names the quantities.
        """
        theta = self.theta if theta is None else theta
        found = self.map_of_quantities.inputs(theta)
        self.domain.check_inputs(found[None], theta)
        return found

    def inputs_dot(self, theta: np.ndarray, theta_dot: np.ndarray) -> np.ndarray:
        """Tangent of the inputs along theta_dot."""
        return self.map_of_quantities.inputs_dot(theta, theta_dot)

    def theta_bar(self, theta: np.ndarray, inputs_bar: np.ndarray) -> np.ndarray:
        """Cotangent of the quantities from that of the inputs."""
        return self.map_of_quantities.theta_bar(theta, inputs_bar)

    def unpack(self, flat: np.ndarray) -> dict[str, np.ndarray]:
        """A flat vector of inputs (or their cotangents) by array name, of particles without hidden nodes; vectors per
        particle come as (n, 3)."""
        shaped: dict[str, np.ndarray] = {}
        for array, (offset, size) in self.given.items():
            part = flat[offset : offset + size]
            shaped[array] = part.reshape(-1, 3) if array in VECTORS else part
        return shaped


def _followed_by(first: Mapping[str, np.ndarray], more: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Entries of a map behind others."""
    joined = {name: np.concatenate([values, more[name]]) for name, values in first.items()}
    end = first["first_factor"][-1]
    return joined | {"first_factor": np.concatenate([first["first_factor"], end + more["first_factor"][1:]])}


def _spread(coefficient: ArrayLike, entries: int) -> np.ndarray:
    """One coefficient per entry; `broadcast_to` takes most of the time of a map with many small terms."""
    given = np.ravel(coefficient)
    return given if len(given) == entries else np.full(entries, *given)


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    """Whole numbers or coefficients, one array after the other."""
    return np.concatenate(parts) if parts else np.zeros(0, dtype=int)
