"""sheetbend check: the gradients of a configuration's scenes against independent paths."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console

from ..config import Study, load, scene_alone
from ..experiment import Experiment
from ..gradients import GradientReport, check_gradients
from ..jacobian_check import JacobianReport, check_jacobian
from ..problem import FitProblem, as_parameters
from .outcome import Code, Outcome, run

FRAMES, SUBSTEPS = 4, 4  # of the stretch: long enough for both time-stepping starts and several compositions
FITTED_FRAMES = 5


def check(
    config: Annotated[
        Path, typer.Argument(help="A TOML configuration, see docs/configuration.md.", show_default=False)
    ],
    json: Annotated[
        bool, typer.Option("--json", help="One JSON object on stdout; everything else goes to stderr.")
    ] = False,
) -> None:
    """Check the gradients of every recording's scene over a short stretch, and the residuals' Jacobian; exit 5 where
    one fails."""
    run(lambda console: _check(console, config), json)


def _check(console: Console, path: Path) -> Outcome:
    study = load(path)
    gradients: dict[str, GradientReport] = {}
    jacobians: dict[str, JacobianReport] = {}
    for name, report in _reports(study):
        console.print(str(report), soft_wrap=True)
        if isinstance(report, GradientReport):
            gradients[name] = report
        else:
            jacobians[name] = report
    passed = all(r.passed for r in gradients.values()) and all(r.passed for r in jacobians.values())
    data = {
        "name": study.config.experiment.name,
        "passed": passed,
        "gradients": {name: r.to_dict() for name, r in gradients.items()},
        "jacobians": {name: r.to_dict() for name, r in jacobians.items()},
    }
    return Outcome(data, Code.DONE if passed else Code.CHECK_FAILED)


def _reports(study: Study) -> Iterator[tuple[str, GradientReport | JacobianReport]]:
    if not study.experiments:
        scene, solver = scene_alone(study.config, study.folder)
        yield scene.name, check_gradients(scene, solver.h * SUBSTEPS * np.arange(FRAMES + 1), solver)
    for e in study.experiments:
        if not e.static:
            yield e.name, check_gradients(e.scene, e.solver.h * SUBSTEPS * np.arange(FRAMES + 1), e.solver)
        report = _jacobian(study, e)
        if report is not None:
            yield e.name, report


def _jacobian(study: Study, e: Experiment) -> JacobianReport | None:
    """Of one recording, its first frames, its driven markers taken for the truth: with corrections the Jacobian is no
    derivative of the residuals, only its gradient is. None where nothing free acts on it."""
    mine = {name: fields for name, fields in study.parameters.items() if name in e.scene.quantities}
    if not any(not fields.get("fixed") and "tied_to" not in fields for fields in mine.values()):
        return None
    part = e.fitted()
    part = part.frames(slice(0, FITTED_FRAMES))
    return check_jacobian(FitProblem([e], as_parameters(mine, [e]), [part], corrected={}), e.name)
