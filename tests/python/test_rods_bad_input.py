"""Bad input to rods and grips: refused by an error that names the field, what it got and a fix."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sheetbend as sb

NAN = math.nan
TIMES, STILL = np.arange(3) / 10, np.zeros((3, 3))
AHEAD = np.tile([1.0, 0, 0], (3, 1))
UPRIGHT = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))


def rod(**options: Any) -> Callable[[], Any]:
    return lambda: sb.rod(**({"length": 1.0, "segments": 4, "density": 0.05, "EI": 1e-3, "GJ": 1e-3} | options))


def fixed(**options: Any) -> sb.Grip:
    return sb.Grip.fixed(**({"position": (0, 0, 0), "direction": (1, 0, 0)} | options))


def poses(**options: Any) -> sb.Grip:
    return sb.Grip.from_poses(**({"times": TIMES, "positions": STILL, "quaternions": UPRIGHT} | options))


def markers(**options: Any) -> sb.Grip:
    return sb.Grip.from_markers(**({"times": TIMES, "first": STILL, "second": AHEAD} | options))


def section(normals: Any = None, edges: Any = ((0, 1),)) -> Callable[[], Any]:
    """A section on an edge; the last particle lies on the first."""

    def run() -> None:
        scene = sb.Scene()
        scene.add_particles([[0, 0, 0], [1, 0, 0], [0, 0, 0]], 1.0)
        own = scene.add_normals(edges)
        scene.add_directors([[0, 1]], [[0, 1, 0]], own if normals is None else normals)

    return run


def later(make: Callable[..., Any], **options: Any) -> Callable[[], Any]:
    return lambda: make(**options)


ROD = {
    "no length": ("rod.length", rod(length=None)),
    "length zero": ("rod.length", rod(length=0.0)),
    "length of text": ("rod.length", rod(length="long")),
    "density negative": ("rod.density", rod(density=-1.0)),
    "EI zero": ("rod.EI", rod(EI=0.0)),
    "no GJ": ("rod.GJ", rod(GJ=None)),
    "GJ not finite": ("rod.GJ", rod(GJ=math.inf)),
    "EA zero": ("rod.EA", rod(EA=0.0)),
    "GA zero": ("rod.GA", rod(GA=0.0)),
    "GA not finite": ("rod.GA", rod(GA=NAN)),
    "EI2 not finite": ("rod.EI2", rod(EI2=NAN)),
    "one segment": ("rod.segments", rod(segments=1)),
    "half a segment": ("rod.segments", rod(segments=2.5)),
    "bend damping zero": ("rod.bend_damping", rod(bend_damping=0.0)),
    "twist damping not finite": ("rod.twist_damping", rod(twist_damping=NAN)),
    "stretch damping of what is rigid": ("rod.stretch_damping", rod(stretch_damping=1e-3)),
    "shear damping of what does not shear": ("rod.shear_damping", rod(shear_damping=1e-3)),
    "tilts without a grip": ("rod.tilts", rod(tilts=True)),
    "roll without a grip": ("rod.roll", rod(roll=True)),
    "roll without a grip at the end": ("rod.roll", rod(roll=True, start=fixed())),
    "drag negative": ("rod_drag_linear", rod(drag_linear=-1.0)),
    "drag of text": ("rod_drag_quadratic", rod(drag_quadratic="much")),
    "mode below zero": ("rod.curvature_modes", rod(curvature_modes=(-1,))),
    "half a mode": ("rod.curvature_modes", rod(curvature_modes=(0.5,))),
    "mode twice": ("rod.twist_modes", rod(twist_modes=(1, 1))),
    "mode alone": ("rod.twist_modes", rod(twist_modes=1)),
    "points of the wrong shape": ("rod.points", rod(points=[[0, 0], [1, 0]])),
    "points not finite": ("rod.points", rod(points=[[0, 0, 0], [NAN, 0, 0]])),
    "points at one place": ("points", rod(points=[[0, 0, 0], [0, 0, 0]])),
    "points that fold back": ("rod.points", rod(points=[[0, 0, 0], [0.5, 0, 0], [0, 0, 0]])),
    "velocity without points": ("rod.velocity", rod(velocity=[[0, 0, 0]])),
    "velocity of the wrong shape": ("rod.velocity", rod(points=[[0, 0, 0], [1, 0, 0]], velocity=[[0, 0, 0]])),
    "director along the rod": ("rod.director", rod(director=(2, 0, 0))),
    "director without length": ("rod.director", rod(director=(0, 0, 0))),
    "director of the wrong shape": ("rod.director", rod(director=(0, 1))),
    "half a turn": ("rod.turns", rod(turns=0.5)),
    "more turns than joints hold": ("rod.turns", rod(turns=10, start=fixed(), end=fixed(position=(1, 0, 0)))),
    "grips too far apart": ("length", rod(start=fixed(), end=fixed(position=(2, 0, 0)))),
    "grips too near for a straight start": ("points", rod(start=fixed(), end=fixed(position=(0.5, 0, 0)))),
    "a place for a grip": ("rod.start", rod(start=(0, 0, 0))),
    "grips with other knots": (
        "drive.times",
        lambda: rod(start=poses(), end=poses(times=2 * TIMES, positions=AHEAD))(),
    ),
}
GRIP = {
    "direction without length": ("direction", later(fixed, direction=(0, 0, 0))),
    "direction of the wrong shape": ("direction", later(fixed, direction=(1, 0))),
    "position not finite": ("position", later(fixed, position=(NAN, 0, 0))),
    "director along": ("director", later(fixed, director=(2, 0, 0))),
    "director without length": ("director", later(fixed, director=(0, 0, 0))),
    "three numbers for a quaternion": ("quaternions", later(poses, quaternions=np.ones((3, 3)))),
    "quaternion without length": ("quaternions", later(poses, quaternions=UPRIGHT * [[1], [0], [1]])),
    "quaternions not finite": ("quaternions", later(poses, quaternions=UPRIGHT * NAN)),
    "positions of the wrong shape": ("positions", later(poses, positions=STILL[:2])),
    "poses backwards in time": ("times", later(poses, times=TIMES[::-1])),
    "no poses": ("times", later(poses, times=[], positions=np.zeros((0, 3)), quaternions=np.zeros((0, 4)))),
    "pose director along": ("director", later(poses, director=(1, 0, 0))),
    "markers that coincide": ("first, second", later(markers, second=STILL)),
    "marker not finite": ("first", later(markers, first=STILL * NAN)),
    "markers of other lengths": ("second", later(markers, second=STILL[:2])),
    "markers backwards in time": ("times", later(markers, times=TIMES[::-1])),
    "nominal opposite": ("nominal", later(markers, nominal=(-1, 0, 0))),
    "nominal without length": ("nominal", later(markers, nominal=(0, 0, 0))),
    "nominal of the wrong shape": ("nominal", later(markers, nominal=(1, 0))),
    "marker director along": ("director", later(markers, director=(3, 0, 0))),
}
SECTION = {
    "a particle for a normal": ("normals", section(normals=[0])),
    "two normals for an edge": ("normals", section(edges=[[0, 1], [0, 1]])),
    "edge without length": ("edges", section(edges=[[0, 2]])),
    "edge to no particle": ("edges", section(edges=[[0, 7]])),
}
CASES = {
    f"{what}: {k}": v for what, part in {"rod": ROD, "grip": GRIP, "section": SECTION}.items() for k, v in part.items()
}


@pytest.mark.parametrize(("field", "run"), CASES.values(), ids=CASES)
def test_bad_input_is_refused(field, run):
    with pytest.raises(sb.SceneError) as caught:
        run()
    message = str(caught.value)
    assert message.startswith(f"{field}: "), message
    assert "(got " in message and "Fix: " in message


def test_an_extensible_rod_may_start_stretched():
    """Recorded grips are a little farther apart than the rod is long."""
    scene = rod(start=fixed(), end=fixed(position=(1.001, 0, 0)), EA=100.0)()
    assert np.diff(scene.positions[:5, 0]) == pytest.approx(1.001 / 4)
    with pytest.raises(sb.SceneError, match=r"does not reach.*1\.001"):
        rod(start=fixed(), end=fixed(position=(1.001, 0, 0)))()
