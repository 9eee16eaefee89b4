"""More of `wrong_calls.py`: fabrics and drapes, configurations, readers of meshes, figures of fits, methods."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import sheetbend as sb
from sheetbend import config, gripped, textile
from wrong_calls_beside import STEP, TIMES, Call, curves, fabric, motion, rope, sheet

TOML = """
[experiment]
name = "take"
[solver]
h = 0.01
[[scene.rope]]
name = "rope"
length = 0.3
segments = 4
density = 0.05
EI = 1e-3
[[recording]]
file = "take.npz"
[parameters.rope_EI]
"""


@cache
def fitted() -> sb.Fit:
    scene = rope()
    recording = sb.Recording(motion() + 1e-4 * np.random.default_rng(1).normal(size=motion().shape), TIMES, name="take")
    e = sb.Experiment(scene=scene, recording=recording, solver=STEP, sigma=1e-4)
    return sb.fit(e, parameters=["rope_EI"], refine=False, profiles=False, windows=())


@cache
def bricks() -> sb.SolidMesh:
    return sb.mesh.bricks((0.2, 0.1, 0.1), (2, 1, 1))


@cache
def file(name: str) -> Path:
    path = Path(mkdtemp(prefix="wrong_")) / name
    if name == "rope.toml":
        path.write_text(TOML)
        sb.Recording(motion(), TIMES, name="take").save(path.with_name("take.npz"))
    elif name == "fit.json":
        fitted().result.save(path)
    elif name == "sheet.obj":
        path.write_text(OBJ)
    elif name == "bricks.vtk":
        path.write_text(VTK)
    return path


OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n"
VTK = """# vtk DataFile Version 2.0
tetrahedron
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 4 double
0 0 0
1 0 0
0 1 0
0 0 1
CELLS 1 5
4 0 1 2 3
CELL_TYPES 1
10
"""


def new(name: str) -> Path:
    return Path(mkdtemp(prefix="wrong_")) / name


@cache
def hung() -> sb.Equilibrium:
    return sb.equilibrium(textile.drape_scene(fabric(), rings=3))


@cache
def overhang() -> textile.Measured:
    value = 1e3 * length(fabric()).value
    return textile.Measured(name="overhang", test=length, value=value, sigma=0.01 * value)


def length(of: sb.Fabric) -> textile.Reading:
    return textile.cantilever(of, cells=4).bending_length


def tests() -> textile.FabricTests:
    return textile.FabricTests(
        pulls={"warp": curves()},
        readings={"bending": [overhang()]},
        given={"density": 0.2, "weft": 1500.0, "shear": 50.0},
        law="linear",
    )


def cloth() -> tuple[sb.Scene, sb.Cloth]:
    scene = sb.Scene()
    mesh = sb.mesh.grid(0.2, 0.2, 3, 3, pattern="one_way")
    return scene, sb.add_cloth(scene, mesh, density=0.2, warp=40.0, shear=5.0, bending=1e-4)


LABORATORY: dict[str, Callable[[], Call]] = {
    "textile.drape": lambda: (
        textile.drape,
        {
            "fabric": fabric(),
            "diameter": 0.3,
            "plate": 0.18,
            "rings": 3,
            "folds": (4,),
            "friction": None,
            "cover": True,
        },
    ),
    "textile.drape_state": lambda: (textile.drape_state, {"rest": hung(), "plate": 0.18}),
    "textile.fit_fabric": lambda: (
        textile.fit_fabric,
        {"measured": [overhang()], "start": fabric(), "free": ["bending"]},
    ),
    "textile.fit_tests": lambda: (textile.fit_tests, {"tests": tests()}),
    "textile.Measured": lambda: (
        textile.Measured,
        {"name": "a", "test": overhang().test, "value": 1.0, "sigma": 0.1, "specimens": {}, "note": ""},
    ),
    "textile.FabricTests": lambda: (
        lambda **given: textile.fit_tests(textile.FabricTests(**given)),
        {**vars(tests()), "way": "loading", "cycle": 0},
    ),
}

TEXTS: dict[str, Callable[[], Call]] = {
    "config.load": lambda: (config.load, {"path": file("rope.toml"), "finer": 1}),
    "config.parse": lambda: (config.parse, {"path": file("rope.toml")}),
    "config.parse_any": lambda: (config.parse_any, {"path": file("rope.toml")}),
    "config.build": lambda: (
        config.build,
        {"config": config.parse(file("rope.toml")), "folder": file("rope.toml").parent, "finer": 1},
    ),
    "config.scene_alone": lambda: (
        config.scene_alone,
        {"config": config.parse(file("rope.toml")), "folder": file("rope.toml").parent, "finer": 1},
    ),
    "mesh.read_mesh": lambda: (
        sb.mesh.read_mesh,
        {
            "path": file("sheet.obj"),
            "material": "texture",
            "unit": "m",
            "texture_size": 1.0,
            "warp": (1.0, 0.0, 0.0),
            "merge": False,
        },
    ),
    "mesh.read_solid": lambda: (sb.mesh.read_solid, {"path": file("bricks.vtk"), "unit": "m"}),
    "FitResult.load": lambda: (sb.FitResult.load, {"path": file("fit.json")}),
    "FitResult.save": lambda: (fitted().result.save, {"path": new("fit.json")}),
    "FitResult.from_dict": lambda: (sb.FitResult.from_dict, {"data": fitted().result.to_dict()}),
    "Fit.save": lambda: (fitted().save, {"path": new("fit.json")}),
    "gripped.trades": lambda: (gripped.trades, {"result": fitted().result}),
}

FITTED: dict[str, Callable[[], Call]] = {
    "plot.compared": lambda: (sb.plot.compared, {"c": fitted().comparisons[0]}),
    "plot.estimates": lambda: (
        sb.plot.estimates,
        {"estimates": fitted().result.estimates, "published": {"rope_EI": 1e-3}, "title": "a", "ax": None},
    ),
    "plot.fields": lambda: (
        sb.plot.fields,
        {
            "mesh": sheet(),
            "fields": [sb.plot.Field("a", np.arange(8.0))],
            "title": "a",
            "gravity": (0.0, 0.0, -9.81),
            "ax": None,
        },
    ),
    "plot.motions": lambda: (
        sb.plot.motions,
        {
            "motions": [sb.plot.Motion("a", np.array(TIMES), *motion()[:, :2, 0].T)],
            "title": "a",
            "ax": None,
        },
    ),
    "plot.strain_fields": lambda: (
        lambda s, c: (sb.plot.strain_fields, {"scene": s, "cloth": c, "positions": s.positions, "values": None})
    )(*cloth()),
    "plot.save": lambda: (
        sb.plot.save,
        {"drawn": sb.plot.estimates(fitted().result.estimates), "path": new("a.png")},
    ),
}

METHODS: dict[str, Callable[[], Call]] = {
    "SolidMesh.within": lambda: (bricks().within, {"lower": (0, 0, 0), "upper": (1, 1, 1)}),
    "SolidMesh.areas": lambda: (bricks().areas, {"vertices": [0, 1, 2, 3]}),
    "SolidMesh.nearest": lambda: (bricks().nearest, {"points": np.zeros((2, 3))}),
    "SolidMesh.at": lambda: (bricks().at, {"points": np.zeros((2, 3))}),
    "TriangleMesh.bending_ratio": lambda: (sheet().bending_ratio, {"directions": np.eye(2)}),
    "TriangleMesh.within": lambda: (sheet().within, {"lower": (0, 0, 0), "upper": (1, 1, 1)}),
    "TriangleMesh.nearest": lambda: (sheet().nearest, {"points": np.zeros((2, 3))}),
    "TriangleMesh.with_set": lambda: (sheet().with_set, {"name": "a", "vertices": [0, 1]}),
    "TriangleMesh.at": lambda: (sheet().at, {"points": np.zeros((2, 2))}),
    "TriangleMesh.project": lambda: (sheet().project, {"points": np.zeros((2, 3))}),
    "TriangleMesh.through": lambda: (
        sheet().through,
        {"places": sheet().project(sheet().vertices), "positions": sheet().vertices},
    ),
}

MORE = {**LABORATORY, **TEXTS, **FITTED, **METHODS}
