"""Changes of planned experiments that need no new scene: one more marker, a force sensor at a support, the same
recordings once more, a parameter that is measured apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..experiment.experiment import Experiment
from ..experiment.force_sensor import ForceSensor
from ..objects.markers import Place, on_rope
from ..problem.smooth import modes_over_time
from ..quantities.parameters import Parameters
from ..recording.force_recording import ForceRecording
from ..recording.recording import Recording
from ..scene.scene import Scene

MEASURED = 0.01  # relative error of a parameter that is measured apart
FORCE = 0.01  # of the weight of the scene: error of a force sensor
GRAVITY = 9.81  # m/s^2, of the weights that set the errors of sensors

Change = tuple[str, list[Experiment], Parameters]


def changes(experiments: Sequence[Experiment], free: Parameters, wanted: Parameters) -> Iterator[Change]:
    """Every change in words, with the experiments and the parameters that come of it.

    Args:
        free: expanded, of the plan.
        wanted: as given.
    """
    marked = [_with_marker(e) for e in experiments]
    if any(new is not e for new, e in zip(marked, experiments, strict=True)):
        yield "one more marker, in the widest gap", marked, wanted
    felt = [_with_sensor(e) for e in experiments]
    if any(new is not e for new, e in zip(felt, experiments, strict=True)):
        yield "a force sensor at the support", felt, wanted
    again = [replace(e, recording=_named(e.recording, f"{e.name} again"), name=f"{e.name} again") for e in experiments]
    yield "the same recordings once more", [*experiments, *again], _with_private_inputs(experiments, wanted)
    for name, p in wanted.items():
        if p.free and p.log and p.prior is None and not p.private and name in free and p.initial is not None:
            known = wanted.replace(name, prior=(p.initial, MEASURED))
            yield f"{name} measured to {100 * MEASURED:g} %", list(experiments), known


def _with_private_inputs(experiments: Sequence[Experiment], wanted: Parameters) -> Parameters:
    """The parameters, those of unknown inputs over time private: each recording has its own."""
    modes = modes_over_time(experiments)
    return Parameters(replace(p, private=True) if p.name in modes else p for p in wanted.values()) if modes else wanted


def _named(recording: Recording, name: str) -> Recording:
    return replace(recording, name=name)


def _with_marker(e: Experiment) -> Experiment:
    """One more marker on the rope, in the middle of the longest piece without one; the same experiment where there is
    no single rope."""
    if len(e.scene.ropes) != 1:
        return e
    (rope,) = e.scene.ropes.values()
    arc = {int(n): float(s) for n, s in zip(rope.particles, rope.arc_length, strict=True)}
    seen = sorted(s for place in e.compared_places if (s := _arc_of(place, arc)) is not None)
    ends = np.array([0.0, *seen, rope.length])
    widest = int(np.argmax(np.diff(ends)))
    at = float(ends[widest] + ends[widest + 1]) / 2 if ends[widest + 1] < rope.length or not seen else rope.length
    r = e.recording
    name = "new marker"
    anywhere = np.broadcast_to(e.scene.positions[rope.particles[-1]], (len(r.times), 1, 3))
    positions = np.concatenate([r.positions, anywhere], axis=1)
    recording = replace(r, positions=positions, markers=(*r.markers, name))
    return replace(e, recording=recording, markers=[*e.places, on_rope(rope, at)])


def _arc_of(place: Place, arc: dict[int, float]) -> float | None:
    """Material coordinate of a marker; None off the rope."""
    if not all(p in arc for p in place.particles):
        return None
    return float(sum(w * arc[p] for p, w in zip(place.particles, place.weights, strict=True)))


def _with_sensor(e: Experiment) -> Experiment:
    """A force sensor at what is held; the same experiment where it cannot have one."""
    held = _support(e.scene)
    if e.static or e.forces or e.has_unknowns or not held:
        return e
    times = e.recording.times[e.recording.times > e.t0]
    if len(times) == 0:
        return e
    compiled = e.scene.compiled
    weight = GRAVITY * float(np.sum(compiled.part(compiled.inputs(), "mass")))
    forces = ForceRecording(times, np.zeros((len(times), 3)), name="new sensor")
    try:
        return replace(e, forces=[ForceSensor(recording=forces, at=held, sigma=max(FORCE * weight, 1e-12))])
    except InputError:  # forces do not go with another of its fields, such as `shooting`
        return e


def _support(scene: Scene) -> list[int]:
    """Held nodes that are places, and not the numbers that joints and what yields keep in pinned nodes."""
    ends = [ghost for rope in scene.ropes.values() for ghost in (rope.start_ghost, rope.end_ghost)]
    places = {*scene.body_nodes.ravel().tolist(), *scene.boundary.driven, *scene.directors, *ends}
    return [node for node in scene.held if node >= 0 or node in places]
