"""How far the estimates of twin_cloth.toml move with the mesh, the step and the solver, and what a drape alone tells.

    python experiments/twin_cloth/portability.py

prints its tables and writes them to out/twin_cloth/portability.txt. Exit code 1 if a stiffness moves by 3 % or more,
or by more than its interval.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import sheetbend as sb
from sheetbend.config import Config, build, parse
from sheetbend.config.values import with_values

FILE = Path(__file__).parent / "twin_cloth.toml"
STIFFNESSES = ("cloth_warp", "cloth_weft", "cloth_shear", "cloth_bending", "cloth_bending_weft")
SWEEPS, FEW = 50, 5
LIMIT = 0.03


def main() -> int:
    config = parse(FILE)
    study = build(config, FILE.parent)
    found = sb.fit(study.experiments, parameters=study.parameters, **study.options)
    converged, hidden = (swept(config, found, sweeps) for sweeps in (SWEEPS, FEW))
    moved = {refit.name: dict(refit.moved) for refit in found.result.refits}
    moved[f"{SWEEPS} sweeps"] = {e.name: converged[e.name].value - e.value for e in found.result.estimates}
    words, ok = table(config, found, moved)
    words += ["", f"{FEW} Gauss-Seidel sweeps:", *verdicts(hidden)]
    words += ["", "the drape alone:", *verdicts(draped(config))]
    text = "\n".join(words) + "\n"
    folder = Path("out/twin_cloth")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "portability.txt").write_text(text)
    print(text, end="")
    return 0 if ok else 1


def swept(config: Config, found: sb.Fit, sweeps: int) -> sb.Fit:
    """The fit through Gauss-Seidel, from what was found."""
    study = build(with_values(config, found.values), FILE.parent)
    experiments = [by_gauss_seidel(e, sweeps) for e in study.experiments]
    return sb.fit(experiments, parameters=study.parameters, profiles=False)


def by_gauss_seidel(e: sb.Experiment, sweeps: int) -> sb.Experiment:
    return replace(e, solver=replace(e.solver, method="gauss_seidel", iterations=sweeps))


def draped(config: Config) -> sb.Fit:
    """The square alone, as a cloth of its own; Poisson's ratio, which it tells even less of, is known."""
    (square,) = (cloth for cloth in config.scene.cloth if cloth.name == "square")
    (shown,) = (recording for recording in config.recording if recording.static)
    known = {"name": "cloth", "poisson": config.published["cloth_poisson"]}
    alone = config.model_copy(
        update={
            "scene": config.scene.model_copy(update={"cloth": [square.model_copy(update=known)]}),
            "recording": [shown.model_copy(update={"leave_out": []})],
            "parameters": {name: config.parameters[name] for name in STIFFNESSES},
        }
    )
    study = build(alone, FILE.parent)
    finer = replace(study.options["refine"], linear=True)
    return sb.fit(study.experiments, parameters=study.parameters, refine=finer, profiles=False)


def table(config: Config, found: sb.Fit, moved: dict[str, dict[str, float]]) -> tuple[list[str], bool]:
    """Lines, and whether no stiffness moves too far."""
    head = ["", "true", "estimate", "95 % interval", *moved]
    rows, ok = [head], True
    for e in found.result.estimates:
        interval = f"{e.lower:.4g} to {e.upper:.4g}"
        shares = [moved[name][e.name] / e.value for name in moved]
        rows.append(
            [e.name, f"{config.published[e.name]:.4g}", f"{e.value:.4g}", interval, *(f"{s:+.2%}" for s in shares)]
        )
        if e.name in STIFFNESSES:
            ok &= all(abs(s) < LIMIT and abs(s) * e.value <= e.half_width for s in shares)
    widths = [max(len(row[k]) for row in rows) for k in range(len(head))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    verdict = "within" if ok else "NOT within"
    return [*lines, f"every stiffness moves {verdict} {LIMIT:.0%} and its interval"], ok


def verdicts(fit: sb.Fit) -> list[str]:
    return [f"  {e.name}: {e.value:.4g} {e.unit}, {e.words}" for e in fit.result.estimates]


if __name__ == "__main__":
    sys.exit(main())
