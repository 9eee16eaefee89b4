"""Reads the file of a scene (scene_file.py) part by part; every part is checked where it is read."""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .. import _core
from ..arrays.types import Array
from ..errors import SceneError
from ..files.memory import free_memory, in_words
from ..quantities.kinds import KINDS
from ..quantities.quantities import FUNCTIONS, Quantity, Term, intermediate
from .boundary import Following
from .compiled import CompiledScene
from .contact_file import read_contacts
from .contacts import ARRAYS as CONTACT_ARRAYS
from .domain import NOT_NEGATIVE
from .group import Group
from .scene import Scene

MAGIC = b"SBSCENE\n"
VERSION = 1
PREFIX = struct.Struct("<8sIIQ")  # magic, version, CRC-32 of all that follows the prefix, bytes of the header
LONGEST_HEADER = 16 * 2**20
LONGEST_NAME = 200
NUMBERS: dict[str, np.dtype[Any]] = {"f8": np.dtype("<f8"), "i4": np.dtype("<i4")}
DAMAGED = "the file is damaged or was not written by sb.save_scene: write it again"


class SceneReader:
    """Reads one file part by part; every part is checked where it is read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with path.open("rb") as file:
                size = os.fstat(file.fileno()).st_size
                prefix = file.read(PREFIX.size)
                if len(prefix) < PREFIX.size or prefix[: len(MAGIC)] != MAGIC:
                    self.fail("file", "is no scene file", prefix[:8], "give a file that sb.save_scene wrote")
                _, version, check, length = PREFIX.unpack(prefix)
                if version != VERSION:
                    fix = f"write it again with this version, which reads {VERSION}"
                    self.fail("version", "is another one", version, fix)
                if size > free_memory() // 2:
                    self.fail("file", "does not fit in the free memory", in_words(size), "use a larger machine")
                if length > min(LONGEST_HEADER, size - PREFIX.size):
                    self.fail("header", "is longer than the file or than any header", length, DAMAGED)
                body = file.read(size - PREFIX.size)
        except OSError as error:
            self.fail("file", "cannot be read", error.strerror or str(error), "give a file that sb.save_scene wrote")
        if len(body) != size - PREFIX.size or zlib.crc32(body) != check:
            self.fail("file", "is damaged: its check sum differs", f"{zlib.crc32(body):08x}", DAMAGED)
        try:
            header = json.loads(body[:length].decode())
        except (ValueError, RecursionError) as error:
            self.fail("header", "is no JSON", str(error), DAMAGED)
        self.header: dict[str, Any] = self.expect("header", header, dict)
        self.data = body[length:]
        self.left = len(self.data)  # bytes that arrays may still take: a file cannot hold the same bytes twice
        self.known: dict[str, Array] = {}
        self.described = self.part(self.header, "arrays", dict)

    def fail(self, field: str, problem: str, got: object, fix: str) -> NoReturn:
        raise SceneError(f"{self.path}: {field}", problem, got, fix)

    def expect(self, field: str, value: object, kind: type) -> Any:
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            self.fail(field, f"must be of type {kind.__name__}", value, DAMAGED)
        return value

    def part(self, parent: Mapping[str, Any], key: str, kind: type, where: str = "") -> Any:
        if key not in parent:
            self.fail(where + key, "is missing", sorted(parent)[:10], DAMAGED)
        return self.expect(where + key, parent[key], kind)

    def name(self, parent: Mapping[str, Any], key: str, where: str = "") -> str:
        text: str = self.part(parent, key, str, where)
        if not is_name(text):
            self.fail(where + key, "is no name", text, DAMAGED)
        return text

    def records(self, key: str) -> list[dict[str, Any]]:
        return [self.expect(f"{key}[{i}]", r, dict) for i, r in enumerate(self.part(self.header, key, list))]

    def array(self, name: str, kind: str, shape: Sequence[int | None]) -> Array:
        """An array of the file; None stands for any length."""
        if name in self.known:
            return self.known[name]
        about = self.part(self.described, name, dict, "arrays.")
        own: list[int] = self.part(about, "shape", list, f"{name}.")
        for length in own:
            self.expect(f"{name}.shape", length, int)
        if about.get("type") != kind or len(own) != len(shape):
            self.fail(name, f"must be of type {kind} with {len(shape)} dimensions", about, DAMAGED)
        if any(
            length < 0 or (wanted is not None and length != wanted) for length, wanted in zip(own, shape, strict=True)
        ):
            self.fail(name, f"must have the shape {tuple(shape)}", own, DAMAGED)
        offset: int = self.part(about, "offset", int, f"{name}.")
        count = 1
        for length in own:
            count *= length
        self.left -= count * NUMBERS[kind].itemsize
        if offset < 0 or offset + count * NUMBERS[kind].itemsize > len(self.data) or self.left < 0:
            self.fail(name, "lies outside the file, or on another array", [offset, count], DAMAGED)
        values = np.frombuffer(self.data, NUMBERS[kind], count, offset).reshape(own)
        if kind == "f8" and not np.isfinite(values).all():
            self.fail(name, "holds numbers that are not finite", values[~np.isfinite(values)][:3].tolist(), DAMAGED)
        self.known[name] = values.astype(np.int64 if kind == "i4" else float)
        return self.known[name]

    def nodes(self, name: str, shape: Sequence[int | None]) -> Array:
        """An array of nodes, which the file names by their places in arrays over all nodes, as a scene numbers them;
        -1, which stands for none, and what is no place stays for the core to refuse."""
        places = self.array(name, "i4", shape)
        if places.size and places.min() < -1:
            self.fail(name, "names particles that do not exist", int(places.min()), DAMAGED)
        nodes, particles = self._counts()
        none = nodes + 1  # that the core refuses where it means a node
        return np.where(places < 0, none, np.where((places >= particles) & (places < nodes), places - nodes, places))

    def _counts(self) -> tuple[int, int]:
        """How many nodes and how many particles the scene has; all nodes of older files are particles."""
        placed = self.part(self.part(self.header, "layout", dict), "position", list, "layout.")
        most = len(self.array("base", "f8", (None,)))
        if len(placed) != 2 or not isinstance(placed[1], int) or not 0 < placed[1] <= most or placed[1] % 3:
            self.fail("layout.position", "is no place", placed, DAMAGED)
        nodes = placed[1] // 3
        particles = self.part(self.header, "particles", int) if "particles" in self.header else nodes
        if not 0 <= particles <= nodes:
            self.fail("particles", f"are not 0 to {nodes}", particles, DAMAGED)
        return nodes, particles

    def scene(self) -> Scene:
        scene = Scene(self.name(self.header, "name"))
        scene.quantities = self._quantities()
        self._topology(scene)
        try:
            self._inputs(scene)
            scene.terms = self._terms(scene)
            compiled = CompiledScene(scene)  # checks all indices, which nothing may use before
            _core.ParameterMap(compiled.map())  # checks the order of intermediate values
            scene.freeze()
        except SceneError as error:
            if error.field.startswith(str(self.path)):
                raise
            self.fail(error.field, error.problem, error.got, error.fix)
        except ValueError as error:
            self.fail("target", str(error), None, DAMAGED)
        scene.__dict__["compiled"] = compiled
        if file_layout(scene) != self.header.get("layout"):
            self.fail("layout", "is not the one of this scene", self.header.get("layout"), DAMAGED)
        return scene

    def _quantities(self) -> dict[str, Quantity]:
        found: dict[str, Quantity] = {}
        for i, about in enumerate(self.records("quantities")):
            where = f"quantities[{i}]."
            name, unit = self.name(about, "name", where), self.name(about, "unit", where)
            value = self._number(about, "value", where)
            scale = None if about.get("scale") is None else self._number(about, "scale", where)
            limits = None
            if about.get("limits") is not None:
                pair = self.part(about, "limits", list, where)
                if len(pair) != 2:
                    self.fail(where + "limits", "must be two", pair, DAMAGED)
                low, high = ({"": limit} for limit in pair)
                limits = (
                    -np.inf if low[""] is None else self._number(low, "", where + "limits"),
                    np.inf if high[""] is None else self._number(high, "", where + "limits"),
                )
            beyond = self.part(about, "beyond", str, where) if "beyond" in about else Quantity.beyond
            unsure = self._number(about, "unsure", where) if "unsure" in about else Quantity.unsure
            if name in found:
                self.fail(where + "name", "is there twice", name, DAMAGED)
            try:
                positive = self.part(about, "positive", bool, where)
                found[name] = Quantity(name, value, unit, positive, scale, limits, beyond, unsure)
            except SceneError as error:
                self.fail(where + "value", error.problem, error.got, DAMAGED)
        return found

    def _number(self, parent: Mapping[str, Any], key: str, where: str) -> float:
        value = parent.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300:
            self.fail(where + key, "must be a finite number", value, DAMAGED)
        return float(value)

    def _topology(self, scene: Scene) -> None:
        scene.has_drag = self.part(self.header, "has_drag", bool)
        scene.pinned = set(self.nodes("pinned", (None,)).tolist())
        if "bodies" in self.described:  # older files have none
            bodies, spins = self.nodes("bodies", (None, 5)).tolist(), self.array("bodies", "i4", (None, 5))[:, 4]
            scene.rotors = {
                f"body {k}": [*own[:4], None if spin == -1 else own[4]]
                for k, (own, spin) in enumerate(zip(bodies, spins, strict=True))
            }
        frames, normals = self.nodes("directors", (None, 4)).tolist(), self.array("directors", "i4", (None, 4))[:, 3]
        for (d, a, b, n), normal in zip(frames, normals, strict=True):
            scene.directors[d] = (a, b, None if normal == -1 else n)
        boundary = scene.boundary
        boundary.driven = self.nodes("driven", (None,)).tolist()
        boundary.times = self.array("boundary_times", "f8", (None,))
        boundary.interpolation = self.part(self.header, "interpolation", str)
        for i, about in enumerate(self.records("following")):
            where = f"following[{i}]."
            markers = self.part(about, "markers", list, where)
            if not all(is_name(marker) for marker in markers):
                self.fail(where + "markers", "are no names", markers, DAMAGED)
            slots = self.array(f"following_{i}", "i4", (None,))
            if slots.size and not (slots.min() >= 0 and slots.max() < len(boundary.driven)):
                self.fail(f"following_{i}", "names particles that are not driven", slots.tolist(), DAMAGED)
            weights = self.array(f"weights_{i}", "f8", (len(slots), len(markers)))
            placed = self.part(about, "from_placed", bool, where)
            boundary.following.append(Following(slots, tuple(markers), weights, placed))
        scene.forces.particles = self.nodes("loaded", (None,)).tolist()
        scene.forces.times = self.array("force_times", "f8", (None,))
        scene.air.triangles = self.array("air", "i4", (None, 3))
        scene.air.times = self.array("wind_times", "f8", (None,))
        for i, about in enumerate(self.records("volumes")):
            name = self.name(about, "name", f"volumes[{i}].")
            if name in scene.volumes.triangles:
                self.fail(f"volumes[{i}].name", "is there twice", name, DAMAGED)
            count = self.part(about, "triangles", int, f"volumes[{i}].")
            scene.volumes.triangles[name] = self.array(f"volume_{i}", "i4", (count, 3))

    def _inputs(self, scene: Scene) -> None:
        """The plain parts of the inputs, in the order of the layout, to where a scene keeps them."""
        base = self.array("base", "f8", (None,))
        taken = 0

        def take(name: str, *shape: int) -> Array:
            nonlocal taken
            size = int(np.prod(shape, dtype=object))
            if taken + size > len(base):
                self.fail("base", f"is too short for {name}", len(base), DAMAGED)
            values = base[taken : taken + size].reshape(shape)
            taken += size
            if name in NOT_NEGATIVE and size and values.min() < 0:
                self.fail(f"base.{name}", "must not be negative", float(values.min()), DAMAGED)
            return values

        n, particles = self._counts()
        groups = [(r, self._stencil(i, r)) for i, r in enumerate(self.records("groups"))]
        constraints = sum(len(stencil) for _, stencil in groups)
        driven, loaded, air = scene.boundary.driven, scene.forces.particles, scene.air
        rows = take("position", n, 3), take("velocity", n, 3), take("mass", n)
        scene._particles.extend(*(own[:particles] for own in rows))
        scene._hidden.extend(*(own[particles:][::-1] for own in rows))
        compliance, damping = take("compliance", constraints), take("damping", constraints)
        first = 0
        for about, stencil in groups:
            own = slice(first, first := first + len(stencil))
            rest = take("rest", len(stencil), len(KINDS[about["kind"]]["parameters"]))
            scene.groups.append(
                Group(about["name"], about["kind"], stencil, compliance[own], damping[own], about["damped"], rest)
            )
        knots = len(scene.boundary.times) if driven else 0
        scene.boundary._values = list(np.moveaxis(take("boundary", knots, len(driven), 3), 1, 0))
        forces = take("force", len(scene.forces.times), len(loaded), 3)
        scene.forces._values = list(np.moveaxis(forces, 1, 0))
        scene._gravity = take("gravity", 3)
        scene._drag = {"linear": take("drag_linear", n), "quadratic": take("drag_quadratic", n)}
        air.wind = take("wind", len(air.times), 3)
        air.normal, air.tangential, air.pressure = (
            take(name, len(air.triangles)) for name in ("air_normal", "air_tangential", "pressure")
        )
        for name in ("volume", "volume_compliance"):
            if take(name, len(scene.volumes.triangles)).any():
                self.fail(f"base.{name}", "must be zero, quantities make it", "other numbers", DAMAGED)
        read_contacts(self, scene, take, DAMAGED)
        if taken != len(base):
            self.fail("base", "is longer than the scene's inputs", [len(base), taken], DAMAGED)

    def _stencil(self, i: int, about: Mapping[str, Any]) -> Array:
        where = f"groups[{i}]."
        self.name(about, "name", where)
        self.part(about, "damped", bool, where)
        kind = self.part(about, "kind", str, where)
        if kind not in KINDS:
            self.fail(where + "kind", "is no known constraint", kind, f"use one of: {', '.join(KINDS)}")
        return self.nodes(f"stencil_{i}", (self.part(about, "count", int, where), KINDS[kind]["arity"]))

    def _terms(self, scene: Scene) -> list[Term]:
        """One term for each run of entries with the same array and factors, in order."""
        offsets = [(name, int(offset)) for name, (offset, size) in _layout(scene).items() if size]
        inputs = len(self.array("base", "f8", (None,)))
        target = self.array("target", "i4", (None,))
        coefficient = self.array("coefficient", "f8", (len(target),))
        first = self.array("first_factor", "i4", (len(target) + 1,))
        factors = int(first[-1])
        parameter = self.array("parameter", "i4", (factors,))
        function = self.array("function", "i4", (factors,))
        weight = self.array("weight", "f8", (factors,))
        made = max(0, -int(target.min())) if target.size else 0
        for name, values, least, limit in (
            ("target", target, -len(target), inputs),
            ("parameter", parameter, -made, len(scene.quantities)),
            ("function", function, 0, len(FUNCTIONS)),
        ):
            if values.size and not (values.min() >= least and values.max() < limit):
                self.fail(name, f"must lie in {least} to {limit - 1}", [int(values.min()), int(values.max())], DAMAGED)
        if first[0] != 0 or (np.diff(first) < 0).any():
            self.fail("first_factor", "must start at 0 and not decrease", first[:5].tolist(), DAMAGED)
        names, functions = [*scene.quantities, *(intermediate(k) for k in range(made)[::-1])], tuple(FUNCTIONS)
        array_of = np.searchsorted([offset for _, offset in offsets], target, side="right") - 1
        terms: list[Term] = []
        begin, known = 0, None
        for e in range(len(target) + 1):
            key = None
            if e < len(target):
                own = slice(first[e], first[e + 1])
                key = (array_of[e], parameter[own].tobytes(), function[own].tobytes())
            if key != known and e > begin:
                array, offset = offsets[array_of[begin]]
                index = target[begin:e] - offset
                if array_of[begin] < 0:
                    array, index = "intermediate", -1 - target[begin:e]
                own = slice(first[begin], first[begin + 1])
                made_of = [(names[q], functions[f]) for q, f in zip(parameter[own], function[own], strict=True)]
                weights = weight[first[begin] : first[e]].reshape(e - begin, -1)
                pairs = tuple(pair for pair in made_of if pair[1] != "exp")
                powers = tuple((q, weights[:, k]) for k, (q, f) in enumerate(made_of) if f == "exp")
                terms.append(Term(array, index, coefficient[begin:e], pairs, powers))
                begin = e
            known = key
        return terms


def file_layout(scene: Scene) -> dict[str, list[int]]:
    """The layout of the input arrays in a file: without the arrays of contacts where there are none."""
    touches = bool(scene.contacts.contacts) or scene.contacts.balls is not None
    left_out = {"contact_weight"} if touches else set(CONTACT_ARRAYS)  # the first of those that files did not have
    own = scene.compiled.layout.items()
    return {name: list(place) for name, place in own if place[1] or name not in left_out}


def _layout(scene: Scene) -> Mapping[str, tuple[int, int]]:
    """The layout of the input arrays before the scene is compiled."""
    found, offset = {}, 0
    for name, values in scene.base_arrays().items():
        found[name] = (offset, np.size(values))
        offset += np.size(values)
    return found


def is_name(text: object) -> bool:
    """Whether a text can be a name in a file."""
    return isinstance(text, str) and text.isprintable() and len(text) <= LONGEST_NAME
