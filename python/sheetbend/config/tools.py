"""Tools of a scene: their poses in one recording, and the parameters that correct their frame."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError
from ..objects.hand_eye import HandEye
from ..objects.tool import Tool
from ..recording.recording import Recording
from . import scene_schema as schema
from .errors import located, of_name

BEYOND = 1.0  # s of poses that are kept behind the last frame
SHORT = 2.0  # frame intervals by which a log of poses may end before the recording: the clocks need not agree


def tools_of(
    section: schema.SceneSection,
    own: Mapping[str, str],
    recording: Recording | None,
    t0: float,
    folder: Path,
    path: str,
) -> dict[str, Tool]:
    """The tools of a scene by name, on the scene's clock.

    Args:
        own: a recording's own files of poses, by tool.
        recording: whose times the poses must cover from t0 on; None without one.
        t0: time of the poses at which the scene starts, s.
        folder: files are relative to it.
        path: of the recording, for errors.

    Raises:
        ConfigError: an unknown tool, one without a file, a bad file, or poses that do not cover the recording.
    """
    known = {tool.name: i for i, tool in enumerate(section.tool)}
    for name in own:
        of_name(f"{path}.tools.{name}", "tool of the scene", name, known, "none, add a [[scene.tool]]")
    found = {}
    for tool in section.tool:
        file, where = own.get(tool.name, tool.file), f"scene.tool[{known[tool.name]}].file"
        if tool.name in own:
            where = f"{path}.tools.{tool.name}"
        if file is None:
            raise ConfigError(where, "is missing", None, f"give it here or in tools of {path or 'the recording'}")
        with located(where):
            frame = HandEye(tool.name, tool.position, tool.quaternion, tool.about)
            poses = Tool.load(folder / file, frame, tool.flex, tool.rod, tool.body).shifted(t0)
            if recording is None:
                found[tool.name] = poses
                continue
            stop = float(recording.times[-1]) - t0
            frames = np.diff(recording.times)
            if len(frames) and stop - SHORT * float(np.median(frames)) <= poses.times[-1] < stop:
                stop = float(poses.times[-1])
            poses.between(0.0, stop)
            found[tool.name] = poses.between(0.0, min(stop + BEYOND, float(poses.times[-1])))
    return found


def tool_named(path: str, name: str, tools: Mapping[str, Tool]) -> Tool:
    """A tool of the scene.

    Raises:
        ConfigError: there is none of that name.
    """
    return of_name(path, "tool of the scene", name, tools, "none, add a [[scene.tool]]")


def with_corrections(config: dict[str, Any]) -> dict[str, Any]:
    """A configuration as read, with the six parameters of every tool that has standard deviations; those that stand
    there already stay."""
    scene, parameters = config.get("scene"), config.get("parameters", {})
    tools = scene.get("tool") if isinstance(scene, dict) else None
    if not isinstance(tools, list) or not isinstance(parameters, dict):
        return config  # refused where it stands
    added: dict[str, Any] = {}
    for tool in tools:
        if not (isinstance(tool, dict) and isinstance(tool.get("name"), str)):
            continue
        names = HandEye(tool["name"]).quantities
        for key, own in (("shift_sd", names[:3]), ("turn_sd", names[3:])):
            sd = tool.get(key)
            if isinstance(sd, int | float) and not isinstance(sd, bool) and sd > 0:
                added |= {name: {"initial": 0.0, "prior": [0.0, float(sd)]} for name in own if name not in parameters}
    return {**config, "parameters": {**parameters, **added}} if added else config
