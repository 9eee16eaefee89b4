"""What varies along a rope or rod, in modes cos(k pi s/length) of its arc length s.

These are the eigenfunctions of the Laplace operator along it with free ends, with the eigenvalues (k pi/length)^2, so
that a prior with a length of correlation is one of independent modes (`stiffness_field`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..arrays.types import Array
from ..errors import SceneError
from ..scene.scene import Scene
from .stiffness_field import StiffnessField

COSINE = 0.5**0.5  # root mean square of a mode


def mode_quantities(
    scene: Scene, name: str, label: str, modes: Sequence[int], s: Array, unit: str = ""
) -> list[tuple[str, Array]]:
    """A new quantity `<name>_<label>_<k>` per mode k, and its weights cos(k pi s) at shares s of the rod's length."""
    field = f"{name}.{label.removesuffix('_1').removesuffix('_2')}_modes"
    scale = 1.0 if unit else 0.3
    return [
        (
            scene.add_quantity(f"{name}_{label}_{k}", 0.0, unit, positive=False, scale=scale),
            np.cos(k * np.pi * s),
        )
        for k in _checked(field, modes)
    ]


def _checked(field: str, modes: Sequence[int]) -> tuple[int, ...]:
    """The modes: whole numbers from 0 on, each once."""
    given = list(modes) if np.iterable(modes) else [None]
    bad = [k for k in given if not isinstance(k, int | np.integer) or k < 0]
    if bad or len(set(given)) < len(given):
        raise SceneError(field, "must be whole numbers from 0 on, each once", modes, "give such as (0, 1)")
    return tuple(int(k) for k in modes)


def softness_field(name: str, modes: Sequence[int], s: Array, length: float) -> StiffnessField | None:
    """The field of EI of a rope or rod whose softness varies: ln EI is that of the quantity `<name>_EI` less the sum of
    the modes. None where these are not 1, 2 and so on: a prior of a size and a length has all of the smoothest modes.

    Args:
        name: of the rope.
        modes: k of the modes.
        s: (joints,) shares of its length, where the joints are.
        length: m.

    Raises:
        SceneError: more modes than the joints tell apart.
    """
    if not len(modes) or tuple(modes) != tuple(range(1, len(modes) + 1)):
        return None
    if len(modes) >= len(s):
        fix = f"give at most {len(s) - 1}, one fewer than joints"
        raise SceneError(f"{name}.softness_modes", "are more than the joints tell apart", len(modes), fix)
    every = np.arange(len(s))
    waves = -np.cos(np.pi * np.outer(s, every[1:]))
    return StiffnessField(
        f"{name}_EI",
        tuple(f"{name}_softness_{k}" for k in modes),
        np.asarray((every * np.pi / length) ** 2, dtype=float),
        waves[:, : len(modes)],
        np.outer(s * length, [1.0, 0.0, 0.0]),
        waves[:, len(modes) :],
        "N m^2",
        "joint",
        COSINE,
    )
