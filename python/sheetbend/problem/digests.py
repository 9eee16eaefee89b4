"""What an evaluation of a fit depends on, as digests: the compiled problem, the software and the machine."""

from __future__ import annotations

import hashlib
import os
import platform
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import metadata, util
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np

from .. import _core
from ..scene.compiled import CompiledScene, specification
from ..version import __version__

if TYPE_CHECKING:
    from ..scene.scene import Scene

PLAIN = (bool, int, float, str, bytes, np.generic, type(None))
_scenes: WeakKeyDictionary[CompiledScene, str] = WeakKeyDictionary()  # digests of frozen scenes


def digest(value: Any) -> str:
    """Hexadecimal digest of nested mappings, sequences, arrays, numbers and strings, to the bit.

    Raises:
        TypeError: something else is in there, whose content is not known.
    """
    found = hashlib.blake2b(digest_size=16)
    _feed(found, value)
    return found.hexdigest()


def of_problem(
    scenes: Sequence[Scene],
    experiments: Sequence[Mapping[str, Any]],
    theta: Sequence[float],
    slots: Sequence[Sequence[int]],
    free: Sequence[Mapping[str, Any]],
) -> dict[str, str]:
    """Digests of what a compiled problem is made from: of each experiment by its name, and of "parameters". The number
    of threads is left out, since no result depends on it."""
    found = {
        f"experiment '{e['name']}'": digest({**e, "scene": _of_scene(scene)})
        for scene, e in zip(scenes, experiments, strict=True)
    }
    return found | {"parameters": digest([theta, slots, free])}


def of_software() -> dict[str, str]:
    """What decides the bits of a result besides its input: versions, the compiled modules, the processor, the C
    library."""
    found = {"Python": platform.python_version(), "processor": f"{_processor()}, {_core.instruction_set()}"}
    found["C library"] = " ".join(platform.libc_ver())
    found |= {"sheetbend": __version__, "NumPy": np.__version__, "SciPy": _scipy_version()}
    for module in ("_core", "_ceres"):
        found[f"compiled {module}"] = _compiled(module)
    return found


def _of_scene(scene: Scene) -> str:
    compiled = scene.compiled
    if compiled not in _scenes:
        _scenes[compiled] = digest(specification(scene))
    return _scenes[compiled]


def _feed(found: hashlib.blake2b, value: Any) -> None:
    if isinstance(value, np.ndarray):
        found.update(f"array {value.dtype.str} {value.shape}".encode())
        found.update(np.ascontiguousarray(value).data if value.size else b"")
    elif isinstance(value, Mapping):
        found.update(f"mapping {len(value)}".encode())
        for key, part in value.items():
            _feed(found, key)
            _feed(found, part)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        if all(isinstance(part, PLAIN) for part in value):  # the same as the branch below in a tenth of its time
            found.update(f"sequence {[*value]!r}".encode())
            return
        found.update(f"parts {len(value)}".encode())
        for part in value:
            _feed(found, part)
    elif isinstance(value, PLAIN):
        found.update(f"{value!r};".encode())
    else:
        raise TypeError(f"no digest of {type(value).__name__}")


@cache
def _compiled(module: str) -> str:
    spec = util.find_spec(f"sheetbend.{module}")
    if spec is None or spec.origin is None:
        return "none"
    with Path(spec.origin).open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=8)).hexdigest()


def _scipy_version() -> str:
    """Version of SciPy, without importing it."""
    try:
        return metadata.version("scipy")
    except metadata.PackageNotFoundError:
        return "none"


def _processor() -> str:
    """Name of the processor, which decides the variants that the C library and the linear algebra choose."""
    if os.path.exists("/proc/cpuinfo"):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
