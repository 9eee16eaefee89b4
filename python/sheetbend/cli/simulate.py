"""sheetbend simulate: the motion or the rest of a configuration's scene, at its starting values."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console

from ..config import Study, load, scene_alone
from ..config.driven_motion import as_simulated
from ..config.errors import located
from ..doubts.touching import touches_of
from ..errors import ConfigError
from ..experiment.checks import check_substep
from ..experiment.experiment import Experiment
from ..experiment.force_readings import sensor_readings
from ..files.door import reading
from ..files.whole import written
from ..motion.depth import too_deep
from ..motion.equilibrium import equilibrium
from ..motion.simulate import Trajectory
from ..motion.simulate import simulate as run_simulation
from ..motion.solver import Solver
from ..pictures.movie import Motion, movie_paths, save_movie
from ..recording.recording import Recording
from ..report.report_contact import touches_section
from ..report.tables import plain_section
from ..result.motions import ContactFit
from ..scene.body import GROUND
from ..scene.scene import Scene
from .folders import made
from .meshes import WHOLE, MeshFormat, check_format, mesh_files, write_meshes
from .movies import OPTION, MoviePath, check_before
from .outcome import Json, Outcome, run
from .predicted import at_starting_values, predicted_files, save_predicted
from .screen import heading
from .targets import check_targets

FRAME = 0.01  # s between frames where no recording tells
DURATION = 1.0  # s where no recording tells


@dataclass(frozen=True)
class Task:
    """A scene and how it is to be run; `times` (frames,) s from its start. `predicted` gives the markers of its
    recording as measured and as simulated."""

    name: str
    scene: Scene
    solver: Solver
    times: np.ndarray
    static: bool = False
    at_rest: bool = False
    predicted: Callable[[], tuple[Recording, np.ndarray]] | None = None
    experiment: Experiment | None = None


def simulate(
    config: Annotated[
        Path,
        typer.Argument(
            help="A TOML configuration (docs/configuration.md), or the fitted.toml of a fit.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Folder for the trajectories. Default: out/NAME.", show_default=False),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Duration in s. Default: until the end of the recording.", show_default=False)
    ] = None,
    recording: Annotated[
        str | None, typer.Option(help="Name of a recording; only its scene is simulated.", show_default=False)
    ] = None,
    mesh: Annotated[
        MeshFormat | None,
        typer.Option(
            help="Also write meshes. obj, ply-sequence: each cloth as a folder with one file per frame. ply: each "
            "cloth in the last frame, with strain and energy of each triangle. gltf, usd: one file with the motion of "
            "all cloths and ropes.",
            show_default=False,
        ),
    ] = None,
    movie: MoviePath = None,
    finer: Annotated[
        bool,
        typer.Option(
            "--finer",
            help="Use a mesh that is twice as fine: twice the segments of ropes and twice the cells of cloths in each "
            "direction. This makes predictions of a fit with few segments more accurate.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Simulate a scene without fitting, and write its motion.

    The NPZ file contains times, positions, velocities, forces of the constraints, pressures of enclosed volumes, and
    readings of force sensors (sensor_NAME_times, _forces, _torques). If the scene has a recording, predicted_NAME.npz
    contains the simulated markers.

    Example: sheetbend simulate experiments/twin/twin.toml --output out/twin --movie motion.gif
    """
    run(lambda console: _simulate(console, config, output, duration, recording, mesh, movie, finer), json)


def _simulate(
    console: Console,
    path: Path,
    output: Path | None,
    duration: float | None,
    recording: str | None,
    mesh: MeshFormat | None,
    movie: Path | None,
    finer: bool,
) -> Outcome:
    if duration is not None and not (np.isfinite(duration) and duration > 0):
        raise ConfigError("--duration", "must be positive", duration, "give s")
    with reading(path, ConfigError):
        study = load(path, 2 if finer else 1)
        tasks = tasks_of(study, duration, recording, finer)
    name = study.config.experiment.name
    folder = output if output is not None else Path("out") / name
    if mesh is not None:
        check_format(mesh)
        if not any(task.scene.cloths or (mesh in WHOLE and (task.scene.ropes or task.scene.solids)) for task in tasks):
            needs = "a cloth, a solid or a rope" if mesh in WHOLE else "a cloth"
            raise ConfigError("--mesh", f"needs {needs}, and the scene has none", mesh.value, "leave it out")
    moving = [task for task in tasks if not task.static]
    if movie is not None:
        check_before(movie, [task.scene for task in moving])
    movies = {} if movie is None else movie_paths(movie, [task.name for task in moving])
    check_targets("--output", folder, [file for task in tasks for file in _files(task, folder, mesh)])
    if movie is not None:
        check_targets(OPTION, movie.parent, movies.values())
    made("--output", folder)
    heading(console, name, study.config.experiment.about)
    done = {task.name: _run(console, task, folder, mesh, movies.get(task.name)) for task in tasks}
    return Outcome({"name": name, "simulated": done})


def tasks_of(study: Study, duration: float | None, recording: str | None, finer: bool = False) -> list[Task]:
    """What a configuration asks to run: one task for each of its recordings, or its scene alone, on a mesh twice as
    fine where asked, as the study's is then.

    Raises:
        ConfigError: the configuration has no recording of that name.
    """
    experiments = [e for e in as_simulated(study) if recording in (None, e.name)]
    if recording is not None and not experiments:
        known = ", ".join(e.name for e in study.experiments) or "none"
        raise ConfigError("--recording", "is not in the configuration", recording, f"name one of: {known}")
    if experiments:
        return [_task(e, duration) for e in experiments]
    scene, solver = scene_alone(study.config, study.folder, 2 if finer else 1)
    with located("solver", "solver"):
        check_substep(solver.h, np.array([0.0, duration or DURATION]), "the motion")
    frame = round(max(FRAME / solver.h, 1.0)) * solver.h
    return [
        Task(study.config.experiment.name, scene, solver, np.arange(0.0, (duration or DURATION) + frame / 2, frame))
    ]


def _task(e: Experiment, duration: float | None) -> Task:
    """Frames as often as the recording's, on the substep grid."""

    def predicted() -> tuple[Recording, np.ndarray]:
        return at_starting_values(e, duration)

    if e.static:
        return Task(e.name, e.scene, e.solver, np.zeros(1), static=True, predicted=predicted)
    frame = float(np.median(np.diff(e.recording.times)))
    frame = max(round(frame / e.solver.h), 1) * e.solver.h
    length = duration or float(e.recording.times[-1]) - e.t0
    times = np.arange(0.0, length + frame / 2, frame)
    return Task(e.name, e.scene, e.solver, times, at_rest=e.start == "equilibrium", predicted=predicted, experiment=e)


def _files(task: Task, folder: Path, mesh: MeshFormat | None) -> list[Path]:
    """What a task leaves in the folder."""
    meshes = [] if mesh is None else mesh_files(task.name, task.scene, len(task.times), folder, mesh)
    markers = [] if task.predicted is None else [folder / file for file in predicted_files([task.name])]
    return [folder / f"{task.name}.npz", *markers, *meshes]


def _run(console: Console, task: Task, folder: Path, mesh: MeshFormat | None, movie: Path | None) -> dict[str, Any]:
    if task.experiment is not None and task.experiment.start == "estimated":
        told = f"{task.name} begins at the given start: a configuration does not hold the estimated one"
        warnings.warn(told, stacklevel=2)
    motion = motion_of(task)
    touches = touches_of(task.name, task.scene, motion) if motion.contacts else []
    depths = {c.contact: c.deepest for c in touches if c.deepest is not None}
    for words in too_deep(task.scene, None, depths):
        warnings.warn(f"in the motion of {task.name} {words}", stacklevel=2)
    path = folder / f"{task.name}.npz"
    arrays: dict[str, Any] = {f"force_{group}": values for group, values in motion.forces.items()}
    arrays |= {f"pressure_{name}": values for name, values in motion.pressures.items()}
    arrays |= _readings(task) | _poses(task, motion)
    with written(path) as beside:
        np.savez_compressed(
            beside, times=motion.times, positions=motion.positions, velocities=motion.velocities, **arrays
        )
    moved = np.linalg.norm(motion.positions - motion.positions[0], axis=2)
    more = {} if mesh is None else {"meshes": write_meshes(task.name, task.scene, motion, folder, mesh)}
    if task.predicted is not None:
        more["markers"] = [str(folder / file) for file in save_predicted(*task.predicted(), task.name, folder)]
    if movie is not None:
        save_movie(Motion(task.scene, motion.times, motion.nodes), movie, task.name)
        more["movie"] = [str(movie)]
    summary = {
        "npz": str(path),
        "frames": len(motion.times),
        "particles": task.scene.particle_count,
        "duration": float(motion.times[-1]),
        "h": task.solver.h,
        "largest_displacement": float(moved.max()),
        "largest_speed": float(np.linalg.norm(motion.velocities, axis=2).max()),
        "largest_force": {group: float(np.abs(values).max()) for group, values in motion.forces.items()},
        "contacts": {c.contact: _numbers(c) for c in touches},
        **more,
    }
    told = (
        "at rest"
        if task.static
        else f"{summary['duration']:.4g} s in {summary['frames']} frames, h = {task.solver.h:.4g} s"
    )
    reach = (
        ""
        if task.static
        else f", moved up to {summary['largest_displacement']:.4g} m at up to {summary['largest_speed']:.4g} m/s"
    )
    files = ", ".join([str(path), *(file for made in more.values() for file in made)])
    console.print(f"  {task.name}: {summary['particles']} particles, {told}{reach}; {files}", soft_wrap=True)
    if touches:
        console.print("\n".join(["", *plain_section(touches_section(touches))]), soft_wrap=True, highlight=False)
    return summary


def _numbers(touching: ContactFit) -> dict[str, Any]:
    numbers = asdict(touching)
    return {key: numbers[key] for key in numbers if key not in ("recording", "contact")}


def _poses(task: Task, motion: Trajectory) -> dict[str, np.ndarray]:
    """Where the bodies' frames are."""
    found: dict[str, np.ndarray] = {}
    for name, body in task.scene.bodies.items():
        if name != GROUND:
            found[f"body_{name}_positions"] = body.pose(motion)[0]
            found[f"body_{name}_quaternions"] = body.quaternions(motion)
    return found


def _readings(task: Task) -> dict[str, np.ndarray]:
    """What the recording's force sensors read along the motion, at the times at which they recorded."""
    e = task.experiment
    found: dict[str, np.ndarray] = {}
    if e is None:
        return found
    for sensor in e.forces:
        until = e.t0 + float(task.times[-1])
        times, read = sensor_readings(sensor, e.scene, e.solver, None, e.start, e.t0, until)
        parts = {"times": times, "forces": read[:, :3], "torques": read[:, 3:]}
        found |= {f"sensor_{sensor.name}_{key}": part for key, part in parts.items()}
    return found


def motion_of(task: Task) -> Trajectory:
    """The motion; of a shape at rest one frame with its forces."""
    start = None
    if task.static or task.at_rest:
        rest = equilibrium(task.scene)
        if task.static:
            still = np.zeros_like(rest.nodes)[None]
            own = slice(len(rest.positions))
            forces = {group: values[None] for group, values in rest.forces.items()}
            x = rest.nodes[None]
            return Trajectory(task.times, x[:, own], still[:, own], forces, nodes=x, node_velocities=still)
        start = rest.nodes
    return run_simulation(task.scene, task.times, task.solver, start=start)
