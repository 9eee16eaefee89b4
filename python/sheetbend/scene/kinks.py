"""What makes the motions of a scene not smooth in time."""

from __future__ import annotations

from .scene_data import SceneData


def kinks(scene: SceneData) -> str:
    """What makes motions of a scene not smooth in time, so that errors have no power series in h; empty if nothing.

    Contacts are not among these, for errors of backward Euler have a first term there all the same (`time_step`).
    Tethers, which act from one side only, need sweeps, and those are refused as such.
    """
    found = of_the_state(scene)
    if scene.boundary.driven and scene.boundary.interpolation == "linear":
        found.append("driven particles with linear knots, which kick them (use 'cubic')")
    return " and ".join(found)


def of_the_state(scene: SceneData) -> list[str]:
    """Those of them whose times depend on the motion, so that residuals have kinks over parameters as well."""
    found = []
    if any("yielding" in group.kind for group in scene.groups):
        found.append("what yields (yield_curvature, yield_shear, yield_stress)")
    if any(group.kind in ("friction_hinge", "joint_friction") for group in scene.groups):
        found.append("joints with dry friction")
    if any(group.kind in ("angle_stop", "slide_stop") for group in scene.groups):
        found.append("joints with limits")
    return found
