"""A workload on this package's own solver: its loss and gradient through the compiled core.

The loss of a scene is half the sum of squared distances, over all frames and particles, to the trajectory of the
nominal scene at twice the stretch compliance, half the bend compliance and 1.2 times the mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from sheetbend.motion.solver import Solver
from sheetbend.scene.scene import Scene

from .workloads import GRAVITY, Array, Workload, colors, direction, pinned, projections, start

REFERENCE_FACTORS = np.array([2.0, 0.5, 1.2])  # of stretch, bend and mass


@dataclass(frozen=True)
class Gradient:
    """Value and gradient of the loss per scene.

    Attributes:
        loss: (scenes,) m^2.
        parameters: (scenes, 3) by stretch and bend compliance and mass.
        start: (scenes, particles, 3) by the initial positions, zero where pinned.
    """

    loss: Array
    parameters: Array
    start: Array

    def numbers(self, along: Array) -> Array:
        """By the three parameters and along a direction (particles, 3) of the start: (scenes, 4)."""
        return np.column_stack([self.parameters, np.tensordot(self.start, along, axes=2)])


def build(w: Workload) -> Scene:
    """One scene; every color is a constraint group of its own, so that sweeps keep the workload's order."""
    scene = Scene(w.name, gravity=(0.0, GRAVITY, 0.0))
    scene.add_particles(start(w), w.mass / w.particles)
    scene.pin(pinned(w))
    for k, c in enumerate(colors(w)):
        compliance = np.full(len(c.rest), w.bend if c.bend else w.stretch)
        scene.add_constraints("distance", c.particles, name=f"color{k}", compliance=compliance, rest=c.rest)
    return scene.freeze()


class Problem:
    """A workload, compiled.

    Attributes:
        workload: what it runs.
        projections: per call of `forward` (and of the forward part of `gradient`).
        colors: of the compiled solver.
    """

    def __init__(self, w: Workload, threads: int = 1) -> None:
        self.workload, self.projections = w, projections(w)
        self._compiled = build(w).compiled
        self._solver = Solver(
            h=w.h, integrator="bdf1", method="gauss_seidel", iterations=w.iterations, threads=threads
        ).core(self._compiled)
        self.colors: int = self._solver.colors
        self._bend = np.concatenate([np.full(len(c.rest), c.bend) for c in colors(w)])
        self._inputs = self._at(w.parameters)
        self._target = self._simulate(self._at(REFERENCE_FACTORS * w.nominal[None]))[0]

    @property
    def target(self) -> Array:
        """The trajectory that the loss compares with, (frames, particles, 3) m."""
        return self._target.reshape(self.workload.frames, -1, 3)

    def export(self, path: Path) -> None:
        """Write what another simulator needs to run the same workload, as NPZ.

        links (count, 2) in sweep order, first_of_color (colors + 1,), rest (count,), bend (count,) 0 or 1,
        start (particles, 3), inverse_mass_factor (particles,), which divided by M is the inverse mass, gravity (3,),
        target (frames, particles, 3), parameters (scenes, 3), direction (particles, 3), and frames, substeps,
        iterations, h. Particles stand row by row, columns to a row.
        """
        w, found = self.workload, colors(self.workload)
        factor = np.full(w.particles, float(w.particles))
        factor[pinned(w)] = 0.0
        np.savez(
            path,
            links=np.concatenate([c.particles for c in found]),
            first_of_color=np.cumsum([0] + [len(c.rest) for c in found]),
            rest=np.concatenate([c.rest for c in found]),
            bend=self._bend.astype(int),
            start=start(w),
            inverse_mass_factor=factor,
            gravity=np.array([0.0, GRAVITY, 0.0]),
            target=self.target,
            parameters=w.parameters,
            direction=direction(w),
            columns=w.columns,
            frames=w.frames,
            substeps=w.substeps,
            iterations=w.iterations,
            h=w.h,
        )

    def forward(self) -> Array:
        """Loss per scene, (scenes,)."""
        return _loss(self._residual(self._simulate(self._inputs)))

    def gradient(self) -> Gradient:
        """Loss and gradient per scene."""
        w, steps = self.workload, self.workload.steps
        if w.scenes == 1:
            states, tape = self._solver.record(self._inputs[0], steps, 0.0)
            residual = self._residual(states[None])
            bar = self._solver.vjp(self._inputs[0], tape, steps, residual[0], 0.0)[None]
            return Gradient(_loss(residual), *self._by_parameter(bar))
        misfit, bar = self._solver.misfit_batch(self._inputs, steps, self._target, 0.0)
        return Gradient(misfit, *self._by_parameter(bar))

    def complex_step(self, scene: int) -> Array:
        """The four numbers of one scene by complex step: (4,); an independent path, several times slower."""
        w = self.workload
        inputs = self._inputs[scene]
        residual = self._residual(self._simulate(inputs[None]))[0]
        directions = np.zeros((4, len(inputs)))
        compliance, mass = self._part(directions, "compliance"), self._part(directions, "mass")
        compliance[0, ~self._bend], compliance[1, self._bend] = 1.0, 1.0
        mass[2] = 1.0 / w.particles
        self._part(directions, "position")[3] = direction(w).ravel()
        along = [self._solver.complex_step(inputs, d, w.steps, 0.0) for d in directions]
        return np.array([np.vdot(residual, x_dot) for x_dot in along])

    def _simulate(self, inputs: Array) -> Array:
        """Positions, (scenes, frames, 3 particles) m."""
        if len(inputs) == 1:
            return self._solver.states(inputs[0], self.workload.steps, 0.0)[None]
        return self._solver.simulate_batch(inputs, self.workload.steps, 0.0)

    def _residual(self, positions: Array) -> Array:
        return np.subtract(positions, self._target, out=positions)

    def _at(self, parameters: Array) -> Array:
        """Flat inputs at (scenes, 3) parameters."""
        inputs = np.tile(self._compiled.inputs(), (len(parameters), 1))
        stretch, bend, mass = (p[:, None] for p in parameters.T)
        self._part(inputs, "compliance")[:] = np.where(self._bend, bend, stretch)
        self._part(inputs, "mass")[:] = mass / self.workload.particles
        return inputs

    def _part(self, flat: Array, array: str) -> Array:
        offset, size = self._compiled.layout[array]
        return flat[:, offset : offset + size]

    def _by_parameter(self, bar: Array) -> tuple[Array, Array]:
        w = self.workload
        free = np.ones(w.particles, dtype=bool)
        free[pinned(w)] = False
        compliance, mass = self._part(bar, "compliance"), self._part(bar, "mass")
        parameters = [
            compliance[:, ~self._bend].sum(axis=1),
            compliance[:, self._bend].sum(axis=1),
            mass[:, free].sum(axis=1) / w.particles,
        ]
        return np.column_stack(parameters), self._part(bar, "position").reshape(w.scenes, -1, 3) * free[:, None]


def _loss(residual: Array) -> Array:
    """(scenes,), without a copy of the residuals. A dot product would wake BLAS threads, which spin beside ours."""
    flat = residual.reshape(len(residual), -1)
    return 0.5 * np.einsum("ij,ij->i", flat, flat)
