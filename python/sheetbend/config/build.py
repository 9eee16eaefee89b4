"""From a configuration to experiments, parameters and fit options."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..arrays.checks import check_count, check_kind
from ..errors import ConfigError
from ..experiment.experiment import Experiment
from ..experiment.wanted import as_parameters
from ..minimum.discretization import Refinement
from ..motion.solver import Solver
from ..problem.smooth import Smooth, with_fields
from ..quantities.parameters import Parameters
from ..recording.windows import check_windows
from ..scene.scene import Scene
from . import schema
from .contacts import check_solver
from .errors import located
from .held import assumptions
from .marker_places import Listed
from .moment import Moment
from .recordings import (
    check_names_used,
    fields_of_experiment,
    offset_names,
    read,
    read_cloud,
    start_time,
    windows,
)
from .rest import check_rest
from .scenes import build_scene
from .sensors import force_sensors
from .shown import ropes_shown, with_grids, with_own_markers, without
from .solver_schema import solver_for
from .start_values import at_finer_values, check_names, fields_of_parameter, set_start_values
from .tools import tools_of

MOST_FINER = 64  # times as many segments and cells


@dataclass(frozen=True)
class Study:
    """A configuration, ready to run: what `sb.fit` takes."""

    config: schema.Config
    folder: Path
    experiments: tuple[Experiment, ...]
    parameters: Mapping[str, Mapping[str, Any]]

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What holds the ends of ropes, where markers without a place are, and what that assumes, in words."""
        return assumptions(self.config)

    @property
    def wanted(self) -> Parameters:
        """The parameters as `sb.fit` takes them, with the modes of fields and unknown inputs, not expanded."""
        given = as_parameters(self.parameters, self.experiments)
        return with_fields(given, self.experiments, smooth_fields(self.config))[0]

    @property
    def options(self) -> dict[str, Any]:
        """Keyword arguments of `sb.fit`."""
        fit = self.config.fit
        return {
            "optimizer": fit.optimizer,
            "starts": fit.starts,
            "windows": fit.windows,
            "tolerance": fit.tolerance,
            "refine": self._refinement,
            "given": {name: section.sd for name, section in self.config.given.items()},
            "smooth": smooth_fields(self.config),
            "profiles": fit.profiles,
            "bootstrap": fit.bootstrap,
            "leave_one_out": fit.leave_one_out,
            "max_iterations": fit.max_iterations,
            "threads": fit.threads,
        }

    @property
    def _refinement(self) -> Refinement:
        """Whatever has a mesh can be made finer, except a scene with a cloth whose stiffness varies: on other triangles
        the modes would have other shapes."""
        fit, scene = self.config.fit, self.config.scene
        varied = any(cloth.stiffness_modes for cloth in scene.cloth)
        if varied and fit.double_segments:
            fix = "leave it out; the intervals then contain no error of the mesh, which the report points out"
            raise ConfigError("fit.double_segments", "does not go with stiffness_modes of a cloth", True, fix)
        meshed = fit.double_segments is not False and bool(scene.strands or scene.cloth) and not varied
        finer = (lambda: build(self.config, self.folder, finer=2).experiments) if meshed else None
        return Refinement(halve_step=fit.halve_step, finer=finer, linear=fit.linear_refits or not fit.double_segments)


def smooth_fields(config: schema.Config) -> dict[str, Smooth]:
    """The argument `smooth` of `sb.fit` and `sb.identify`."""
    return {name: Smooth(section.size, section.length) for name, section in config.smooth.items()}


def build(config: schema.Config, folder: str | Path, finer: int = 1) -> Study:
    """Read the recordings and build one scene for each.

    Args:
        folder: files are relative to it.
        finer: multiplies the segments of every rope and the cells of every cloth.

    Raises:
        ConfigError: anything that cannot be built, with the path of its key.
    """
    folder = _checked(config, folder, finer)
    check_solver(config.scene, config.solver)
    config = config if finer == 1 else at_finer_values(config)
    experiments = tuple(_experiment(config, folder, i, finer) for i in range(len(config.recording)))
    names = [e.name for e in experiments]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ConfigError(
                f"recording[{i}].name", "is another recording's too", name, "give each recording a name of its own"
            )
    parameters = {name: fields_of_parameter(p) for name, p in config.parameters.items()}
    if experiments:
        check_names(config, experiments)
    study = Study(config, folder, experiments, parameters)
    if experiments and parameters:  # raise here, where the path is known
        with located("parameters"):
            wanted = as_parameters(parameters, experiments)
        with located("smooth", "smooth"):
            with_fields(wanted, experiments, smooth_fields(config))
    return study


def scene_alone(config: schema.Config, folder: str | Path = Path(), finer: int = 1) -> tuple[Scene, Solver]:
    """The scene of a configuration without recordings, and its solver; `folder` and `finer` as in `build`."""
    folder = _checked(config, folder, finer)
    check_solver(config.scene, config.solver)
    tools = tools_of(config.scene, {}, None, 0.0, folder, "")
    scene, _ = build_scene(config.experiment.name, config.scene, None, {}, finer, folder=folder, tools=tools)
    set_start_values(scene, config, {}, "")
    solver = solver_for(config.solver, None)
    with located("scene"):
        assert scene.compiled
    solver.core(scene.compiled)  # raise or warn here, before any work starts
    return scene, solver


def _checked(config: schema.Config, folder: str | Path, finer: int) -> Path:
    """The folder of a configuration whose arguments are of their kinds."""
    check_kind("config", config, schema.Config, "give what `parse` returns", ConfigError)
    if not isinstance(folder, str | Path):
        raise ConfigError("folder", "must be a path", folder, "give the folder of its files")
    check_count("finer", finer, 1, MOST_FINER, ConfigError)
    return Path(folder)


def _experiment(config: schema.Config, folder: Path, i: int, finer: int) -> Experiment:
    section, path = config.recording[i], f"recording[{i}]"
    recording = read(section, folder, path)
    shown = recording if section.cloud is None else read_cloud(section, folder, path, recording.name)
    with located(path):
        t0 = start_time(section, shown)
        check_windows(shown, *windows(section), section.start_time, section.static)
        part = recording.piece(*(section.fit if section.static and section.fit else (t0, None)))
    moment = Moment(part, recording, t0, section.static, section.max_gap)
    ropes = ropes_shown(config, section, path)
    listed = Listed.of(config, section, path, recording)
    described = with_grids(without(config.scene, section.leave_out, path), section.grids, path)
    described = with_own_markers(described, section.here, path)
    tools = tools_of(described, section.tools, recording, t0, folder, path)
    seats = listed.seats(described, ropes)
    scene, particles = build_scene(recording.name, described, moment, seats, finer, ropes, folder, tools)
    forces = force_sensors(path, section.force, scene, particles, folder)
    set_start_values(scene, config, section.values, path)
    if section.static or section.start == "equilibrium":
        check_rest(f"{path}.static" if section.static else f"{path}.start", described, scene)
    places = listed.places(described, seats, scene, particles)
    with located(path, recording.name):
        experiment = Experiment(
            scene=scene,
            recording=shown,
            markers=None if section.cloud else places or None,
            solver=solver_for(config.solver, recording, section.static),
            forces=forces,
            offsets=offset_names(path, section, scene),
            **fields_of_experiment(section),
        )
        check_names_used(path, section, experiment)
        experiment.observed(experiment.fitted())  # raise here, where the path is known
    with located("scene"):
        assert scene.compiled
    if not section.static:
        experiment.solver.core(scene.compiled)  # raise here, before any work starts
    return experiment
