"""What a notebook shows of fits, recordings, scenes and motions: their page, in a frame of its own."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import Any

import numpy as np

from ..fitting.fit import Fit
from ..motion.equilibrium import Equilibrium
from ..motion.simulate import Trajectory
from ..optional import MissingExtraError
from ..recording.recording import Recording
from ..report.fit_result import FitResult
from ..scene.scene import Scene
from ..version import __version__
from .of_fit import fit_page, result_page
from .of_motion import motion_page
from .shown import Shown, of_positions, of_recording, of_trajectory

HEIGHT, OF_FIT = 780, 1060  # pixels: the motion with its legend, below a recording's summary or a fit's tables


def show_in_notebooks() -> None:
    """Give the classes whose objects notebooks show a `_repr_html_`, which IPython looks for.

    It is None, so that a notebook prints the object as text, where jinja2 is not installed, and for a motion that does
    not know its scene.
    """
    for kind, page in _PAGES.items():
        kind._repr_html_ = _framed(page, OF_FIT if kind in (Fit, FitResult) else HEIGHT)


def _framed(page: Callable[[Any], str | None], height: int) -> Callable[[Any], str | None]:
    def repr_html(self: Any) -> str | None:
        try:
            text = page(self)
        except MissingExtraError:
            return None
        if text is None:
            return None
        style = f"width:100%;height:{height}px;border:0"
        return f'<iframe style="{style}" srcdoc="{html.escape(text)}"></iframe>'

    return repr_html


def _fit(found: Fit) -> str:
    title = ", ".join(c.experiment.name for c in found.comparisons[:3]) or "fit"
    return fit_page(found, title, version=__version__)


def _result(result: FitResult) -> str:
    title = ", ".join(r.name for r in result.recordings[:3]) or "fit"
    return result_page(result, [], title, version=__version__)


def _recording(recording: Recording) -> str:
    return _motion(of_recording(recording, recording.name), recording.summary())


def _scene(scene: Scene) -> str:
    groups = ", ".join(f"{len(g.particles)} {g.kind} ({g.name})" for g in scene.groups)
    about = f"{scene.particle_count} particles; {groups or 'no constraints'}; drawn where the scene starts"
    return _motion(of_positions(scene, np.zeros(1), scene.nodes[None]), about)


def _trajectory(motion: Trajectory) -> str | None:
    return None if motion.scene is None else _motion(of_trajectory(motion.scene, motion))


def _equilibrium(rest: Equilibrium) -> str:
    about = f"at rest, energy {rest.energy:.4g} J"
    return _motion(of_positions(rest.scene, np.zeros(1), rest.nodes[None]), about)


def _motion(shown: Shown, about: str = "") -> str:
    return motion_page([shown], shown.name, about, __version__)


_PAGES: dict[Any, Callable[[Any], str | None]] = {
    Fit: _fit,
    FitResult: _result,
    Recording: _recording,
    Scene: _scene,
    Trajectory: _trajectory,
    Equilibrium: _equilibrium,
}
