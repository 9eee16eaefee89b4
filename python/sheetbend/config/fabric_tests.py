"""From a file of `sheetbend fabric` to the readings of all tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import ValidationError

from ..errors import ConfigError, InputError
from ..files.door import reading
from ..textile import Curve, FabricTests, Measured, Outline, read_curves, read_outline
from ..textile.laboratory import bending_lengths, bias_pulled, draped, rigidities, shear_stiffness, weighed
from ..textile.units import quantity
from .errors import from_validation
from .fabric_schema import DrapeTest, FabricConfig, Machine, Pull
from .file import content


@dataclass(frozen=True)
class FabricStudy:
    """A fabric's tests as read: what `fit_tests` takes, with the curves of all pulls by direction ("bias" too), and
    outlines of drapes."""

    config: FabricConfig
    tests: FabricTests
    curves: dict[str, tuple[Curve, ...]]
    outlines: tuple[Outline, ...]


def load_fabric_tests(path: str | Path) -> FabricStudy:
    """Read a file of `sheetbend fabric`, and all files that it names.

    Raises:
        ConfigError: a key is unknown, missing or wrong, or a file cannot be read; it names the key.
    """
    path = Path(path)
    with reading(path, ConfigError):
        try:
            config = FabricConfig.model_validate(content(path))
        except ValidationError as error:
            raise from_validation(error, FabricConfig) from error
    folder = path.parent
    curves: dict[str, tuple[Curve, ...]] = {
        p.along: _pulled(f"pull[{k}]", p, folder) for k, p in enumerate(config.pull)
    }
    outlines = () if config.drape is None else _outlines(config.drape, folder)
    readings: dict[str, list[Measured]] = {}
    if config.weight is not None:
        readings["density"] = [weighed(config.weight.specimens)]
    for k, shear in enumerate(config.shear):
        with _at(f"shear[{k}]"):
            values = shear.specimens or _curves(f"shear[{k}]", shear, folder, "shear")
            readings.setdefault("shear", []).append(shear_stiffness(values, shear.along, shear.cycle))
    for k, bending in enumerate(config.bending):
        name = "bending" if bending.along == "warp" else "bending_weft"
        with _at(f"bending[{k}]"):
            if bending.bending_length is not None:
                found = bending_lengths(bending.bending_length, bending.along)
            else:
                loops = _curves(f"bending[{k}]", bending, folder, "bending")
                found = rigidities(loops, bending.along, bending.cycle)
            readings.setdefault(name, []).append(found)
    by_direction = {p.along: p for p in config.pull}
    if "bias" in curves:
        with _at("pull of the bias"):
            readings.setdefault("shear", []).extend(bias_pulled(curves["bias"], by_direction["bias"].cycle))
    if config.drape is not None:
        with _at("drape"):
            of = config.drape
            readings["drape"] = [draped(outlines, of.plates(), of.error)]
    straight = [p for p in config.pull if p.along != "bias"]
    ways = {(p.way, p.cycle) for p in straight}
    if len(ways) > 1:
        fix = "choose the same way and cycle: a fabric has one curve"
        raise ConfigError("pull", "follow different ways of the loop", sorted(ways), fix)
    way, cycle = ways.pop() if ways else ("loading", 0)
    tests = FabricTests(
        pulls={along: c for along, c in curves.items() if along != "bias"},
        readings=readings,
        given=config.given.model_dump(exclude_none=True),
        law=config.fabric.law,
        way=way,
        cycle=cycle,
    )
    return FabricStudy(config, tests, curves, outlines)


def _pulled(field: str, pull: Pull, folder: Path) -> tuple[Curve, ...]:
    curves: Sequence[Curve] = _curves(field, pull, folder, "tension")
    with _at(field):
        if pull.pretension is not None:
            value, dimension = quantity("pretension", pull.pretension, "force", "force per width")
            width = curves[0].width
            if dimension == "force" and width is None:
                raise InputError("pretension", "is a force, and the width is not known", pull.pretension, "give width")
            load = value if dimension != "force" or width is None else value / width
            curves = [c.from_pretension(load) for c in curves]
    return tuple(replace(c, name=f"{pull.along} {k} {c.name}") for k, c in enumerate(curves, start=1))


def _curves(field: str, machine: Machine, folder: Path, test: str) -> list[Curve]:
    found: list[Curve] = []
    for file in machine.files or ():
        with _at(field):
            found += read_curves(
                folder / file,
                test=test,
                length=_size("length", machine.length),
                width=_size("width", machine.width),
                columns=machine.columns,
                units=machine.units,
                decimal=machine.decimal,
            )
    return found


def _outlines(drape: DrapeTest, folder: Path) -> tuple[Outline, ...]:
    with _at("drape"):
        return tuple(read_outline(folder / f, units=drape.units, width=drape.picture_width) for f in drape.outlines)


def _size(field: str, given: str | None) -> float | str | None:
    """m; words that the preamble is to be searched for stay words."""
    return given if given is None or not given[:1].isdigit() else quantity(field, given, "length")[0]


@contextmanager
def _at(field: str) -> Iterator[None]:
    """What goes wrong names its table."""
    try:
        yield
    except ConfigError:  # names it already
        raise
    except InputError as error:
        own = {"path": "files"}.get(error.field, error.field)
        named = f"{field}.{own}" if own in Pull.model_fields else f"{field}: {own}"
        raise ConfigError(named, error.problem, error.got, error.fix) from error
