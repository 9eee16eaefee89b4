"""The configuration as pydantic models: every key with its default, unit and meaning."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import model_validator

from ..files.units import Length
from .cloth_schema import MarkerGrid
from .rope_schema import RopeHere
from .scene_schema import SceneSection
from .section import AXES, Finite, Name, Pair, Quaternion, Reference, Section, Vector, Window, key
from .solver_schema import SolverSection
from .tools import with_corrections


class ExperimentSection(Section):
    """[experiment]: the name of the experiment."""

    name: Name = key(..., "names the results and their folder")
    about: str = key("", "a sentence for the report")


class Marker(Section):
    """Where a marker sits: on a rope by arc length, on a cloth, on a particle, on an arm, or between two particles.

    A list: [[marker]], shared, or [[recording.marker]].
    """

    marker: str | int = key(..., "name or number in the recording")
    rope: Name | None = key(None, "a rope, with `arc_length`; the only rope when left out")
    arc_length: Finite | None = key(None, "material coordinate along the rope", "m")
    cloth: Name | None = key(None, "a cloth instead, with `material`; the only cloth when left out")
    material: Pair | None = key(None, "material coordinates on the cloth, along warp and weft", "m")
    particle: Reference | None = key(None, "a particle instead")
    arm: Name | None = key(None, "an arm or pendulum instead, with `radius`")
    radius: Finite | None = key(None, "distance from the arm's pivot", "m")
    body: Name | None = key(None, "a rigid body instead, with `point`")
    point: Vector | None = key(None, "place in the body's frame; `offset` counts along its axes", "m")
    solid: Name | None = key(None, "a solid instead, with `place`")
    place: Vector | None = key(None, "point of the solid's shape at rest, on its surface or inside", "m")
    between: list[Reference] | None = key(None, "two particles instead, with `fraction`", min_length=2, max_length=2)
    fraction: Finite = key(0.5, "share of the way from the first of the two to the second")
    offset: Vector | None = key(None, "standing off along (tangent, normal, tangent x normal)", "m")
    normal: Vector = key([0.0, 1.0, 0.0], "the normal of `offset`")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        kinds = ("arc_length", "material", "particle", "arm", "body", "solid", "between")
        places = [n for n in kinds if getattr(self, n) is not None]
        if len(places) != 1:
            raise ValueError(f"names {' and '.join(places) or 'no place'}|give one of {', '.join(kinds)}")
        if (self.arm is None) != (self.radius is None):
            raise ValueError("has only one of arm and radius|give both")
        if (self.body is None) != (self.point is None):
            raise ValueError("has only one of body and point|give both")
        if (self.solid is None) != (self.place is None):
            raise ValueError("has only one of solid and place|give both")
        if self.solid is not None and self.offset is not None:
            raise ValueError("stands off a solid|leave offset out, and give the place below it")
        return self


class ForceSection(Section):
    """The forces that a sensor at a support measured. A list: [[recording.force]]."""

    file: str = key(..., "CSV (time, fx, fy, fz, ...) or NPZ, relative to the configuration; in the sensor's axes")
    at: list[str] = key(
        ...,
        'the support: ["ROPE:start"] or ["ROPE:end"] for the end of a rope with its grip, ["CLOTH:SET"] for a set of '
        'vertices, ["BODY"] for a [[scene.body]], or particles; all of them held; torques are taken at the first, the '
        "center of mass of a body",
        min_length=1,
    )
    name: Name | None = key(None, "its quantities begin with it; the file's when left out")
    sigma: Finite = key(..., "expected error of a force", "N", gt=0)
    torque_sigma: Finite | None = key(None, "expected error of a torque; torques do not count without", "N m", gt=0)
    axes: str = key("xyz", "forces that count, in the sensor's axes", pattern=AXES)
    torque_axes: str = key("xyz", "torques that count", pattern=AXES)
    reads: Literal["support", "body"] = key(
        "support", 'the force that the support puts on the body, or ("body") its opposite'
    )
    quaternion: Quaternion = key(
        [0.0, 0.0, 0.0, 1.0],
        "(x, y, z, w) from the sensor's axes to the world's, of one that does not turn; the file's count before it",
    )
    arm: Vector = key([0.0, 0.0, 0.0], "from the first particle to the point of the torques, sensor's axes", "m")
    average: Finite = key(0.0, "time before each sample over which the sensor takes the mean", "s", ge=0)
    bias: bool = key(False, "quantities NAME_bias_x, ... are added to what it reads")
    torque_bias: bool = key(False, "quantities NAME_torque_bias_x, ... likewise")
    tool: bool = key(False, "it also carries a tool: quantities NAME_tool_mass, NAME_tool_center_x, ...")
    time_offset: str | bool | None = key(
        None, "a quantity (s) that shifts its clock, or true for one of its own, NAME_time_offset"
    )


class RecordingSection(Section):
    """A recording. A list: [[recording]]; each gets a scene object of its own from the shared description."""

    file: str = key(..., "NPZ, CSV or PKL, relative to the configuration")
    cloud: str | None = key(
        None,
        "an NPZ of a point cloud that is compared with the scene's cloths or ropes, in place of the markers of `file`: "
        "these drive and hold the scene. Where no marker does, `file` names the cloud too",
    )
    name: Name | None = key(None, "the file's when left out")
    units: Length | None = key(None, "length unit of the file; its JSON's when left out")
    mend: bool = key(
        False, "put back markers that exchange their labels, and do not use those that are elsewhere for some frames"
    )
    ropes: list[Name] | None = key(None, "names of the ropes that it shows; all when left out", min_length=1)
    leave_out: list[Name] = key(
        [],
        "names of cloths, particles, constraints, hung masses, forces, contacts and quantities that are not in its "
        "scene",
    )
    frames: list[int] | None = key(
        None, "[first, stop] or [first, stop, step]: use these frames only", min_length=2, max_length=3
    )
    max_gap: Finite | None = key(
        None,
        "longest time for which a marker that drives something may be lost; a cubic fills the gap; "
        "3.5 frame intervals when left out",
        "s",
        ge=0,
    )
    fit: Window | None = key(
        None, "[start, stop] in the recording's time: the part that is fitted; all when left out", "s"
    )
    hidden: list[Window] = key(
        [], "[start, stop] each: parts that count as not seen, to predict them; markers that drive something stay", "s"
    )
    held_out: Window | None = key(None, "[start, stop]: the part that is only predicted, from the same start", "s")
    tools: dict[Name, str] = key({}, "poses of tools in this recording: files by tool, see `scene.tool.file`")
    start_time: Finite | None = key(
        None, "recording time at which the scene starts; by default the start of `fit`", "s"
    )
    static: bool = key(False, "it shows an equilibrium; the frames of `fit` are averaged")
    start: Literal["given", "estimated", "equilibrium"] = key(
        "given",
        "a motion starts from the initial shape and velocities, or from the scene's equilibrium. Where the recording "
        'begins in the middle of a motion, "estimated": the fit finds the places and velocities of ropes and cloths at '
        "the start along with the parameters. The initial shape and velocities are where it begins, such as those "
        "through the markers",
    )
    predict: Literal["window", "mean"] | None = key(
        None,
        'not fitted, only predicted: private parameters fitted to its own `fit` window ("window") '
        'or the others\' mean ("mean")',
    )
    sigma: Finite = key(1e-3, "expected error of a marker", "m", gt=0)
    driven_sigma: Finite | Literal["estimate"] | None = key(
        None,
        'noise of the markers that `scene.drive` and grips follow, in each coordinate, or "estimate" (from the '
        "recording): the fit also estimates their true motion, with this noise as prior, and intervals allow for it; "
        "`sigma` must be right too",
        "m",
    )
    driven_motion: str | None = key(
        None,
        "a file with the true motion of these markers, as `sheetbend fit` writes it beside its fitted.toml: "
        "simulations follow it instead of the recorded motion. A fit estimates it anew",
    )
    axes: str = key("xyz", "coordinates that count", pattern=AXES)
    radius: Finite | None = key(
        None,
        "distance of the markers from a pivot: the report then gives errors as angles, rms distance/radius",
        "m",
        gt=0,
    )
    loss: Literal["squares", "soft_l1", "huber", "cauchy"] = key(
        "squares",
        "soft_l1 and huber give large residuals less weight, and cauchy, for a `cloud`, almost none",
    )
    loss_scale: Finite = key(1.0, "residual beyond which a robust loss grows more slowly, in sigma", gt=0)
    shooting: Finite | Literal["auto"] | None = key(
        None,
        'cut the motion into windows of this length, or "auto": their states at the start are found along with the '
        "parameters, so that a chaotic motion can be fitted; the report gives the error that the model accumulates per "
        "second",
        "s",
    )
    marker: list[Marker] = key([], "places of this recording's markers; those of [[marker]] when left out")
    here: dict[Name, RopeHere] = key({}, "by rope or rod, its markers and grips in this recording, instead of its own")
    grids: dict[Name, MarkerGrid] = key({}, "by cloth, markers on a grid in this recording, instead of the cloth's own")
    offsets: dict[str, list[str]] = key(
        {},
        'per marker [a, b, c]: quantities added to its offset along (tangent, normal, tangent x normal), "" for none',
    )
    time_offset: str | None = key(
        None,
        "a quantity (s) that is added to the times of the recording to get those of the scene: -0.3 for a camera that "
        "is 0.3 s late (its frame at 1 s shows what happened at 0.7 s). Start the scene early enough: `start_time`",
    )
    force: list[ForceSection] = key([], "forces that were measured at its supports")
    values: dict[str, Finite] = key(
        {}, "quantities whose value is known to differ here; for private parameters the initial value"
    )
    finer: dict[str, Finite] = key(
        {}, "values of private parameters on twice the segments or cells, as `finer` of [parameters.NAME] is of others"
    )

    @model_validator(mode="after")
    def _estimated_by_a_fit(self) -> Self:
        if self.driven_motion is not None and self.driven_sigma is None:
            raise ValueError("has driven_motion without driven_sigma|give the noise of the driven markers, or drop it")
        return self


class ParameterSection(Section):
    """What is fitted. One table each: [parameters.NAME], NAME being a quantity of the scene; `info` lists them."""

    initial: Finite | None = key(None, "starting value; the scene's when left out")
    finer: Finite | None = key(
        None, "value on twice the segments or cells, for `sheetbend simulate --finer`; a fit writes it into fitted.toml"
    )
    lower: Finite | None = key(None, "lower bound")
    upper: Finite | None = key(None, "upper bound")
    log: bool | None = key(None, "fit the logarithm; by default for quantities that must be positive")
    fixed: bool = key(False, "keep the initial value")
    tied_to: str | None = key(None, "follow another parameter")
    factor: Finite = key(1.0, "value = factor times that of `tied_to`")
    prior: Pair | None = key(None, "[mean, sd]; with log the sd is that of the natural logarithm")
    unit: str | None = key(None, "for reports; the scene's when left out")
    private: bool = key(False, "one value per recording")
    scale: Finite | None = key(None, "natural size of a parameter that may be zero", gt=0)


class GivenSection(Section):
    """How uncertain a number is that the fit takes as given. One table each: [given.NAME], NAME being a quantity that
    is not fitted, "gravity", "clamp_direction", "grip_direction" (of each grip against its poses, or of each of several
    clamps), "collider_direction" or "load_direction" (directions, rad), "clamps", "lead" (free length: how far a rope
    sticks out of what holds it), "markers", "marker_offset" (from a rope's axis) or "drive_place" (places, m),
    "recording_delay" (s), "marker_mass" (of each that the model does not have, kg), "draft" (velocity of the air along
    each axis, m/s), of force sensors "force_size" (relative), "force_zero" (N), "torque_zero" (N m), "force_direction"
    (rad) and "force_delay" (s), "gravity_size", "recording_clock" (its frame rate), "recording_size", "drive_size" (how
    far what drives the scene moves), "load_size" (forces that are no quantities), "start_speed" (how fast a motion
    starts), "unnamed" (masses, drag, air and pressures of a scene built by hand that are no quantities), "dry_friction"
    (of hinges that have viscosity alone, as a share of its loss) or "isotropy" (weft over warp, and other second
    stiffnesses, where only the first is given; relative)."""

    sd: Finite = key(
        ...,
        "standard deviation, which then counts in the intervals: relative for what must be positive (0.02 is 2 %), "
        "else in the quantity's unit; 0 is exact",
        ge=0,
    )


class SmoothSection(Section):
    """A field that is fitted with a smoothness prior. One table each: [smooth.NAME], NAME being "<solid>_stiffness" of
    a solid with clusters and `stiffness_modes`, "<cloth>_stiffness" of a cloth with them, "<rope>_softness" of a rope
    or rod with `softness_modes`, or the name of an unknown force or wind, which needs no table. The modes are then
    parameters."""

    size: Finite | None = key(
        None,
        "root mean square of ln E about its mean, or of a force (N) or wind (m/s) along each axis; found from the "
        "recordings when left out",
        gt=0,
    )
    length: Finite | None = key(
        None,
        "over which neighbors are alike, m; of a force or wind the time, s; found from the recordings when left out",
        gt=0,
    )


class FitSection(Section):
    """[fit]: options of the fit."""

    optimizer: Literal["auto", "ceres", "scipy"] = key("auto", "Ceres where it was built, else SciPy")
    starts: list[dict[str, Finite]] | int = key(
        [],
        "further starting values by name; the best result counts. Or a number of starts: the initial one, and others "
        "drawn from priors, between bounds, or over two decades; all race through the windows, and one of each group "
        "that ends in the same minimum is fitted",
    )
    windows: Literal["auto"] | list[Finite] = key(
        "auto",
        "increasing lengths of the beginnings that are fitted first, one after another; auto chooses them (none if the "
        "start is near the minimum); [] = none",
        "s",
    )
    max_iterations: int = key(200, "per start and window", ge=1)
    tolerance: Finite = key(1e-10, "relative change of the cost at which the optimizer stops", gt=0, lt=1)
    threads: int = key(1, "share the work of recordings and derivatives; results do not depend on it", ge=1)
    halve_step: bool = key(
        True,
        "extrapolate the estimates to the limit of short substeps, and include the remaining error in the intervals; "
        "costs about three evaluations with tangents",
    )
    double_segments: bool | None = key(
        None,
        "true: fit again with twice the segments in every rope and twice the cells in every cloth; left out: one "
        "simulation there, whose effect on the estimates to first order counts; false: the mesh does not count",
    )
    linear_refits: bool = key(False, "with `double_segments = true`: one simulation instead of the second fit")
    profiles: bool = key(
        True, "follow the cost to the ends of every interval, refitting the others; false: linear intervals, at no cost"
    )
    bootstrap: int = key(
        0,
        "number of fits to data that are drawn from these with replacement, for intervals that assume nothing of the "
        "noise: whole recordings where there are eight or more, else stretches of each; 0 = none, else at least 50",
        ge=0,
    )
    leave_one_out: bool = key(False, "predict every recording that has no held-out part by a fit to the others")
    strict: bool = key(False, "exit 3 when any requested parameter is not identifiable, not only when all are")


class OutputSection(Section):
    """[output]: what `fit` writes beside fit.json and fitted.toml."""

    figures: Literal["png", "svg", "pdf", "none"] = key("png", "format of the figures")


class Config(Section):
    """A whole file."""

    experiment: ExperimentSection = key(..., "the name of the experiment")
    solver: SolverSection = key(SolverSection(), "how motions are stepped")
    scene: SceneSection = key(..., "what all recordings share")
    marker: list[Marker] = key([], "places of markers, shared by the recordings")
    recording: list[RecordingSection] = key([], "the recordings")
    parameters: dict[str, ParameterSection] = key({}, "what is fitted")
    given: dict[str, GivenSection] = key({}, "how uncertain the numbers are that the fit takes as given")
    smooth: dict[str, SmoothSection] = key({}, "fields that are fitted with a smoothness prior")
    fit: FitSection = key(FitSection(), "how the fit runs")
    output: OutputSection = key(OutputSection(), "what is written")
    published: dict[str, Finite | Window] = key(
        {}, "values by others, or [lowest, highest], shown beside the estimates"
    )

    @model_validator(mode="before")
    @classmethod
    def _tools_have_their_parameters(cls, given: Any) -> Any:
        return with_corrections(given) if isinstance(given, dict) else given
