"""Where the markers of a recording sit: on ropes, cloths, arms and particles of its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import ConfigError, RecordingError
from ..objects.arm_data import Arm
from ..objects.markers import Place, between, on_body, on_cloth, on_particle, on_rope, on_solid
from ..recording.recording import Recording
from ..recording.recording_checks import marker_indices
from ..scene.scene import Scene
from . import schema
from .bodies import named_body
from .cloth_markers import places_on_cloths
from .errors import located, of_name
from .particles import Particles
from .rope_points import Seats
from .rope_schema import Rod, Rope
from .ropes import check_markers
from .scene_schema import SceneSection


@dataclass(frozen=True)
class Listed:
    """The markers of [[recording.marker]], or of [[marker]] where a recording has none of its own.

    Attributes:
        path: of the list.
        sections: its tables.
        recording: whose markers they are.
        numbers: of each in the recording.
    """

    path: str
    sections: Sequence[schema.Marker]
    recording: Recording
    numbers: Sequence[int]

    @classmethod
    def of(cls, config: schema.Config, section: schema.RecordingSection, path: str, recording: Recording) -> Listed:
        """The list that counts.

        Raises:
            ConfigError: one names no marker of the recording.
        """
        own = section.marker
        sections, where = (own, f"{path}.marker") if own else (config.marker, "marker")
        numbers = [_number(f"{where}[{k}].marker", m.marker, recording) for k, m in enumerate(sections)]
        return cls(where, sections, recording, numbers)

    def seats(self, scene: SceneSection, ropes: Sequence[str]) -> dict[str, Seats]:
        """Per rope or rod that is shown the markers on it, in order along it.

        Raises:
            ConfigError: a rope names a marker that is none, or nothing says where its markers begin.
        """
        strands = {rope.name: (at, rope) for at, rope in scene.strands if rope.name in ropes}
        for at, rope in strands.values():
            check_markers(at, rope, self.recording.markers)
        if not self.sections and not any(rope.markers for _, rope in strands.values()):
            alone = len(strands) == 1
            return {name: _evenly(at, rope, self.recording) for name, (at, rope) in strands.items()} if alone else {}
        number = {marker: k for k, marker in enumerate(self.recording.markers)}
        placed: dict[str, Seats] = {}
        for name, (_, rope) in strands.items():
            mine = [(arc, number[marker]) for marker, arc in (rope.markers or {}).items()]
            mine += [
                (m.arc_length, n)
                for m, n in zip(self.sections, self.numbers, strict=True)
                if m.arc_length is not None and m.rope in (name, None)
            ]
            placed[name] = sorted(mine)
        return placed

    def places(
        self, described: SceneSection, seats: Mapping[str, Seats], scene: Scene, particles: Particles
    ) -> dict[str, Place]:
        """The place of every marker that has one, by name: those of cloths, of ropes, and of this list, which wins.

        Raises:
            ConfigError: a place is none of the scene's.
        """
        own = {
            self.recording.markers[n]: _placed(f"{self.path}[{k}]", m, scene, particles)
            for k, (m, n) in enumerate(zip(self.sections, self.numbers, strict=True))
        }
        on_cloths = places_on_cloths(described.cloth, scene, self.recording)
        return on_cloths | _of_ropes(described, seats, scene, self.recording) | own


def _number(path: str, marker: str | int, recording: Recording) -> int:
    try:
        return marker_indices("marker", (marker,), recording.markers)[0]
    except RecordingError as error:
        raise ConfigError(path, error.problem, error.got, error.fix) from error


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


def _placed(path: str, marker: schema.Marker, scene: Scene, particles: Particles) -> Place:
    if marker.particle is not None:
        place = on_particle(particles.find(f"{path}.particle", marker.particle))
    elif marker.arm is not None:
        arm = of_name(f"{path}.arm", "arm of the scene", marker.arm, particles.arms)
        return _on_arm(path, marker, arm)
    elif marker.body is not None:
        body = named_body(f"{path}.body", marker.body, scene)
        off = np.add(marker.point or np.zeros(3), marker.offset or np.zeros(3))
        return on_body(body, [off])[0]
    elif marker.solid is not None:
        with located(path):
            none = "none, add a [[scene.solid]]"
            solid = of_name(f"{path}.solid", "solid of the scene", marker.solid, scene.solids, none)
            return on_solid(solid, [marker.place or ()])[0]
    elif marker.between is not None:
        first, second = (particles.find(f"{path}.between", r) for r in marker.between)
        place = between(first, second, marker.fraction)
    elif marker.material is not None:
        with located(path):
            cloth = of_name(f"{path}.cloth", "cloth of the scene", marker.cloth or _only(scene.cloths), scene.cloths)
            (place,) = on_cloth(cloth, [marker.material])
    else:
        rope = of_name(f"{path}.rope", "rope of the scene", marker.rope or _only(scene.ropes), scene.ropes)
        with located(path):
            place = on_rope(rope, marker.arc_length or 0.0)
    # A zero offset still sets the frame in which offset quantities count.
    with located(path):
        framed = place.with_offset(marker.offset or (0.0, 0.0, 0.0), marker.normal)
    return framed if marker.offset else replace(framed, offset=None)


def _of_ropes(
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


def _only(known: Mapping[str, object]) -> str | None:
    """The name of the only one there is."""
    return next(iter(known)) if len(known) == 1 else None


def _on_arm(path: str, marker: schema.Marker, arm: Arm) -> Place:
    place = arm.place(marker.radius or 0.0)
    along, *across = marker.offset or (0.0, 0.0, 0.0)
    with located(path):
        return place.with_offset((along + (marker.radius or 0.0), *across), marker.normal)
