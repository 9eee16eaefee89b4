"""The balloon of O-35: a sphere of a St. Venant-Kirchhoff membrane, whose tension carries p = 2 sigma/R."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.mesh import icosphere

YOUNG, POISSON, RADIUS, STRETCH = 100.0, 0.3, 0.1, 1.2  # N/m, m
SHEAR = YOUNG / (2 * (1 + POISSON))
PRESSURE = YOUNG * (STRETCH**2 - 1) / ((1 - POISSON) * STRETCH * RADIUS)


def skin(subdivisions: int, stretch: float) -> tuple[sb.Scene, np.ndarray]:
    """Its isotropic skin with drag, that nothing holds, and its triangles (n, 3) of particles."""
    scene = sb.Scene("balloon", gravity=(0, 0, 0))
    mesh = icosphere(RADIUS, subdivisions)
    cloth = sb.add_cloth(
        scene,
        mesh,
        density=0.2,
        warp=YOUNG,
        shear=SHEAR,
        poisson=POISSON,
        drag_linear=40.0,
        positions=stretch * mesh.vertices,
    )
    return scene, cloth.particles[mesh.triangles]


def held(scene: sb.Scene, particles: list[int]) -> sb.Scene:
    """The same, held in place so softly that no shape feels it."""
    anchors = scene.add_particles(scene.positions[particles], 1.0)
    scene.pin(anchors)
    scene.add_constraints("attachment", np.column_stack([particles, anchors]), compliance=1e7, name="hold")
    return scene


def expect_bits_of_a_loop(scene, times, solver, volume):
    """Batches over a kept volume, in torch, are what each scene is alone, with its gradient."""
    torch = pytest.importorskip("torch")
    st = pytest.importorskip("sheetbend.torch")
    batch = (volume * torch.linspace(0.9, 1.2, 10, dtype=torch.float64)).requires_grad_()
    x = st.simulate(scene, times, solver, values={"cloth_volume": batch})
    weights = torch.linspace(-1.0, 1.0, x[0].numel(), dtype=torch.float64).reshape(x[0].shape)
    (bars,) = torch.autograd.grad((x * weights).sum(), batch)
    for one, x_of_one, bar in zip(batch.tolist(), x, bars, strict=True):
        run = sb.rollout(scene, times, solver, {"cloth_volume": one})
        assert (run.positions == x_of_one.detach().numpy()).all()
        assert run.gradient(weights.numpy()).quantities["cloth_volume"] == float(bar)
