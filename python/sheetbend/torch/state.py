"""The state between two substeps: a value that can be kept, copied, batched, saved and differentiated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor
from torch.utils import _pytree as pytree
from torch.utils.data._utils.collate import default_collate_fn_map

_WHOLE = 2  # numbers at the end of a row: the substep, and what an impact has left


@dataclass(frozen=True, eq=False)
class State:
    """Everything that the next substep starts from, of one scene or of a batch of scenes.

    States are made by `Stepper.start` and `Stepper.__call__` and are never changed. `copy.deepcopy`, `torch.save`,
    `torch.func` and a DataLoader's default collation work with them; `State.stack` makes a batch of several, which may
    be at different substeps.

    Attributes:
        numbers: (*batch, 12 particles + 2) float64: positions, positions a substep earlier, velocities, velocities a
            substep earlier, the number of substeps since the start, and how many substeps an impact still affects. The
            last two are whole numbers and have no derivatives.
        dtype: of what the properties return.
    """

    numbers: Tensor
    dtype: torch.dtype = torch.float64

    @property
    def positions(self) -> Tensor:
        """(*batch, particles, 3) m."""
        return self._part(0)

    @property
    def positions_before(self) -> Tensor:
        """(*batch, particles, 3) m, a substep earlier; the same as `positions` at the start."""
        return self._part(1)

    @property
    def velocities(self) -> Tensor:
        """(*batch, particles, 3) m/s."""
        return self._part(2)

    @property
    def velocities_before(self) -> Tensor:
        """(*batch, particles, 3) m/s, a substep earlier; the same as `velocities` at the start."""
        return self._part(3)

    @property
    def substep(self) -> Tensor:
        """(*batch,) int64: how many substeps lead here from the start."""
        return self.numbers[..., -_WHOLE].detach().to(torch.int64)

    def detach(self) -> State:
        """The same state without what led to it: gradients stop here."""
        return State(self.numbers.detach(), self.dtype)

    def __getitem__(self, index: Any) -> State:
        """Some states of a batch."""
        return State(self.numbers[index], self.dtype)

    def __len__(self) -> int:
        if self.numbers.dim() < 2:
            raise TypeError("a single state has no length; State.stack makes a batch")
        return len(self.numbers)

    @staticmethod
    def stack(states: Sequence[State]) -> State:
        """A batch of states of the same scene; it gets a new first dimension."""
        return State(torch.stack([state.numbers for state in states]), states[0].dtype)

    def _part(self, i: int) -> Tensor:
        size = (self.numbers.shape[-1] - _WHOLE) // 4
        part = self.numbers[..., i * size : (i + 1) * size]
        return part.reshape(*part.shape[:-1], -1, 3).to(self.dtype)


def _collated(batch: Sequence[State], **_: Any) -> State:
    return State.stack(batch)


pytree.register_pytree_node(
    State,
    lambda state: ([state.numbers], state.dtype),
    lambda numbers, dtype: State(*numbers, dtype),  # type: ignore[call-arg]
    serialized_type_name="sheetbend.torch.State",
)
default_collate_fn_map[State] = _collated
