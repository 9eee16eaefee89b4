"""Types of the compiled module: the core, its adjoint and the least-squares evaluation. Arrays are C-contiguous
float64."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

class Diverged(RuntimeError):
    """A state that is not finite or means nothing, or a gradient that grew beyond meaning."""

    substep: int
    time: float
    particle: int
    seen: str  # of the particle, such as "is not finite"

class Unconverged(RuntimeError):
    """Conjugate gradients ran out of iterations."""

    iterations: int
    residual: float

class Unbalanced(Unconverged):
    """The forces of an implicit substep do not balance."""

    problem: str
    fix: str
    substep: int
    particle: int
    time: float

class NoEquilibrium(RuntimeError): ...

class BudgetTooSmall(ValueError):
    """A gradient needs more memory than its budget."""

    needed: int  # bytes

def constraint_kinds() -> dict[str, dict[str, Any]]: ...
def rest_values(kind: str, x: ArrayLike) -> Array: ...
def instruction_set() -> str: ...
def compiled_instruction_sets() -> list[str]: ...

class Scene:
    def __init__(
        self,
        *,
        particles: int,
        directors: Sequence[tuple[int, int, int, int]],
        pinned: Sequence[int],
        driven: Sequence[int],
        boundary_times: Sequence[float],
        boundary_interpolation: str,
        loaded: Sequence[int],
        force_times: Sequence[float],
        has_drag: bool,
        air: Sequence[Sequence[int]],
        wind_times: Sequence[float],
        groups: Sequence[Mapping[str, Any]],
        volumes: Sequence[Mapping[str, Any]],
        colliders: Sequence[Mapping[str, Any]],
        contacts: Sequence[Mapping[str, Any]],
    ) -> None: ...
    @property
    def layout(self) -> dict[str, tuple[int, int]]: ...  # array name -> (offset, size) in the flat inputs
    @property
    def inputs(self) -> int: ...
    @property
    def constraints(self) -> int: ...
    @property
    def rows(self) -> int: ...
    @property
    def dofs(self) -> int: ...
    # (particles, 4): gap and normal of a contact's particles at their initial positions
    def contact_gaps(self, inputs: Array, t: float, contact: int) -> Array: ...
    def pair_gaps(self, inputs: Array) -> tuple[Array, Array]: ...

class Tape:
    @property
    def bytes(self) -> int: ...
    @property
    def steps(self) -> int: ...
    @property
    def states(self) -> int: ...
    @property
    def recomputed(self) -> int: ...  # substeps that the last reverse advanced again

class Stepper:
    """Single substeps. States (batch, width), inputs (batch, total)."""

    def __init__(self, solver: Solver, held: Sequence[str] = ()) -> None: ...
    @property
    def width(self) -> int: ...
    def step(self, states: ArrayLike, inputs: ArrayLike) -> Array: ...  # (batch, width)
    def vjp(
        self, states: ArrayLike, inputs: ArrayLike, next: ArrayLike, next_bar: ArrayLike
    ) -> Array: ...  # (batch, width + total)
    def jvp(
        self, states: ArrayLike, inputs: ArrayLike, states_dot: ArrayLike, inputs_dot: ArrayLike
    ) -> Array: ...  # (batch, width)

class TapePlan:
    @property
    def steps(self) -> int: ...
    @property
    def states(self) -> int: ...
    @property
    def recomputed(self) -> int: ...
    # Bytes:
    @property
    def inputs(self) -> int: ...
    @property
    def frames(self) -> int: ...
    @property
    def plan(self) -> int: ...
    @property
    def forward(self) -> int: ...
    @property
    def reverse(self) -> int: ...
    @property
    def heap(self) -> int: ...
    @property
    def tape(self) -> int: ...
    @property
    def least(self) -> int: ...

class Solver:
    def __init__(
        self,
        *,
        scene: Scene,
        h: float,
        integrator: str,
        partition: str,
        iterations: int,
        force_tolerance: float,
        threads: int,
        grain: int,
        cg_tolerance: float,
        cg_iterations: int,
    ) -> None: ...
    def simulate(self, inputs: ArrayLike, steps: Sequence[int], t0: float) -> dict[str, Any]: ...
    def states(self, inputs: ArrayLike, steps: Sequence[int], t0: float) -> Array: ...  # (frames, dofs)
    def tape_plan(self, steps: Sequence[int], scenes: int = 1, memory: int | None = None) -> TapePlan: ...
    def record(
        self, inputs: ArrayLike, steps: Sequence[int], t0: float, memory: int | None = None
    ) -> tuple[Array, Tape]: ...  # (frames, dofs)
    def vjp(self, inputs: ArrayLike, tape: Tape, steps: Sequence[int], x_bar: ArrayLike, t0: float) -> Array: ...
    # the same, with the substeps that were computed again for it
    def reverse(
        self, inputs: ArrayLike, tape: Tape, steps: Sequence[int], x_bar: ArrayLike, t0: float
    ) -> tuple[Array, int]: ...
    def jvp(self, inputs: ArrayLike, inputs_dot: ArrayLike, steps: Sequence[int], t0: float) -> tuple[Array, Array]: ...
    def complex_step(self, inputs: ArrayLike, direction: ArrayLike, steps: Sequence[int], t0: float) -> Array: ...
    # per substep, per block: the force left at the start and after each Newton step, over the largest one
    def force_balance(self, inputs: ArrayLike, steps: int, t0: float) -> list[list[list[float]]]: ...
    def settled(self, inputs: ArrayLike, t0: float) -> Array: ...  # (dofs,) where a start that settles begins
    def redundant(self, inputs: ArrayLike, t0: float) -> str: ...  # rows that others say already, in words
    # the constraints of those and of the others; volumes count on behind the constraints
    def redundant_constraints(self, inputs: ArrayLike, t0: float) -> list[int]: ...
    # lengths: (batch,) frames of each scene, or none where all have every frame
    def simulate_batch(
        self, inputs: ArrayLike, steps: Sequence[int], t0: float, lengths: Sequence[int] = ()
    ) -> Array: ...  # (batch, frames, dofs)
    def vjp_batch(
        self,
        inputs: ArrayLike,
        steps: Sequence[int],
        x_bar: ArrayLike,
        t0: float,
        memory: int | None = None,
        lengths: Sequence[int] = (),
    ) -> Array: ...  # (batch, inputs)
    def jvp_batch(  # inputs_dot (batch, inputs)
        self, inputs: ArrayLike, inputs_dot: ArrayLike, steps: Sequence[int], t0: float, lengths: Sequence[int] = ()
    ) -> Array: ...  # (batch, frames, dofs)
    def vjp_dot_batch(
        self,
        inputs: ArrayLike,
        inputs_dot: ArrayLike,
        steps: Sequence[int],
        x_bar: ArrayLike,
        x_bar_dot: ArrayLike,
        t0: float,
        memory: int | None = None,
        lengths: Sequence[int] = (),
    ) -> Array: ...  # (batch, inputs)
    def misfit_batch(  # targets (batch, frames, dofs) or (frames, dofs)
        self,
        inputs: ArrayLike,
        steps: Sequence[int],
        targets: ArrayLike,
        t0: float,
        memory: int | None = None,
        lengths: Sequence[int] = (),
    ) -> tuple[Array, Array]: ...  # (batch,), (batch, inputs)
    @property
    def blocks(self) -> list[tuple[int, int, bool]]: ...  # rows, half bandwidth, banded
    @property
    def colors(self) -> int: ...

class EquilibriumSolution:
    @property
    def positions(self) -> Array: ...  # (dofs,)
    @property
    def multipliers(self) -> Array: ...  # (rows + volumes,)
    @property
    def energy(self) -> float: ...
    @property
    def residual(self) -> float: ...
    @property
    def iterations(self) -> int: ...
    @property
    def unstable_modes(self) -> int: ...
    @property
    def converged(self) -> bool: ...
    @property
    def message(self) -> str: ...
    @property
    def redundant(self) -> str: ...  # rows that others say already, in words
    def vjp(self, x_bar: ArrayLike | None = None, lambda_bar: ArrayLike | None = None) -> Array: ...

def equilibrium(
    scene: Scene, inputs: ArrayLike, start: ArrayLike | None = None, stable: bool = True
) -> EquilibriumSolution: ...
def equilibria(  # inputs (batch, total)
    scene: Scene, inputs: ArrayLike, start: ArrayLike | None = None, stable: bool = True, threads: int = 1
) -> list[EquilibriumSolution]: ...
def equilibria_vjp(  # bar (batch, dofs + rows + volumes)
    solutions: Sequence[EquilibriumSolution], bar: ArrayLike, threads: int = 1
) -> Array: ...  # (batch, inputs)
def equilibria_jvp(  # inputs_dot (batch, inputs)
    solutions: Sequence[EquilibriumSolution], inputs_dot: ArrayLike, threads: int = 1
) -> Array: ...  # (batch, dofs + rows + volumes)
def evaluate_constraints(
    scene: Scene, inputs: ArrayLike, positions: ArrayLike, multipliers: ArrayLike
) -> tuple[Array, Array]: ...

class ParameterMap:
    def __init__(self, arg0: Mapping[str, Any], /) -> None: ...
    def inputs(self, arg0: ArrayLike, /) -> Array: ...
    def inputs_dot(self, arg0: ArrayLike, arg1: ArrayLike, /) -> Array: ...
    def theta_bar(self, arg0: ArrayLike, arg1: ArrayLike, /) -> Array: ...
    def theta_bar_dot(
        self, arg0: ArrayLike, arg1: ArrayLike, arg2: ArrayLike, arg3: ArrayLike, /
    ) -> tuple[Array, Array]: ...

class Problem:
    def __init__(
        self,
        *,
        experiments: Sequence[Mapping[str, Any]],
        theta: ArrayLike,
        slots: Sequence[Sequence[int]],
        free: Sequence[Mapping[str, Any]],
        threads: int,
    ) -> None: ...
    @property
    def rows(self) -> int: ...
    @property
    def data_rows(self) -> int: ...
    @property
    def first_rows(self) -> list[int]: ...
    @property
    def parameters(self) -> int: ...
    @property
    def failure(self) -> str: ...
    def evaluate(self, u: ArrayLike, jacobian: bool = True) -> tuple[bool, Array, Array]: ...
    def physical(self, arg0: ArrayLike, /) -> Array: ...
    def simulate(self, arg0: int, arg1: ArrayLike, /) -> Array: ...
    def readings(self, arg0: int, arg1: ArrayLike, /) -> Array: ...  # of force sensors, (samples, 6)
    def respond(self, arg0: int, arg1: ArrayLike, arg2: ArrayLike, /) -> Array: ...
    def reduced(self, arg0: ArrayLike, /) -> Array: ...  # a change of the data's residuals, less what corrections take
    def correction(self, arg0: int, /) -> Array: ...
    def absorbed(self, arg0: int, /) -> float: ...
    def relinearize(self) -> None: ...
    def follow(self, other: Problem) -> None: ...  # corrections begin where those of the other ended
    def state(self) -> Array: ...  # what evaluations depend on besides u; empty where no correction is estimated
    def restore(self, arg0: ArrayLike, /) -> None: ...
    def evaluation(self) -> object: ...  # a capsule for _ceres.minimize

def evaluation_of(  # the same of (u, jacobian) -> ((ok, residuals, Jacobian), seconds or None)
    rows: int,
    parameters: int,
    function: Callable[[Array, bool], tuple[tuple[bool, Array, Array], float | None]],
    jacobian_along: bool = False,
) -> object: ...
