"""Motions as USD (Universal Scene Description), for film, design and robotics tools."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays.types import Array
from ..errors import InputError
from ..files.whole import written
from ..motion.simulate import Trajectory
from ..optional import require
from ..scene.scene import Scene
from ..version import __version__
from .moving_shapes import MovingShape, moving_shapes, turn_between, up_of

SUFFIXES = (".usd", ".usda", ".usdc")


def write_usd(path: str | Path, scene: Scene, motion: Trajectory, *, radius: float | None = None) -> int:
    """Write the cloths and ropes of a motion as a USD stage, with a time sample for each frame.

    A cloth is a mesh with points, velocities, texture coordinates (`primvars:st`, the material's, in m) and the largest
    strain of each triangle (`primvars:strain`). A rope is a linear curve with points, velocities and a width. The stage
    is in meters, with y or z up as in the scene (a scene with another axis up is turned), and its time codes are
    seconds times `timeCodesPerSecond`. The scene's quantities are attributes of the root prim, as `sheetbend:NAME`.

    Args:
        path: of the file: .usd and .usdc are binary, .usda is text.
        scene: that was simulated.
        motion: of `simulate`.
        radius: of ropes, m; 0.4 % of each rope's length when left out.

    Returns:
        The number of frames.

    Raises:
        InputError: a scene without cloth and rope, or another suffix.
        MissingExtraError: usd-core is not installed (extra `usd`).
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError("path", "is not a USD file", str(path), f"give a name that ends in {', '.join(SUFFIXES)}")
    pxr = {name: require(f"pxr.{name}", "usd") for name in ("Usd", "UsdGeom", "Sdf", "Vt", "Gf")}
    with written(path) as beside:
        file = beside.with_name(beside.name + path.suffix)  # USD chooses the format by the suffix
        try:
            _write(pxr, file, scene, motion, radius)
            beside.write_bytes(file.read_bytes())
        finally:
            file.unlink(missing_ok=True)
    return len(motion.times)


def _write(pxr: dict[str, Any], file: Path, scene: Scene, motion: Trajectory, radius: float | None) -> None:
    usd, geometry, sdf = pxr["Usd"], pxr["UsdGeom"], pxr["Sdf"]
    stage = usd.Stage.CreateNew(str(file))
    up = up_of(scene.gravity)
    geometry.SetStageUpAxis(stage, geometry.Tokens.y if up[1] > 0.0 else geometry.Tokens.z)
    geometry.SetStageMetersPerUnit(stage, 1.0)
    rate = _rate(motion.times)
    stage.SetTimeCodesPerSecond(rate)
    codes = motion.times * rate
    stage.SetStartTimeCode(float(codes[0]))
    stage.SetEndTimeCode(float(codes[-1]))
    stage.SetMetadata("comment", f"written by sheetbend {__version__}")
    root = geometry.Xform.Define(stage, f"/{_identifier(scene.name)}")
    stage.SetDefaultPrim(root.GetPrim())
    if up[1] <= 0.0 and up[2] <= 0.0:
        x, y, z, w = turn_between(up, np.array([0.0, 0.0, 1.0]))
        root.AddOrientOp().Set(pxr["Gf"].Quatf(w, x, y, z))
    for name, quantity in scene.quantities.items():
        attribute = root.GetPrim().CreateAttribute(f"sheetbend:{_identifier(name)}", sdf.ValueTypeNames.Double)
        attribute.Set(float(quantity.value))
        if quantity.unit:
            attribute.SetDocumentation(quantity.unit)
    for shape in moving_shapes(scene, motion, np.arange(len(motion.times))):
        at = f"{root.GetPath()}/{_identifier(shape.name)}"
        prim = _curve(pxr, stage, at, shape, radius) if shape.triangles is None else _mesh(pxr, stage, at, shape)
        for k, code in enumerate(codes.tolist()):
            prim.GetPointsAttr().Set(_vectors(pxr, shape.positions[k]), code)
            prim.GetVelocitiesAttr().Set(_vectors(pxr, shape.velocities[k]), code)
            prim.GetExtentAttr().Set(_vectors(pxr, _box(shape.positions[k])), code)
        if shape.strain is not None:
            api = geometry.PrimvarsAPI(prim)
            strain = api.CreatePrimvar("strain", sdf.ValueTypeNames.FloatArray, geometry.Tokens.uniform)
            for values, code in zip(shape.strain, codes.tolist(), strict=True):
                strain.Set(pxr["Vt"].FloatArray.FromNumpy(np.ascontiguousarray(values, dtype="f4")), code)
    stage.GetRootLayer().Save()


def _mesh(pxr: dict[str, Any], stage: Any, at: str, shape: MovingShape) -> Any:
    geometry, integers = pxr["UsdGeom"], pxr["Vt"].IntArray
    assert shape.triangles is not None  # what sent it here
    mesh = geometry.Mesh.Define(stage, at)
    mesh.CreateSubdivisionSchemeAttr(geometry.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreateFaceVertexCountsAttr(integers.FromNumpy(np.full(len(shape.triangles), 3, dtype="i4")))
    mesh.CreateFaceVertexIndicesAttr(integers.FromNumpy(np.ascontiguousarray(shape.triangles.ravel(), dtype="i4")))
    if shape.material is not None:
        kind = pxr["Sdf"].ValueTypeNames.TexCoord2fArray
        st = geometry.PrimvarsAPI(mesh).CreatePrimvar("st", kind, geometry.Tokens.vertex)
        st.Set(pxr["Vt"].Vec2fArray.FromNumpy(np.ascontiguousarray(shape.material, dtype="f4")))
    return mesh


def _curve(pxr: dict[str, Any], stage: Any, at: str, shape: MovingShape, radius: float | None) -> Any:
    geometry = pxr["UsdGeom"]
    curve = geometry.BasisCurves.Define(stage, at)
    curve.CreateTypeAttr(geometry.Tokens.linear)
    curve.CreateCurveVertexCountsAttr([shape.positions.shape[1]])
    curve.CreateWidthsAttr([2.0 * shape.radius(radius)])
    curve.SetWidthsInterpolation(geometry.Tokens.constant)
    return curve


def _vectors(pxr: dict[str, Any], rows: Array) -> Any:
    return pxr["Vt"].Vec3fArray.FromNumpy(np.ascontiguousarray(rows, dtype="f4"))


def _box(rows: Array) -> Array:
    return np.stack([rows.min(axis=0), rows.max(axis=0)])


def _rate(times: Array) -> float:
    """Time codes per second: frames where they are even, else milliseconds."""
    steps = np.diff(times)
    even = len(steps) > 0 and steps.min() > 0.0 and np.allclose(steps, steps[0], rtol=1e-6)
    return float(1.0 / steps[0]) if even else 1000.0


def _identifier(name: str) -> str:
    """A name of a prim: letters, digits and underscores, no digit first."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name) or "scene"
    return f"_{plain}" if plain[0].isdigit() else plain
