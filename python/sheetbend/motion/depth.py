"""How deep particles were in the shapes that they touch, at the frames of a motion.

A rigid contact is a spring, as stiff as masses and substeps allow, and stands for a surface that does not yield: a
particle at rest is h^2 g/1000 deep, and after an impact speed h/1000. What is pressed in with thousands of times its
weight is not held, and lies where no surface is. A soft contact is to yield, as far as its stiffness says.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..arrays.types import Array
from ..quantities.wording import short
from ..scene.compiled import CompiledScene
from ..scene.scene import Scene
from .contact_counts import ContactMode

SHARE = 0.1  # of its radius, that a rigid contact may yield
UNSEEN = 1e-4  # m, that it may yield where its radius is smaller: what recordings of markers do not show


def deepest(
    scene: CompiledScene, inputs: Array, times: Array, states: Array, modes: Mapping[str, Array]
) -> dict[str, float]:
    """The largest depth [m] of the particles of each contact that touched in the substep before a frame; 0 where none
    did.

    Args:
        inputs: flat, of the motion.
        times: (frames,) s.
        states: (frames, coordinates) of all nodes.
        modes: by contact (frames, particles), see `ContactMode`.
    """
    at = inputs.copy()
    positions, found = scene.part(at, "position"), {}
    for k, (name, mode) in enumerate(modes.items()):
        touched = mode != ContactMode.APART
        found[name] = 0.0
        for frame in np.flatnonzero(touched.any(axis=1)):
            positions[:] = states[frame]
            gaps = scene.core.contact_gaps(at, float(times[frame]), k)[:, 0]
            found[name] = max(found[name], -float(gaps[touched[frame]].min()))
    return found


def too_deep(scene: Scene, values: Mapping[str, float] | None, depths: Mapping[str, float | None]) -> tuple[str, ...]:
    """Sentences on the rigid contacts in which particles were too deep.

    Args:
        values: quantities of the motion that differ from the scene's.
        depths: m, by contact, see `ContactCounts.deepest`.
    """
    compiled = scene.compiled
    radii = compiled.part(compiled.inputs(compiled.values(values)), "contact_radius")
    found = []
    for contact, radius in zip(scene.contacts.contacts, radii, strict=False):  # radii of pieces follow
        bound, depth = max(SHARE * float(radius), UNSEEN), depths.get(contact.name)
        if not contact.rigid or depth is None or depth <= bound:
            continue
        found.append(
            f"the contact '{contact.name}' does not hold what it touches: up to {short(1e3 * depth, 2)} mm deep, where "
            f"{short(1e3 * bound, 2)} mm are allowed. The motion is wrong there. Something presses it in, such as "
            "driven particles: let what is driven leave room, or shorten h of the solver, as half of it makes the "
            "contact 4 times stiffer"
        )
    return tuple(found)
