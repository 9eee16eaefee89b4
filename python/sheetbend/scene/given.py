"""Refuses what a caller gives in place of a scene."""

from __future__ import annotations

from ..arrays.checks import check_kind
from ..errors import SceneError
from .scene import Scene


def check_scene(scene: object) -> None:
    """Refuse what is no `Scene`.

    Raises:
        SceneError: names the argument `scene`.
    """
    check_kind("scene", scene, Scene, "give what sb.Scene() or sb.rope(...) returns", SceneError)
