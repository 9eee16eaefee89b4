"""Forces that a sensor would read along a simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..arrays.checks import finite
from ..arrays.types import Array
from ..errors import InputError
from ..motion.core_terms import divergence
from ..motion.solver import Solver
from ..objects.markers import on_particle
from ..recording.force_recording import ForceRecording
from ..recording.recording import Recording
from ..scene.body import Body
from ..scene.given import check_scene
from ..scene.scene import Scene
from .experiment import Experiment
from .force_sensor import ForceSensor


def simulate_forces(
    scene: Scene,
    times: ArrayLike,
    at: tuple[str, str] | Sequence[int] | Body,
    solver: Solver | None = None,
    values: Mapping[str, float] | None = None,
    *,
    start: str = "given",
    quaternions: ArrayLike | None = None,
    **sensor: Any,
) -> ForceRecording:
    """Simulate a scene from its start, and read the force and torque at one of its supports.

    Args:
        scene: is frozen by this.
        times: (samples,) s, increasing, after 0; at the end of the first substep there is a force.
        at: the support, see `ForceSensor.at`.
        solver: `Solver()` by default.
        values: quantities to change for this run, by name, those of the sensor (`ForceSensor.declare`) among them.
        start: "given", or "equilibrium": the scene starts at rest.
        quaternions: (samples, 4) of a sensor that turns.
        sensor: further fields of `ForceSensor`, such as reads, arm, average, or name and bias.

    Returns:
        Forces (samples, 3) N and torques (samples, 3) N m in the sensor's axes, without noise.

    Raises:
        InputError: times, particles or fields that do not suit.
        DivergenceError: as `simulate`.
    """
    made = read_at(times, at, quaternions, **sensor)
    t, read = sensor_readings(made, scene, Solver.given(solver), values, start)
    return ForceRecording(t, read[:, :3], read[:, 3:], made.recording.quaternions, made.name)


def sensor_readings(
    sensor: ForceSensor,
    scene: Scene,
    solver: Solver,
    values: Mapping[str, float] | None = None,
    start: str = "given",
    start_time: float = 0.0,
    until: float = np.inf,
) -> tuple[Array, Array]:
    """What a sensor reads along a simulation, at the times at which it recorded.

    Args:
        start_time: of the sensor's clock at which the scene starts, s.
        until: s of that clock, up to which it is read.

    Returns:
        Times (samples,) s and readings (samples, 6), N and N m in its axes; those after the start that count.
    """
    span = (start_time, min(float(sensor.recording.times[-1]), until))
    problem = readings_problem(sensor, scene, solver, values or {}, (), start, span)
    with divergence(scene):
        read = problem.readings(0, np.zeros(0))
    return sensor.recording.times[sensor.kept(start_time, span)], read


def readings_problem(
    sensor: ForceSensor,
    scene: Scene,
    solver: Solver,
    values: Mapping[str, float],
    free: Sequence[str],
    start: str,
    span: tuple[float, float],
) -> _core.Problem:
    """A compiled problem whose residuals end with a sensor's readings (sigma 1 and nothing measured) over a span of its
    clock; the scene starts with that. Its parameters are the quantities `free`.

    Raises:
        InputError: unknown quantities, or values that make no sense.
    """
    check_scene(scene)
    experiment = Experiment(
        scene=scene,
        recording=Recording(np.zeros((2, 1, 3)), np.array(span)),
        markers=[on_particle(int([*scene.free, 0][0]))],
        solver=solver,
        start=start,
        start_time=span[0],
        forces=[sensor],
    )
    compiled = scene.compiled
    theta, names = compiled.values(values), list(compiled.names)
    compiled.inputs(theta)  # refuse what makes a mass or a stiffness negative
    slots = [names.index(name) for name in free]
    listed = [
        {"name": name, "log": False, "slots": [slot], "factors": [1.0], "prior": None}
        for name, slot in zip(free, slots, strict=True)
    ]
    core, every = experiment.core(experiment.recording), list(range(len(names)))
    return _core.Problem(experiments=[core], theta=theta, slots=[every], free=listed, threads=1)


def read_at(
    times: ArrayLike, at: tuple[str, str] | Sequence[int] | Body, quaternions: ArrayLike | None, **sensor: Any
) -> ForceSensor:
    """A sensor that reads all forces and torques at some times, with sigma 1.

    Raises:
        InputError: times that do not increase from above 0, fields that do not suit.
    """
    t = finite("times", times, None, InputError).ravel()
    if len(t) == 0 or t[0] <= 0.0 or (np.diff(t) <= 0).any():
        fix = "give times after the start, in s"
        raise InputError("times", "must increase from above 0", t[:5].tolist(), fix)
    none = np.zeros((len(t), 3))
    name = str(sensor.pop("name", "force"))
    wanted = ForceRecording(t, none, none, quaternions, name)  # type: ignore[arg-type]
    return ForceSensor(recording=wanted, at=at, **{"sigma": 1.0, "torque_sigma": 1.0, **sensor})
