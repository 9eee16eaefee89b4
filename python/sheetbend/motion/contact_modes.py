"""Which contacts of a motion are open, stick or slide at some of its frames."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..scene.scene import Scene
from .simulate import Trajectory
from .solver import Solver

Array = np.ndarray
OPEN, STICKS, SLIDES = 0, 1, 2
RIGIDITY = 1e3  # N h^2/(kg m): stiffness of rigid contacts, as core/contact/law.h has it
AT_THE_CONE = 1e-6  # of Coulomb's limit: a tangential force so near it slides


def contact_modes(scene: Scene, motion: Trajectory, solver: Solver, values: Mapping[str, float]) -> dict[str, Array]:
    """For each contact of a motion, what its particles do at the frames.

    A particle touches where it lies inside the surface (by 1e-8 m under its weight), and slides where its tangential
    force is Coulomb's limit. With "bdf2", what slides in the substeps that went with BDF1 counts as sticking.

    Args:
        motion: of the scene with this solver, one run, and these values (of quantities that it changed, by name).

    Returns:
        By contact (frames, particles) of OPEN, STICKS and SLIDES. Particles that are held or driven are open.
    """
    compiled = scene.compiled
    inputs = compiled.inputs(compiled.values(values))
    arrays = compiled.unpack(inputs)
    first, size = compiled.layout["position"]
    eta = solver.h * (2.0 / 3.0 if solver.integrator == "bdf2" else 1.0)
    soft = iter(arrays["contact_stiffness"])
    held = np.array(sorted({*scene.pinned, *scene.boundary.driven}), dtype=int)
    found = {}
    for k, contact in enumerate(scene.contacts.contacts):
        mass = arrays["mass"][contact.particles]
        stiffness = RIGIDITY * mass / eta**2 if contact.rigid else np.full(len(mass), next(soft))
        limit = arrays["friction"][k] * stiffness
        modes = np.full((len(motion.times), len(mass)), OPEN)
        for frame, (t, x) in enumerate(zip(motion.times, motion.positions, strict=True)):
            inputs[first : first + size] = x.ravel()
            depth = -compiled.core.contact_gaps(inputs, t, k)[:, 0]
            force = np.linalg.norm(x[contact.carried], axis=1)
            modes[frame] = np.where(depth > 0.0, STICKS, OPEN)
            modes[frame][(depth > 0.0) & (force >= (1.0 - AT_THE_CONE) * limit * depth)] = SLIDES
        modes[:, np.isin(contact.particles, held)] = OPEN
        found[contact.name] = modes
    return found
