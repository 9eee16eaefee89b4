"""sheetbend check: the gradients of a configuration's scenes against independent paths."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from ..config import GrippedConfig, Study, load, parse_any, scene_alone
from ..experiment.experiment import Experiment
from ..experiment.wanted import as_parameters
from ..gripped.model import RopeModel, nominal_directions
from ..gripped.over_density import UNIT
from ..gripped.plausible import gravities
from ..gripped.start import started, whole
from ..gripped.windows import SPANS
from ..minimum.growth import in_words, over_fit
from ..motion.gradient_report import GradientReport
from ..motion.gradients import check_gradients
from ..motion.solver import Solver
from ..objects.chain import unit_vector
from ..problem.jacobian_check import JacobianReport, check_jacobian
from ..problem.problem import FitProblem
from ..quantities.parameters import Parameters
from .gripped import RUNGS, RopeData, load_ropes
from .outcome import Code, Json, Outcome, run

FRAMES, SUBSTEPS = 4, 4  # of the stretch: long enough for both time-stepping starts and several compositions
FITTED_FRAMES = 5
SECONDS, LEAST = 40.0, 5.0  # about what the gradients of all scenes together may take, and those of one


def check(
    config: Annotated[Path, typer.Argument(help="A TOML configuration (docs/configuration.md).", show_default=False)],
    json: Json = False,
) -> None:
    """Compare the gradients of a scene with independent ones.

    Checks the scene of every recording over a short part of the motion, and the Jacobian of the residuals. Exits with 5
    if a check fails. In a large scene only a sample is checked; the output lists it. Also prints by which factor small
    displacements grow along each fitted motion.

    Example: sheetbend check experiments/twin/twin.toml
    """
    run(lambda console: _check(console, config), json)


def _check(console: Console, path: Path) -> Outcome:
    config = parse_any(path)
    fitted: tuple[Experiment, ...] = ()
    if isinstance(config, GrippedConfig):
        found = _of_ropes(config, path.parent)
    else:
        study = load(path)
        found = _reports(study)
        fitted = tuple(e for e in study.experiments if not e.static and e.predict is None)
    gradients: dict[str, GradientReport] = {}
    jacobians: dict[str, JacobianReport] = {}
    for name, report in found:
        console.print(str(report), markup=False, soft_wrap=True)
        if isinstance(report, GradientReport):
            gradients[name] = report
        else:
            jacobians[name] = report
    grown = [over_fit(e) for e in fitted]
    for g in grown:
        console.print(in_words(g), markup=False, soft_wrap=True)
    passed = all(r.passed for r in gradients.values()) and all(r.passed for r in jacobians.values())
    data = {
        "name": config.experiment.name,
        "passed": passed,
        "gradients": {name: r.to_dict() for name, r in gradients.items()},
        "jacobians": {name: r.to_dict() for name, r in jacobians.items()},
        "growth": {g.name: g.to_dict() for g in grown},
    }
    return Outcome(data, Code.DONE if passed else Code.CHECK_FAILED)


def _reports(study: Study) -> Iterator[tuple[str, GradientReport | JacobianReport]]:
    if not study.experiments:
        scene, solver = scene_alone(study.config, study.folder)
        yield scene.name, check_gradients(scene, _stretch(solver), solver, seconds=SECONDS)
    each = max(SECONDS / max(len(study.experiments), 1), LEAST)
    for e in study.experiments:
        if not e.static:
            yield e.name, check_gradients(e.scene, _stretch(e.solver), e.solver, seconds=each)
        report = _jacobian(study, e)
        if report is not None:
            yield e.name, report


def _of_ropes(config: GrippedConfig, folder: Path) -> Iterator[tuple[str, GradientReport | JacobianReport]]:
    """The gradient report of each rope: on its first recording, with all that its rungs may add to the model, at the
    first start."""
    ropes = load_ropes(config, folder)
    for rope in ropes:
        e, parameters = _started(rope)
        each = max(SECONDS / len(ropes), LEAST)
        yield rope.section.name, check_gradients(e.scene, _stretch(e.solver), e.solver, seconds=each)
        part = e.fitted().frames(slice(0, FITTED_FRAMES))
        yield rope.section.name, check_jacobian(FitProblem([e], parameters, [part]), rope.section.name)


def _started(rope: RopeData) -> tuple[Experiment, Parameters]:
    s = rope.section
    nominal = (
        nominal_directions(rope.train) if s.nominal is None else tuple(unit_vector("nominal", d) for d in s.nominal)
    )
    model = RopeModel(
        density=UNIT if s.density is None else s.density,
        nominal=(nominal[0], nominal[1]),
        values={},
        segments=s.segments,
        substeps=s.substeps,
        smoothing=s.smoothing,
        sigma=s.sigma,
        gravity=gravities(rope.train)[-1] if s.gravity is None else (s.gravity[0], s.gravity[1], s.gravity[2]),
    )
    model = started(model, rope.train, s.bending_lengths[0])
    return whole(
        model, [RUNGS[name] for name in s.rungs], rope.train[0], (SPANS if s.windows == "all" else s.windows)[0][0]
    )


def _stretch(solver: Solver) -> np.ndarray:
    return solver.h * SUBSTEPS * np.arange(FRAMES + 1)


def _jacobian(study: Study, e: Experiment) -> JacobianReport | None:
    """The report of one recording's Jacobian on its first frames; None where nothing free acts on it. Its driven
    markers are taken for the truth: with corrections the Jacobian is no derivative of the residuals, only its gradient
    is."""
    mine = {name: fields for name, fields in study.parameters.items() if name in e.scene.quantities}
    if not any(not fields.get("fixed") and "tied_to" not in fields for fields in mine.values()):
        return None
    part = e.fitted()
    part = part.frames(slice(0, FITTED_FRAMES))
    return check_jacobian(FitProblem([e], as_parameters(mine, [e]), [part], corrected={}), e.name)
