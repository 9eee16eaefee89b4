"""From a configuration to experiments, parameters and fit options."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ConfigError, RecordingError
from ..experiment.experiment import Experiment
from ..minimum.discretization import Refinement
from ..minimum.problem import as_parameters
from ..motion.solver import Solver
from ..objects.cloth import Cloth
from ..objects.markers import Place, between, on_cloth, on_particle, on_rope
from ..recording.recording import Recording
from ..recording.recording_checks import marker_indices
from ..recording.unit_doubt import extent, unit_doubt
from ..scene.scene import Scene
from . import schema
from .cloth_markers import places_on_cloths
from .cloth_schema import MarkerGrid
from .errors import located
from .forces import force_sensors
from .held import assumptions
from .moment import Moment
from .rest import check_rest
from .rope_points import Seats
from .rope_schema import Rod, Rope
from .ropes import check_markers
from .scene_schema import SceneSection
from .scenes import Particles, build_scene
from .tools import tools_of

SUBSTEPS = 10
OPTIONAL = ("cloth", "particles", "constraints", "point_mass", "force")
"""Lists of the scene that a recording can leave out by name."""


@dataclass(frozen=True)
class Study:
    """A configuration, ready to run: what `sb.fit` takes."""

    config: schema.Config
    folder: Path
    experiments: tuple[Experiment, ...]
    parameters: Mapping[str, Mapping[str, Any]]

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What holds the ends of ropes, and what that assumes, in words."""
        return assumptions(self.config.scene)

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
            "profiles": fit.profiles,
            "leave_one_out": fit.leave_one_out,
            "max_iterations": fit.max_iterations,
            "threads": fit.threads,
        }

    @property
    def _refinement(self) -> Refinement:
        """Whatever has a mesh can be made finer."""
        fit, scene = self.config.fit, self.config.scene
        meshed = fit.double_segments is not False and bool(scene.strands or scene.cloth)
        finer = (lambda: build(self.config, self.folder, finer=2).experiments) if meshed else None
        return Refinement(halve_step=fit.halve_step, finer=finer, linear=fit.linear_refits or not fit.double_segments)


def build(config: schema.Config, folder: Path, finer: int = 1) -> Study:
    """Read the recordings and build one scene for each.

    Args:
        folder: files are relative to it.
        finer: multiplies the segments of every rope and the cells of every cloth.

    Raises:
        ConfigError: anything that cannot be built, with the path of its key.
    """
    experiments = tuple(_experiment(config, folder, i, finer) for i in range(len(config.recording)))
    names = [e.name for e in experiments]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ConfigError(
                f"recording[{i}].name", "is another recording's too", name, "give each recording a name of its own"
            )
    parameters = {name: _given(p) for name, p in config.parameters.items()}
    if experiments:
        _check_names(config, experiments)
    if experiments and parameters:
        with located("parameters"):
            as_parameters(parameters, experiments)  # raise here, where the path is known
    return Study(config, folder, experiments, parameters)


def scene_alone(config: schema.Config, folder: Path = Path()) -> tuple[Scene, Solver]:
    """The scene of a configuration without recordings, and its solver; files of meshes are relative to `folder`."""
    tools = tools_of(config.scene, {}, None, 0.0, folder, "")
    scene, _ = build_scene(config.experiment.name, config.scene, None, {}, folder=folder, tools=tools)
    _start_values(scene, config, {}, "")
    solver = solver_for(config.solver, None)
    solver.core(scene.compiled)  # raise or warn here, before any work starts
    return scene, solver


def solver_for(section: schema.SolverSection, recording: Recording | None) -> Solver:
    """The solver, its substep taken from the recording's median frame interval where `h` is not given."""
    fields = section.model_dump(exclude={"h", "substeps"}, exclude_none=True)
    if section.h is not None:
        return Solver(h=section.h, **fields)
    if recording is None or len(recording.times) < 2:
        return Solver(**fields)
    return Solver(h=float(np.median(np.diff(recording.times))) / (section.substeps or SUBSTEPS), **fields)


def _experiment(config: schema.Config, folder: Path, i: int, finer: int) -> Experiment:
    section, path = config.recording[i], f"recording[{i}]"
    recording = _read(section, folder, path)
    with located(path):
        t0 = _start(section, recording)
        for key in ("fit", "held_out"):
            _check_window(f"{path}.{key}", getattr(section, key), recording)
        part = recording.piece(*(section.fit if section.static and section.fit else (t0, None)))
    moment = Moment(part, recording, t0, section.static, section.max_gap)
    ropes = _shown(config, section, path)
    shared = not section.marker
    markers = config.marker if shared else section.marker
    where = "marker" if shared else f"{path}.marker"
    numbers = [_number(f"{where}[{k}].marker", m.marker, recording) for k, m in enumerate(markers)]
    described = _with_grids(_without(config.scene, section.leave_out, path), section.grids, path)
    tools = tools_of(described, section.tools, recording, t0, folder, path)
    seats = _along(described, ropes, markers, numbers, recording)
    scene, particles = build_scene(recording.name, described, moment, seats, finer, ropes, folder, tools)
    forces = force_sensors(path, section.force, scene, particles, folder)
    _start_values(scene, config, section.values, path)
    if section.static or section.start == "equilibrium":
        check_rest(f"{path}.static" if section.static else f"{path}.start", described, scene)
    places = {
        recording.markers[n]: _place(f"{where}[{k}]", m, scene, particles)
        for k, (m, n) in enumerate(zip(markers, numbers, strict=True))
    }
    places = (
        places_on_cloths(described.cloth, scene, recording) | _on_ropes(described, seats, scene, recording) | places
    )
    plain = section.model_dump(
        include={
            "static",
            "start",
            "start_time",
            "predict",
            "sigma",
            "driven_sigma",
            "axes",
            "radius",
            "loss",
            "loss_scale",
            "time_offset",
        }
    )
    with located(path, recording.name):
        experiment = Experiment(
            scene=scene,
            recording=recording,
            markers=places or None,
            fit=_window(section.fit),
            held_out=_window(section.held_out),
            solver=solver_for(config.solver, recording),
            forces=forces,
            offsets={m: _offset(f"{path}.offsets.{m}", names, scene) for m, names in section.offsets.items()},
            **plain,
        )
        _known(path, section, experiment)
        experiment.observed(experiment.fitted())  # raise here, where the path is known
    with located("scene"):
        assert scene.compiled
    if not section.static:
        experiment.solver.core(scene.compiled)  # raise here, before any work starts
    return experiment


def _read(section: schema.RecordingSection, folder: Path, path: str) -> Recording:
    file = folder / section.file
    if not file.exists():
        raise ConfigError(
            f"{path}.file", "does not exist", str(file), "give a file relative to the configuration's folder"
        )
    try:
        recording = Recording.load(file, section.units)
        if section.frames is not None:
            recording = recording.frames(slice(*section.frames))
    except RecordingError as error:
        raise ConfigError(f"{path}.{error.field}", error.problem, error.got, error.fix) from error
    doubt = unit_doubt(recording) if section.units is None else None
    if doubt is not None:
        problem = f"are not said, and in the unit that was read the markers are {extent(recording):.4g} m apart"
        raise ConfigError(f"{path}.units", problem, None, f'give units = "{doubt}", or "m" if it is so')
    return replace(recording, name=section.name or recording.name)


def _start(section: schema.RecordingSection, recording: Recording) -> float:
    if section.start_time is not None:
        return section.start_time
    return section.fit[0] if section.fit is not None else float(recording.times[0])


def _window(window: list[float] | None) -> tuple[float, float] | None:
    return None if window is None else (window[0], window[1])


def _number(path: str, marker: str | int, recording: Recording) -> int:
    try:
        return marker_indices("marker", (marker,), recording.markers)[0]
    except RecordingError as error:
        raise ConfigError(path, error.problem, error.got, error.fix) from error


def _shown(config: schema.Config, section: schema.RecordingSection, path: str) -> list[str]:
    """Names of the ropes that a recording shows."""
    every = [rope.name for _, rope in config.scene.strands]
    unknown = [name for name in section.ropes or () if name not in every]
    if unknown:
        raise ConfigError(
            f"{path}.ropes", "name no rope of the scene", unknown, f"name some of: {', '.join(every) or 'none'}"
        )
    return every if section.ropes is None else section.ropes


def _without(scene: SceneSection, names: list[str], path: str) -> SceneSection:
    """The scene's description less what a recording leaves out."""
    every = {part.name for key in OPTIONAL for part in getattr(scene, key) if part.name} | set(scene.quantities)
    unknown = [name for name in names if name not in every]
    if unknown:
        fix = f"name some of: {', '.join(sorted(every)) or 'none'}"
        raise ConfigError(f"{path}.leave_out", "name nothing that can be left out", unknown, fix)
    kept = {key: [part for part in getattr(scene, key) if part.name not in names] for key in OPTIONAL}
    quantities = {name: q for name, q in scene.quantities.items() if name not in names}
    return scene.model_copy(update={**kept, "quantities": quantities})


def _with_grids(scene: SceneSection, grids: Mapping[str, MarkerGrid], path: str) -> SceneSection:
    """The scene's description with a recording's own grids of markers."""
    unknown = set(grids) - {cloth.name for cloth in scene.cloth}
    if unknown:
        fix = f"name some of: {', '.join(cloth.name for cloth in scene.cloth) or 'none'}"
        raise ConfigError(f"{path}.grids", "name no cloth of the scene", sorted(unknown), fix)
    cloths = [c.model_copy(update={"grid": grids[c.name]}) if c.name in grids else c for c in scene.cloth]
    return scene.model_copy(update={"cloth": cloths})


def _along(
    scene: SceneSection,
    ropes: list[str],
    markers: list[schema.Marker],
    numbers: list[int],
    recording: Recording,
) -> dict[str, Seats]:
    """Per rope or rod the markers on it, in order along it."""
    strands = {rope.name: (at, rope) for at, rope in scene.strands if rope.name in ropes}
    for at, rope in strands.values():
        check_markers(at, rope, recording.markers)
    if not markers and not any(rope.markers for _, rope in strands.values()):
        return {name: _evenly(at, rope, recording) for name, (at, rope) in strands.items()} if len(strands) == 1 else {}
    number = {marker: k for k, marker in enumerate(recording.markers)}
    placed: dict[str, Seats] = {}
    for name, (_, rope) in strands.items():
        mine = [(arc, number[marker]) for marker, arc in (rope.markers or {}).items()]
        mine += [
            (m.arc_length, n)
            for m, n in zip(markers, numbers, strict=True)
            if m.arc_length is not None and m.rope in (name, None)
        ]
        placed[name] = sorted(mine)
    return placed


def _evenly(path: str, rope: Rope | Rod, recording: Recording) -> Seats:
    """All markers at equal distances from end to end; of a grip's, one or two, the inner one is the end's own."""
    count = len(recording.markers)
    moving: dict[str, list[int]] = {}
    for i, grip in enumerate(rope.grip):
        own = grip.markers or []
        moving[grip.at] = [_number(f"{path}.grip[{i}].markers", m, recording) for m in own]
        if len(own) != 1 and (len(own) != 2 or any(grip.offset)):
            fix = f"give their arc lengths, such as markers = {{ {recording.markers[0]} = 0.1 }}"
            raise ConfigError(f"{path}.markers", "is missing: the grip does not say where they begin", grip.at, fix)
    held = {n for own in moving.values() for n in own}
    first, last = moving.get("start", [])[-1:], moving.get("end", [])[:1]
    return [(None, n) for n in (*first, *(k for k in range(count) if k not in held), *last)]


def _place(path: str, marker: schema.Marker, scene: Scene, particles: Particles) -> Place:
    if marker.particle is not None:
        place = on_particle(particles.find(f"{path}.particle", marker.particle))
    elif marker.arm is not None:
        return _on_arm(path, marker, particles)
    elif marker.between is not None:
        first, second = (particles.find(f"{path}.between", r) for r in marker.between)
        place = between(first, second, marker.fraction)
    elif marker.material is not None:
        with located(path):
            (place,) = on_cloth(_cloth(path, marker.cloth, scene), [marker.material])
    else:
        name = marker.rope or (next(iter(scene.ropes)) if len(scene.ropes) == 1 else "")
        if name not in scene.ropes:
            raise ConfigError(
                f"{path}.rope",
                "is no rope of the scene",
                marker.rope,
                f"name one of: {', '.join(scene.ropes) or 'none'}",
            )
        with located(path):
            place = on_rope(scene.ropes[name], marker.arc_length or 0.0)
    # A zero offset still sets the frame in which offset quantities count.
    with located(path):
        framed = place.with_offset(marker.offset or (0.0, 0.0, 0.0), marker.normal)
    return framed if marker.offset else replace(framed, offset=None)


def _on_ropes(
    described: SceneSection, seats: Mapping[str, Seats], scene: Scene, recording: Recording
) -> dict[str, Place]:
    """Places that ropes give their markers: by `markers`, or at equal distances beside the markers of grips."""
    found: dict[str, Place] = {}
    for path, section in described.strands:
        if section.name not in scene.ropes or not (section.markers or section.grip):
            continue
        rope, own = scene.ropes[section.name], seats.get(section.name, [])
        for k, (arc, number) in enumerate(own):
            at = rope.length * k / max(len(own) - 1, 1) if arc is None else arc
            with located(f"{path}.markers"):
                found[recording.markers[number]] = on_rope(rope, at)
    return found


def _cloth(path: str, name: str | None, scene: Scene) -> Cloth:
    wanted = name or (next(iter(scene.cloths)) if len(scene.cloths) == 1 else "")
    if wanted not in scene.cloths:
        fix = f"name one of: {', '.join(scene.cloths) or 'none'}"
        raise ConfigError(f"{path}.cloth", "is no cloth of the scene", name, fix)
    found: Cloth = scene.cloths[wanted]
    return found


def _on_arm(path: str, marker: schema.Marker, particles: Particles) -> Place:
    if marker.arm not in particles.arms:
        raise ConfigError(
            f"{path}.arm", "is no arm of the scene", marker.arm, f"name one of: {', '.join(particles.arms) or 'none'}"
        )
    place = particles.arms[marker.arm].place(marker.radius or 0.0)
    along, *across = marker.offset or (0.0, 0.0, 0.0)
    with located(path):
        return place.with_offset((along + (marker.radius or 0.0), *across), marker.normal)


def _offset(path: str, names: list[str], scene: Scene) -> tuple[str | None, str | None, str | None]:
    if len(names) != 3:
        raise ConfigError(path, "must be three names", names, 'give [tangent, normal, tangent x normal], "" for none')
    for name in names:
        if name and name not in scene.quantities:
            raise ConfigError(path, "names no quantity", name, f"declare [scene.quantities.{name}]")
    a, b, c = (name or None for name in names)
    return a, b, c


def _check_window(path: str, window: list[float] | None, recording: Recording) -> None:
    if window is None:
        return
    try:
        recording.piece(*window)
    except RecordingError as error:
        raise ConfigError(path, error.problem, window, error.fix) from error


def _check_names(config: schema.Config, experiments: tuple[Experiment, ...]) -> None:
    """Parameters and published values name quantities of the scenes."""
    known = sorted({q for e in experiments for q in e.scene.quantities})
    for section in ("parameters", "published"):
        for name in getattr(config, section):
            base = name.partition("[")[0]
            if base not in known:
                near = difflib.get_close_matches(base, known, n=1)
                hint = f"did you mean '{near[0]}'? " if near else ""
                raise ConfigError(
                    f"{section}.{name}", "is no quantity of the scenes", name, f"{hint}There are: {', '.join(known)}"
                )


def _known(path: str, section: schema.RecordingSection, experiment: Experiment) -> None:
    """Names that a recording uses exist."""
    for marker in section.offsets:
        if marker not in experiment.recording.markers:
            fix = f"name some of: {', '.join(experiment.recording.markers)}"
            raise ConfigError(f"{path}.offsets.{marker}", "is no marker of the recording", marker, fix)
    if section.time_offset is not None and section.time_offset not in experiment.scene.quantities:
        fix = f'declare [scene.quantities.{section.time_offset}] with unit = "s"'
        raise ConfigError(f"{path}.time_offset", "names no quantity", section.time_offset, fix)


def _start_values(scene: Scene, config: schema.Config, values: Mapping[str, float], path: str) -> None:
    """Quantities start where the parameters do, and at what is known of this recording."""
    for name, value in values.items():
        if name not in scene.quantities:
            raise ConfigError(
                f"{path}.values.{name}",
                "is no quantity of the scene",
                name,
                f"name some of: {', '.join(scene.quantities)}",
            )
        p = config.parameters.get(name)
        if p is not None and not p.private:
            fix = f"set parameters.{name}.initial, or make it private = true"
            raise ConfigError(f"{path}.values.{name}", "is a parameter shared by all recordings", value, fix)
    initial = {
        name: p.initial for name, p in config.parameters.items() if p.initial is not None and name in scene.quantities
    }
    for name, value in {**initial, **values}.items():
        with located(f"{path}.values" if name in values else "parameters"):
            scene.quantities[name] = replace(scene.quantities[name], value=float(value))
    for name in config.parameters:
        root, factor = _root(config, name)
        if root == name or name not in scene.quantities:
            continue
        here, shared = scene.quantities.get(root), config.parameters.get(root)
        start = here.value if here is not None else None if shared is None else shared.initial
        if start is not None:
            scene.quantities[name] = replace(scene.quantities[name], value=factor * start)


def _root(config: schema.Config, name: str) -> tuple[str, float]:
    """The end of a parameter's ties and the factor to it; circles and loose ends, which `Parameters` reports, lead
    back to itself."""
    at, factor, passed = name, 1.0, {name}
    while (p := config.parameters.get(at)) is not None and p.tied_to is not None:
        if p.tied_to in passed:
            return name, 1.0
        at, factor = p.tied_to, factor * p.factor
        passed.add(at)
    return at, factor


def _given(section: schema.ParameterSection) -> dict[str, Any]:
    """The fields of `Parameter` that the configuration sets; a private one starts at its own scene's value."""
    fields = section.model_dump(exclude_unset=True, exclude_none=True)
    if section.private:
        fields.pop("initial", None)
    if "prior" in fields:
        fields["prior"] = tuple(fields["prior"])
    return fields
