"""sheetbend identify: what recordings of a configuration's scene would tell, before they are made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console, Group

from ..config import Config, Study, build, parse, scene_alone
from ..config.build import smooth_fields
from ..config.start_values import fields_of_parameter
from ..errors import ConfigError, InputError
from ..experiment.experiment import Experiment
from ..files.door import reading
from ..fitting.identify import identify as run_identify
from ..fitting.plan import Plan
from ..recording.recording import Recording
from ..report.tables import rich_section
from .folders import made
from .outcome import Code, Json, Outcome, run
from .screen import heading, show
from .targets import check_targets

MARKERS = 10
FILE = "plan.json"
HUNG = "hung_by_the_plan"


def identify(
    config: Annotated[
        Path, typer.Argument(help="A TOML configuration. Its recordings need not exist yet.", show_default=False)
    ],
    noise: Annotated[
        float | None,
        typer.Option(
            help="Standard deviation of the noise of a marker in m. Default: the recordings' sigma.", show_default=False
        ),
    ] = None,
    autocorrelation: Annotated[
        float, typer.Option(help="Correlation of the errors of a marker between one frame and the next.")
    ] = 0.0,
    duration: Annotated[float, typer.Option(help="Duration in s of a motion that is not recorded yet.")] = 1.0,
    rate: Annotated[float, typer.Option(help="Frames per second of a motion that is not recorded yet.")] = 100.0,
    markers: Annotated[
        int, typer.Option(help="Number of markers along the rope, if there is no recording and no marker table.")
    ] = MARKERS,
    other: Annotated[
        list[Path] | None,
        typer.Option(
            "--with",
            help="Compare with a plan that also contains the motions of this configuration.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for plan.json. Default: nothing is written.", show_default=False),
    ] = None,
    json: Json = False,
) -> None:
    """Predict, before an experiment, which parameters it will determine and how well.

    Prints the expected intervals and verdicts, the combinations of parameters that the data will not determine, and the
    effect of one more marker, mass, force sensor or motion. The prediction uses the initial values of the parameters.

    Example: sheetbend identify rope.toml --noise 0.0005
    """

    def command(console: Console) -> Outcome:
        frames = _Frames(duration, rate, markers)
        return _identify(console, config, noise, autocorrelation, frames, other or [], output)

    run(command, json)


class _Frames:
    """The recording to plan with where there is none."""

    def __init__(self, duration: float, rate: float, markers: int) -> None:
        for option, value in (("--duration", duration), ("--rate", rate)):
            if not (np.isfinite(value) and value > 0):
                raise ConfigError(option, "must be positive", value, "give s, or frames per second")
        if markers < 1:
            raise ConfigError("--markers", "must be positive", markers, "give at least 1")
        count = int(np.floor(duration * rate * (1.0 + 1e-12))) + 1
        if count < 2:
            raise ConfigError("--duration", "holds no second frame", duration, "make it longer, or raise --rate")
        self.times, self.markers = np.arange(count) / rate, markers


def _identify(
    console: Console,
    path: Path,
    noise: float | None,
    autocorrelation: float,
    frames: _Frames,
    others: Sequence[Path],
    output: Path | None,
) -> Outcome:
    config = parse(path)
    if not config.parameters:
        fix = "add a [parameters.NAME] for what is to be found; `sheetbend info` lists the names"
        raise ConfigError("parameters", "is missing", None, fix)
    if output is not None:
        check_targets("--output", output, [output / FILE])
    with reading(path, ConfigError):
        experiments = _planned(config, path.parent, frames)
        instead = _with_mass(config, path.parent, frames)
    for other in others:
        with reading(other, ConfigError):
            more = _planned(parse(other), other.parent, frames)
        taken = {e.name for e in experiments}
        more = [replace(e, name=f"{e.name} of {other.stem}") if e.name in taken else e for e in more]
        instead[f"with {other.stem}"] = [*experiments, *more]
    if output is not None:
        made("--output", output)
    heading(console, config.experiment.name, config.experiment.about)
    parameters = {name: fields_of_parameter(p) for name, p in config.parameters.items()}
    plan = run_identify(
        experiments,
        parameters=parameters,
        noise=noise,
        autocorrelation=autocorrelation,
        instead=instead,
        smooth=smooth_fields(config),
        threads=config.fit.threads,
    )
    show(console, lambda: _rich(plan), plan.report)
    files: list[str] = []
    if output is not None:
        plan.save(output / FILE)
        files = [FILE]
        console.print(f"\nwritten to {output}: {FILE}", soft_wrap=True)
    return Outcome(plan.to_dict() | {"name": config.experiment.name, "files": files}, _code(plan))


def _code(plan: Plan) -> Code:
    if any(e.verdict == "rough" for e in plan.told):
        return Code.NOT_CONVERGED
    unknown = [e.verdict == "not identifiable" for e in plan.told]
    return Code.NOT_IDENTIFIABLE if all(unknown) else Code.DONE


def _rich(plan: Plan) -> Group:
    parts: list[Any] = []
    for section in plan.sections():
        parts += ["", *rich_section(section)]
    return Group(*parts)


def _planned(config: Config, folder: Path, frames: _Frames) -> list[Experiment]:
    """The configuration's experiments; of its scene alone where no recording is named, or none of them is there."""
    there = [r for r in config.recording if (folder / r.file).exists()]
    if config.recording and len(there) == len(config.recording):
        study: Study = build(config, folder)
        return [e for e in study.experiments if e.predict is None]
    if there:
        missing = [r.file for r in config.recording if r not in there]
        raise ConfigError("recording", "are there in part", missing, "record them, or leave all of them out")
    scene, solver = scene_alone(config, folder)
    if len(scene.ropes) != 1:
        fix = "give a recording with the planned frames and markers; their places do not count"
        raise ConfigError("recording", "is missing, and the scene has not exactly one rope", len(scene.ropes), fix)
    (rope,) = scene.ropes.values()
    ends = scene.positions[rope.particles[[0, -1]]]
    share = np.linspace(0.0, 1.0, frames.markers)[:, None]
    places = np.broadcast_to(ends[0] + share * (ends[1] - ends[0]), (len(frames.times), frames.markers, 3))
    recording = Recording(places, frames.times, name=config.experiment.name)
    section = config.recording[0] if config.recording else None
    more = {} if section is None else {"sigma": section.sigma, "axes": section.axes, "start": section.start}
    return [Experiment(scene=scene, recording=recording, solver=solver, **more)]  # type: ignore[arg-type]


def _with_mass(config: Config, folder: Path, frames: _Frames) -> dict[str, list[Experiment]]:
    """The experiments with a further motion in which the rope's own weight hangs on its free end; ropes
    without weight or a free end are left out."""
    found: dict[str, list[Experiment]] = {}
    for rope in config.scene.rope:
        mass = rope.density * (rope.length or 0.0)
        if mass <= 0.0:
            continue
        hung = {"particle": f"{rope.name}:end", "mass": mass, "name": HUNG}
        content = config.model_dump(exclude_unset=True)
        content["scene"]["point_mass"] = [*content["scene"].get("point_mass", []), hung]
        try:
            heavy = _planned(Config.model_validate(content), folder, frames)
            plain = _planned(config, folder, frames)
        except (InputError, ValueError):  # its end is held, or no place for a mass
            continue
        words = f"a known mass of {1e3 * mass:.3g} g at the end of {rope.name}, in a further motion"
        found[words] = [*plain, *(replace(e, name=f"{e.name} with a mass") for e in heavy)]
    return found
