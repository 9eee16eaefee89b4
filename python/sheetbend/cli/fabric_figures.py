"""The pictures of a fabric: its pulls beside the fitted law, and the drape beside the fabric's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console

from ..config.fabric_tests import FabricStudy
from ..motion.equilibrium import Equilibrium
from ..optional import MissingExtraError, require
from ..pictures import plotting
from ..pictures.drawing import ACCENT, GRAY, PALE, clean, key, panels_in
from ..textile import WholeFabric, mean_curve
from ..textile.laboratory import as_draped
from ..textile.shadow import shadow
from .textile_figure import write_figure

PICTURES = ("warp.png", "weft.png", "drape.png")


def fabric_pictures(console: Console, study: FabricStudy, found: WholeFabric, folder: Path) -> list[str]:
    """Write what can be drawn, and give the files' names; says so where matplotlib is missing."""
    try:
        require("matplotlib.figure", "plot")
    except MissingExtraError as error:
        console.print(f"no figures will be drawn: {error}", markup=False, soft_wrap=True)
        return []
    tests, written = study.tests, []
    for along, curves in tests.pulls.items():
        mean = mean_curve(curves, tests.way, cycle=tests.cycle)
        written += write_figure(curves, mean, tests.way, found.fit, along, "png", folder, name=along)
    if study.config.drape is not None:
        _draw_drape(study, found, folder / "drape.png")
        written.append("drape.png")
    return written


def draped_rest(study: FabricStudy, found: WholeFabric) -> Equilibrium:
    """The state of the fitted fabric with as many folds as the outlines have."""
    sizes = study.config.drape
    assert sizes is not None  # what sent it here
    return as_draped(found.fit.fabric, study.outlines, sizes.plates()).rest


def _draw_drape(study: FabricStudy, found: WholeFabric, path: Path) -> None:
    """Outlines about their middles, the folds of the fabric's own turned to those of the first."""
    sizes, rest = study.config.drape, draped_rest(study, found)
    assert sizes is not None
    cloth = rest.scene.cloths["cloth"]
    own = shadow(rest.positions[cloth.particles], cloth.mesh.edges, cloth.mesh.sets["rim"])
    (panel,), _ = panels_in(None, 1, (4.4, 4.6), " ")
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    panel.fill(500.0 * sizes.plate * np.cos(turn), 500.0 * sizes.plate * np.sin(turn), color=PALE)
    panel.plot(500.0 * sizes.diameter * np.cos(turn), 500.0 * sizes.diameter * np.sin(turn), color=PALE, linewidth=0.8)
    first = np.zeros(0)
    for outline in study.outlines:
        x, y = 1e3 * (outline.points - outline.points.mean(axis=0)).T
        panel.plot(np.append(x, x[0]), np.append(y, y[0]), color=GRAY, linewidth=0.9)
        first = first if len(first) else _radii(x, y)
    angle = 2.0 * np.pi * (np.arange(len(own.radius)) + 0.5) / len(own.radius)
    size, radius = len(first), np.interp(2.0 * np.pi * np.arange(len(first)) / len(first), angle, own.radius)
    shift = int(np.fft.irfft(np.fft.rfft(first) * np.conj(np.fft.rfft(radius)), size).argmax())
    turned = np.append(angle, angle[0]) + 2.0 * np.pi * shift / size
    r = 1e3 * np.append(own.radius, own.radius[0])
    panel.plot(r * np.cos(turned), r * np.sin(turned), color=ACCENT, linewidth=1.6)
    clean(panel)
    panel.set_aspect("equal")
    panel.set(xlabel="[mm]", ylabel="[mm]")
    key(panel, [("shadows", GRAY), ("fitted fabric", ACCENT)])
    plotting.save(panel, path)


def _radii(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The distance of an outline from the origin, at 360 even angles from 0."""
    angle = np.arctan2(y, x) % (2.0 * np.pi)
    order = np.argsort(angle)
    at = 2.0 * np.pi * np.arange(360) / 360
    return np.interp(at, angle[order], np.hypot(x, y)[order], period=2.0 * np.pi)
