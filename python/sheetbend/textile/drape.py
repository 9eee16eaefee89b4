"""The drape test: a round piece of cloth hangs over a round plate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

import numpy as np

from ..arrays.checks import check_count, check_kind, check_positive, is_list, is_number
from ..arrays.types import Array
from ..errors import InputError, MeshError, NoEquilibriumError
from ..mesh import TriangleMesh, disk
from ..motion.equilibrium import Equilibrium, equilibrium
from ..objects.cloth import add_cloth
from ..objects.fabric import Fabric
from ..scene.colliders import Cylinder
from ..scene.scene import Scene
from .arguments import check_specimen
from .reading import Reading, combined
from .shadow import Shadow, shadow

_THICK, _RIM = 0.02, 1e-3  # m, of a plate that the cloth touches, and of its rounded edge
MOST_FOLDS = 1000
_SAME = 1e-6  # relative difference in energy below which two states are one, turned or mirrored


class Plates(TypedDict):
    """Options of `drape` that say what lies between which plates; a test of a laboratory hands them on together."""

    diameter: float
    plate: float
    friction: float | None
    cover: bool


@dataclass(frozen=True)
class DrapeState:
    """One of the shapes in which a cloth can rest.

    Attributes:
        coefficient: the drape coefficient.
        nodes: number of folds, the strongest wave of the shadow's outline.
        energy: of weight and strain, J.
        hidden: share of the outline where the cloth overhangs itself, see `Shadow`.
        rest: the cloth at rest, the plate's middle at the origin.
    """

    coefficient: Reading
    nodes: int
    energy: float
    hidden: float
    rest: Equilibrium


@dataclass(frozen=True)
class Drape:
    """Result of `drape`.

    Attributes:
        coefficient: of the state of the lowest energy.
        nodes: of the same.
        states: all that were found, lowest energy first.
        lost: starts that led to no rest.
    """

    coefficient: Reading
    nodes: int
    states: tuple[DrapeState, ...]
    lost: tuple[int, ...]


def drape(
    fabric: Fabric,
    *,
    diameter: float = 0.3,
    plate: float = 0.18,
    rings: int = 11,
    folds: Sequence[int] = (4, 5, 6, 7),
    friction: float | None = None,
    cover: bool = True,
) -> Drape:
    """The drape test of BS 5058 and ISO 9073-9, after Cusick (1965): 30 cm of cloth between plates of 18 cm.

    The drape coefficient is the part of the overhanging ring that the shadow covers; 24 and 36 cm are for limp and
    stiff cloths. A draped cloth has many states of rest, and each start with a number of folds leads to one. A
    laboratory sees one of those of low energy. They differ by several percent, like repeated tests. The derivative is
    that of a state as it deforms. Cloth does not touch cloth here: see `DrapeState.hidden`.

    Args:
        diameter, plate: of cloth and plates, m.
        rings: of the mesh's vertices between center and rim.
        folds: of the starts.
        friction: Coulomb's coefficient of the plates, which the cloth then touches. None = the cloth is held, flat and
            without slip, which moves the coefficient by at most 0.3 points (docs/fabric.md).
        cover: whether a second plate lies on the cloth, so that it cannot lift off the one below.

    Raises:
        MeshError: plates as large as the cloth, or a number of rings of which none fits the plates' edge.
        InputError: a friction that is not positive, or no cover on a cloth that is held.
        NoEquilibriumError: no start leads to a state of rest.
    """
    check_specimen("drape", fabric, {"diameter": diameter, "plate": plate}, rings)
    _check_plates(friction, cover)
    if not is_list(folds):
        raise InputError("drape.folds", "must be a list", folds, "give numbers of folds, such as (4, 5, 6, 7)")
    for count in folds:
        check_count("drape.folds", count, 1, MOST_FOLDS)
    states: list[DrapeState] = []
    lost = []
    for count in folds:
        scene = drape_scene(fabric, diameter, plate, rings)
        try:
            rest = equilibrium(scene, _folded(scene.cloths["cloth"].mesh, count))
            if friction is not None:
                rest = equilibrium(drape_scene(fabric, diameter, plate, rings, friction, cover), rest.positions)
            state = drape_state(rest, plate)
        except NoEquilibriumError:
            lost.append(count)
            continue
        if all(abs(state.energy - other.energy) > _SAME * abs(other.energy) for other in states):
            states.append(state)
    if not states:
        fix = "give more folds to start from, or refine the mesh"
        raise NoEquilibriumError(f"no start with {', '.join(map(str, folds))} folds led to a rest. Fix: {fix}")
    states.sort(key=lambda state: state.energy)
    return Drape(states[0].coefficient, states[0].nodes, tuple(states), tuple(lost))


def drape_scene(
    fabric: Fabric,
    diameter: float = 0.3,
    plate: float = 0.18,
    rings: int = 11,
    friction: float | None = None,
    cover: bool = True,
) -> Scene:
    """The cloth flat between its plates: held on them, or with a `friction` pinned in its middle alone. Friction counts
    from where an equilibrium starts, so start that of the second at rest of the first.

    Raises:
        MeshError: plates as large as the cloth, or a number of rings of which none fits the plates' edge.
        InputError: a friction that is not positive, or no cover on a cloth that is held.
    """
    check_specimen("drape", fabric, {"diameter": diameter, "plate": plate}, rings)
    _check_plates(friction, cover)
    mesh = _mesh(diameter / 2.0, plate / 2.0, rings)
    scene = Scene("drape")
    held = mesh.sets["support"]
    if friction is None:
        cloth = add_cloth(scene, mesh, held=held, **fabric.options())
        scene.pin(cloth.particles[held])
        return scene
    cloth = add_cloth(scene, mesh, **fabric.options())
    scene.pin(cloth.particles[mesh.sets["center"]])
    touching = np.delete(cloth.particles, mesh.sets["center"])
    flat = float(np.linalg.norm(mesh.vertices[held], axis=1).max())  # its outermost vertices lie on the plates yet
    for name, low in (("plate", -_THICK), ("cover", 0.0)) if cover else (("plate", -_THICK),):
        start, end = (0.0, 0.0, low), (0.0, 0.0, low + _THICK)
        disk = Cylinder(start=start, end=end, radius=flat + _RIM, edge_radius=_RIM, name=name)
        scene.add_contact(touching, disk, friction=friction)
    return scene


def _check_plates(friction: float | None, cover: bool) -> None:
    if friction is None and not cover:
        raise InputError("cover", "is left out where the cloth is held", cover, "give the friction of the plate too")
    if friction is not None and not (is_number(friction) and friction > 0.0):
        problem = "must be positive, because nothing else keeps the cloth from turning"
        raise InputError("friction", problem, friction, "give Coulomb's coefficient, such as 0.3")


def _mesh(radius: float, plate: float, rings: int) -> TriangleMesh:
    """A clamp acts in the middle between the outermost held ring and the next inside: the plates' edge is put there."""
    held_at = plate * (1.0 + 0.5 / max(1, round(rings * plate / radius)))
    for _ in range(6):
        mesh = disk(radius, rings, support=held_at)
        held = np.sort(np.linalg.norm(mesh.vertices[mesh.sets["support"]], axis=1))
        inner = round((math.sqrt(12.0 * len(held) - 3.0) - 3.0) / 6.0)  # 3 inner (inner + 1) + 1 vertices
        gap = held[-1] - held[-6 * inner - 6 * (inner - 1) : -6 * inner].mean()
        off = held[-1] - gap / 2.0 - plate
        if abs(off) < 2e-3 * plate:
            return mesh
        held_at -= off
    fix = "give one more or one less"
    raise MeshError("rings", "put none where the plates' edge needs one", rings, fix)


def drape_state(rest: Equilibrium, plate: float = 0.18) -> DrapeState:
    """What a laboratory reads off a state of rest of `drape_scene`.

    Raises:
        InputError: no state of rest, or a plate that is none.
    """
    check_kind("rest", rest, Equilibrium, "give sb.equilibrium(drape_scene(fabric))")
    check_positive("drape_state", {"plate": plate}, {})
    cloth = rest.scene.cloths["cloth"]
    flat = _shadow(cloth.mesh, cloth.mesh.vertices)
    seen = _shadow(cloth.mesh, rest.positions[cloth.particles])
    covered = math.pi * plate**2 / 4.0
    ring = flat.area - covered
    bar = np.zeros_like(rest.positions)
    bar[cloth.particles] = seen.area_bar / ring
    places = tuple(f"{name}_{axis}" for name in rest.scene.contacts.colliders for axis in "xyz")
    gradient = combined((1.0, rest.gradient(bar)), leave=places)
    coefficient = Reading((seen.area - covered) / ring, "", gradient, "%", 100.0)
    return DrapeState(coefficient, seen.nodes, rest.energy, seen.hidden, rest)


def _shadow(mesh: TriangleMesh, positions: Array) -> Shadow:
    return shadow(positions, mesh.edges, mesh.sets["rim"])


def _folded(mesh: TriangleMesh, folds: int) -> Array:
    """(vertices, 3) m: the overhanging ring bent down by 20 to 80 degrees, `folds` times around."""
    x, y, _ = mesh.vertices.T
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    held = radius[mesh.sets["support"]].max()
    hanging = np.maximum(radius - held, 0.0)
    slope = np.radians(50.0 + 30.0 * np.cos(folds * angle))
    out = np.minimum(radius, held) + hanging * np.cos(slope)
    return np.column_stack([out * np.cos(angle), out * np.sin(angle), -hanging * np.sin(slope)])
