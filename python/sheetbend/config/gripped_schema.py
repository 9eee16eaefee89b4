"""The configuration of a fit of ropes held by two grips: every key with its default, unit and meaning."""

from __future__ import annotations

import inspect
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, Field, field_validator, model_validator

from ..files.units import Length
from ..gripped import fit_rope
from ..minimum.starts import MOST
from .schema import ExperimentSection, OutputSection
from .section import MOST_SEGMENTS, Finite, Name, Pair, Section, Vector, key

RungName = Literal["twist", "tilts", "rest", "varying", "yield", "rolls", "clock", "beside", "shifts", "markers"]
RUNGS: tuple[RungName, ...] = get_args(RungName)
RECIPE = {name: option.default for name, option in inspect.signature(fit_rope).parameters.items()}


def _default(option: str) -> Any:
    """That of `fit_rope`, tuples as lists."""
    value = RECIPE[option]
    if isinstance(value, tuple):
        return [list(part) if isinstance(part, tuple) else part for part in value]
    return value


def _span(pair: list[float]) -> list[float]:
    if not 0 < pair[0] <= pair[1]:
        raise ValueError("must be [length, total] with 0 < length <= total|give such as [0.5, 8.0]")
    return pair


def _directions(pair: list[list[float]]) -> list[list[float]]:
    if len(pair) != 2 or not all(any(direction) for direction in pair):
        raise ValueError("must be two directions that have a length|give [start, end] such as [[1, 0, -1], [1, 0, 1]]")
    return pair


Positive = Annotated[Finite, Field(gt=0)]
Span = Annotated[Pair, AfterValidator(_span)]
Directions = Annotated[list[Vector], AfterValidator(_directions)]


class GrippedRopeSection(Section):
    """[[gripped_rope]]: a rope between two grips, and how it is fitted. A list."""

    name: Name = key(..., "names the rope in results, and their folder")
    density: Finite | None = key(
        None,
        "mass per length, weighed; when left out, what follows from motion alone is fitted and reported: stiffness and "
        "drag over the density, such as EI/density in m^4/s^2",
        "kg/m",
        gt=0,
    )
    density_sd: Finite | None = key(
        None, "relative standard deviation of the density, which then counts in the intervals (0.02 is 2 %)", gt=0
    )
    marker_mass: Finite | None = key(
        None,
        "mass of each free marker that was not weighed with the rope, 0 if all were; when left out, the intervals "
        "allow for 8 % of the density",
        "kg",
        ge=0,
    )
    train: str = key(..., "folder of the recordings to fit, relative to the configuration")
    eval: str | None = key(None, "folder of recordings that are only predicted, from their first frame")
    pattern: str = key("*", 'which files of these folders, such as "*.pkl"', min_length=1)
    units: Length | None = key(None, "length unit of the files; their JSONs' when left out")
    clamped: list[str | int] | None = key(
        None, "names or numbers of the gripped markers, two or more at each end; the files' when left out"
    )
    reorder: dict[str, list[str | int]] = key(
        {},
        "order of the markers along the rope of single files, such as "
        '{ "train/02" = [0, 1, 2, 3, 5, 4, 6, 7] } or with their names; all markers of the file, once each. Exchanged '
        "markers of a grip need no entry: they are found and put back",
    )
    gravity: Vector | None = key(
        None,
        "in the axes of the recordings, if their JSONs do not contain it; when left out, 9.81 along -z, or along the "
        "axis of the rope's sag if that is another one and predicts better; a warning then names the axis",
        "m/s^2",
    )
    nominal: Directions | None = key(
        None,
        "[start, end], directions from which the frames of the grips are carried by the shortest rotation, the same "
        "for all recordings; the mean recorded ones when left out",
    )
    rungs: list[RungName] = key(
        list(RUNGS),
        "effects that are added to the model one after another: straight with twist, tilts of the grips, rest "
        "curvature, a stiffness that varies along the rope, yield, how far the grips roll about the rope as they lean, "
        "how late the grips are recorded, how far the markers are from the rope's axis, places of the grips beside "
        "their markers, places of the markers along the rope. A rung is kept only if it improves predictions of most "
        "recordings that it was not fitted to, and does not worsen those of the others",
        min_length=1,
    )
    validate_share: Finite = key(
        _default("validate"),
        "share of the recordings in `train` that judge each rung. If that is less than one recording, the end of each "
        "recording judges, with this share of its time. The last fit uses all recordings",
        ge=0,
        lt=1,
    )
    windows: Annotated[list[Span], Field(min_length=1)] | Literal["all"] = key(
        _default("windows"),
        "[length, total] of the windows of each fit, each predicted open loop: short ones first, whose cost is "
        'smooth. "all" = these defaults, but the last fit uses every window of all recordings; its expected time is '
        "printed before",
        "s",
    )
    bending_lengths: list[Positive] = key(
        _default("bending_lengths"), "of the starts, (EI/(density g))^(1/3); the best one is used", "m", min_length=1
    )
    starts: int | None = key(
        _default("starts"),
        "number of starts, fitted to the shortest windows: those of `bending_lengths`, and others drawn over two "
        "decades about the middle one. The best of each group that ends in the same minimum is fitted to whole "
        "recordings, and the recipe continues from the one that predicts best. When left out, those of "
        "`bending_lengths` alone",
        ge=1,
        le=MOST,
    )
    segments: int = key(_default("segments"), "links at the start", ge=4, le=MOST_SEGMENTS)
    max_segments: int = key(
        _default("max_segments"), "links are doubled, up to this number, until EI changes by less than 5 %", ge=4
    )
    substeps: int = key(_default("substeps"), "per frame", ge=1)
    smoothing: Finite = key(
        _default("smoothing"),
        "over which starts are smoothed; grips over this time or more, depending on their noise",
        "s",
        ge=0,
    )
    sigma: Finite = key(_default("sigma"), "expected error of a marker, against which priors count", "m", gt=0)

    @field_validator("rungs")
    @classmethod
    def _each_once(cls, rungs: list[RungName]) -> list[RungName]:
        if len(set(rungs)) < len(rungs) or rungs[0] != "twist":
            order = ", ".join(f'"{rung}"' for rung in RUNGS)
            raise ValueError(f'must be given each once, "twist" first|leave out some of {order}')
        return rungs

    @model_validator(mode="after")
    def _weighed(self) -> Self:
        if self.density is None and self.density_sd is not None:
            raise ValueError("density_sd needs a density|give density, or leave density_sd out")
        return self

    @field_validator("reorder")
    @classmethod
    def _of_a_folder(cls, reorder: dict[str, list[str | int]]) -> dict[str, list[str | int]]:
        for name in reorder:
            if name.partition("/")[0] not in ("train", "eval"):
                raise ValueError(f'names {name!r}|write "train/NAME" or "eval/NAME"')
        return reorder


class GrippedFitSection(Section):
    """[fit]: options of the fits, beside [[gripped_rope]]."""

    threads: int = key(1, "over windows and derivatives; results do not depend on it", ge=1)
    without_twist: bool = key(
        False, "also fit, with the same rungs, a rope of negligible torsional stiffness, to show what twist explains"
    )
    strict: bool = key(False, "exit 3 when any parameter is not identifiable, not only when all are")

    @model_validator(mode="before")
    @classmethod
    def _starts_of_a_rope(cls, given: Any) -> Any:
        if isinstance(given, dict) and "starts" in given:
            raise ValueError("has starts, which are a key of each rope here|write starts in [[gripped_rope]]")
        return given


class GrippedConfig(Section):
    """A whole file with [[gripped_rope]]."""

    experiment: ExperimentSection = key(..., "the name of the experiment")
    gripped_rope: list[GrippedRopeSection] = key(..., "the ropes", min_length=1)
    fit: GrippedFitSection = key(GrippedFitSection(), "how the fits run")
    output: OutputSection = key(OutputSection(), "what is written")

    @field_validator("gripped_rope")
    @classmethod
    def _named_once(cls, ropes: list[GrippedRopeSection]) -> list[GrippedRopeSection]:
        names = [rope.name for rope in ropes]
        twice = [name for i, name in enumerate(names) if name in names[:i]]
        if twice:
            raise ValueError(f"has two ropes of the name {twice[0]!r}|give each rope a name of its own")
        return ropes
