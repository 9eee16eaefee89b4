"""The state between two substeps: a value that can be kept, copied, batched, saved and differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils import _pytree as pytree
from torch.utils.data._utils.collate import default_collate_fn_map

from ..errors import InputError

_WHOLE = 2  # numbers at the end of a row: the substep, and what an impact has left


@dataclass(frozen=True, eq=False, repr=False)
class State:
    """Everything that the next substep starts from, of one scene or of a batch of scenes.

    States are made by `Stepper.start` and `Stepper.__call__` and are never changed. `copy.deepcopy`, `torch.save`,
    `torch.func` and a DataLoader's default collation work with them; `State.stack` makes a batch of several, which may
    be at different substeps.

    Attributes:
        numbers: (*batch, 12 nodes + 2) float64, of particles and hidden nodes: positions, positions a substep earlier,
            velocities, velocities a substep earlier, the number of substeps since the start, and how many substeps an
            impact still affects. The last two are whole numbers and have no derivatives.
        dtype: of what the properties return.
        hidden: how many of the nodes, the last ones, are no particles.
    """

    numbers: Tensor
    dtype: torch.dtype = torch.float64
    hidden: int = 0

    @property
    def positions(self) -> Tensor:
        """(*batch, particles, 3) m."""
        return self._of_particles(0)

    @property
    def positions_before(self) -> Tensor:
        """(*batch, particles, 3) m, a substep earlier; the same as `positions` at the start."""
        return self._of_particles(1)

    @property
    def velocities(self) -> Tensor:
        """(*batch, particles, 3) m/s."""
        return self._of_particles(2)

    @property
    def velocities_before(self) -> Tensor:
        """(*batch, particles, 3) m/s, a substep earlier; the same as `velocities` at the start."""
        return self._of_particles(3)

    @property
    def nodes(self) -> Tensor:
        """(*batch, nodes, 3) m, the positions of all nodes, see `sheetbend.Trajectory.nodes`."""
        return self._part(0)

    @property
    def node_velocities(self) -> Tensor:
        """(*batch, nodes, 3) m/s, the velocities of all nodes."""
        return self._part(2)

    @property
    def substep(self) -> Tensor:
        """(*batch,) int64: how many substeps lead here from the start."""
        return self.numbers[..., -_WHOLE].detach().to(torch.int64)

    def detach(self) -> State:
        """The same state, cut off from how it was computed: gradients stop here."""
        return State(self.numbers.detach(), self.dtype, self.hidden)

    def __repr__(self) -> str:
        *batch, particles, _ = self.positions.shape
        return f"State(batch={tuple(batch)}, particles={particles}, dtype={self.dtype})"

    def __getitem__(self, index: Any) -> State:
        """Some states of a batch."""
        return State(self.numbers[index], self.dtype, self.hidden)

    def __len__(self) -> int:
        if self.numbers.dim() < 2:
            raise TypeError("a single state has no length; State.stack makes a batch")
        return len(self.numbers)

    @staticmethod
    def stack(states: Sequence[State]) -> State:
        """A batch of states of the same scene; it gets a new first dimension.

        Raises:
            InputError: no states, or states of different scenes.
        """
        if len({state.numbers.shape for state in states}) != 1:
            got = [tuple(state.numbers.shape) for state in states]
            raise InputError("states", "do not make a batch", got, "give one state or more, all of one scene")
        return State(torch.stack([state.numbers for state in states]), states[0].dtype, states[0].hidden)

    def _of_particles(self, i: int) -> Tensor:
        part = self._part(i)
        return part[..., : part.shape[-2] - self.hidden, :]

    def _part(self, i: int) -> Tensor:
        size = (self.numbers.shape[-1] - _WHOLE) // 4
        part = self.numbers[..., i * size : (i + 1) * size]
        return part.reshape(*part.shape[:-1], -1, 3).to(self.dtype)


def _collated(batch: Sequence[State], **_: Any) -> State:
    return State.stack(batch)


pytree.register_pytree_node(
    State,
    lambda state: ([state.numbers], (state.dtype, state.hidden)),
    lambda numbers, rest: State(*numbers, *rest),
    serialized_type_name="sheetbend.torch.State",
)
default_collate_fn_map[State] = _collated
torch.serialization.add_safe_globals([State])  # so that torch.load reads it as it reads tensors
