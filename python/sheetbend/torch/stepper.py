"""One substep after the other: differentiable functions of a state, the scene's inputs and what acts meanwhile."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

from .. import _core
from ..errors import InputError
from ..motion.core_terms import divergence
from ..motion.rollouts import Rollouts
from ..motion.solver import Solver
from ..scene.given import check_scene
from ..scene.scene import Scene
from .compiled import not_traced
from .function import respond
from .inputs import NEEDS, InputMap, broadcast
from .state import State
from .substep import Core, take_substep

_MOTIONS = ("boundary", "force", "wind", "load")  # arrays over knots in time


class Stepper:
    """Simulates a scene one substep at a time, for networks, policies and controllers that act in between.

    ```python
    stepper = Stepper(scene, sb.Solver(h=1 / 240))
    state = stepper.start()
    for _ in range(200):
        state = stepper(state, force=network(state.positions, state.velocities))
    loss = (state.positions[-1] - target).square().sum()
    loss.backward()
    ```

    Single substeps give the bits of one `sheetbend.simulate` over the same inputs. Gradients are exact in reverse mode
    and in forward mode (tangents), with respect to the state, the scene's inputs and everything given for a substep.
    `torch.func.vmap`, `grad`, `vjp`, `jvp`, `jacrev` and `jacfwd` work; there are no second derivatives. A batch of
    states goes through the core in one call, eight scenes to a vector; its states may be at different substeps.
    Everything is computed in float64.

    A stepper can be copied and pickled, and so can be used in the workers of a DataLoader. Backward needs no memory but
    the states: about 100 bytes per node and substep.

    Args:
        scene: frozen by this call.
        solver: `Solver()` by default. Its `memory` has no meaning here.
        dtype: of the positions and velocities that states return. Tensors given to a stepper may have any floating
            type; the states themselves stay float64.

    Raises:
        InputError: `dtype` is no floating type.
    """

    def __init__(self, scene: Scene, solver: Solver | None = None, *, dtype: torch.dtype = torch.float64) -> None:
        if not isinstance(dtype, torch.dtype) or not dtype.is_floating_point:
            raise InputError("dtype", "must be a floating type of torch", dtype, "give torch.float64 or torch.float32")
        check_scene(scene)
        self.scene, self.solver, self.dtype = scene, Solver.given(solver), dtype
        compiled = scene.compiled
        self._layout, self._check = compiled.layout, compiled.domain.check_inputs
        self._map = InputMap(scene)
        self._default = torch.from_numpy(compiled.inputs())
        self._shapes = {
            name: tuple(shape[1:] if name in _MOTIONS else shape)
            for name, shape in compiled.shapes.items()
            if math.prod(shape)
        }
        self._solver_core = self.solver.core(compiled)
        self._steppers: dict[frozenset[str], Any] = {}
        self._cores: dict[tuple[str, ...], Core] = {}
        self._width = self._stepper(frozenset()).width

    def __reduce__(self) -> Any:
        return _again, (self.scene, self.solver, self.dtype)

    def __deepcopy__(self, memo: Any) -> Stepper:
        return Stepper(self.scene, self.solver, dtype=self.dtype)

    @not_traced
    def inputs(
        self, values: Mapping[str, Tensor | float] | None = None, inputs: Mapping[str, Tensor] | None = None
    ) -> Tensor:
        """All numbers of the scene, for `start` and for substeps: make them once and hand them to each substep.

        Args:
            values: quantities to change, by name: tensors (*batch,), or plain numbers.
            inputs: input arrays to replace, by name, (*batch, ...); see `sheetbend.torch.simulate`.

        Returns:
            (*batch, numbers) float64, differentiable.

        Raises:
            InputError: unknown names, wrong shapes, or values outside their range.
        """
        wide = {name: v.double() if isinstance(v, Tensor) else v for name, v in (values or {}).items()}
        return self._map(wide, {name: array.double() for name, array in (inputs or {}).items()})

    @not_traced
    def start(self, inputs: Tensor | None = None) -> State:
        """The scene's initial state, at substep 0.

        Args:
            inputs: (*batch, numbers) of `inputs`; the scene's own by default.
        """
        flat = self._default if inputs is None else inputs
        if flat.shape[-1:] != self._default.shape:
            raise _wrong_inputs(flat)
        rows = flat.reshape(-1, flat.shape[-1])
        first = Rollouts(self.scene, self._solver_core, [0], False, self.solver)
        x = respond(first, rows).reshape(*flat.shape[:-1], -1)
        offset, size = self._layout["velocity"]
        v = flat[..., offset : offset + size]
        return self._state(torch.cat([x, x, v, v, x.new_zeros(*x.shape[:-1], 2)], -1))

    @not_traced
    def __call__(self, state: State, inputs: Tensor | None = None, **given: Tensor) -> State:
        """The state a substep later.

        Args:
            state: of `start` or of a substep before.
            inputs: (*batch, numbers) of `inputs`; the scene's own by default.
            given: arrays for this substep alone, by name, (*batch, ...). Those over time have no knots here: "force"
                (loaded, 3) N and "load" (loads,) act during the substep, "wind" (3,) m/s blows during it, and
                "boundary" (driven, 3) m is where driven particles are at its end. Others as in
                `sheetbend.torch.simulate`, such as "gravity" (3,) and "pressure" (triangles in air,).
                "position" and "velocity" belong to the start and are refused.

        Raises:
            InputError: an unknown array, one of the wrong shape, values outside their range, a state of another scene.
            DivergenceError: the next state is not finite. A simulation also notices finite states that no energy
                explains; a stepper does not.
            UnbalancedError, UnconvergedError: as `sheetbend.simulate`.
        """
        if not isinstance(state, State):
            fix = "give what `start`, or the call before, returned"
            raise InputError("state", "is not a State", type(state).__name__, fix)
        flat = self._default if inputs is None else inputs
        numbers = state.numbers
        if numbers.shape[-1] != self._width:
            raise InputError("state", "is one of another scene", tuple(numbers.shape), f"give (..., {self._width})")
        if flat.shape[-1] != len(self._default):
            raise _wrong_inputs(flat)
        names = tuple(given)
        core = self._cores.get(names) or self._core(names)
        arrays = [self._array(name, array) for name, array in given.items()]
        batches = [numbers.shape[:-1], flat.shape[:-1], *(batch for _, batch in arrays)]
        if not any(batches):
            return self._state(take_substep(core, [numbers, flat, *(array for array, _ in arrays)]))
        batch = broadcast({name: tuple(b) for name, b in zip(("state", "inputs", *names), batches, strict=True)})
        every = zip([numbers, flat, *(array for array, _ in arrays)], batches, strict=True)
        together = [t.expand(*batch, *t.shape[len(own) :]).reshape(-1, *t.shape[len(own) :]) for t, own in every]
        return self._state(take_substep(core, together).reshape(*batch, -1))

    def _state(self, numbers: Tensor) -> State:
        return State(numbers, self.dtype, self.scene.hidden_count)

    def _array(self, name: str, array: Tensor) -> tuple[Tensor, torch.Size]:
        """An array (*batch, ...) in float64, and its batch."""
        shape = self._shapes[name]
        dims = array.dim() - len(shape) if isinstance(array, Tensor) else -1
        if dims < 0 or array.shape[dims:] != shape or not array.is_floating_point():
            got = tuple(array.shape) if isinstance(array, Tensor) else type(array).__name__
            fix = f"give a floating tensor {shape}, batch dimensions before it if any"
            raise InputError(name, "is not a tensor of the right shape", got, fix)
        return array.double(), array.shape[:dims]

    def _core(self, names: tuple[str, ...]) -> Core:
        """The compiled solver for substeps in which these arrays are given."""
        possible = [n for n in self._shapes if n not in ("position", "velocity")]
        for name in names:
            if name not in possible:
                fix = f"call {NEEDS[name]} first" if name in NEEDS else f"give some of: {', '.join(possible)}"
                raise InputError(name, "cannot be given for a substep", name, fix)
        held = frozenset(names) & frozenset(_MOTIONS)
        places = [self._place(name) for name in names]
        early = not set(names) <= {*_MOTIONS, "gravity", "pressure"}
        core = Core(self._stepper(held), places, self._check, early, lambda: divergence(self.scene))
        self._cores[names] = core
        return core

    def _place(self, name: str) -> slice:
        """The slice of an array in the inputs; of one over time that of its first knot, which then holds at all
        times."""
        offset, _ = self._layout[name]
        return slice(offset, offset + torch.Size(self._shapes[name]).numel())

    def _stepper(self, held: frozenset[str]) -> Any:
        if held not in self._steppers:
            self._steppers[held] = _core.Stepper(self._solver_core, sorted(held))
        return self._steppers[held]


def _again(scene: Scene, solver: Solver, dtype: torch.dtype) -> Stepper:
    return Stepper(scene, solver, dtype=dtype)


def _wrong_inputs(flat: Tensor) -> InputError:
    return InputError("inputs", "are those of another scene", tuple(flat.shape), "make them with Stepper.inputs")
