"""More of `wrong_calls.py`: calls of the textile laboratory, of torch and JAX, and of figures."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import sheetbend as sb
from sheetbend import textile
from sheetbend.optional import MissingExtraError

Call = tuple[Callable[..., Any], dict[str, Any]]
TIMES = [0.0, 0.01, 0.02]
STEP = sb.Solver(h=0.01)
PULLED = "strain (%),force (N)\n" + "".join(f"{k},{0.5 * k**1.5}\n" for k in range(12))


def rope() -> sb.Scene:
    return sb.rope(0.3, 4, density=0.05, EA=1e3, EI=1e-3, bend_damping=1e-3)


@cache
def motion() -> np.ndarray:
    return sb.simulate(rope(), TIMES, STEP).positions


def fabric() -> sb.Fabric:
    return sb.Fabric(density=0.2, warp=2000.0, weft=1500.0, shear=50.0, bending=2e-5)


@cache
def file() -> Path:
    path = Path(mkdtemp()) / "strip.csv"
    path.write_text(PULLED)
    return path


@cache
def curves() -> tuple[textile.Curve, ...]:
    return textile.read_curves(file(), length=0.2, width=0.05)


@cache
def loop(test: str) -> textile.Curve:
    """A KES loop of bending or shear, of which 30 % slide."""
    far, columns = {"bending": (2.5, "K [1/cm];M [gf cm/cm]"), "shear": (8.0, "angle [deg];F [gf/cm]")}[test]
    there = np.linspace(0.0, 1.0, 41)
    at = far * np.concatenate([there, there[-2::-1], -there[1:], -there[-2::-1]])
    slid, load = 0.0, list[float]()
    for x in at:
        slid = min(max(slid, x - 0.15 * far), x + 0.15 * far)
        load.append(0.5 * (x - 0.3 * slid))
    path = Path(mkdtemp()) / f"{test}.csv"
    path.write_text(f"{columns}\n" + "".join(f"{x:.5f};{y:.6f}\n" for x, y in zip(at, load, strict=True)))
    return textile.read_curves(path, test=test, length=0.2, width=0.05)[0]


@cache
def outline() -> Path:
    angle = np.linspace(0.0, 2 * np.pi, 60, endpoint=False)
    path = Path(mkdtemp()) / "drape.csv"
    path.write_text("".join(f"{130 * np.cos(a):.3f},{110 * np.sin(a):.3f}\n" for a in angle))
    return path


def sheet() -> sb.TriangleMesh:
    return sb.mesh.grid(0.1, 0.1, 2, 2)


TEXTILE: dict[str, Callable[[], Call]] = {
    "textile.cantilever": lambda: (
        textile.cantilever,
        {"fabric": fabric(), "along": "warp", "width": 0.025, "angle": 41.5, "cells": 4},
    ),
    "textile.uniaxial": lambda: (
        textile.uniaxial,
        {"fabric": fabric(), "along": "warp", "load": 20.0, "width": 0.2, "gauge": 0.05, "cells": 2},
    ),
    "textile.shear": lambda: (
        textile.shear,
        {
            "fabric": fabric(),
            "along": "warp",
            "angles": (0.5, 2.5),
            "tension": 9.8,
            "width": 0.2,
            "gauge": 0.05,
            "cells": 2,
        },
    ),
    "textile.picture_frame": lambda: (
        textile.picture_frame,
        {"fabric": fabric(), "angle": 5.0, "side": 0.2, "cells": 2},
    ),
    "textile.bias_extension": lambda: (
        textile.bias_extension,
        {"fabric": fabric(), "extension": 0.002, "length": 0.2, "width": 0.1, "cells": 2},
    ),
    "textile.drape_scene": lambda: (
        textile.drape_scene,
        {"fabric": fabric(), "diameter": 0.3, "plate": 0.18, "rings": 3, "friction": None, "cover": True},
    ),
    "textile.read_curves": lambda: (
        textile.read_curves,
        {
            "path": file(),
            "test": "tension",
            "length": 0.2,
            "width": 0.05,
            "columns": None,
            "units": None,
            "decimal": None,
        },
    ),
    "textile.mean_curve": lambda: (
        textile.mean_curve,
        {"curves": curves(), "way": "loading", "cycle": 0, "points": 10},
    ),
    "textile.tensile_loop": lambda: (textile.tensile_loop, {"curve": curves()[0], "cycle": 0}),
    "textile.fit_pull": lambda: (
        textile.fit_pull,
        {
            "curves": curves(),
            "along": "warp",
            "law": "exponential",
            "weights": 0.0,
            "way": "loading",
            "cycle": 0,
            "error": 0.005,
            "poisson": 0.0,
        },
    ),
    "textile.pulled": lambda: (
        textile.pulled,
        {
            "curves": curves(),
            "along": "warp",
            "way": "loading",
            "cycle": 0,
            "levels": 3,
            "error": 0.005,
            "cells": 2,
        },
    ),
    "textile.bending_loop": lambda: (
        textile.bending_loop,
        {"curve": loop("bending"), "cycle": 0, "slope": (50.0, 150.0), "at": 100.0},
    ),
    "textile.bending_yield": lambda: (textile.bending_yield, {"curve": loop("bending")}),
    "textile.shear_loop": lambda: (
        textile.shear_loop,
        {"curve": loop("shear"), "cycle": 0, "slope": (0.5, 2.5), "at": (0.5, 5.0)},
    ),
    "textile.shear_yield": lambda: (textile.shear_yield, {"curve": loop("shear"), "tension": 9.8}),
    "textile.read_outline": lambda: (textile.read_outline, {"path": outline(), "units": "mm", "width": None}),
    "textile.strains_under": lambda: (
        textile.strains_under,
        {"fabric": fabric(), "curves": curves(), "loads": [5.0, 10.0], "along": "warp", "cells": 2},
    ),
    "textile.forecast_pull": lambda: (
        textile.forecast_pull,
        {
            "curves": curves(),
            "strain": [0.05],
            "laws": ("exponential", "sinh"),
            "up_to": None,
            "way": "loading",
            "cycle": 0,
            "seed": 0,
        },
    ),
}

FIGURES: dict[str, Callable[[], Call]] = {
    "plot.trajectories": lambda: (
        sb.plot.trajectories,
        {"measured": motion(), "simulated": motion(), "times": TIMES},
    ),
    "plot.residuals": lambda: (
        sb.plot.residuals,
        {"measured": motion(), "simulated": motion(), "times": TIMES},
    ),
    "plot.shapes": lambda: (
        sb.plot.shapes,
        {"measured": [motion()[0]], "simulated": [motion()[-1]], "rings": (), "names": ("a",), "plane": (0, 2)},
    ),
    "plot.green_strain": lambda: (sb.plot.green_strain, {"mesh": sheet(), "positions": sheet().vertices}),
    "plot.largest_strain": lambda: (sb.plot.largest_strain, {"mesh": sheet(), "positions": sheet().vertices}),
    "mesh.write_obj_sequence": lambda: (
        sb.mesh.write_obj_sequence,
        {"folder": Path(mkdtemp()), "mesh": sheet(), "positions": sheet().vertices[None]},
    ),
    "mesh.write_ply_sequence": lambda: (
        sb.mesh.write_ply_sequence,
        {
            "folder": Path(mkdtemp()),
            "mesh": sheet(),
            "positions": sheet().vertices[None],
            "vertex_fields": None,
            "face_fields": None,
        },
    ),
}


def tensors() -> dict[str, Callable[[], Call]]:
    """Calls of torch; none where it is not installed."""
    try:
        import sheetbend.torch as st
    except MissingExtraError:
        return {}
    return {
        "torch.simulate": lambda: (
            st.simulate,
            {
                "scene": rope(),
                "times": TIMES,
                "solver": STEP,
                "values": {"rope_EI": 1e-3},
                "inputs": None,
                "lengths": None,
                "nodes": False,
            },
        ),
        "torch.equilibrium": lambda: (
            st.equilibrium,
            {"scene": rope(), "start": None, "values": {"rope_EI": 1e-3}, "inputs": None, "stable": True, "threads": 1},
        ),
        "torch.forces": lambda: (
            st.forces,
            {
                "scene": rope(),
                "times": TIMES[1:],
                "at": [0],
                "solver": STEP,
                "values": {"rope_EI": 1e-3},
                "start": "given",
                "quaternions": None,
            },
        ),
        "torch.SceneModule": lambda: (
            st.SceneModule,
            {"scene": rope(), "times": TIMES, "solver": STEP, "learn": ["rope_EI"]},
        ),
        "torch.Simulation": lambda: (st.Simulation, {"scene": rope(), "times": TIMES, "solver": STEP, "nodes": False}),
        "torch.Stepper": lambda: (st.Stepper, {"scene": rope(), "solver": STEP}),
    }


def arrays_of_jax() -> dict[str, Callable[[], Call]]:
    """Calls of JAX; none where it is not installed."""
    try:
        import sheetbend.jax as sj
    except MissingExtraError:
        return {}
    given = {"scene": rope(), "times": TIMES, "solver": STEP, "values": {"rope_EI": 1e-3}, "inputs": None}
    gravity = {"values": None, "inputs": {"gravity": np.array([0.0, 0.0, -9.81])}}
    return {
        "jax.simulate": lambda: (sj.simulate, {**given, "nodes": False}),
        "jax.simulate inputs": lambda: (sj.simulate, {**given, **gravity}),
    }


BESIDE = {**TEXTILE, **FIGURES, **tensors(), **arrays_of_jax()}
