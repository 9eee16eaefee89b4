"""Old names of modules, functions and methods, for one version: what uses them warns, and pickles that name them load.

Until version 0.2. Names of `sheetbend` itself and of its packages mesh, textile, gripped, torch and config never moved;
they are what users import from.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

MODULES = {
    "arrays": "checks column rigid smoothing timeseries",
    "doubts": (
        "beginnings conclude contradictions driven_noise floors force_comparison given leave_one_out losses misread "
        "prediction roughness stationary unexplained"
    ),
    "experiment": "carried clock correction force_readings force_sensor",
    "files": "door json_file memory names typed units whole",
    "fitting": "fit fitted_motion",
    "minimum": "approach discretization fine_meshes growth linear_step optimizers refuted search time_step windows",
    "motion": (
        "balance equilibrium extrapolation gradient_probe gradients redundancy rollout simulate solver tape values"
    ),
    "objects": (
        "arm arm_data chain cloth elastic_group fabric grip hand_eye hinges markers pivot rod rod_end rod_joints "
        "rod_junction rod_shape rope sheet_bending tethers tool"
    ),
    "pictures": "drawing field_plot force_plot movie plotting strain",
    "problem": "jacobian_check journal",
    "quantities": "kinds parameters wording",
    "recording": (
        "baseline force_recording io io.c3d io.cells io.clock io.csv io.deform io.folder io.mesh_sequence io.motive "
        "io.natural io.npz io.pickled_arrays io.plain_pickle io.poses io.sidecar io.vicon marker_data oscillation "
        "recording_checks"
    ),
    "report": "report_driven scores tables",
    "scene": (
        "air boundary compiled domain forces frames group kinks moving_clamp rest_values scene_checks scene_data "
        "scene_file scene_reader volume"
    ),
    "statistics": "blocks covariance gauge identifiability intervals judge profile",
}
"""The modules sheetbend.NAME that are sheetbend.PACKAGE.NAME now, by package."""

CONTENTS = {
    "experiment": {
        "experiment.experiment": "Experiment",
    },
    "problem": {
        "problem.problem": "FitProblem",
    },
    "quantities": {
        "quantities.quantities": "FUNCTIONS ZERO_OR_MORE Quantity Term Builder term product",
    },
    "recording": {
        "recording.recording": "Recording",
    },
    "report": {
        "report.report": "sections headline plain rich_report",
    },
    "result": {
        "result.estimate": "UNSOUND VERDICTS Estimate Given Premise Correlation",
        "result.motions": "RecordingFit ForceFit MotionGrowth",
        "result.result": "Misfit Start Refit",
        "report.fit_result": "FORMAT FitResult",
    },
    "scene": {
        "scene.scene": "Scene",
    },
}
"""What modules held that have the name of a package now, by the module where it is."""

RENAMED = {
    "Exponential": "laws.Exponential",
    "Linear": "laws.Linear",
    "Sinh": "laws.Sinh",
    "Spline": "laws.Spline",
    "no_physics": "baseline",
    "recordings": "read_recordings",
}
"""Names of `sheetbend` itself that have another now."""


class _Moved(ModuleType):
    """What stands under the old name of a module, and imports the new one when it is asked for something."""

    def __init__(self, old: str, new: str) -> None:
        super().__init__(old, f"Moved to {new}.")
        self._new = new

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return _found(self.__name__, self._new, name)


class OldMethod:
    """An old name of a method, as an attribute of its class: using it warns, and gives the method of the new name."""

    def __init__(self, now: str) -> None:
        self._now = now

    def __set_name__(self, _: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: Any, owner: type) -> Any:
        message = f"{owner.__name__}.{self._name} goes in version 0.2: use {owner.__name__}.{self._now}"
        warnings.warn(message, DeprecationWarning, stacklevel=2)
        return getattr(owner if instance is None else instance, self._now)


def keep_old_modules() -> None:
    """Make `import sheetbend.OLD` find the modules of `MODULES`; none of them is imported before it is used."""
    for package, names in MODULES.items():
        for name in names.split():
            old = f"sheetbend.{name}"
            # Entered here and not through a finder, which would also set sheetbend.fit, a function, to the module.
            sys.modules.setdefault(old, _Moved(old, f"sheetbend.{package}.{name}"))


def old_contents(package: str) -> Callable[[str], Any]:
    """`__getattr__` of a package that has the name of an old module: what that module held is found where it is now."""
    now = {name: new for new, names in CONTENTS[package.partition(".")[2]].items() for name in names.split()}

    def getattr_(name: str) -> Any:
        if name not in now:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return _found(package, f"sheetbend.{now[name]}", name)

    return getattr_


def renamed(name: str, level: int = 3) -> Any:
    """What `sheetbend` offered under a name of `RENAMED`.

    Raises:
        AttributeError: the name is none of those.
    """
    if name not in RENAMED:
        raise AttributeError(f"module 'sheetbend' has no attribute {name!r}")
    found: Any = import_module("sheetbend")
    for part in RENAMED[name].split("."):
        found = getattr(found, part)
    message = f"sheetbend.{name} goes in version 0.2: use sheetbend.{RENAMED[name]}"
    warnings.warn(message, DeprecationWarning, stacklevel=level)
    return found


def _found(old: str, new: str, name: str) -> Any:
    try:
        found = getattr(import_module(new), name)
    except AttributeError:
        if name in RENAMED:
            return renamed(name, 4)
        raise AttributeError(f"module {old!r}, now {new!r}, has no attribute {name!r}") from None
    public = getattr(sys.modules["sheetbend"], name, None) is found
    use = f"from sheetbend import {name}" if public else f"use {new}.{name}"
    message = f"{old} has moved, and its old name goes in version 0.2: {use} (a pickle: load it and save it again)"
    warnings.warn(message, DeprecationWarning, stacklevel=3)
    return found
