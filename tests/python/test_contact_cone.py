"""Contacts of all particles in all substeps: nothing pulls, and friction is at most Coulomb's."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import equilateral

Array = np.ndarray


N = np.array([0.1, 0.05, 1.0]) / np.linalg.norm([0.1, 0.05, 1.0])


def thrown_at_a_slope(what: str, friction: float) -> tuple[sb.Scene, Array]:
    """Points, a rope or a cloth, and how far each particle is from touching when its place is multiplied by N, m."""
    scene, radius = sb.Scene("thrown"), 0.004
    aside = np.array([0.5, -0.2, -1.0])
    if what == "points":
        thing: object = scene.add_particles([[0, 0, 0.02], [0.05, 0, 0.04]], [0.02, 0.1], np.tile(aside, (2, 1)))
    elif what == "rope":
        thing = sb.add_rope(
            scene, length=0.3, segments=10, density=0.05, EA=500.0, EI=1e-4, start=(0, 0, 0.03), direction=(1, 0, 0.3),
            velocity=np.tile(aside, (11, 1)),
        )  # fmt: skip
    else:
        mesh = equilateral(0.1, 0.1, 4)
        places = np.asarray(mesh.vertices) + np.array([0, 0, 0.03])
        thing = sb.add_cloth(
            scene, mesh, "cloth", positions=places, density=0.2, warp=100.0, shear=30.0,
            velocity=np.tile(aside, (len(places), 1)),
        )  # fmt: skip
    scene.add_contact(thing, sb.Plane(normal=N, name="slope"), friction=friction, radius=radius)
    return scene, radius


@pytest.mark.parametrize("method", ["implicit", "gauss_seidel"])
@pytest.mark.parametrize("integrator", ["bdf1", "bdf2"])
@pytest.mark.parametrize("what", ["points", "rope", "cloth"])
def test_contacts_never_pull_and_friction_stays_in_its_cone(what: str, integrator: str, method: str) -> None:
    """In every substep: the carried force is at most friction times the push of a rigid contact, 1000 m depth/h^2."""
    h, friction = 1e-3, 0.3
    scene, radius = thrown_at_a_slope(what, friction)
    solver = sb.Solver(h=h, method=method, integrator=integrator, **({} if method == "implicit" else {"iterations": 5}))
    motion = sb.simulate(scene, h * np.arange(150), solver)
    (contact,) = scene.contacts.contacts
    first = scene.compiled.layout["mass"][0]
    mass = scene.compiled.inputs()[first : first + scene.particle_count]
    depth = radius - motion.positions @ N
    push = 1000 * mass * np.maximum(0.0, depth) / h**2
    rounding = 1000 * mass * 1e-16 / h**2  # of the depth that positions tell, m
    rub = np.linalg.norm(motion.nodes[:, contact.carried], axis=2)
    assert (depth > 0).sum() > 100
    assert (rub <= friction * (push * (1 + 1e-9) + rounding)).all()
    slides = motion.contact_modes["slope"] == sb.ContactMode.SLIDES
    assert slides.sum() > 10
    assert (np.abs(rub - friction * push) <= friction * (1e-9 * push + rounding))[slides].all()
