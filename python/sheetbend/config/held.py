"""What a configuration assumes about how its ropes are held and where their markers are, in words."""

from __future__ import annotations

from .rope_schema import Rod, Rope, RopeGrip
from .scene_schema import SceneSection
from .schema import Config

_FEW = 4  # markers that are named; of more their number is


def assumptions(config: Config) -> tuple[str, ...]:
    """A sentence for each end of each rope and rod, ropes first. A last one follows where a configuration with one rope
    does not say where its markers are."""
    strands = [strand for _, strand in config.scene.strands]
    ends = tuple(f"{s.name}, {end}: {_of_end(config.scene, s, end)}" for s in strands for end in ("start", "end"))
    unplaced = not config.marker and any(r.cloud is None and not (r.marker or r.here) for r in config.recording)
    if len(strands) != 1 or config.scene.cloth or strands[0].markers or not unplaced:
        return ends
    own = f"{strands[0].name}, markers"
    return (*ends, f"{own}: all of them, at equal distances from end to end, because no key says where they are")


def _of_end(section: SceneSection, strand: Rope | Rod, end: str) -> str:
    grip = strand.grip_at(end)
    if grip is not None:
        return _of_grip(grip, strand)
    node = 0 if end == "start" else strand.segments
    own = {f"{strand.name}:{end}", f"{strand.name}:{node}"} | ({f"{strand.name}:-1"} if end == "end" else set())
    clamped = strand.clamp_start is not None if end == "start" else strand.clamp_end is not None
    turning = "it may turn by a fitted angle" if isinstance(strand, Rope) and strand.clamp_angles else "it never turns"
    drive = next((d for d in section.drive if own & set(d.particles)), None)
    if drive is not None:
        mover = f"tool {drive.tool}" if drive.markers is None else "a marker of the recording"
        kept = "the clamp keeps its direction" if clamped else f"its direction is free{_spin(strand, end)}"
        return f"moved with {mover}; {kept}"
    if clamped:
        return f"clamped in the place and direction that are given; {turning}"
    last = {0} if end == "start" else {-1, strand.segments}
    if last & set(strand.pinned) or own & set(section.pin):
        return f"pinned where it starts; its direction is free{_spin(strand, end)}"
    hung = [mass.name for mass in section.point_mass if mass.particle in own]
    if hung:
        return f"free, with the weight of {' and '.join(f'{name}_mass' for name in hung)}"
    return "free"


def _spin(strand: Rope | Rod, end: str) -> str:
    """What an end that turns freely does about its own axis."""
    if isinstance(strand, Rope):
        return ""
    return ", but it does not spin" if end in strand.hold_roll else " and it spins freely"


def _of_grip(grip: RopeGrip, strand: Rope | Rod) -> str:
    markers = grip.markers or []
    names = ", ".join(str(m) for m in markers) if len(markers) <= _FEW else f"{len(markers)} markers"
    smooth = f"; the motion is smoothed over {grip.smoothing:g} s" if grip.smoothing > 0 else ""
    if grip.tool is not None:
        missing = [key for key in ("position", "direction") if getattr(grip, key) is None]
        placed = f", {' and '.join(missing)} as it is placed" if missing else ""
        return f"held with place, direction and roll by tool {grip.tool}{placed}{smooth}"
    if len(markers) == 1:
        if grip.direction is not None:
            return f"follows marker {names} and keeps the given direction: one marker does not record turning{smooth}"
        spin = _spin(strand, grip.at)
        return f"pinned to marker {names}: one marker gives no direction, so the end turns freely there{spin}{smooth}"
    if len(markers) == 2:
        twists = isinstance(strand, Rod)
        roll = "a roll about it is not recorded and taken as none" if twists else "a rope feels no roll"
        return f"held in the place and direction of markers {names}; {roll}{smooth}"
    given = "given" if grip.direction is not None else "of the rope as placed at the start"
    return f"held by the rigid body of markers {names}; the direction in which the rope leaves it is {given}{smooth}"
