"""One recording and the scene that is to explain it, as a fit takes it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError, RecordingError
from ..motion.solver import Solver
from ..objects.markers import Place, places_for
from ..quantities.quantities import Term, product
from ..recording.cloud import Cloud
from ..recording.recording import Recording
from ..recording.windows import Window
from ..scene.given import check_scene
from ..scene.scene import Scene
from .checks import check_driven_sigma, check_errors, check_forces, check_parts, check_substep
from .correction import Correction, recorded_noise
from .estimated_start import EstimatedStart, together
from .force_sensor import INPUTS, ForceSensor
from .names import check_names
from .of_cloud import check_cloud, rows_of_point, shape_of
from .shooting import Shooting

NO_SHARE = 1e-9  # interpolation weights below this are zero


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """A recording, its scene, and which parts of the recording are fitted and which only predicted.

    Attributes:
        scene: frozen by the fit.
        recording: of markers, or a `Cloud` of points on the scene's cloths or ropes; times may start anywhere, see
            `start_time`.
        name: the recording's by default.
        markers: places of the markers (see `places_for`).
        fit: (start, stop) in s of the recording's own time, the part that the fit sees; all of it by default.
        held_out: the part that is only predicted, from the same start; None = none.
        solver: substep and method of the motion; must suit the recording (h well below the frame interval).
        static: the recording shows an equilibrium; its frames in the window are averaged into one.
        start: of motions, "given" (the scene's initial state), "equilibrium" (of the scene at the start, forces
            included), or "estimated": the fit finds the places and velocities of ropes and cloths at the start along
            with the parameters, from the scene's initial state on; for recordings that begin in the middle of a motion.
            A "settled" start is the given one once rigid links hold; an estimated one settles too.
        start_time: recording time at which the scene starts, s; the start of the fit window by default.
        time_offset: name of a quantity [s] that is added to the recording's times to get the scene's, or None. It is
            negative for a camera that is late: what its frame at 1 s shows happened at 0.7 s of the scene where it is
            -0.3 s.
        offsets: per marker name, names of quantities that are added to its offset (tangent, normal, tangent x normal),
            None for none.
        sigma: expected error of a marker, m: scales residuals against priors and between experiments.
        driven_sigma: noise of the markers that the scene follows (`Scene.follow`), m per coordinate, or "estimate"
            (from the recording itself): the fit then estimates their true motion along with the parameters, one
            correction for every frame and axis with this prior, and its intervals allow for it. `sigma` must be as
            honest, since the two are weighed against each other. For an equilibrium it is the noise of the places that
            hold it, in m. None = what is recorded of them is taken for the truth.
        axes: coordinates that count, such as "xz".
        radius: distance of the markers from a pivot, m: errors are then reported as angles in rad, rms
            distance/radius; None = in m.
        loss: "squares", "soft_l1", "huber" or, of a cloud, "cauchy", with loss_scale in units of sigma.
        shooting: cuts a motion whose errors grow into windows of this length, s, "auto", or a `Shooting`: their states
            at the start are found along with the parameters, and what the model loses over a window is a result.
        forces: sensors whose recorded forces are residuals too, beside those of the markers; for motions.
        predict: None takes part in the fit. Otherwise the recording is only predicted, with the shared parameters as
            fitted on the others and its private ones either fitted to its own fit window ("window": initial states,
            offsets) or set to the mean of the others' ("mean").
    """

    scene: Scene
    recording: Recording
    name: str = ""
    markers: Mapping[str, Place] | Sequence[Place | None] | None = None
    fit: Window | None = None
    held_out: Window | None = None
    solver: Solver = field(default_factory=Solver)
    static: bool = False
    start: str = "given"
    start_time: float | None = None
    time_offset: str | None = None
    offsets: Mapping[str, tuple[str | None, str | None, str | None]] = field(default_factory=dict)
    sigma: float = 1e-3
    driven_sigma: float | str | None = None
    axes: str = "xyz"
    radius: float | None = None
    loss: str = "squares"
    loss_scale: float = 1.0
    predict: str | None = None
    forces: Sequence[ForceSensor] = ()
    shooting: float | str | Shooting | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.recording, Recording):
            raise InputError(
                "recording", "is not a Recording", self.recording, "read the file: sb.Recording.load(path)"
            )
        check_scene(self.scene)
        object.__setattr__(self, "solver", Solver.given(self.solver))
        if not self.name:
            object.__setattr__(self, "name", self.recording.name)
        if self.is_cloud:
            of_markers = {"markers": self.markers, "offsets": self.offsets, "axes": self.axes.removeprefix("xyz")}
            not_yet = {"driven_sigma": self.driven_sigma, "radius": self.radius, "shooting": self.shooting}
            not_yet["start"] = "estimated" if self.start == "estimated" else None
            check_cloud(self.name, self.scene, of_markers, not_yet)
        check_errors(self.name, self.axes, self.radius, self.loss, self.loss_scale, self.sigma, self.is_cloud)
        if not self.static:
            check_substep(self.solver.h, self.recording.times)
        check_parts(self.name, self.fit, self.held_out, self.static, self.start, self.start_time, self.predict)
        corrected, late = self.driven_sigma is not None, self.time_offset is not None
        check_driven_sigma(self.name, self.driven_sigma, self.scene)
        if corrected:
            assert self.driven_noise is not None  # raises where the recording shows too little
        unknown = "driven_sigma" if corrected else "start" if self.start == "estimated" else None
        check_forces(self.name, self.forces, self.scene, self.static, unknown)
        beside = {"static": self.static, "forces": bool(self.forces), "driven_sigma": corrected, "time_offset": late}
        beside["start"] = self.start == "estimated"
        object.__setattr__(self, "shooting", Shooting.given(self.name, self.shooting, beside))

    @cached_property
    def driven_noise(self) -> float | None:
        """Noise of the markers that the scene follows, m: `driven_sigma`, "estimate" carried out; None without one.

        Raises:
            InputError: the recording shows too little of the markers that are followed to estimate from.
        """
        if self.driven_sigma != "estimate":
            return None if self.driven_sigma is None else float(self.driven_sigma)
        found = self.recorded_noise()
        if not found:
            fix = "give it in m"
            raise InputError(f"{self.name}.driven_sigma", "cannot be estimated from the recording", found, fix)
        return found

    def recorded_noise(self) -> float | None:
        """Noise that the markers show which the scene follows, m per coordinate; None where there are none, or the
        recording shows too little of them."""
        markers = tuple(dict.fromkeys(m for part in self.scene.boundary.following for m in part.markers))
        return None if self.static or self.is_cloud else recorded_noise(self.recording.piece(self.t0, None), markers)

    @property
    def has_unknowns(self) -> bool:
        """Whether a fit solves for numbers of it on the way: its start, or the motion of what drives it."""
        return self.driven_sigma is not None or self.start == "estimated"

    @property
    def is_cloud(self) -> bool:
        """Whether the recording is a cloud, whose points are compared with the closest places on the scene's cloths,
        or on its ropes if it has no cloth."""
        return isinstance(self.recording, Cloud)

    @property
    def rows_each(self) -> int:
        """Residuals of a marker in a frame, one along every axis that counts; of a point of a cloud its distances."""
        return rows_of_point(self.scene) if self.is_cloud else len(self.axes)

    @cached_property
    def places(self) -> tuple[Place | None, ...]:
        """The markers' places, None where not compared; none of a cloud."""
        if self.is_cloud:
            return ()
        return places_for(self.scene, self.markers, self.recording.markers, self.recording.positions)

    @property
    def compared_places(self) -> list[Place]:
        """Places of the compared markers; none of a cloud."""
        return [place for i in self.placed if (place := self.places[i]) is not None]

    @cached_property
    def compared(self) -> tuple[int, ...]:
        """Indices of compared markers: placed, and not on particles whose motion is given. All points of a cloud."""
        if self.is_cloud:
            return tuple(range(len(self.recording.markers)))
        held = self.scene.pinned | set(self.scene.boundary.driven)
        chosen = tuple(i for i, p in enumerate(self.places) if p is not None and not self._depends_on(i, p) <= held)
        if not chosen:
            fix = "place markers on particles that move"
            raise RecordingError(f"{self.name}.markers", "leave nothing to compare", len(self.places), fix)
        return chosen

    @property
    def placed(self) -> tuple[int, ...]:
        """`compared` markers, which have places; none of a cloud."""
        return () if self.is_cloud else self.compared

    def _depends_on(self, i: int, place: Place) -> set[int]:
        """Particles that move a marker: weights of a node right at its place are rounding errors elsewhere."""
        turns = place.offset is not None or self.recording.markers[i] in self.offsets
        if place.body is not None:
            return set(place.particles)
        shares = zip(place.particles, place.weights, place.tangent, strict=True)
        return {p for p, weight, tangent in shares if abs(weight) > NO_SHARE or (turns and tangent != 0.0)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the compared markers."""
        return tuple(self.recording.markers[i] for i in self.compared)

    def fitted(self) -> Recording:
        """The part of the recording that the fit sees, compared markers only; one mean frame for an equilibrium."""
        return self._part(self.fit)

    def held(self) -> Recording | None:
        """The part that is only predicted."""
        return None if self.held_out is None else self._part(self.held_out)

    def _part(self, window: Window | None) -> Recording:
        part = self.recording if window is None else self.recording.piece(*window)
        if isinstance(part, Cloud):
            return part.named(self.name).pooled() if self.static else part.named(self.name)
        markers = part.compared(self.compared, self.name)
        return markers.mean() if self.static and len(part.times) > 1 else markers

    @property
    def t0(self) -> float:
        """Recording time of the scene's start, s."""
        if self.start_time is not None:
            return self.start_time
        return float(self.recording.times[0] if self.fit is None else self.fit[0])

    def scene_times(self, times: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
        """Times (frames,) s of the recording on the scene's clock, which starts at zero.

        Args:
            values: of quantities of the scene, for the clock's offset; as the scene has it by default.
        """
        name = self.time_offset
        offset = 0.0 if name is None else values.get(name, self.scene.quantities[name].value)
        return np.asarray(times - self.t0 + offset)

    def observed(self, recording: Recording) -> dict[str, Any]:
        """Observations for the compiled core; the scene's clock starts at 0.

        Args:
            recording: the experiment's, or a part of it, with the compared markers only.

        Raises:
            RecordingError: the scene starts after the first frame.
        """
        times = np.zeros(1) if self.static else recording.times - self.t0
        if not self.static and times[0] < -1e-9:
            raise RecordingError(
                f"{self.name}.start_time", "lies after the first frame that is compared", self.t0, "start earlier"
            )
        measured = np.where(recording.mask[..., None], recording.positions, np.nan)
        return {
            "times": np.maximum(times, 0.0),
            "measured": np.ascontiguousarray(measured),
            "sigma": np.full(measured.shape[:2], self.sigma),
            "axes": ["xyz".index(a) for a in self.axes],
            "loss": self.loss,
            "loss_scale": self.loss_scale,
            "markers": [place.core(self.scene) for place in self.compared_places],
            "cloud": shape_of(self.scene, len(self.compared)) if self.is_cloud else None,
        }

    def extra_terms(self) -> list[Term]:
        """Terms of the inputs that belong to the observation: marker offsets (3 each), then the time offset."""
        known = self.scene.quantities
        check_names(self.name, self.recording.markers, known, self.offsets, self.time_offset)
        terms: list[Term] = []
        for m, i in enumerate(self.placed):
            terms += [
                Term("extra", 3 * m + k, c, factors)
                for k, one in enumerate(self._offset(i))
                for factors, c in one.parts.items()
                if factors
            ]
        if self.time_offset is not None:
            terms.append(product("extra", 3 * len(self.compared), 1.0, {self.time_offset: "identity"}))
        return terms

    def _offset(self, i: int) -> np.ndarray:
        """(3,) expressions of the offset of a compared marker, m."""
        place = self.places[i]
        assert place is not None
        return place.offset_with(self.offsets.get(self.recording.markers[i], (None, None, None)))

    def sensor_terms(self) -> list[Term]:
        """Terms of the inputs of the force sensors, which follow the time offset."""
        first = 3 * len(self.compared) + 1
        return [term for k, sensor in enumerate(self.forces) for term in sensor.terms(first + INPUTS * k)]

    def sensed(self, recording: Recording) -> list[dict[str, Any]]:
        """The force sensors for the compiled core, with the samples that (part of) the recording spans."""
        span = (float(recording.times[0]), float(recording.times[-1]))
        return [sensor.core(self.scene, self.t0, span, self.solver.h) for sensor in self.forces]

    def correction(self, recording: Recording) -> Correction | None:
        """Of the markers that the scene follows, as far as (part of) the recording feels it; None without any."""
        until = None if self.static else float(recording.times[-1]) - self.t0
        if until not in self._corrections:
            self._corrections[until] = Correction.of(self.scene, until)
        return self._corrections[until]

    @cached_property
    def _corrections(self) -> dict[float | None, Correction | None]:
        """By what they are made from, which no problem on the frozen scene changes."""
        return {}

    @cached_property
    def estimated_start(self) -> EstimatedStart | None:
        """The numbers of a start that is estimated; None of another."""
        if self.start != "estimated":
            return None
        return EstimatedStart.of(self.name, self.scene, self.compared_places, self.fitted(), self.sigma)

    @cached_property
    def _can_step(self) -> bool:
        """Asked once, so that what the solver refuses or warns of is told before any fit."""
        self.solver.core(self.scene.compiled)
        return True

    def core(self, recording: Recording, corrected: np.ndarray | None = None) -> dict[str, Any]:
        """The experiment on (part of) its recording, for the compiled core.

        Args:
            corrected: (knots, markers, 3) m, a known correction of the markers that the scene follows; by default the
                fit finds it where there is a `driven_sigma`, and otherwise it is zero. A start is estimated in either
                case.
        """
        compiled = self.scene.compiled
        if not self.static:
            self.solver.check_smooth(compiled)
        offsets = [[one.constant for one in self._offset(i)] for i in self.placed]
        observed = self.observed(recording)
        for marker, m in zip(observed["markers"], self.placed, strict=True):
            marker["carries_offset"] = marker["carries_offset"] or self.recording.markers[m] in self.offsets
        extra = 3 * len(self.compared) + 1 + INPUTS * len(self.forces)
        map_ = compiled.map(extra, [*self.extra_terms(), *self.sensor_terms()])
        map_["base"][compiled.core.inputs : compiled.core.inputs + 3 * len(offsets)] = np.ravel(offsets)
        correction = self.correction(recording)
        _ = self.static or self._can_step
        sigma = 0.0 if corrected is not None else self.driven_noise or 0.0
        start = self.estimated_start
        if (sigma > 0.0 or start is not None) and self.solver.extrapolate > 1 and not self.static:
            fix, key = "leave one of the two out", "driven_sigma" if sigma > 0.0 else "start"
            raise InputError(
                f"{self.name}.{key}", "does not go with runs that are extrapolated", getattr(self, key), fix
            )
        layout = compiled.layout
        driven = None if correction is None else correction.core(layout["boundary"][0], sigma, corrected)
        own = None if start is None else start.core(layout)
        return {
            "name": self.name,
            "scene": compiled.core,
            **self.solver.core_options,
            "finer": [] if self.static else list(self.solver.runs[1:]),
            "map": map_,
            "least": compiled.domain.least,
            "most": compiled.domain.most,
            "observed": observed,
            "sensors": self.sensed(recording),
            "correction": together(own, driven),
            "is_static": self.static,
            "start": self.start,
            "t0": 0.0,
        }
