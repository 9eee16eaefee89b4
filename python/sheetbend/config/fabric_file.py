"""Files of fabrics: what `sheetbend fabric` has found, and what cloths of scenes name with `fabric_file`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from ..errors import ConfigError
from ..files.door import reading
from ..files.whole import write_text
from ..objects.fabric import Fabric
from ..objects.laws import Linear, Spline

KEYS = ("density", "warp", "weft", "shear", "poisson", "bending", "bending_weft", "bending_twist", "law")


def write_fabric(
    path: Path, fabric: Fabric, intervals: Mapping[str, tuple[float | None, float | None]], about: str
) -> None:
    """Write a fabric so that `[[scene.cloth]]` can name it.

    Args:
        path: of the TOML file.
        fabric: what was found.
        intervals: 95 %, by the number's name; None where open.
        about: lines of a comment at the top.
    """
    law = fabric.law
    numbers: dict[str, Any] = {k: getattr(fabric, k) for k in KEYS if k != "law" and getattr(fabric, k) is not None}
    if not isinstance(law, Linear | Spline):
        kind = type(law).__name__.lower()
        numbers["law"] = {"kind": kind, "warp": law.warp, "weft": law.weft, "shear": law.shear}
    ends = {name: ["open" if end is None else end for end in pair] for name, pair in intervals.items()}
    comment = "".join(f"# {line}\n" for line in about.splitlines())
    write_text(path, f"{comment}\n{tomli_w.dumps({'fabric': numbers, 'intervals': ends})}")


def with_fabric_files(data: dict[str, Any], folder: Path, content: Callable[[Path], dict[str, Any]]) -> dict[str, Any]:
    """A configuration as read, in which cloths have the numbers of the files that they name.

    Args:
        data: plain data of the file.
        folder: that paths are relative to.
        content: reads a TOML file.

    Raises:
        ConfigError: a file holds no fabric, or a cloth has a number beside it.
    """
    scene = data.get("scene")
    cloths = scene.get("cloth") if isinstance(scene, dict) else None
    if not isinstance(scene, dict) or not isinstance(cloths, list):
        return data
    return data | {"scene": scene | {"cloth": [_completed(k, c, folder, content) for k, c in enumerate(cloths)]}}


def _completed(index: int, cloth: Any, folder: Path, content: Callable[[Path], dict[str, Any]]) -> Any:
    file = cloth.get("fabric_file") if isinstance(cloth, dict) else None
    if not isinstance(file, str):
        return cloth  # without one, or refused where the schema checks it
    field = f"scene.cloth[{index}].fabric_file"
    with reading(folder / file, ConfigError):
        numbers = content(folder / file).get("fabric")
    if not isinstance(numbers, dict) or not set(numbers) <= set(KEYS):
        fix = "give a file that `sheetbend fabric` has written: [fabric] with density, warp, shear and so on"
        raise ConfigError(field, "holds no fabric", file, fix)
    both = sorted(set(numbers) & set(cloth))
    if both:
        raise ConfigError(field, f"stands beside {', '.join(both)}", file, "leave out what the file has")
    return {k: v for k, v in cloth.items() if k != "fabric_file"} | numbers
