"""Rigid bodies and joints of a configuration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays.rotations import quaternions_of
from ..errors import ConfigError
from ..objects.body_end import attach
from ..objects.joint_making import Joint
from ..objects.joints import ball, cylinder, fixed, hinge, slider, universal
from ..objects.tool import COVERED, Tool
from ..recording.of_poses import start_of_poses
from ..scene.bodies import Path
from ..scene.body import Body
from ..scene.inertia import Inertia
from ..scene.scene import Scene
from .body_schema import GROUND, JOINTS, BodySection, Knots
from .errors import located, of_name
from .scene_schema import SceneSection
from .tools import tool_named

MADE: Mapping[str, Callable[..., Joint]] = {
    "ball": ball,
    "hinge": hinge,
    "universal": universal,
    "slider": slider,
    "cylinder": cylinder,
    "fixed": fixed,
}


def add_bodies(scene: Scene, section: SceneSection, tools: Mapping[str, Tool]) -> None:
    """Add the bodies of [[scene.body]], then the joints of [[scene.joint]].

    Raises:
        ConfigError: names that are taken or unknown, an inertia that no body has.
    """
    for i, body in enumerate(section.body):
        path = f"scene.body[{i}]"
        if body.name in scene.bodies or body.name == GROUND:
            raise ConfigError(f"{path}.name", "is taken", body.name, "give every body a name of its own")
        poses = None if body.tool is None else tool_named(f"{path}.tool", body.tool, tools)
        given: dict[str, Any] = body.model_dump(include={"pinned", "drag", "turn_drag"})
        with located(path, body.name):
            if body.starts_on is None:
                given |= body.model_dump(include={"at", "velocity", "spin"}) | {"rotation": body.quaternion}
            else:
                shown = tool_named(f"{path}.starts_on", body.starts_on, tools)
                given |= _start_on(shown, body, scene.gravity)
            if body.box is not None:
                inertia = Inertia.box(body.mass, body.box).moved(body.center)
            else:
                inertia = Inertia(body.mass, body.inertia or [], body.center)
            scene.add_body(body.name, of=inertia, poses=poses, **given)
    for i, joint in enumerate(section.joint):
        path = f"scene.joint[{i}]"
        upper = None if joint.upper == GROUND else named_body(f"{path}.upper", joint.upper, scene)
        lower = named_body(f"{path}.lower", joint.lower, scene)
        own: dict[str, Any] = {name: getattr(joint, name) for name in JOINTS[joint.kind]}
        own |= {name: (k.times, k.values) for name, k in own.items() if isinstance(k, Knots)}
        with located(path, joint.name):
            MADE[joint.kind](upper, lower, at=joint.at, name=joint.name, **own)


def _start_on(tool: Tool, body: BodySection, gravity: np.ndarray) -> dict[str, np.ndarray]:
    """The state at the scene's start that the tool's first poses show."""
    path = Path.of(body.name, tool)
    first = slice(int((path.times < -COVERED).sum()), None)
    times, places, turns = (
        a[first][: body.start_poses] for a in (path.times, path.origins, quaternions_of(path.frames))
    )
    return start_of_poses(times, places, turns, gravity if body.start_falls else np.zeros(3), time=0.0)


def fix_to_body(scene: Scene, path: str, body: str, particles: ArrayLike, what: str) -> None:
    """Fix particles to the body that `path`.body names, as the group `what`_on_`body`.

    Raises:
        ConfigError: there is no body of this name, or it does not take them.
    """
    fixed_to = named_body(f"{path}.body", body, scene)
    with located(path, "attach"):
        attach(fixed_to, particles, name=f"{what}_on_{body}")


def named_body(path: str, name: str, scene: Scene) -> Body:
    """A body of the scene.

    Raises:
        ConfigError: there is none of this name.
    """
    return of_name(path, "body of the scene", name, scene.bodies, "none, add a [[scene.body]]")
