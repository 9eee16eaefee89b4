"""What is drawn and fitted: ropes, cloth and pulls with known truth, each fit in some tenths of a second."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache

import chaotic_cases as chaotic
import contact_cases as contact
import middle_cases as middle
import numpy as np
import population_cases as many
import sheetbend as sb
from sheetbend import textile
from sheetbend.experiment.wanted import as_parameters
from sheetbend.problem.problem import FitProblem
from sheetbend.result.estimate import Estimate

SIGMA = 3e-3  # m
ALIKE = 0.8  # correlation of neighboring frames


@dataclass(frozen=True)
class Case:
    """Draws of noise on one clean recording.

    Attributes:
        about: in words.
        truth: by parameter.
        fit: (seed) -> estimates by name.
        least, most: of 200 draws, how many intervals are to hold the truth.
        beside: the case whose half-widths these are compared with.
    """

    about: str
    truth: Mapping[str, float]
    fit: Callable[[int], Mapping[str, Estimate]]
    least: int = 182
    most: int = 198
    beside: str = ""


def white(shape: tuple[int, ...], seed: int) -> np.ndarray:
    return SIGMA * np.random.default_rng(seed).standard_normal(shape)


def autoregressive(shape: tuple[int, ...], seed: int) -> np.ndarray:
    """Of first order along the frames, with the same standard deviation."""
    noise = white(shape, seed)
    for k in range(1, len(noise)):
        noise[k] = ALIKE * noise[k - 1] + np.sqrt(1 - ALIKE**2) * noise[k]
    return noise


def seen(e: sb.Experiment) -> np.ndarray:
    """Markers of an experiment's own scene."""
    problem = FitProblem([e], as_parameters(list(e.scene.quantities)[:1], [e]))
    return problem.simulate(problem.parameters.initial())[0]


def blank(markers: int, frames: int, name: str) -> sb.Recording:
    return sb.Recording(positions=np.zeros((frames, markers, 3)), times=np.arange(frames) / 60, name=name)


LINKS = 40
ROPE = {"rope_EI": 1e-3, "rope_bend_damping": 0.01, "rope_drag_linear": 5e-3}


def rope(links: int, solver: sb.Solver | None = None, share: float = 1.0) -> sb.Experiment:
    """Clamped level and let go; six markers, 0.8 s."""
    numbers = {name.removeprefix("rope_"): share * value for name, value in ROPE.items()}
    scene = sb.rope(0.5, links, density=0.05, clamp_start=(1, 0, 0), **numbers)
    places = [sb.on_rope(scene.ropes["rope"], 0.5 * (k + 1) / 6) for k in range(6)]
    return sb.Experiment(
        scene=scene,
        recording=blank(6, 49, "rope"),
        markers=places,
        solver=solver or sb.Solver(h=1 / 240),
        sigma=SIGMA,
    )


CLOTH = {"cloth_warp": 60.0, "cloth_bending": 5e-5, "cloth_drag_linear": 0.1}


def cloth(cells: int, solver: sb.Solver | None = None, share: float = 1.0) -> sb.Experiment:
    """A sheet of 0.2 m held along one side and let go; twelve markers, 0.3 s."""
    scene, mesh = sb.Scene("sheet"), sb.mesh.grid(0.2, 0.2, cells, cells, "one_way")
    numbers = {name.removeprefix("cloth_"): share * value for name, value in CLOTH.items()}
    held = np.flatnonzero(mesh.material[:, 0] == 0.0)
    known = {"density": 0.15, "weft": 40.0, "shear": 12.0, "membrane_damping": 1e-3}
    sheet = sb.add_cloth(scene, mesh, held=held, **known, **numbers)
    scene.pin(sheet.particles[held])
    spots = np.array([(x, y) for x in (0.2 / 3, 0.4 / 3, 0.2) for y in np.linspace(0, 0.2, 4)])
    return sb.Experiment(
        scene=scene,
        recording=blank(12, 19, "sheet"),
        markers=list(sb.on_cloth(sheet, spots)),
        solver=solver or sb.Solver(h=1 / 240, method="newton"),
        sigma=SIGMA,
    )


Make = Callable[..., sb.Experiment]


def of_motion(
    make: Make,
    size: int,
    clean: Callable[[], np.ndarray],
    truth: Mapping[str, float],
    noise: Callable[[tuple[int, ...], int], np.ndarray] = white,
    refine: str | None = None,
) -> Callable[[int], Mapping[str, Estimate]]:
    """A fit that starts at 1.3 times the truth; `refine` counts its "step", or "mesh" and step, or nothing."""
    known = cache(clean)

    def fit(seed: int) -> Mapping[str, Estimate]:
        e = make(size, share=1.3)
        recording = replace(e.recording, positions=known() + noise(known().shape, seed))
        finer = sb.Refinement(finer=lambda: [replace(make(2 * size), recording=recording)], linear=True)
        counted = {"step": "auto", "mesh": finer, None: False}[refine]
        found = sb.fit(replace(e, recording=recording), parameters=list(truth), refine=counted)
        return {name: found[name] for name in truth}

    return fit


PULL = {"warp": 3000.0, "warp_stiffening": 400.0}
SCATTER = 0.03  # of each point of a pull, relative
STRAINS = np.linspace(0.0, 0.05, 41)


def pull(seed: int) -> Mapping[str, Estimate]:
    """Five specimens of an exponential fabric, whose readings scatter by 3 % independently at every level."""
    clean = pulled_loads()
    rng = np.random.default_rng(seed)
    curves = [
        textile.Curve(f"specimen {k}", "tension", STRAINS, clean * (1 + SCATTER * rng.standard_normal(len(clean))))
        for k in range(5)
    ]
    found = textile.fit_pull([replace(c, length=0.2, width=0.05) for c in curves], error=1e-4)
    return {e.name: e for e in found.estimates}


def pulled_loads() -> np.ndarray:
    """Loads at the strains, N/m, of a strip whose sides are free: Fung's law in closed form."""
    green = STRAINS + STRAINS**2 / 2
    return PULL["warp"] * np.exp(PULL["warp_stiffening"] * green**2) * green * (1 + STRAINS)


def fine(links: int) -> Callable[[], np.ndarray]:
    """A rope of so many links at a fourth of the step, extrapolated."""
    return lambda: seen(rope(links, sb.Solver(h=1 / 960, extrapolate=2)))


CASES: Mapping[str, Case] = {
    "rope": Case("ropes, white noise", ROPE, of_motion(rope, LINKS, lambda: seen(rope(LINKS)), ROPE)),
    "rope_ar1": Case(
        "ropes, AR(1) noise of 0.8",
        ROPE,
        of_motion(rope, LINKS, lambda: seen(rope(LINKS)), ROPE, autoregressive),
        least=178,
        most=200,
    ),
    "rope_step": Case(
        "ropes measured at a finer step",
        ROPE,
        of_motion(rope, LINKS, fine(LINKS), ROPE, refine="step"),
        least=180,
        most=200,
        beside="rope",
    ),
    "rope_finer": Case(
        "ropes measured on a finer mesh and step",
        ROPE,
        of_motion(rope, LINKS, fine(3 * LINKS), ROPE, refine="mesh"),
        least=180,
        most=200,
        beside="rope",
    ),
    "cloth": Case("cloth, white noise", CLOTH, of_motion(cloth, 4, lambda: seen(cloth(4)), CLOTH)),
    "pull": Case("pulls of five specimens, white noise", PULL, pull),
    "population": Case("50 ropes with a spread of 10 %", many.TRUTH, many.fit_population, least=180, most=200),
    "chaotic": Case("a double pendulum over 20 s, shot", chaotic.TRUTH, chaotic.fit, least=180, most=200),
    "middle": Case("a rope of 40 links from the middle of its motion", middle.TRUTH, middle.fit, least=180, most=200),
    "contact_drag": Case(
        "rope dragged over a table", contact.DRAG, contact.twin(contact.drag, contact.DRAG), least=180, most=200
    ),
    "contact_drawn": Case(
        "cloth drawn over a table's edge",
        contact.DRAWN,
        contact.twin(contact.drawn, contact.DRAWN),
        least=180,
        most=200,
    ),
    "contact_over": Case(
        "rope over a cylinder, with its force",
        contact.OVER,
        contact.twin(contact.over, contact.OVER, sensed=True),
        least=180,
        most=200,
    ),
}
