"""Small files of every format, as tests write and experiments ship them: what `fuzz_targets.py` mutates.

Each function gives contents by name of one or more cases; the first file of a case is the one that is mutated.
"""

from __future__ import annotations

import io
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import sheetbend as sb
import test_c3d
import test_config_cloth
import test_journal
import test_motion_capture
import test_readers
import test_whole_fabric
import test_written_files
from sheetbend.problem import journal
from sheetbend.report.fit_result import FitResult
from sheetbend.report.many import OwnParameter
from sheetbend.result import result

EXPERIMENTS = Path(__file__).resolve().parents[2] / "experiments"

Files = dict[str, bytes]


def _saved(folder: Path, suffix: str) -> bytes:
    recording = sb.Recording(
        np.random.default_rng(1).normal(size=(4, 5, 3)), np.arange(4) / 100, ["a", "b", "c", "d", "e"], clamped=[0]
    )
    recording.save(folder / f"saved{suffix}")
    return (folder / f"saved{suffix}").read_bytes()


def csv(folder: Path) -> list[Files]:
    long = "time,marker,x,y,z\n" + "".join(f"{k // 3 / 100},m{k % 3},{k}.5,2,nan\n" for k in range(12))
    stamps = "# a remark\n%time\ta.x\ta.y\ta.z\n1700000000000000001\t1\t2\t3\n1700000000010000001\t\t\t\n"
    commas = "Zeit [s];x1 [mm];y1 [mm];z1 [mm]\n0,00;1,5;2,25;3,0\n0,01;0,0;0,0;0,0\n"
    poses = "%time,field.header.seq,field.a.position.x,field.a.position.y,field.a.position.z\n17,0,1,2,3\n"
    texts = [_saved(folder, ".csv"), long.encode(), stamps.encode(), commas.encode(), poses.encode()]
    return [{"take.csv": text} for text in texts]


def mocap(folder: Path) -> list[Files]:
    written = (
        test_motion_capture.motive(folder / "take.csv"),
        test_motion_capture.motive(folder / "code.csv", timecode=True),
        test_motion_capture.vicon(folder),
        test_motion_capture.qtm(folder),
    )
    texts = [*(path.read_bytes() for path in written), test_motion_capture.ROWS.encode()]
    return [{"take.csv": text} for text in texts]


def trc(folder: Path) -> list[Files]:
    return [{"take.trc": test_readers.TRC.encode()}]


def npz(folder: Path) -> list[Files]:
    shipped = EXPERIMENTS / "wires" / "data" / "red_0.npz"
    return [{"take.npz": _saved(folder, ".npz")}, {"take.npz": shipped.read_bytes()}]


def npy(folder: Path) -> list[Files]:
    np.save(folder / "take.npy", np.random.default_rng(1).normal(size=(4, 5, 3)))
    return [{"take.npy": (folder / "take.npy").read_bytes(), "take.json": b'{"rate": 100}'}]


def pickles(folder: Path) -> list[Files]:
    frames = np.random.default_rng(1).normal(size=(4, 3, 5))
    contents = (list(frames), frames, frames.tolist(), frames.transpose(2, 1, 0), [f.astype(">f4") for f in frames])
    return [{"take.pkl": pickle.dumps(c, protocol=k)} for c in contents for k in range(6)]


def c3d(folder: Path) -> list[Files]:
    kinds = [(kind, scale) for kind in (test_c3d.INTEL, test_c3d.DEC, test_c3d.MIPS) for scale in (-0.1, 0.1)]
    return [{"take.c3d": test_c3d.written(folder, kind, scale).read_bytes()} for kind, scale in kinds]


def sidecar(folder: Path) -> list[Files]:
    said = {
        "units": "mm, s", "name": "swing 3", "markers": ["a", "b", "c", "d", "e"], "clamped": ["a", 1], "rate": 120,
        "gravity": [0, 0, -9.81], "known": {"length": 0.3}, "attribution": "a laboratory", "arrays": {"x": [[4, 2, 3]]},
    }  # fmt: skip
    archive, rope = _saved(folder, ".npz"), _saved(folder, ".pkl")
    shipped = (EXPERIMENTS / "beam" / "data" / "beam_gravity_b.json").read_bytes()
    return [
        {"take.json": json.dumps(said).encode(), "take.npz": archive},
        {"take.json": json.dumps(said).encode(), "take.pkl": rope},
        {"take.json": shipped, "take.pkl": rope},
    ]


def toml(folder: Path) -> list[Files]:
    scene = sb.rope(0.6, 4, density=0.05, EA=1e3, EI=1e-3)
    motion = sb.simulate(scene, np.arange(6) / 100, sb.Solver(h=1 / 400))
    sb.Recording(motion.positions, motion.times, name="swing").save(folder / "swing.npz")
    sheet = sb.Recording(np.repeat(test_config_cloth.PLACED[None], 4, axis=0), np.arange(4) / 100, ["a", "b", "c"])
    sheet.save(folder / "sheet.npz")
    data = {name: (folder / name).read_bytes() for name in ("swing.npz", "sheet.npz", "sheet.json", "swing.json")}
    texts = [test_written_files.ROPE, test_config_cloth.CLOTH]
    for name in ("pendulum", "twin", "twin_cloth", "gripped_ropes", "wires", "beam", "held_cloth"):
        text = (EXPERIMENTS / name / f"{name}.toml").read_text()
        texts.append(text.replace("data/", f"{EXPERIMENTS}/{name}/data/"))
    return [{"my.toml": text.encode(), **data} for text in texts]


def fits(folder: Path) -> list[Files]:
    estimate = result.Estimate(
        name="EI", value=1e-3, unit="N m^2", lower=9e-4, upper=None, half_width=None, statistical=None,
        discretization=0.0, verdict="one-sided", words="bounded",
    )  # fmt: skip
    bounded = {"upper": 1.1e-3, "half_width": 1e-4, "statistical": 9e-5, "in_all": 2e-4}
    known = replace(estimate, name="GJ", verdict="identified", **bounded)
    found = FitResult(
        estimates=(estimate, known),
        recordings=(result.RecordingFit(name="a", rows=9, rms=1e-3, held_out=2e-3, baseline=3e-3, motion=1e-2),),
        given=(result.Given(name="EA", value=1.0, unit="N", words="fixed"),),
        correlations=(result.Correlation(first="EI", second="EI", value=0.5),),
        starts=(result.Start(cost=1.0, iterations=3, converged=True, values={"EI": 1e-3}),) * 2,
        refits=(result.Refit(name="finer mesh", to_limit=4 / 3, moved={"EI": 1e-5}),),
        gauges=("EI/EA is known",), warnings=("a warning",), cost=1.0, rows=9, optimizer="ceres", iterations=3,
        seconds=0.1, converged=True,
    )  # fmt: skip
    return [{"fit.json": json.dumps(found.to_dict()).encode()}]


def meshes(folder: Path) -> list[Files]:
    mesh = sb.mesh.grid(0.2, 0.2, 2, 2)
    sb.mesh.write_obj(folder / "a.obj", mesh)
    sb.mesh.write_ply(folder / "a.ply", mesh, face_fields={"strain": np.zeros(len(mesh.triangles))})
    x, t = mesh.vertices.tolist(), mesh.triangles.tolist()
    head = ["ply", "format ascii 1.0", "comment TextureFile a.png", "element vertex 9"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(t)}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{a} {b} {c}" for a, b, c in x] + [f"3 {a} {b} {c}" for a, b, c in t]
    facets = []
    for row in t:
        corners = [f"vertex {a} {b} {c}" for a, b, c in (x[k] for k in row)]
        facets += ["facet normal 0 0 1", "outer loop", *corners, "endloop", "endfacet"]
    binary_stl = bytes(80) + len(t).to_bytes(4, "little")
    for row in t:
        binary_stl += np.array([[0, 0, 1], *(x[k] for k in row)], dtype="<f4").tobytes() + b"\0\0"
    return [
        {"a.obj": (folder / "a.obj").read_bytes()},
        {"a.ply": (folder / "a.ply").read_bytes()},
        {"a.ply": "\n".join([*head, *rows, ""]).encode()},
        {"a.stl": "\n".join(["solid a", *facets, "endsolid a", ""]).encode()},
        {"a.stl": binary_stl},
    ]


def curves(folder: Path) -> list[Files]:
    rows = "".join(f"{k / 10:.1f};{k * k / 7:.3f}\n" for k in range(9)).replace(".", ",")
    semicolons = f"Width;50;mm\nWeg [mm];Kraft [N]\n{rows}"
    rows = "".join(f"{k}\t{k / 9:.4f}\t{k / 5:.3f}\n" for k in range(9))
    tabs = f"Gauge length\t20 cm\nTime (s)\tLoad (N)\tExtension (mm)\n{rows}"
    repeats = "strain %, force_N, strain %, force_N\n" + "".join(f"{k},{k}.5,{k},{k}.25\n" for k in range(9))
    latin = "Dehnung in %  Kraft/cN\n" + "".join(f"{k}  1'{k:03}.5\n" for k in range(9))
    files = (semicolons.encode(), tabs.encode("utf-16"), repeats.encode(), latin.encode("cp1252"))
    return [{"strip.csv": content} for content in files]


def poses(folder: Path) -> list[Files]:
    rows = "".join(f"{k / 10},{k},0,{k / 7:.3f},0,0,{k / 9:.4f},1\n" for k in range(9))
    np.savez(folder / "tool.npz", times=np.arange(4.0), positions=np.zeros((4, 3)), quaternions=np.ones((4, 4)))
    header = "time,x,y,z,qx,qy,qz,qw\n"
    return [{"tool.csv": (header + rows).encode()}, {"tool.npz": (folder / "tool.npz").read_bytes()}]


def scenes(folder: Path) -> list[Files]:
    rope = sb.rope(0.3, 4, density=0.05, EI=1e-3, bend_damping=0.01, drag_linear=0.01, clamp_start=(1, 0, 0))
    cloth, mesh = sb.Scene("cloth"), sb.mesh.grid(0.2, 0.2, 2, 2, pattern="one_way")
    made = sb.add_cloth(cloth, mesh, density=0.1, warp=40.0, shear=10.0, bending=1e-4)
    cloth.drive(made.particles[:1], [0.0, 0.1, 0.2], np.zeros((3, 1, 3)))
    for scene in (rope, cloth):
        sb.save_scene(scene, folder / f"{scene.name}.scene")
    return [{"a.scene": (folder / f"{name}.scene").read_bytes()} for name in ("rope", "cloth")]


def forces(folder: Path) -> list[Files]:
    times, forces = np.arange(5) / 100, np.random.default_rng(2).normal(size=(5, 3))
    sb.ForceRecording(times, forces, torques=forces, quaternions=np.ones((5, 4))).save(folder / "f.npz")
    table = "time_ms,fx,fy,fz,tx,ty,tz\n" + "".join(f"{10 * k},{k}.5,-1,,{k},0,1e-3\n" for k in range(9))
    cell = "time,fz\n0,1\n0.01,2\n0.02,nan\n"
    archive = (folder / "f.npz").read_bytes()
    return [{"f.csv": table.encode()}, {"f.csv": cell.encode()}, {"f.npz": archive}]


def evaluated() -> list[bytes]:
    """A problem's residuals and Jacobian, or residuals alone, at a few points."""
    problem = test_journal.problem_of(test_journal.swinging())
    points = [problem.parameters.initial() + 0.01 * k for k in range(4)]
    found = [problem.evaluate(u, jacobian=bool(k % 2)) for k, u in enumerate(points)]
    return [r.tobytes() + J.tobytes() for _, r, J in found]


def journals(folder: Path) -> list[Files]:
    with journal.Journal(folder / "a.sqlite", {"[fit]": "abc"}):
        evaluated()
    return [{"a.sqlite": (folder / "a.sqlite").read_bytes()}]


def clouds(folder: Path) -> list[Files]:
    rng = np.random.default_rng(3)
    sb.Cloud.of([rng.normal(size=(k, 3)) for k in (3, 0, 5, 2)], np.arange(4) / 100).save(folder / "cloud.npz")
    return [{"cloud.npz": (folder / "cloud.npz").read_bytes(), "cloud.json": b'{"units": "mm", "name": "folds"}'}]


def solids(folder: Path) -> list[Files]:
    """Of meshio, in every format that is read: tests without it leave this reader out."""
    import meshio

    found = []
    for make, kind in ((sb.mesh.bricks, "hexahedron"), (sb.mesh.tetrahedra, "tetra")):
        box = make([0.2, 0.1, 0.1], (2, 1, 1))
        cells, tags = [(kind, box.elements)], [np.full(len(box.elements), 2)]
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        plain = meshio.Mesh(box.vertices, cells)
        grouped = meshio.Mesh(box.vertices, cells, field_data={"body": np.array([2, 3])}, cell_data=data)
        written = (
            ("a.msh", "gmsh22", grouped), ("a.msh", "gmsh", plain), ("a.vtk", "vtk", plain), ("a.vtu", "vtu", plain),
            ("a.inp", "abaqus", plain), ("a.mesh", "medit", plain),
        )  # fmt: skip
        for name, form, mesh in written:
            meshio.write(folder / name, mesh, file_format=form)
            found.append({name: (folder / name).read_bytes()})
        places = {"gmsh:dim_tags": np.full((len(box.vertices), 2), (3, 2)), "moved": box.vertices}
        full = meshio.Mesh(box.vertices, cells, places, data | {"stress": tags}, {"body": np.array([2, 3])})
        for version, binary, mesh in (
            ("2.2", False, grouped), ("4.0", True, plain), ("4.0", False, plain), ("4.1", True, full),
            ("4.1", False, plain),
        ):  # fmt: skip
            meshio.gmsh.write(folder / "a.msh", mesh, version, binary)
            found.append({"a.msh": (folder / "a.msh").read_bytes()})
    return found


def many(folder: Path) -> list[Files]:
    estimate = result.Estimate(
        name="EI", value=1e-3, unit="N m^2", lower=9e-4, upper=1.1e-3, half_width=1e-4, statistical=1e-4,
        discretization=0.0, verdict="identified", words="",
    )  # fmt: skip
    own = OwnParameter("tilt", "rad", False, (0.1, float("nan"), 0.2), (0.01, float("nan"), 0.01))
    found = sb.ManyFit(
        estimates=(estimate,), scatter={"EI": 1.5}, own=(own,), recordings=("a", "b", "c"), misfit=(1.0, 0.9, 3.0),
        cost=1.0, first_cost=9.0, rows=90, iterations=3, converged=True, seconds=0.1, evaluations=5, jacobians=3,
        jacobian_bytes=1000,
    )  # fmt: skip
    found.save(folder / "many.json")
    tree, table = ((folder / f"many{end}").read_bytes() for end in (".json", ".csv"))
    return [{"many.json": tree, "many.csv": table}]


def tables_of_many(folder: Path) -> list[Files]:
    return [dict(reversed(files.items())) for files in many(folder)]


def drape() -> bytes:
    points = test_whole_fabric.wavy()[::8]
    return ("x;y\n" + "".join(f"{1e3 * x:.2f};{1e3 * y:.2f}\n" for x, y in points)).encode()


def outlines(folder: Path) -> list[Files]:
    from PIL import Image

    inside = np.hypot(*np.meshgrid(np.arange(48) - 23.5, np.arange(40) - 19.5)) < 15.0
    picture = Image.fromarray(np.where(inside, 40, 220).astype(np.uint8))
    found = [{"drape.csv": drape()}]
    for suffix, form in ((".png", "PNG"), (".jpg", "JPEG"), (".tif", "TIFF"), (".bmp", "BMP")):
        stream = io.BytesIO()
        picture.save(stream, form)
        found.append({f"drape{suffix}": stream.getvalue()})
    return found


def fabric_tests(folder: Path) -> list[Files]:
    pulls = {name: test_whole_fabric.pull(folder / name, 500.0, 150.0, 1.0) for name in ("warp.csv", "weft.csv")}
    files: Files = {name: (folder / name).read_bytes() for name in pulls}
    turn = np.sin(np.linspace(0.0, 2 * np.pi, 41))
    loop = "K [1/cm];M [gf cm/cm]\n" + "".join(f"{2.5 * k:.3f};{0.05 * k:.5f}\n" for k in turn)
    files |= {"loop.csv": loop.encode(), "drape.csv": drape()}
    text = """
[fabric]
name = "twill"
law = "exponential"
[weight]
specimens = [199, 200, 201]
[[pull]]
files = ["warp.csv"]
along = "warp"
length = "20cm"
width = "5cm"
pretension = "1cN/cm"
[[pull]]
files = ["weft.csv"]
along = "weft"
length = "20cm"
width = "5cm"
[[shear]]
specimens = [0.8, 0.9]
[[bending]]
bending_length = [24.9, 25.0, 25.1]
[drape]
outlines = ["drape.csv"]
units = "mm"
[given]
shear = 25.0
"""
    loops = """
[fabric]
name = "loops"
[[bending]]
files = ["loop.csv"]
width = "5cm"
length = "20cm"
[given]
warp = 400.0
shear = 25.0
density = 0.2
"""
    return [{"tests.toml": one.encode(), **files} for one in (text, loops)]


def fabrics(folder: Path) -> list[Files]:
    """Files of fabrics, and a configuration that names one."""
    cloth = """
[experiment]
name = "flag"
[[scene.cloth]]
fabric_file = "fabric.toml"
[scene.cloth.mesh]
kind = "grid"
width = 0.2
height = 0.2
nx = 2
ny = 2
"""
    fabric = """
[fabric]
density = 0.2
warp = 500.0
weft = 400.0
shear = 25.0
poisson = 0.2
bending = 3e-5
law = { kind = "exponential", warp = 150.0, weft = 120.0, shear = 3.0 }
[intervals]
warp = [490.0, 510.0]
density = ["open", 0.21]
"""
    return [{"fabric.toml": fabric.encode(), "flag.toml": cloth.encode()}]
