"""The joints of a rope: bending, and the curvature at rest in the rope's plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.checks import is_list, is_number
from ..arrays.types import Array
from ..errors import SceneError
from ..quantities.quantities import Term, product
from ..scene.scene import Scene
from .along_rope import mode_quantities, softness_field
from .chain import TimeConstant, voronoi_shares
from .rope_grips import Chain
from .stiffness_field import StiffnessField


def check_modes(
    name: str,
    EI: float | None,
    normal: Array | None,
    modes: Sequence[int],
    softness_modes: Sequence[int],
    clamp_angles: bool,
) -> None:
    """Raises SceneError where the modes of a rest curvature are no whole numbers, where nothing bends, and where the
    normal of the plane is missing that they and angles of clamps turn about."""
    if not is_list(modes) or any(not is_number(k) or k != int(k) or k < 0 for k in modes):
        raise SceneError(f"{name}.set_modes", "must be whole numbers from 0 on", modes, "give such as (0, 1)")
    if normal is None and (clamp_angles or len(modes)):
        fix = "give the unit normal that the clamp angles or the set turn about"
        raise SceneError(f"{name}.plane", "is missing", None, fix)
    if len(modes) and EI is None:
        raise SceneError(f"{name}.set_modes", "need EI", EI, "give EI: a rest curvature acts through bending")
    if EI is None and np.size(softness_modes):
        raise SceneError(f"{name}.softness_modes", "need EI", EI, "give EI, or leave them out")


def add_joints(
    scene: Scene,
    rope: Chain,
    EI: float,
    damping: TimeConstant | None,
    normal: Array | None,
    modes: Sequence[int],
    softness_modes: Sequence[int],
) -> StiffnessField | None:
    """Let a rope bend at its inner nodes and clamped ends; alpha = Voronoi length / EI.

    A clamped end counts the rope's own half link.

    Args:
        EI: bending stiffness N m^2, the new quantity `<rope>_EI`.
        damping: Kelvin-Voigt time constant; None = undamped.
        normal: (3,) unit normal of the plane of the rest curvature.
        modes: k of the modes cos(k pi s / length) of the rest curvature, new quantities `<rope>_set_<k>` 1/m.
        softness_modes: k of the same modes of the logarithm of the compliance, new quantities `<rope>_softness_<k>`.

    Returns:
        The field of EI, where these make one (`softness_field`).

    Raises:
        SceneError: a rope without a joint, or modes that are none.
    """
    name, nodes, arc = rope.name, rope.particles, rope.arc_length
    before, behind = ([] if ghost is None else [ghost] for ghost in (rope.start_ghost, rope.end_ghost))
    chain = [*before, *nodes, *behind]
    at = [*([0] if before else []), *range(1, len(nodes) - 1), *([len(nodes) - 1] if behind else [])]
    if not at:
        raise SceneError(f"{name}.segments", "leave no joint to bend", len(nodes) - 1, "use at least 2 segments")
    group, length, ones = f"{name}_bend", f"{name}_length", np.ones(len(at))
    scene.add_constraints(
        "planar_bend" if len(modes) else "bend",
        np.array([chain[i : i + 3] for i in range(len(chain) - 2)]),
        name=group,
        compliance=ones,
        damping=None if damping is None else 0.0 * ones,
        normal=normal if len(modes) else None,
    )
    places = scene.places_of_group(group)
    places.group.compliance[:] = 0.0
    share = voronoi_shares(len(nodes) - 1)
    stiffness = scene.add_quantity(f"{name}_EI", EI, "N m^2")
    s = np.array(at) / (len(nodes) - 1)
    softer = mode_quantities(scene, name, "softness", softness_modes, s)
    joints = places.constraints
    terms = [Term("compliance", joints, share[at], ((length, "identity"), (stiffness, "inverse")), tuple(softer))]
    if damping is not None:
        scale, tau = damping
        factors = (*tau.items(), (stiffness, "identity"), (length, "inverse"))
        stiffer = tuple((mode, -weights) for mode, weights in softer)
        terms.append(Term("damping", joints, scale / share[at], factors, stiffer))
    rest = places.rest
    for k in modes:
        mode = scene.add_quantity(f"{name}_set_{k}", 0.0, "1/m", positive=False, scale=1.0 / arc[-1])
        terms += [
            product(
                "rest",
                rest[i, 3],
                share[node] * np.cos(k * np.pi * arc[node] / arc[-1]),
                {length: "identity", mode: "identity"},
            )
            for i, node in enumerate(at)
        ]
    scene.add_terms(terms)
    return softness_field(name, softness_modes, s, float(arc[-1]))
