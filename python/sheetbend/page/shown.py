"""What a page draws of one motion: ropes, cloths and markers over time, all in one frame of reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ..arrays.types import Array
from ..doubts.prediction import Comparison
from ..fitting.fit import Fit
from ..fitting.fitted_motion import fitted_positions
from ..mesh import TriangleMesh
from ..motion.simulate import Trajectory
from ..pictures.body_lines import body_lines, is_arm, point_masses
from ..pictures.collider_lines import collider_lines
from ..pictures.strain import largest_strain
from ..recording.cloud import Cloud
from ..recording.recording import Recording
from ..scene.scene import Scene

TICK = 0.02  # of the motion's extent: length of the mark that shows how a rod is twisted


@dataclass(frozen=True)
class Sheet:
    """A cloth: triangles (m, 3) of its vertices, their positions (frames, vertices, 3) m, and each triangle's largest
    strain (frames, m), 1; `kind` is what the legend calls it, "cloth" or "solid"."""

    triangles: Array
    positions: Array
    strain: Array
    kind: str = "cloth"


@dataclass(frozen=True)
class Shown:
    """One motion.

    Attributes:
        name: of the recording or the scene.
        times: (frames,) s.
        lines: ropes by name, (frames, nodes, 3) m; of a scene without ropes, its links.
        line_kind: what the legend calls them.
        ticks: short lines by name, (frames, lines, 2, 3) m: "twist" of rods, from an edge's middle along its director,
            and the outlines of colliders and bodies.
        bodies: names of the rigid bodies among the ticks.
        sheets: cloths and surfaces of solids by name.
        masses: (frames, n, 3) m, particles that carry a mass of their own; None without.
        markers: names of the measured markers.
        is_cloud: whether they are points of a cloud, other ones in every frame.
        measured, simulated, baseline: (frames, markers, 3) m, NaN where there is nothing; None without.
        held_out: (frames,) frames that the fit did not see.
        up: (3,) against gravity; zeros without gravity.
    """

    name: str
    times: Array
    lines: Mapping[str, Array] = field(default_factory=dict)
    line_kind: str = "rope"
    ticks: Mapping[str, Array] = field(default_factory=dict)
    bodies: tuple[str, ...] = ()
    sheets: Mapping[str, Sheet] = field(default_factory=dict)
    masses: Array | None = None
    markers: tuple[str, ...] = ()
    is_cloud: bool = False
    measured: Array | None = None
    simulated: Array | None = None
    baseline: Array | None = None
    held_out: Array | None = None
    up: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    @property
    def points(self) -> list[Array]:
        """Everything that has a place, (frames, n, 3) each."""
        parts = [*self.lines.values(), *(sheet.positions for sheet in self.sheets.values())]
        parts += [t.reshape(len(t), -1, 3) for t in self.ticks.values()]
        return parts + [x for x in (self.masses, self.measured, self.simulated, self.baseline) if x is not None]


def fitted_motion(found: Fit, c: Comparison) -> Shown:
    """A fitted motion beside its recording, at the substeps nearest to the recorded frames; a shape at rest is one
    frame. Costs one simulation."""
    e = c.experiment
    recorded = {
        "markers": tuple(c.recording.markers),
        "is_cloud": e.is_cloud,
        "measured": c.recording.positions,
        "simulated": c.simulated,
        "baseline": c.baseline,
        "held_out": c.held_out,
    }
    positions = fitted_positions(found, c)
    return _motion_shown(e.name, e.scene, c.recording.times[: len(positions)], positions, recorded)


def predicted_motion(recording: Recording, predicted: Array) -> Shown:
    """Markers along a rope beside their prediction, (frames, markers, 3) m, which a line joins."""
    return Shown(
        recording.name,
        recording.times,
        lines={"predicted": predicted},
        markers=tuple(recording.markers),
        measured=recording.positions,
        simulated=predicted,
        up=_up(recording, np.array([0.0, 0.0, 1.0])),
    )


def of_trajectory(scene: Scene, motion: Trajectory, name: str = "") -> Shown:
    """A simulated motion."""
    return of_positions(scene, motion.times, motion.nodes, name)


def of_positions(scene: Scene, times: Array, positions: Array, name: str = "") -> Shown:
    """A scene whose nodes are at positions (frames, nodes, 3) m at times (frames,) s."""
    return _motion_shown(name or scene.name, scene, times, positions, {})


def of_recording(recording: Recording, name: str) -> Shown:
    """The markers of a recording."""
    x, up = recording.positions, _up(recording, np.zeros(3))
    names, is_cloud = tuple(recording.markers), isinstance(recording, Cloud)
    return Shown(name, recording.times, markers=names, is_cloud=is_cloud, measured=x, up=up)


def _motion_shown(name: str, scene: Scene, times: Array, positions: Array, recorded: Mapping[str, object]) -> Shown:
    lines = {rope.name: positions[:, rope.particles] for rope in scene.ropes.values()}
    sheets = {
        c.name: _sheet(c.mesh, positions[:, c.particles], "solid" if c.name in scene.solids else "cloth")
        for c in scene.sheets
    }
    boxes = body_lines(scene, positions)
    if not lines and not sheets and not boxes:  # a scene of bare particles and constraints: its links
        lines = _links(scene, positions)
    kind = "rope" if scene.ropes else "link"
    ticks = _ticks(scene, positions) | collider_lines(scene, times, positions) | boxes
    heavy, up = point_masses(scene), _unit(-scene.gravity)
    masses = positions[:, heavy] if len(heavy) else None
    return Shown(name, times, lines, kind, ticks, tuple(boxes), sheets, masses, up=up, **recorded)  # type: ignore[arg-type]


def _sheet(mesh: TriangleMesh, positions: Array, kind: str) -> Sheet:
    return Sheet(mesh.triangles, positions, np.stack([largest_strain(mesh, x) for x in positions]), kind)


def _links(scene: Scene, positions: Array) -> dict[str, Array]:
    """Constraints between two particles as lines of their own; of an arm that from its pivot to its end."""
    pairs = []
    for group in scene.groups:
        own = group.particles.tolist()[: 1 if is_arm(scene, group.name.removesuffix("_links")) else None]
        pairs += [pair for pair in own if len(pair) == 2]
    points = [pair for pair in pairs if not set(pair) & set(scene.directors)]
    return {f"link {a}-{b}": positions[:, [a, b]] for a, b in points}


def _ticks(scene: Scene, positions: Array) -> dict[str, Array]:
    """The directors across a rod's edges; a section's normal is none."""
    nodes = [node for node, (_, _, normal) in scene.directors.items() if node != normal]
    if not nodes:
        return {}
    ends = np.array([scene.directors[node][:2] for node in nodes])
    middle = positions[:, ends].mean(axis=2)
    d = positions[:, nodes]
    along = d / np.linalg.norm(d, axis=2, keepdims=True)
    size = TICK * np.ptp(positions[:, ends].reshape(-1, 3), axis=0).max()
    return {"twist": np.stack([middle, middle + size * along], axis=2)}


def _up(recording: Recording, unknown: Array) -> Array:
    """Against the gravity that the recording tells; `unknown` where it tells none."""
    return unknown if recording.gravity is None else _unit(-recording.gravity)


def _unit(v: Array) -> Array:
    size = float(np.linalg.norm(v))
    return v / size if size > 0 else v
