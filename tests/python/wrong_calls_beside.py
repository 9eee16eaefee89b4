"""More of `wrong_calls.py`: calls of the textile laboratory, of torch, and of figures."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import sheetbend as sb
from sheetbend import textile

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
}


def tensors() -> dict[str, Callable[[], Call]]:
    """Calls of torch; none where it is not installed."""
    try:
        import sheetbend.torch as st
    except sb.MissingExtraError:
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


BESIDE = {**TEXTILE, **FIGURES, **tensors()}
