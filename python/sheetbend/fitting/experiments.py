"""The experiments that a fit or a plan is given, checked before any work starts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..arrays.checks import is_several
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..recording.recording import Recording
from ..recording.windows import check_windows
from ..scene.scene import Scene


def experiments_of(
    scene: Scene | Experiment | Sequence[Experiment],
    recording: Recording | None,
    fields: Mapping[str, Any],
    wanted: str = "give the recording that the scene is to explain",
) -> list[Experiment]:
    """A scene with its recording and fields of `Experiment`, or one or several experiments.

    Args:
        wanted: what to do where a scene comes without a recording.

    Raises:
        InputError: there is none, or a window does not lie within its recording.
    """
    if isinstance(scene, Scene):
        if recording is None:
            raise InputError("recording", "is missing", None, wanted)
        return within([Experiment(scene=scene, recording=recording, **fields)])
    if recording is not None or fields:
        fix = "put everything into the experiments"
        raise InputError("recording", "goes with a single scene", sorted(fields) or "recording", fix)
    experiments = listed([scene] if isinstance(scene, Experiment) else scene)
    if not experiments:
        raise InputError("experiments", "are empty", 0, "give at least one")
    return within(experiments)


def listed(experiments: Iterable[Experiment]) -> list[Experiment]:
    """The experiments as a list.

    Raises:
        InputError: they are no list, or hold something else.
    """
    found = list(experiments) if is_several(experiments) else []
    if not is_several(experiments) or not all(isinstance(e, Experiment) for e in found):
        fix = "give a scene with its recording, an sb.Experiment, or a list of them"
        raise InputError("experiments", "hold what is not an Experiment", experiments, fix)
    return found


def within(experiments: list[Experiment]) -> list[Experiment]:
    """The experiments, after a check that their windows lie within their recordings.

    Raises:
        InputError: one does not.
    """
    for e in experiments:
        check_windows(e.recording, e.fit, e.held_out, e.start_time, e.static, f"{e.name}.")
    return experiments
