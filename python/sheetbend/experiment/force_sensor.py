"""Force sensors: where a recorded force acts on a scene, and what the sensor adds to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays.checks import finite, is_number
from ..arrays.rotations import rotated
from ..arrays.types import Array
from ..errors import InputError
from ..quantities.quantities import Term, product
from ..recording.force_recording import ForceRecording
from ..scene.body import GROUND, Body
from ..scene.scene import Scene

INPUTS = 11
"""Numbers of a sensor in an experiment's inputs: biases of force and torque, mass and center of the tool, its clock."""
CHANNELS = 6
AXES = "xyz"
MOST_INSTANTS = 64  # of a mean over a sample
_IGNORED = 1.0  # a sigma of channels that do not count


@dataclass(frozen=True, kw_only=True)
class ForceSensor:
    """A force sensor between a support of the scene (a grip, a clamp, a hook) and whatever holds or moves the support.

    Its readings are residuals of a motion, beside those of the markers. With the force F and torque T that the support
    puts on the body, gravity g, and the axes R of the sensor, it reads at the point p + R arm, p being where the first
    particle is:

        force    R' (F + m (p'' - g)) + bias
        torque   R' (T - R arm x F + R c x m (p'' - g)) + bias

    m and c are the mass of the tool that the sensor carries besides the body and the place of its center. What a tool
    adds when it turns (its angular momentum) is left out. F holds elastic and damping forces of all constraints at the
    support, and the weight, inertia, drag and air of the rope's or cloth's own mass that is lumped there.

    Attributes:
        recording: what was measured, in the sensor's own axes.
        at: the support: (rope, "start") or (rope, "end") for an end of a rope, a body, or particles, all of them held
            (pinned or driven). Torques are taken at the first of them, the center of mass of a body.
        name: of the sensor; the recording's by default. Its quantities begin with it.
        sigma: expected error of a force, N.
        torque_sigma: expected error of a torque, N m; None leaves torques out.
        axes: forces that count, some of "xyz" in the sensor's axes: "z" for a load cell.
        torque_axes: torques that count.
        reads: "support" for the force that the support puts on the body; "body" for its opposite, which a wrist reads
            that tells what acts on the robot.
        quaternion: (x, y, z, w) from the sensor's axes to the world's, of a sensor that does not turn.
        arm: (3,) m, from the first particle to the point where torques are measured, in the sensor's axes.
        average: s, the time before each sample over which the sensor takes the mean; 0 reads at the sample's time.
        bias, torque_bias: whether the sensor has unknown biases: quantities `<name>_bias_x`, ... (N) and
            `<name>_torque_bias_x`, ... (N m).
        tool: whether it carries a tool: quantities `<name>_tool_mass` (kg) and `<name>_tool_center_x`, ... (m, from the
            point where torques are measured, in the sensor's axes).
        time_offset: name of a quantity [s] that shifts the sensor's clock, such as that of `Experiment.time_offset`
            where both clocks are one; True makes one of its own, `<name>_time_offset`; None for none. What is recorded
            at time t is compared with the motion at t + offset.

    Raises:
        InputError: a field is inconsistent.
    """

    recording: ForceRecording
    at: tuple[str, str] | Sequence[int] | Body
    sigma: float
    name: str = ""
    torque_sigma: float | None = None
    axes: str = AXES
    torque_axes: str = AXES
    reads: str = "support"
    quaternion: Sequence[float] = (0.0, 0.0, 0.0, 1.0)
    arm: Sequence[float] = (0.0, 0.0, 0.0)
    average: float = 0.0
    bias: bool = False
    torque_bias: bool = False
    tool: bool = False
    time_offset: str | bool | None = None
    _turns: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.recording, ForceRecording):
            fix = "read the file: sb.ForceRecording.load(path)"
            raise InputError("force.recording", "is not a ForceRecording", self.recording, fix)
        if not self.name:
            object.__setattr__(self, "name", self.recording.name)
        for key, value in (("sigma", self.sigma), ("torque_sigma", self.torque_sigma)):
            if not (is_number(value) and value > 0) and not (value is None and key == "torque_sigma"):  # type: ignore[operator]
                raise InputError(f"{self.name}.{key}", "must be positive", value, "give the sensor's expected error")
        for key, axes in (("axes", self.axes), ("torque_axes", self.torque_axes)):
            if not isinstance(axes, str) or set(axes) - set(AXES) or len(set(axes)) != len(axes):
                raise InputError(f"{self.name}.{key}", "must be some of x, y, z", axes, "give such as 'z'")
        if self.torque_sigma is not None and self.recording.torques is None:
            fix = "leave torque_sigma out"
            raise InputError(f"{self.name}.torque_sigma", "has no recorded torque", self.torque_sigma, fix)
        if not np.isfinite(self._measured()).any():
            raise InputError(f"{self.name}.axes", "leave nothing to compare", self.axes, "name axes that were measured")
        if self.reads not in ("support", "body"):
            raise InputError(f"{self.name}.reads", "is unknown", self.reads, "use 'support' or 'body'")
        if not (is_number(self.average) and self.average >= 0):
            raise InputError(f"{self.name}.average", "must not be negative", self.average, "give a time in s")
        if self.torque_bias and self.torque_sigma is None:
            fix = "give torque_sigma, or leave it out"
            raise InputError(f"{self.name}.torque_bias", "needs measured torques", self.torque_bias, fix)
        finite(f"{self.name}.arm", self.arm, (3,), InputError)
        q = finite(f"{self.name}.quaternion", self.quaternion, (4,), InputError)
        if not np.linalg.norm(q) > 0:
            raise InputError(f"{self.name}.quaternion", "has no length", q.tolist(), "give (x, y, z, w)")
        turns = q[None] if self.recording.quaternions is None else self.recording.quaternions
        units = turns / np.linalg.norm(turns, axis=1, keepdims=True)
        object.__setattr__(self, "_turns", rotated(units[:, None], np.eye(3)).swapaxes(1, 2))

    @property
    def quantities(self) -> dict[str, str]:
        """Names of the sensor's own quantities and their units."""
        found: dict[str, str] = {}
        if self.bias:
            found |= {f"{self.name}_bias_{a}": "N" for a in self.axes}
        if self.torque_bias:
            found |= {f"{self.name}_torque_bias_{a}": "N m" for a in self.torque_axes}
        if self.tool:
            found[f"{self.name}_tool_mass"] = "kg"
            if self.torque_sigma is not None:
                found |= {f"{self.name}_tool_center_{a}": "m" for a in AXES}
        if self.time_offset is True:
            found[f"{self.name}_time_offset"] = "s"
        return found

    def declare(self, scene: Scene) -> None:
        """Give a scene the sensor's own quantities, all zero, so that they can be fitted; those that it has already
        stay as they are.

        Raises:
            SceneError: the scene is frozen.
        """
        scales = {"N": self.sigma, "N m": self.torque_sigma or self.sigma, "kg": 0.1, "m": 0.05, "s": 0.01}
        for name, unit in self.quantities.items():
            if name not in scene.quantities:
                scene.add_quantity(name, 0.0, unit, positive=False, scale=scales[unit])

    @property
    def delay(self) -> str | None:
        """The quantity that shifts the clock."""
        return f"{self.name}_time_offset" if self.time_offset is True else self.time_offset or None

    def check(self, scene: Scene, path: str) -> None:
        """Whether a scene has what the sensor names.

        Raises:
            InputError: particles that are free or do not exist, or quantities that are not declared.
        """
        held = scene.pinned | set(scene.boundary.driven)
        loose = [p for p in self.particles(scene, path) if p not in held]
        if loose:
            fix = "name particles that are pinned or driven"
            raise InputError(f"{path}.at", "names particles that nothing holds", loose, fix)
        if all(p in scene.directors for p in self.particles(scene, path)[:1]):
            raise InputError(f"{path}.at", "begins with a direction", self.at, "name a particle first")
        wanted = [*self.quantities, *([self.delay] if self.delay else [])]
        missing = [name for name in wanted if name not in scene.quantities]
        if missing:
            fix = "call sensor.declare(scene) before the scene is frozen"
            raise InputError(f"{path}.quantities", "are not in the scene", missing, fix)

    def particles(self, scene: Scene, path: str = "force") -> list[int]:
        """What the support holds, directors included; the place of the first one is where torques are taken.

        Raises:
            InputError: no such rope, or a body of another scene.
        """
        if isinstance(self.at, Sequence) and len(self.at) == 2 and isinstance(self.at[0], str):
            return end_of_rope(scene, str(self.at[0]), str(self.at[1]), path)
        if isinstance(self.at, Body):
            own = scene.bodies.get(self.at.name)
            if own is None or not np.array_equal(own.particles, self.at.particles):
                raise InputError(f"{path}.at", "is a body of another scene", self.at.name, "name one of this scene")
            return [int(p) for p in own.particles]
        found: list[int] = scene.node_array(f"{path}.at", self.at).tolist()
        return list(dict.fromkeys(found))

    def terms(self, first: int) -> list[Term]:
        """Terms of the sensor's inputs, which begin at entry `first` of the array "extra"."""
        names: dict[int, str] = {}
        for k, axis in enumerate(AXES):
            names[k], names[3 + k] = f"{self.name}_bias_{axis}", f"{self.name}_torque_bias_{axis}"
            names[7 + k] = f"{self.name}_tool_center_{axis}"
        names[6] = f"{self.name}_tool_mass"
        own = {k: name for k, name in names.items() if name in self.quantities}
        if self.delay:
            own[10] = self.delay
        return [product("extra", first + k, 1.0, {name: "identity"}) for k, name in own.items()]

    def core(self, scene: Scene, t0: float, span: tuple[float, float], h: float) -> dict[str, Any]:
        """The sensor for the compiled core, with the samples within a span of the recording's time.

        Args:
            t0: recording time of the scene's start, s.
            h: substep, of which an average takes each.
        """
        kept = self.kept(t0, span)
        measured = self._measured()[kept]
        count = 1 if self.average == 0.0 else min(max(2, math.ceil(self.average / h)), MOST_INSTANTS)
        back = self.average * (1.0 - (np.arange(count) + 0.5) / count) if count > 1 else np.zeros(1)
        instants = (self.recording.times[kept, None] - t0 - back).ravel()
        order = np.argsort(instants, kind="stable")
        every = self.particles(scene)
        sigma = [self.sigma] * 3 + [_IGNORED if self.torque_sigma is None else self.torque_sigma] * 3
        turns = np.broadcast_to(self._turns, (len(self.recording.times), 3, 3))[kept]
        return {
            "particles": scene.places_of(every).tolist(),
            "carried": scene.places_of(carried(scene, every)).tolist(),
            "about": scene.places_of(every[:1])[0],
            "arm": [float(a) for a in self.arm],
            "sign": 1.0 if self.reads == "support" else -1.0,
            "times": instants[order],
            "sample": np.repeat(np.arange(len(measured)), count)[order],
            "share": np.full(len(instants), 1.0 / count),
            "rotation": np.ascontiguousarray(turns),
            "measured": np.ascontiguousarray(measured),
            "sigma": sigma,
        }

    def kept(self, t0: float, span: tuple[float, float]) -> Array:
        """(samples,) bool, those within a span of the recording's time that have a channel that counts. At the start,
        before any substep, there is no force."""
        t = self.recording.times
        inside = (t >= span[0] - 1e-9) & (t <= span[1] + 1e-9) & (t - self.average > t0 + 1e-9)
        return np.asarray(inside & np.isfinite(self._measured()).any(axis=1))

    def _measured(self) -> Array:
        """(samples, 6), NaN where nothing counts."""
        r = self.recording
        out = np.full((len(r.times), CHANNELS), np.nan)
        for k, axis in enumerate(AXES):
            if axis in self.axes:
                out[:, k] = r.forces[:, k]
            if self.torque_sigma is not None and r.torques is not None and axis in self.torque_axes:
                out[:, 3 + k] = r.torques[:, k]
        return out


def end_of_rope(scene: Scene, rope: str, end: str, path: str = "force") -> list[int]:
    """The particles that hold an end of a rope: its node, and where a grip or clamp holds its direction too, the stub
    and the director (and normal) behind it.

    Raises:
        InputError: no such rope or end.
    """
    if rope not in scene.ropes:
        raise InputError(f"{path}.at", "names no rope of the scene", rope, f"name one of: {', '.join(scene.ropes)}")
    if end not in ("start", "end"):
        raise InputError(f"{path}.at", "names no end of a rope", end, "use 'start' or 'end'")
    built, k = scene.ropes[rope], 0 if end == "start" else -1
    ghost = built.start_ghost if end == "start" else built.end_ghost
    behind = [] if ghost is None else [ghost]
    for frames in (getattr(built, "directors", ()), getattr(built, "normals", ())):
        behind += [int(frames[k])] if len(frames) and ghost is not None else []
    held = scene.pinned | set(scene.boundary.driven)
    return [int(built.particles[k]), *(int(p) for p in behind if p in held)]


def carried(scene: Scene, particles: Sequence[int]) -> list[int]:
    """The particles of a support whose mass is that of a rope, a cloth or a rigid body; pivots and stubs have masses
    that nothing uses."""
    every = (*scene.ropes.values(), *scene.cloths.values(), *scene.bodies.values())
    bodies = {int(p) for body in every if body.name != GROUND for p in body.particles}
    return [p for p in particles if p in bodies]
