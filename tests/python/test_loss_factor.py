"""The loss factor of a rope: the damping ratio is the same at every frequency that is given as its reference."""

from __future__ import annotations

import numpy as np
import pytest
import sheetbend as sb
from sheetbend.doubts.floors import solver_floors
from sheetbend.experiment.wanted import as_parameters

LENGTH, DENSITY, EI = 0.1, 1.0, 0.02
FIRST = 3.51601526 / (2 * np.pi * LENGTH**2) * np.sqrt(EI / DENSITY)  # Hz, of a cantilever


def damping_ratio(frequency: float, eta: float, EI: float) -> float:
    """Of the first mode of a cantilever without gravity, from the logarithmic decrement of its tip."""
    scene = sb.Scene("cantilever", gravity=(0, 0, 0))
    shape = [(x, 0.0, 1e-3 * (x / LENGTH) ** 2) for x in np.linspace(0, LENGTH, 13)]
    stiffness = {"density": DENSITY, "EA": 1e4 * EI, "EI": EI, "loss_factor": eta, "loss_frequency": frequency}
    beam = sb.add_rope(scene, "beam", points=shape, length=LENGTH, segments=12, clamp_start=(1, 0, 0), **stiffness)
    h = 1.0 / (400.0 * frequency)
    tip = sb.simulate(scene, h * np.arange(2000), sb.Solver(h=h)).positions[:, beam.particles[-1], 2]
    peaks = [tip[k] for k in range(200, 1999) if tip[k - 1] < tip[k] >= tip[k + 1]]
    decrement = np.log(peaks[0] / peaks[2]) / 2
    return float(decrement / np.hypot(2 * np.pi, decrement))


@pytest.mark.parametrize("stiffer", [1.0, 4.0])
def test_damping_ratio_is_half_the_loss_factor(stiffer: float) -> None:
    assert damping_ratio(FIRST * np.sqrt(stiffer), 0.1, stiffer * EI) == pytest.approx(0.05, rel=0.03)


def test_it_is_a_time_constant() -> None:
    """tau = loss_factor / (2 pi f) in stretching and in bending."""
    with_loss = sb.rope(1.0, 4, density=0.1, EA=50.0, EI=1e-3, loss_factor=0.2, loss_frequency=5.0)
    tau = 0.2 / (2 * np.pi * 5.0)
    with_tau = sb.rope(1.0, 4, density=0.1, EA=50.0, EI=1e-3, stretch_damping=tau, bend_damping=tau)
    np.testing.assert_allclose(with_loss.compiled.inputs(), with_tau.compiled.inputs(), rtol=1e-13)


def test_backward_euler_sets_its_floor() -> None:
    """BDF1 damps like a loss factor of 2 pi f h."""
    scene = sb.rope(1.0, 4, density=0.1, EA=50.0, EI=1e-3, loss_factor=0.2, loss_frequency=5.0)
    motion = sb.Recording(positions=np.tile(scene.positions, (3, 1, 1)), times=np.arange(3) / 100, name="still")
    for integrator, floor in (("bdf1", 2 * np.pi * 5.0 * 0.001), ("bdf2", None)):
        e = sb.Experiment(scene=scene, recording=motion, solver=sb.Solver(h=0.001, integrator=integrator))
        found = solver_floors([e], as_parameters(["rope_loss_factor"], [e]))
        assert (found["rope_loss_factor"].value if found else None) == (None if floor is None else pytest.approx(floor))
