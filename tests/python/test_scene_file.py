"""Scenes saved to one file and loaded: the same bits; damaged and forged files end in the package's error."""

from __future__ import annotations

import json
import struct
import tracemalloc
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sheetbend as sb
from test_memory import net
from test_pickling import SCENES, SOLVER, TIMES, cloth, rope

PREFIX = struct.Struct("<8sIIQ")


def following() -> sb.Scene:
    scene = sb.rope(0.3, 6, density=0.05, EI=1e-3, EA=50.0, clamp_start=(1, 0, 0))
    motion = np.arange(3)[:, None, None] * np.array([-5e-3, 0.0, 0.0]) + np.zeros((3, 2, 3))
    scene.follow([6], [0.0, 0.02, 0.1], motion + scene.positions[6], ["left", "right"], weights=[[0.25, 0.75]])
    return scene


@pytest.mark.parametrize("make", [*SCENES, following])
def test_the_same_bits(make: Callable[[], sb.Scene], tmp_path: Path) -> None:
    scene = make()
    sb.save_scene(scene, tmp_path / "a.scene")
    loaded = sb.load_scene(tmp_path / "a.scene")
    assert loaded.frozen and loaded.name == scene.name and loaded.quantities == scene.quantities
    assert list(loaded.quantities) == list(scene.quantities)
    assert loaded.compiled.layout == scene.compiled.layout
    maps = scene.compiled.map(), loaded.compiled.map()
    assert all(np.array_equal(maps[0][name], maps[1][name]) for name in maps[0])
    values = {name: 1.1 * q.value for name, q in scene.quantities.items() if q.positive}
    one, two = (sb.rollout(s, TIMES, SOLVER, values) for s in (scene, loaded))
    assert np.array_equal(one.positions, two.positions)
    gradients = one.gradient(one.positions), two.gradient(two.positions)
    assert gradients[0].quantities == gradients[1].quantities
    assert all(np.array_equal(a, gradients[1].inputs[name]) for name, a in gradients[0].inputs.items())
    ends = (sb.simulate(s, TIMES, SOLVER) for s in (scene, loaded))
    assert all(np.array_equal(a, b) for a, b in zip(*(list(e.forces.values()) for e in ends), strict=True))
    sb.save_scene(loaded, tmp_path / "b.scene")
    assert (tmp_path / "b.scene").read_bytes() == (tmp_path / "a.scene").read_bytes()


def touching() -> sb.Scene:
    """A rope that falls on a table and on shapes that move."""
    scene = sb.rope(0.3, 6, density=0.05, EI=1e-3, EA=50.0, start=(0, 0, 0.009), pinned=())
    rope, table = scene.ropes["rope"], sb.Plane(name="table")
    (loose,) = scene.add_particles([[0.5, 0.0, 0.01]], 0.1, [[0.0, 0.0, -1.0]])
    scene.add_contact(rope, table, friction=0.3, radius=0.005)
    scene.add_contact([loose], table, friction=0.3, restitution=0.4, name="bounce")
    ball = sb.Sphere((0.1, 0.0, -0.025), 0.03, name="ball").moving([0.0, 0.1], [[0, 0, 0], [0, 0, 0.01]])
    scene.add_contact(rope, ball, friction=0.2, stiffness=1e3, dissipation=0.3)
    scene.add_contact(rope.particles[:2], sb.Capsule((0, -1, -0.05), (0, 1, -0.05), 0.02, name="bar"), friction=0.0)
    plate = sb.Cylinder((0.2, 0, -0.2), (0.2, 0.01, -0.16), 0.05, 0.003, name="plate")
    scene.add_contact([4], plate, friction=0.1)
    scene.add_contact([3], sb.Box((0.2, 0, -0.06), (0.1, 0.1, 0.1), 0.01, name="box"), friction=0.1)
    return scene


def test_contacts_are_kept_with_the_same_bits(tmp_path: Path) -> None:
    scene, solver = touching(), sb.Solver(h=1e-3, method="implicit")
    sb.save_scene(scene, tmp_path / "a.scene")
    loaded = sb.load_scene(tmp_path / "a.scene")
    assert loaded.compiled.layout == scene.compiled.layout
    motions = [sb.simulate(s, TIMES, solver) for s in (scene, loaded)]
    assert motions[0].contacts == motions[1].contacts and motions[0].contacts["table"].began > 0
    assert np.array_equal(motions[0].positions, motions[1].positions)
    rollouts = [sb.rollout(s, TIMES, solver, {"table_friction": 0.2, "ball_radius": 0.031}) for s in (scene, loaded)]
    gradients = [r.gradient(r.positions) for r in rollouts]
    assert gradients[0].quantities == gradients[1].quantities and gradients[0].quantities["bounce_restitution"] != 0.0
    sb.save_scene(loaded, tmp_path / "b.scene")
    assert (tmp_path / "b.scene").read_bytes() == (tmp_path / "a.scene").read_bytes()


def test_forged_contacts_are_refused(tmp_path: Path) -> None:
    sb.save_scene(touching(), tmp_path / "a.scene")
    whole = (tmp_path / "a.scene").read_bytes()

    def put(part: str, key: str, value: object) -> Callable[[dict[str, Any]], object]:
        return lambda header: header[part][0].__setitem__(key, value)

    for change in (
        put("contacts", "collider", 9),
        put("contacts", "rigid", False),
        put("contacts", "bounces", 1),
        put("colliders", "shape", "torus"),
        put("colliders", "interpolation", "quintic"),
        put("colliders", "name", "ball"),
        lambda header: header.pop("colliders"),
        lambda header: header.pop("contacts"),
    ):
        refused(forged(whole, change), tmp_path / "x.scene")
    pairs = np.array([[k, 9999] for k in range(7)], "<i4")
    refused(altered(whole, "contact_0", pairs), tmp_path / "x.scene")


def test_what_follows_markers_is_kept(tmp_path: Path) -> None:
    scene = following()
    sb.save_scene(scene, tmp_path / "a.scene")
    (kept,) = sb.load_scene(tmp_path / "a.scene").boundary.following
    (given,) = scene.boundary.following
    assert kept.markers == given.markers and kept.from_placed == given.from_placed
    assert np.array_equal(kept.weights, given.weights) and np.array_equal(kept.slots, given.slots)


def test_limits_and_scales_are_kept(tmp_path: Path) -> None:
    scene = rope()
    scene.add_quantity("tilt", 0.1, "rad", positive=False, scale=0.2, limits=(-1.0, np.inf), unsure=0.5)
    sb.save_scene(scene, tmp_path / "a.scene")
    assert sb.load_scene(tmp_path / "a.scene").quantities["tilt"] == scene.quantities["tilt"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("scene") / "net.scene"
    sb.save_scene(net(), path)
    return path.read_bytes()


def refused(content: bytes, path: Path) -> str:
    """The error of a file, which names the file and a fix."""
    path.write_bytes(content)
    with pytest.raises(sb.SceneError, match="Fix:") as caught:
        sb.load_scene(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_damaged_files_are_refused(whole: bytes, tmp_path: Path) -> None:
    path = tmp_path / "x.scene"
    for length in (0, 5, 23, 24, 100, len(whole) // 2, len(whole) - 1):
        refused(whole[:length], path)
    refused(whole + b"\0", path)
    rng = np.random.default_rng(0)
    for place in rng.choice(len(whole), 300, replace=False):
        refused(whole[:place] + bytes([whole[place] ^ 1 << rng.integers(8)]) + whole[place + 1 :], path)
    assert "version" in refused(whole[:8] + struct.pack("<I", 2) + whole[12:], path)
    with pytest.raises(sb.SceneError, match="cannot be read"):
        sb.load_scene(tmp_path)
    with pytest.raises(sb.SceneError, match="cannot be read"):
        sb.load_scene(tmp_path / "none.scene")


def forged(whole: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """The file with another header, and a check sum that fits."""
    magic, version, _, length = PREFIX.unpack_from(whole)
    header = json.loads(whole[PREFIX.size : PREFIX.size + length])
    change(header)
    body = json.dumps(header).encode() + whole[PREFIX.size + length :]
    return PREFIX.pack(magic, version, zlib.crc32(body), len(body) - len(whole) + PREFIX.size + length) + body


def altered(whole: bytes, array: str, values: np.ndarray) -> bytes:
    """The file with other numbers in the same places."""
    magic, version, _, length = PREFIX.unpack_from(whole)
    about = json.loads(whole[PREFIX.size : PREFIX.size + length])["arrays"][array]
    raw = values.astype("<i4" if about["type"] == "i4" else "<f8").tobytes()
    begin = PREFIX.size + length + about["offset"]
    body = (whole[:begin] + raw + whole[begin + len(raw) :])[PREFIX.size :]
    return PREFIX.pack(magic, version, zlib.crc32(body), length) + body


def change(path: str, value: object) -> Callable[[dict[str, Any]], object]:
    def apply(header: dict[str, Any]) -> None:
        at: Any = header
        *way, last = path.split(".")
        for step in way:
            at = at[int(step) if step.isdigit() else step]
        at[int(last) if last.isdigit() else last] = value

    return apply


FORGED_HEADERS: list[tuple[str, Any]] = [
    ("name", 7),
    ("name", "a\nb"),
    ("name", "x" * 1000),
    ("groups", {}),
    ("groups.0", "link"),
    ("groups.0.kind", "no such kind"),
    ("groups.0.kind", "bend"),
    ("groups.0.count", -1),
    ("groups.0.count", 10**30),
    ("groups.0.damped", 1),
    ("groups.0.name", None),
    ("quantities.0.value", "1"),
    ("quantities.0.value", -1.0),
    ("quantities.0.value", 1e999),
    ("quantities.0.name", "link_damping"),
    ("quantities.0.limits", [1]),
    ("quantities.0.positive", None),
    ("interpolation", "quintic"),
    ("has_drag", "no"),
    ("particles", -1),
    ("particles", 10**6),
    ("particles", "8"),
    ("layout.position", [0, 10**9]),
    ("layout.position", [0, "3"]),
    ("layout.mass", [0, 1]),
    ("arrays", []),
    ("arrays.base.shape", [10**12]),
    ("arrays.base.shape", [-1]),
    ("arrays.base.shape", [True]),
    ("arrays.base.shape", [10, 10]),
    ("arrays.base.offset", -8),
    ("arrays.base.offset", 10**15),
    ("arrays.base.type", "f4"),
    ("arrays.air.shape", [10**9, 3]),
    ("following", [{"markers": ["a"], "from_placed": True}]),
    ("volumes", [{"name": "v", "triangles": 3}]),
]


@pytest.mark.parametrize(("path", "value"), FORGED_HEADERS)
def test_forged_headers_are_refused(whole: bytes, tmp_path: Path, path: str, value: object) -> None:
    refused(forged(whole, change(path, value)), tmp_path / "x.scene")


FORGED_ARRAYS: list[tuple[str, Any]] = [
    ("base", np.full(10, np.nan)),
    ("base", np.full(1000, -1.0)),
    ("pinned", np.array([36])),
    ("pinned", np.array([-1])),
    ("driven", np.array([0])),
    ("boundary_times", np.array([0.2, 0.1])),
    ("stencil_0", np.array([0, 0])),
    ("stencil_0", np.array([0, 2**31 - 1])),
    ("loaded", np.array([99])),
    ("target", np.array([-(10**5)])),
    ("parameter", np.array([-1])),
    ("target", np.array([2**31 - 1])),
    ("first_factor", np.array([1])),
    ("first_factor", np.array([0, 5, 2])),
    ("parameter", np.array([50])),
    ("function", np.array([10])),
    ("coefficient", np.array([np.inf])),
]


@pytest.mark.parametrize(("array", "values"), FORGED_ARRAYS)
def test_forged_arrays_are_refused(whole: bytes, tmp_path: Path, array: str, values: np.ndarray) -> None:
    refused(altered(whole, array, values), tmp_path / "x.scene")


def test_a_file_takes_no_more_memory_than_its_size(whole: bytes, tmp_path: Path) -> None:
    """A thousand groups that name the same bytes; lists in lists; a header that is not there."""

    def repeat(header: dict[str, Any]) -> None:
        for k in range(1, 1000):
            header["groups"].append({**header["groups"][0], "name": f"g{k}"})
            header["arrays"][f"stencil_{k}"] = header["arrays"]["stencil_0"]

    path = tmp_path / "x.scene"
    deep = b"[" * 1_000_000
    prefix = PREFIX.pack(b"SBSCENE\n", 1, zlib.crc32(deep), len(deep))
    content = forged(whole, repeat)
    tracemalloc.start()
    assert "on another array" in refused(content, path)
    refused(prefix + deep, path)
    refused(PREFIX.pack(b"SBSCENE\n", 1, 0, 2**60), path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 30e6


def test_writing_leaves_the_old_file_or_the_new_one(tmp_path: Path) -> None:
    with pytest.raises(sb.InputError, match="cannot be written"):
        sb.save_scene(cloth(), tmp_path / "none" / "a.scene")
    path = tmp_path / "a.scene"
    sb.save_scene(cloth(), path)
    sb.save_scene(rope(), path)
    assert sb.load_scene(path).name == "rope"
    assert [p.name for p in tmp_path.iterdir()] == ["a.scene"]


def test_names_that_no_file_holds_are_refused(tmp_path: Path) -> None:
    scene = rope()
    scene.name = "a\x1b[31m"
    with pytest.raises(sb.SceneError, match="printable"):
        sb.save_scene(scene, tmp_path / "a.scene")
