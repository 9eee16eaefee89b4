"""Ends of ropes in clamps, in grips and on bodies."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import product
from ..scene.body import BodyPoint
from ..scene.in_frame import drive_in_frame
from ..scene.scene import Scene
from .body_end import STUB, hold_place
from .chain import TimeConstant, unit_vector, voronoi_shares
from .grip import Grip
from .grip_freedom import Lead, add_shifts, add_tilts, spread_shift

GHOST = 0.01  # length of a clamp's ghost link over a rope's link; only its direction matters


class Chain(Protocol):
    """A built rope: particles in order, material coordinates [m], and the ghosts of its ends."""

    @property
    def name(self) -> str: ...
    @property
    def particles(self) -> Array: ...
    @property
    def arc_length(self) -> Array: ...
    @property
    def start_ghost(self) -> int | None: ...
    @property
    def end_ghost(self) -> int | None: ...


class End(NamedTuple):
    """One end of a rope and what holds it: a clamp, a grip, a point of a body, or nothing.

    Attributes:
        rope: its name.
        label: "start" or "end".
        grip: the grip, or the point of a body.
        clamp: (3,), the rope's direction from start to end.
        lead: m, to the first marker, where that is not known exactly.
        tilts, shifts: whether those of a grip are added, see `add_rope`.
    """

    rope: str
    label: str
    grip: Grip | BodyPoint | None
    clamp: ArrayLike | None
    lead: float | None
    tilts: bool
    shifts: bool

    def hold(self, scene: Scene, node: int, link: float, density: float, normal: Array | None) -> int | None:
        """Hold the end, and its direction by a ghost, whose number this returns; a clamp turns about a normal (3,)."""
        label, side = f"{self.rope}_{self.label}", -1.0 if self.label == "start" else 1.0
        if isinstance(self.grip, BodyPoint):
            return _ride(scene, self.grip, label, node, side * STUB * link, GHOST * density * link)
        if self.grip is not None:
            return _hold(scene, self.grip, node, side * GHOST * link)
        if self.clamp is None:
            return None
        along = unit_vector(f"{self.rope}.clamp_{self.label}", self.clamp)
        return _clamp(scene, label, along, node, side * GHOST * link, normal)

    def loosen(self, scene: Scene, rope: Chain, taus: tuple[TimeConstant | None, TimeConstant | None]) -> None:
        """Let a grip be askew, beside its place, or farther from the first marker."""
        ghost = rope.start_ghost if self.label == "start" else rope.end_ghost
        if not isinstance(self.grip, Grip) or ghost is None:
            return
        _loosen(scene, rope, self, self.grip, ghost)
        if self.lead is not None:
            _lengthen(scene, rope, self.label, self.grip, ghost, self.lead, taus)


def checked_ends(
    name: str,
    grips: tuple[Grip | BodyPoint | None, Grip | BodyPoint | None],
    clamps: tuple[ArrayLike | None, ArrayLike | None],
    leads: tuple[float | None, float | None],
    tilts: bool,
    shifts: bool,
) -> tuple[End, End]:
    """The start and the end of a rope.

    Raises:
        SceneError: what is no grip, a grip beside a clamp, and freedoms of a grip where there is none.
    """
    each = zip(("start", "end"), grips, clamps, leads, strict=True)
    start, end = (End(name, *given, tilts, shifts) for given in each)
    for e in (start, end):
        field = f"{name}.grip_{e.label}"
        if e.grip is not None and not isinstance(e.grip, Grip | BodyPoint):
            fix = "give sb.Grip.fixed, from_poses, from_markers or from_body, or a point of a body"
            raise SceneError(field, "is not a grip", e.grip, fix)
        if e.grip is not None and e.clamp is not None:
            fix = "leave one of them out: a grip gives the direction"
            raise SceneError(field, f"stands beside clamp_{e.label}", e.clamp, fix)
    first, last = (isinstance(e.grip, Grip) for e in (start, end))
    for field, asked, possible in (
        ("tilts", tilts or None, first or last),
        ("shifts", shifts or None, first or last),
        ("start_lead", start.lead, first),
        ("end_lead", end.lead, last),
    ):
        if asked is not None and not possible:
            raise SceneError(f"{name}.{field}", "needs a grip", asked, "give grip_start or grip_end")
    return start, end


def placed(grip: Grip | BodyPoint) -> tuple[Array, Array]:
    """Place and direction (3,) of an end at the start; any direction where a body lets it turn."""
    if isinstance(grip, Grip):
        return grip.position[0], grip.direction[0]
    at, along = grip.at_start()
    return at, np.array([1.0, 0.0, 0.0]) if along is None else along


def _hold(scene: Scene, grip: Grip, node: int, reach: float) -> int:
    """Give an end the place and the direction of a grip, by a ghost particle `reach` m along the rope from it."""
    ghost = int(scene.add_hidden([grip.position[0] + reach * grip.direction[0]], 1.0)[0])
    if grip.stays:
        scene.pin([node, ghost])
        return ghost
    motion = np.stack([grip.position, grip.position + reach * grip.direction], axis=1)
    drive_in_frame(scene, grip.frame, [node, ghost], grip.times, motion)
    return ghost


def _clamp(scene: Scene, end: str, along: Array, node: int, reach: float, normal: Array | None) -> int:
    """Pin an end and hold its direction of travel by a ghost, a hidden node `reach` m along the rope from it. The new
    quantity `<end>_angle` turns it about `normal`, if that is given."""
    ghost = int(scene.add_hidden([scene.nodes[node] + reach * along], 1.0, pinned=True)[0])
    scene.pin([node])
    if normal is None:
        return ghost
    angle = scene.add_quantity(f"{end}_angle", 0.0, "rad", positive=False, scale=0.1)
    across = np.cross(normal, along)
    scene.add_terms(
        [product("position", 3 * ghost + k, reach * along[k], {angle: "cos"}) for k in range(3)]
        + [product("position", 3 * ghost + k, reach * across[k], {angle: "sin"}) for k in range(3)]
    )
    scene.shift_base(ghost, -reach * along)
    return ghost


def _ride(scene: Scene, point: BodyPoint, name: str, node: int, reach: float, mass: float) -> int | None:
    """Keep an end on a body, and where the point has a direction, a light ghost `reach` m along it."""
    hold_place(scene, point, node, f"{name}_on_{point.body.name}")
    if point.along is None:
        return None
    at, along = placed(point)
    ghost = int(scene.add_hidden([at + reach * along], mass)[0])
    hold_place(scene, point, ghost, f"{name}_stub", reach)
    return ghost


def _loosen(scene: Scene, rope: Chain, end: End, grip: Grip, ghost: int) -> None:
    """Let the grip of an end be askew, or beside its place."""
    label, first = f"{rope.name}_{end.label}", end.label == "start"
    nodes, along = (rope.particles, 1.0) if first else (rope.particles[::-1], -1.0)
    if end.tilts:
        add_tilts(scene, grip, label, ghost, -along * GHOST * float(rope.arc_length[1]))
    if end.shifts:
        add_shifts(scene, grip, label, (int(nodes[0]), ghost))
        other_end = rope.end_ghost if first else rope.start_ghost
        shares = np.ones(len(nodes)) if other_end is None else np.linspace(1.0, 0.0, len(nodes))
        between = slice(1, None if other_end is None else -1)
        spread_shift(scene, grip, label, nodes[between], shares[between])


def _lengthen(
    scene: Scene,
    rope: Chain,
    end: str,
    grip: Grip,
    ghost: int,
    length: float,
    taus: tuple[TimeConstant | None, TimeConstant | None],
) -> None:
    """Let a grip be farther from the first marker than given: links, joints, masses and drags between them grow."""
    name, link, segments = rope.name, float(rope.arc_length[1]), len(rope.particles) - 1
    way = slice(None, None, 1 if end == "start" else -1)
    nodes, places, links = rope.particles[way], np.arange(segments + 1)[way], np.arange(segments)[way]
    lead = Lead(scene, f"{name}_{end}", grip, length, nodes, link)
    lead.hold(ghost, 1.0 if end == "start" else -1.0)
    places, links, nodes = places[: lead.count + 1], links[: lead.count], nodes[: lead.count + 1]
    lead.lengthen("rest", scene.places_of_group(f"{name}_stretch").rest[links, 0], {})
    lead.lengthen("mass", nodes, {f"{name}_density": "identity"})
    for kind in ("linear", "quadratic"):
        if f"{name}_drag_{kind}" in scene.quantities:
            lead.lengthen(f"drag_{kind}", nodes, {f"{name}_drag_{kind}": "identity"})
    shares = voronoi_shares(segments)
    for stiffness, group, own, share, tau in (
        ("EA", "stretch", links, np.full(len(links), 1.0 / segments), taus[0]),
        ("EI", "bend", places - (rope.start_ghost is None), shares[places], taus[1]),
    ):
        if f"{name}_{stiffness}" not in scene.quantities:
            continue
        first = scene.places_of_group(f"{name}_{group}").constraints[own]
        lead.lengthen("compliance", first, {f"{name}_{stiffness}": "inverse"})
        if tau is not None:
            factors = {**tau[1], f"{name}_{stiffness}": "identity", f"{name}_length": "inverse"}
            lead.soften(first, tau[0] / share, factors, link)
