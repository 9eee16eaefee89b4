"""The model of a rope held by two grips: what is known of it, what is assumed, and how it is discretized."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..experiment.experiment import Experiment
from ..motion.solver import Solver
from ..objects.markers import Place, on_rope
from ..objects.rod import Rod, add_rod
from ..quantities.quantities import product
from ..recording.recording import Recording
from ..recording.windows import Window
from ..scene.scene import Scene
from .motion import GrippedMotion
from .rolls import add_rolls

NAME = "rope"
GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True, kw_only=True)
class RopeModel:
    """A rod between two grips.

    Attributes:
        density: kg/m, weighed: motion alone tells stiffness over density only.
        nominal: directions (3,) of the start and the end grip from which their frames are carried; recordings that
            share them share their material frames.
        values: starting values of quantities, as options of `add_rod` (EI, GJ, bend_damping, ...); None = without it.
        tilts, shifts, roll: nuisances of the grips, see `add_rod`.
        rolls: let each grip roll as it leans, see `add_rolls`.
        curvature_modes, softness_modes, density_modes, slid_modes: see `add_rod`.
        places: let each free marker stand off from its measured place along the rope, by the quantity
            `rope_place_<its number>`, m.
        beside: (free markers, 2) m, how far each free marker sits beside the rope's axis, about its two directors;
            predictions start from the axis and tell where the markers are. Windows of a fit are of recordings that
            were moved onto the axis.
        late: s, by which the markers of the grips come after the others; predictions take the grips as so much earlier.
            Windows of a fit are of motions that do.
        marker_mass: kg of each free marker, beside `density`; spread over the rope it does the same, so that no motion
            tells it.
        segments: links between the grips.
        substeps: per frame.
        iterations: Newton iterations per substep.
        smoothing: s, over which starts are smoothed, and grips at least (`GrippedMotion.of`).
        sigma: m, expected error of a marker, against which priors count.
    """

    density: float
    nominal: tuple[Array, Array]
    values: Mapping[str, float | None]
    tilts: bool = False
    shifts: bool = False
    roll: bool = True
    rolls: bool = False
    curvature_modes: Sequence[int] = ()
    softness_modes: Sequence[int] = ()
    density_modes: Sequence[int] = ()
    slid_modes: Sequence[int] = ()
    places: bool = False
    beside: tuple[tuple[float, float], ...] = ()
    late: float = 0.0
    marker_mass: float = 0.0
    segments: int = 12
    substeps: int = 2
    iterations: int = 1
    smoothing: float = 0.08
    sigma: float = 5e-3
    gravity: tuple[float, float, float] = field(default=GRAVITY)

    def with_values(self, **values: float | None) -> RopeModel:
        """The same with other starting values."""
        return replace(self, values={**self.values, **values})

    def at(self, fitted: Mapping[str, float]) -> RopeModel:
        """The same starting from fitted quantities `rope_<option>`; those that no option holds stay at their start."""
        known = {key.removeprefix(f"{NAME}_"): value for key, value in fitted.items()}
        return replace(self, values={k: known.get(k, v) for k, v in self.values.items()})

    @property
    def quantities(self) -> dict[str, float]:
        """Its starting values by the names of quantities, `rope_<option>`."""
        return {f"{NAME}_{option}": value for option, value in self.values.items() if value is not None}

    def scene(self, motion: GrippedMotion, first: int, last: int) -> Scene:
        """The rope as it is in frame `first`, with the grips' motion until frame `last`."""
        scene = Scene(NAME, motion.recording.gravity if motion.recording.gravity is not None else self.gravity)
        frames = slice(first, last + 1)
        points, velocity = motion.start(first)
        options: dict[str, Any] = {k: v for k, v in self.values.items() if v is not None}
        length = options.pop("length", motion.length)
        grips = motion.grip(False, frames, self.nominal[0]), motion.grip(True, frames, self.nominal[1])
        rod = add_rod(
            scene,
            NAME,
            length=length,
            segments=self.segments,
            density=self.density,
            points=points,
            velocity=velocity,
            start=grips[0],
            end=grips[1],
            tilts=self.tilts,
            shifts=self.shifts,
            roll=self.roll,
            curvature_modes=self.curvature_modes,
            softness_modes=self.softness_modes,
            density_modes=self.density_modes,
            slid_modes=self.slid_modes,
            **options,
        )
        if self.rolls:
            add_rolls(scene, rod, grips, self.nominal, f"{NAME}_roll" if self.roll else None)
        scene.boundary.smoothed = motion.steadied
        if self.places:
            for k in motion.free:
                scene.add_quantity(place_of(k), 0.0, "m", positive=False, scale=5e-3)
        if self.marker_mass > 0.0:
            self._weigh_markers(scene, motion)
        return scene

    def _weigh_markers(self, scene: Scene, motion: GrippedMotion) -> None:
        """Each free marker's mass, shared by the two nodes beside it."""
        rod: Rod = scene.ropes[NAME]
        for k in motion.free:
            link, ahead = divmod(float(motion.fractions[k]) * self.segments, 1.0)
            for node, near in ((int(link), 1.0 - ahead), (int(link) + 1, ahead)):
                scene.add_terms([product("mass", int(rod.particles[node]), self.marker_mass * near, {})])

    def experiment(self, motion: GrippedMotion, window: Window | None = None) -> Experiment:
        """A window of a recording (all of it by default), predicted open loop from its first frame."""
        times = motion.recording.times
        start, stop = (times[0], times[-1]) if window is None else window
        inside = np.flatnonzero((times >= start - 1e-9) & (times <= stop + 1e-9))
        if len(inside) < 3:
            apart = f"{np.median(np.diff(times)):g} s apart"
            fix = f"give at least three frames between {times[0]:g} and {times[-1]:g} s, {apart}"
            raise InputError("window", f"of {motion.recording.name} holds too few frames", window, fix)
        first, last = int(inside[0]), int(inside[-1])
        scene = self.scene(motion, first, last)
        h, names = float(np.median(np.diff(times))) / self.substeps, motion.recording.markers
        return Experiment(
            scene=scene,
            recording=motion.recording,
            name=f"{motion.recording.name} from {times[first]:.2f} s",
            markers=self.marker_places(motion, scene),
            offsets={names[k]: (place_of(k), None, None) for k in motion.free} if self.places else {},
            fit=(float(times[min(first + 1, last)]), float(times[last])),
            start_time=float(times[first]),
            solver=Solver(h=h, iterations=self.iterations),
            sigma=self.sigma,
        )

    @staticmethod
    def marker_places(motion: GrippedMotion, scene: Scene) -> list[Place | None]:
        """The free markers on the rope, None for the gripped ones."""
        rod: Rod = scene.ropes[NAME]
        return [
            on_rope(rod, float(motion.fractions[k]) * rod.length) if k in motion.free else None
            for k in range(len(motion.recording.markers))
        ]


def place_of(marker: int) -> str:
    """Name of the quantity that moves a marker along the rope."""
    return f"{NAME}_place_{marker}"


def nominal_directions(motions: Sequence[GrippedMotion]) -> tuple[Array, Array]:
    """The mean directions of the two grips over all recordings."""
    means = []
    for end in (False, True):
        mean = np.concatenate([m.directions(end) for m in motions]).mean(axis=0)
        means.append(np.asarray(mean / np.linalg.norm(mean)))
    return means[0], means[1]


def shared_gravity(recordings: Sequence[Recording]) -> tuple[float, ...] | None:
    """The gravity that the recordings tell, or None where they tell none.

    Raises:
        InputError: they differ.
    """
    told = {tuple(float(g) for g in r.gravity) for r in recordings if r.gravity is not None}
    if len(told) > 1:
        raise InputError("gravity", "differs between recordings", sorted(told), "correct the JSON beside them")
    return told.pop() if told else None
