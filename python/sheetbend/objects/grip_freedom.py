"""What is not known exactly about a grip: how a rope leaves it, and how much rope there is up to the first marker."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.checks import is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term, product
from ..scene.in_frame import add_motion_in_frame
from ..scene.scene import Scene
from .chain import voronoi_shares
from .grip import Grip

SHORTEST, LONGEST = 0.6, 0.8  # of a lead: by so much it shrinks and grows at most
SERIES = 9  # powers of its growth in what is inverse to a lead: 0.03 % are left out at half of it, 6 % at most


def axes_of(grip: Grip) -> tuple[Array, Array, Array]:
    """(knots, 3) each: the director, the axis across it and the direction of travel."""
    return grip.director, np.cross(grip.direction, grip.director), grip.direction


def add_tilts(scene: Scene, grip: Grip, end: str, ghost: int, stub: float, sections: Sequence[int] = ()) -> None:
    """Add the quantities `<end>_tilt_1` and `_2`, rad: small angles by which a rope leaves its grip askew.

    Args:
        end: name of the rope and of its end.
        ghost: the particle `stub` m along the rope that holds the direction.
        sections: normals of sections that turn along.
    """
    for k, axis in enumerate(axes_of(grip)[:2], start=1):
        tilt = scene.add_quantity(f"{end}_tilt_{k}", 0.0, "rad", positive=False, scale=0.1)
        for n, length in ((ghost, stub), *((n, 1.0) for n in sections)):
            add_motion(scene, grip, n, length * axis, {tilt: "identity"})


def add_shifts(scene: Scene, grip: Grip, end: str, nodes: Sequence[int]) -> None:
    """Add the quantities `<end>_shift_1` to `_3`, m: how far from the given place the held nodes are, along the frame's
    first and second axis and along the rope."""
    for k, axis in enumerate(axes_of(grip), start=1):
        shift = scene.add_quantity(f"{end}_shift_{k}", 0.0, "m", positive=False, scale=5e-3)
        for n in nodes:
            add_motion(scene, grip, n, axis, {shift: "identity"})


def spread_shift(scene: Scene, grip: Grip, end: str, nodes: Array, shares: Array) -> None:
    """Let nodes start shifted by shares of the shifts of a grip, so that no link is stretched in the first substep.

    Args:
        end: name of the rope and of its end, which the quantities have.
        nodes, shares: (k,).
    """
    for k, axis in enumerate(axes_of(grip), start=1):
        _move_start(scene, nodes, shares[:, None] * axis[0], f"{end}_shift_{k}")


class Lead:
    """A stretch of rope between a grip and the rope's first marker, whose length is not known exactly.

    The quantity `<end>_lead`, m, is that much more rope than given: the grip goes back along the rope by it, and the
    links between grip and marker are longer by equal shares. Markers keep their places. With dots for the links between

        grip . . . . first marker - - -      becomes      grip  .  .  .  .  first marker - - -

    Args:
        end: name of the rope and of its end.
        length: (m) from the grip to the first marker, as given.
        nodes: of the rope, from the held end on.
        link: m.

    Raises:
        SceneError: it is longer than the rope, or shorter than half a link.
    """

    def __init__(self, scene: Scene, end: str, grip: Grip, length: float, nodes: Array, link: float) -> None:
        self.count = round(length / link) if is_number(length) else 0
        if not 1 <= self.count < len(nodes):
            fix = f"give {0.5 * link:g} to {link * (len(nodes) - 1):g} m, or leave it out"
            raise SceneError(f"{end}_lead", "is not a part of the rope that has a link", length, fix)
        self.scene, self.grip, self.nodes = scene, grip, nodes
        given = self.count * link
        limits = (-SHORTEST * given, LONGEST * given)
        beyond = f"a lead of {given:.3g} m changes by no more: give the grip another `lead`, and fit again"
        self.quantity = scene.add_quantity(
            f"{end}_lead", 0.0, "m", positive=False, scale=0.5 * link, limits=limits, beyond=beyond
        )

    def hold(self, ghost: int, along: float) -> None:
        """Move the held node and its ghost, and let the links between start where they then are.

        Args:
            along: 1 at a rope's start, -1 at its end: the direction of travel, seen from the grip.
        """
        back = -along * self.grip.direction
        for n in (int(self.nodes[0]), ghost):
            add_motion(self.scene, self.grip, n, back, {self.quantity: "identity"})
        between = 1.0 - np.arange(1, self.count) / self.count
        if len(between):
            _move_start(self.scene, self.nodes[1 : self.count], between[:, None] * back[0], self.quantity)

    def lengthen(self, array: str, places: Array, factors: dict[str, str]) -> None:
        """Let what links (count,) or nodes (count + 1,) from the grip on have of an input array grow with their length.

        Args:
            places: in the array.
            factors: what a length is multiplied by.
        """
        shares = voronoi_shares(self.count) if len(places) > self.count else np.full(self.count, 1.0 / self.count)
        own = {self.quantity: "identity", **factors}
        self.scene.add_terms([product(array, k, share, own) for k, share in zip(places, shares, strict=True)])

    def soften(self, places: Array, values: Array, factors: dict[str, str], link: float) -> None:
        """Let damping that is inverse to lengths of links (count,) or nodes (count + 1,) from the grip on follow them.

        Args:
            places: in the input array "damping".
            values: what is there as given, but for its factors.
            link: m, as given.
        """
        growth = np.full(len(places), 1.0 / (self.count * link))  # of a length per meter of the lead's growth
        if len(places) > self.count:
            growth[-1] *= 0.5  # half of it is beyond the lead
        for power in range(1, SERIES + 1):  # 1/(1 + growth) - 1
            own = ((self.quantity, "identity"),) * (power % 2) + ((self.quantity, "square"),) * (power // 2)
            self.scene.add_terms([Term("damping", places, values * (-growth) ** power, (*factors.items(), *own))])


def add_motion(scene: Scene, grip: Grip, node: int, by: Array, factors: dict[str, str]) -> None:
    """Add `by` (knots, 3), times a product of functions of quantities, to what a grip makes of a held node."""
    if not grip.stays:
        add_motion_in_frame(scene, grip.frame, node, by, factors)
    else:
        scene.add_terms([product("position", 3 * node + k, by[0, k], factors) for k in range(3)])


def _move_start(scene: Scene, nodes: Array, by: Array, quantity: str) -> None:
    index = (3 * np.asarray(nodes)[:, None] + np.arange(3)).ravel()
    scene.add_terms([Term("position", index, by.ravel(), ((quantity, "identity"),))])
