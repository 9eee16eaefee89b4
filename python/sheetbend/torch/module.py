"""A scene whose named quantities are learned."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn

from ..arrays.checks import is_list
from ..errors import InputError, choices
from ..motion.solver import Solver
from ..scene.given import check_scene
from ..scene.scene import Scene
from .simulate import Simulation


class SceneModule(nn.Module):
    """A simulated scene as a module with one scalar parameter per learned quantity, under the quantity's name.

    A positive quantity is stored as its natural logarithm, so that no optimizer step can make it negative and a step
    means a relative change; `state_dict()["rope_EI"]` is thus log(EI). The others are stored as they are. `values()`
    gives physical values.

    Args:
        scene, times, solver: as `sheetbend.torch.simulate`.
        learn: names of quantities; they start at the scene's values.

    Raises:
        InputError: no name, or one that the scene does not have; times off the grid.
    """

    def __init__(self, scene: Scene, times: ArrayLike, solver: Solver | None = None, *, learn: Sequence[str]) -> None:
        super().__init__()
        check_scene(scene)
        if not is_list(learn) or len(learn) == 0 or not all(isinstance(name, str) for name in learn):
            fix = f"name some of: {', '.join(scene.quantities)}"
            raise InputError("learn", "must be a list of quantities", learn, fix)
        self._simulation = Simulation(scene, times, solver)
        self._positive: dict[str, bool] = {}
        for name in learn:
            if name not in scene.quantities:
                raise InputError("learn", "names no quantity of the scene", name, choices(name, scene.quantities))
            q = scene.quantities[name]
            self._positive[name] = q.positive
            stored = math.log(q.value) if q.positive else q.value
            self.register_parameter(name, nn.Parameter(torch.tensor(stored, dtype=torch.float64)))

    def values(self) -> dict[str, Tensor]:
        """Physical values of the learned quantities in SI units, differentiable."""
        stored = dict(self.named_parameters())
        return {name: stored[name].exp() if positive else stored[name] for name, positive in self._positive.items()}

    def forward(
        self,
        inputs: Mapping[str, Tensor] | None = None,
        lengths: ArrayLike | None = None,
        **overrides: Tensor | float,
    ) -> Tensor:
        """Positions (*batch, frames, particles, 3) m.

        Args:
            inputs, lengths: input arrays to replace, and frames per scene, as in `sheetbend.torch.simulate`.
            overrides: quantities by name, physical values (*batch,), instead of the learned or the scene's ones.

        Raises:
            InputError, DivergenceError: as `sheetbend.torch.simulate`.
        """
        return self._simulation({**self.values(), **overrides}, inputs, lengths)

    def extra_repr(self) -> str:
        units = {name: q.unit for name, q in self._simulation.scene.quantities.items()}
        return ", ".join(f"{name}={value.item():.6g} {units[name]}".rstrip() for name, value in self.values().items())
