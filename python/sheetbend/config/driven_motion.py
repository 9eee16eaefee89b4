"""The motion of driven markers that a fit estimated, in a file beside its `fitted.toml` (`recording.driven_motion`)."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from ..errors import ConfigError, RecordingError
from ..experiment.driven_motion import estimated_motion, following
from ..experiment.experiment import Experiment
from ..fitting.fit import Fit
from ..recording.recording import Recording
from .build import Study
from .schema import Config

DRIVEN = "driven_"
ABOUT = "markers that drive the scene, moved as the fit estimated their true motion; in m, on the recording's clock"


def driven_files(experiments: Iterable[Experiment]) -> list[str]:
    """The files that `save_driven` may write of experiments."""
    names = [e.name for e in experiments if e.driven_sigma is not None]
    return [f"{DRIVEN}{name}{suffix}" for name in names for suffix in (".npz", ".json")]


def save_driven(found: Fit, folder: Path) -> dict[str, str]:
    """Write the driven markers' motion of every experiment whose correction a fit found, as an NPZ with its JSON, which
    `Recording.load` reads; the names of the NPZ files by experiment."""
    files: dict[str, str] = {}
    for e in (c.experiment for c in found.comparisons if c.experiment.name in found.corrections):
        motion = estimated_motion(e, found.corrections[e.name])
        if motion is not None:
            files[e.name] = f"{DRIVEN}{e.name}.npz"
            replace(motion, name=f"{DRIVEN}{e.name}", metadata={"about": ABOUT}).save(folder / files[e.name])
    return files


def with_driven(study: Study, config: Config, files: Mapping[str, str], folder: Path) -> Config:
    """A configuration of a study whose recordings name the files in `folder`, by experiment, and no others."""
    recordings = [
        section.model_copy(
            update={"driven_motion": os.path.relpath(folder / files[e.name], study.folder) if e.name in files else None}
        )
        for section, e in zip(config.recording, study.experiments, strict=True)
    ]
    return config.model_copy(update={"recording": recordings})


def as_simulated(study: Study) -> tuple[Experiment, ...]:
    """The experiments of a study, whose scenes follow the estimated motion of their driven markers where the
    configuration names its file. A fit takes the recorded motion, and estimates the true one anew.

    Raises:
        ConfigError: a file does not exist, is no recording, or is not one of these driven markers.
    """
    return tuple(_simulated(study, i, e) for i, e in enumerate(study.experiments))


def _simulated(study: Study, i: int, e: Experiment) -> Experiment:
    path, name = f"recording[{i}].driven_motion", study.config.recording[i].driven_motion
    if name is None:
        return e
    file = study.folder / name
    if not file.exists():
        fix = "fit again, which writes it beside fitted.toml, or leave the key out to follow the recorded motion"
        raise ConfigError(path, "does not exist", str(file), fix)
    try:
        return following(e, Recording.load(file, "m"))
    except RecordingError as error:
        raise ConfigError(path, error.problem, error.got, error.fix) from error
