"""Force sensors of a configuration's recordings."""

from __future__ import annotations

from pathlib import Path

from ..errors import ConfigError, RecordingError
from ..experiment.force_sensor import ForceSensor, end_of_rope
from ..recording.force_recording import ForceRecording
from ..scene.scene import Scene
from . import schema
from .errors import located
from .particles import Particles

FIELDS = (
    *("sigma", "torque_sigma", "axes", "torque_axes", "reads", "quaternion", "arm", "average", "bias", "torque_bias"),
    *("tool", "time_offset"),
)


def force_sensors(
    path: str, sections: list[schema.ForceSection], scene: Scene, particles: Particles, folder: Path
) -> tuple[ForceSensor, ...]:
    """Read the forces of a recording, and declare the sensors' own quantities in its scene.

    Raises:
        ConfigError: a file that cannot be read, a support that the scene does not have, or fields that do not suit.
    """
    sensors = []
    for k, section in enumerate(sections):
        where = f"{path}.force[{k}]"
        recording = _read(where, folder / section.file)
        with located(where):
            sensor = ForceSensor(
                recording=recording,
                at=_support(where, section.at, scene, particles),
                name=section.name or recording.name,
                **section.model_dump(include=set(FIELDS)),
            )
            sensor.declare(scene)
        sensors.append(sensor)
    return tuple(sensors)


def _read(path: str, file: Path) -> ForceRecording:
    if not file.exists():
        fix = "give a file relative to the configuration's folder"
        raise ConfigError(f"{path}.file", "does not exist", str(file), fix)
    try:
        return ForceRecording.load(file)
    except RecordingError as error:
        raise ConfigError(f"{path}.file: {error.field}", error.problem, error.got, error.fix) from error


def _support(path: str, references: list[str], scene: Scene, particles: Particles) -> list[int]:
    found: list[int] = []
    for reference in references:
        name, _, label = reference.partition(":")
        if name in scene.ropes and label in ("start", "end"):
            found += end_of_rope(scene, name, label, path)
        elif name in scene.cloths and label in scene.cloths[name].mesh.sets:
            cloth = scene.cloths[name]
            found += [int(cloth.particles[v]) for v in cloth.mesh.sets[label]]
        elif reference in scene.bodies:
            found += scene.bodies[reference].particles.tolist()
        else:
            found.append(particles.find(f"{path}.at", reference))
    return list(dict.fromkeys(found))
