"""Static equilibrium of scenes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import check_kind, finite, is_number, is_several, numbers
from ..errors import NoEquilibriumError, SceneError, refusal
from ..scene.scene import Scene
from .core_terms import compiled_of, forces_by_group, over_all_nodes, pressures_by_volume, start_of
from .redundancy import warn_redundant

_FLAT = 1e-9  # of its extent: a sheet this near to a plane has no side to which it buckles


def no_rest(scene: Scene, problem: str, positions: np.ndarray) -> NoEquilibriumError:
    """What the core says ("problem. Fix: what to do") of a start (nodes, 3) m that leads to no rest."""
    flat = [name for name, cloth in scene.cloths.items() if _flat(positions[cloth.particles])]
    if flat:
        problem = (
            f"{problem.partition('. Fix: ')[0]}. Fix: start with {', '.join(flat)} bent a little. Exactly flat, and "
            "pressed together in its plane, nothing tells a sheet to which side it buckles. add_cloth takes such "
            "positions (mesh.through leads them through markers), and so do equilibrium (start=) and a configuration "
            '(shape = "recording"); or hold its supports as far apart as the sheet is wide'
        )
    return NoEquilibriumError(f"{scene.name}: {problem}")


def _flat(positions: np.ndarray) -> bool:
    sizes = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    return bool(sizes[2] <= _FLAT * sizes[0])


@dataclass(frozen=True)
class Equilibrium:
    """A state of rest.

    Attributes:
        positions: (particles, 3) m.
        nodes: (nodes, 3) m, the positions of all nodes, see `Trajectory.nodes`.
        forces: per group the multipliers (count, rows): minus the tension in N of a distance, minus the moment in N m
            of bending.
        energy: of weight, forces and strain, J; of several equilibria the lowest is the most stable one.
        unstable_modes: negative eigenvalues of the energy's Hessian; 0 = stable.
        residual: relative force imbalance.
        iterations: Newton matrices used.
        pressures: per volume that is kept its multiplier, Pa, inside above outside.
    """

    nodes: np.ndarray
    forces: Mapping[str, np.ndarray]
    energy: float
    unstable_modes: int
    residual: float
    iterations: int
    solution: _core.EquilibriumSolution = field(repr=False)
    scene: Scene = field(repr=False)
    theta: np.ndarray = field(repr=False)
    pressures: Mapping[str, float] = field(default_factory=dict)

    @property
    def positions(self) -> np.ndarray:
        """(particles, 3) m."""
        return self.nodes[: self.scene.particle_count]

    def gradient(
        self,
        positions_bar: ArrayLike | None = None,
        forces_bar: Mapping[str, ArrayLike] | None = None,
        pressures_bar: Mapping[str, float] | None = None,
    ) -> dict[str, float]:
        """Gradient of a loss with respect to every named quantity, by the implicit function theorem.

        Args:
            positions_bar: (particles, 3), derivative of the loss with respect to the positions, or (nodes, 3) with
                respect to those of all nodes.
            forces_bar: per group (count, rows), derivative with respect to `forces`.
            pressures_bar: per volume, derivative with respect to `pressures`.

        Raises:
            SceneError: wrong shapes, no such group or volume.
            NoEquilibriumError: the derivative is not unique there.
        """
        return self.by_name(self.input_gradient(positions_bar, forces_bar, pressures_bar))

    def input_gradient(
        self,
        positions_bar: ArrayLike | None = None,
        forces_bar: Mapping[str, ArrayLike] | None = None,
        pressures_bar: Mapping[str, float] | None = None,
    ) -> np.ndarray:
        """Gradient of a loss with respect to the flat inputs (`CompiledScene.inputs`), which include places and rest
        geometry.

        Args:
            positions_bar, forces_bar, pressures_bar: as for `gradient`.

        Returns:
            (inputs,), in the layout of `CompiledScene.layout`.

        Raises:
            SceneError: wrong shapes, no such group or volume.
            NoEquilibriumError: the derivative is not unique there.
        """
        x_bar = (
            None
            if positions_bar is None
            else over_all_nodes(
                numbers("positions_bar", positions_bar, SceneError),
                self.nodes.shape,
                self.scene.particle_count,
                SceneError,
            ).ravel()
        )
        if forces_bar is None and pressures_bar is None:
            return self._vjp(x_bar, None)
        lambda_bar = np.zeros(len(self.solution.multipliers))
        forces, pressures = forces_by_group(self.scene, lambda_bar), pressures_by_volume(self.scene, lambda_bar)
        for argument, bars in (("forces_bar", forces_bar), ("pressures_bar", pressures_bar)):
            check_kind(
                argument, {} if bars is None else bars, Mapping, "give a mapping from names to arrays", SceneError
            )
        for name, bar in (forces_bar or {}).items():
            self.scene.group(name)
            forces[name][...] = finite(f"forces_bar.{name}", bar, forces[name].shape, SceneError)
        for name, given in (pressures_bar or {}).items():
            if name not in pressures:
                raise SceneError(f"pressures_bar.{name}", "is not a volume", name, f"use one of {sorted(pressures)}")
            pressures[name][...] = finite(f"pressures_bar.{name}", given, (), SceneError)
        return self._vjp(x_bar, lambda_bar)

    def _vjp(self, x_bar: np.ndarray | None, lambda_bar: np.ndarray | None) -> np.ndarray:
        try:
            return self.solution.vjp(x_bar, lambda_bar)
        except _core.NoEquilibrium as error:
            raise NoEquilibriumError(f"{self.scene.name}: {error}") from error

    def by_name(self, inputs_bar: np.ndarray) -> dict[str, float]:
        """A gradient with respect to the named quantities from one by the flat inputs."""
        compiled = self.scene.compiled
        return dict(zip(compiled.names, compiled.theta_bar(self.theta, inputs_bar).tolist(), strict=True))


def equilibrium(
    scene: Scene, start: ArrayLike | None = None, values: Mapping[str, float] | None = None, stable: bool = True
) -> Equilibrium:
    """Find the equilibrium that a start leads to.

    Examples:
        >>> rest = sb.equilibrium(sb.rope(0.6, 20, density=0.05, EI=1e-3, clamp_start=(1, 0, 0)))
        >>> rest.unstable_modes  # 0: stable
        0

    Friction holds the points that touch their collider at the start: they stick, or slide to Coulomb's limit. What
    comes to touch later slides without friction, because nothing tells where it would have stuck. So let what is draped
    come to rest in a simulation, and start here where it ends.

    Args:
        scene: frozen by this call.
        start: (particles, 3) m, or (nodes, 3) m as of `simulate`, with the friction forces that act there; the scene's
            initial positions by default. Friction counts from there; gradients take a given start as constant.
        values: quantities to change, by name.
        stable: leave saddles; False goes to the nearest equilibrium whatever its stability.

    Raises:
        SceneError: the start has the wrong shape or leaves out hidden nodes that can move, or the forces of the scene
            have no energy, such as those of wind on triangles; still air leaves a scene at rest as it is.
        NoEquilibriumError: the solver did not converge; the message says how far it came and what to try.

    Warns:
        RedundantConstraintsWarning: some rigid constraints follow from others at rest.
    """
    compiled = compiled_of(scene)
    theta = compiled.values(values)
    inputs = compiled.inputs(theta)
    x = None if start is None else whole_start(scene, start, inputs)
    try:
        out = _core.equilibrium(compiled.core, inputs, x, stable)
    except ValueError as error:
        raise refusal(error, SceneError, scene.name) from error
    if not out.converged:
        raise no_rest(scene, out.message, scene.nodes if x is None else x.reshape(-1, 3))
    warn_redundant(scene.name, out.redundant)
    return Equilibrium(
        out.positions.reshape(-1, 3),
        forces_by_group(scene, out.multipliers),
        out.energy,
        out.unstable_modes,
        out.residual,
        out.iterations,
        solution=out,
        scene=scene,
        theta=theta,
        pressures={name: float(p) for name, p in pressures_by_volume(scene, out.multipliers).items()},
    )


def whole_start(scene: Scene, start: ArrayLike, inputs: np.ndarray, field: str = "start") -> np.ndarray:
    """(3 nodes,) m, positions where hidden nodes that they leave out are where the inputs have them."""
    x, own = scene.compiled.part(inputs, "position").copy(), start_of(scene, start, SceneError, field)
    x[: own.size] = own.ravel()
    return x


def equilibria(
    scene: Scene, starts: Iterable[ArrayLike], values: Mapping[str, float] | None = None, tolerance: float = 1e-6
) -> list[Equilibrium]:
    """Find the distinct equilibria that several starts lead to, lowest energy first.

    Starts that lead to no equilibrium are left out.

    Args:
        scene: frozen by this call.
        starts: positions to start from, each (particles, 3) or (nodes, 3) m, see `equilibrium`.
        values: quantities to change, by name.
        tolerance: m; two states count as one if no particle is farther apart than this.

    Raises:
        SceneError: as `equilibrium`.
    """
    if not is_several(starts):
        raise SceneError("starts", "must be a list", starts, "give a list of positions to start from")
    if not (is_number(tolerance) and tolerance >= 0):
        raise SceneError("tolerance", "must not be negative", tolerance, "give m")
    found: list[Equilibrium] = []
    for start in starts:
        try:
            e = equilibrium(scene, start, values)
        except NoEquilibriumError:
            continue
        if all(np.abs(e.positions - other.positions).max() > tolerance for other in found):
            found.append(e)
    return sorted(found, key=lambda e: e.energy)
