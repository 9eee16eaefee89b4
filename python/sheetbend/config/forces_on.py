"""Forces of a configuration on particles and on bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import ConfigError
from ..quantities.expression import expressions, vector
from ..scene.body_force import push_point
from ..scene.scene import Scene
from .bodies import named_body
from .errors import located
from .scene_schema import Force


def add_forces(scene: Scene, forces: Sequence[Force], find: Callable[[str, str], int]) -> None:
    """Forces, plain or made of named quantities.

    Args:
        find: the particle of a reference, after its place in the file.

    Raises:
        ConfigError: an unknown particle or body, or factors that do not match the times.
    """
    for i, force in enumerate(forces):
        path = f"scene.force[{i}]"
        factors = np.ones(len(force.times)) if force.factors is None else np.array(force.factors)
        if len(factors) != len(force.times):
            raise ConfigError(f"{path}.factors", "do not match the times", len(factors), f"give {len(force.times)}")
        which = [find(f"{path}.particles", r) for r in force.particles]
        point = None if force.body is None else named_body(f"{path}.body", force.body, scene).point(force.point)
        with located(path):
            whole = expressions(force.force)
            if force.name is not None:
                size = float(np.linalg.norm(force.force)) or 1.0
                names = [f"{force.name}_{axis}" for axis in "xyz"]
                for name, value in zip(names, force.force, strict=True):
                    scene.add_quantity(name, value, "N", positive=False, scale=size)
                whole = vector(names)
            over_time = whole * factors[:, None]
            if point is not None:
                push_point(scene.forces, point, over_time, force.times)
                continue
            scene.add_force(which, np.zeros(3), force.times)
            scene.forces.push(which, np.repeat(over_time[:, None], len(which), axis=1), force.times)
