"""USD for Blender, Omniverse and usdview: one PointInstancer, with a prototype for each shape and colour.

Obstacles are meshes by themselves, with their motion, colour and opacity. Time codes are the numbers of frames, which
come at the rate that the stage names; quaternions of particles have half precision, as the schema wants them (5e-4).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.extras import require
from particlesim.geometry.surface import Surface, surface_of
from particlesim.trajectory.drawn_obstacles import DrawnObstacle, poses_of
from particlesim.trajectory.export import Exported

_NAMES = "Gf", "Usd", "UsdGeom", "Vt"


def usd_modules() -> tuple[Any, ...]:
    """The modules Gf, Usd, UsdGeom and Vt. MissingExtraError without usd-core."""
    return tuple(require(f"pxr.{name}", "usd", "usd-core") for name in _NAMES)


def write_usd(path: Path, run: Exported) -> list[Path]:
    """Write a stage. MissingExtraError without usd-core; OSError if it cannot be written."""
    gf, usd, geom, vt = usd_modules()
    stage = usd.Stage.CreateInMemory()
    geom.SetStageUpAxis(stage, geom.Tokens.z)
    geom.SetStageMetersPerUnit(stage, 1.0)
    rate = 1.0 / run.scene.time_of(1)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(float(run.scene.movie.fps))
    root = geom.Xform.Define(stage, "/Run")
    stage.SetDefaultPrim(root.GetPrim())
    instancer = geom.PointInstancer.Define(stage, "/Run/Particles")
    prototype = _prototypes(geom, vt, stage, instancer, run)
    obstacles = _obstacles(geom, vt, stage, run)
    times: list[float] = []
    for frame in run.frames:
        ids, time = frame.ids, rate * frame.time
        turned = np.roll(frame.orientation, -1, axis=1).astype(np.float16)  # as USD keeps them, x y z w
        instancer.GetPositionsAttr().Set(_vectors(vt, frame.position), time)
        instancer.GetOrientationsAttr().Set(vt.QuathArray.FromNumpy(turned), time)
        instancer.GetVelocitiesAttr().Set(_vectors(vt, frame.velocity), time)
        if not times or frame.present is not None:
            scale = np.repeat(run.header.size[ids, None], 3, axis=1)
            instancer.GetProtoIndicesAttr().Set(vt.IntArray.FromNumpy(prototype[ids].astype(np.int32)), time)
            instancer.GetIdsAttr().Set(vt.Int64Array.FromNumpy(ids.astype(np.int64)), time)
            instancer.GetScalesAttr().Set(_vectors(vt, scale), time)
        for each, ops in zip(run.obstacles, obstacles, strict=True):
            if not times or each.moves:
                _place(gf, ops, each, frame.time, time if each.moves else usd.TimeCode.Default())
        times.append(time)
    stage.SetStartTimeCode(times[0])
    stage.SetEndTimeCode(times[-1])
    with atomic_write(path) as hidden:
        if not stage.GetRootLayer().Export(str(hidden)):
            raise OSError(f"{path}: cannot be written")
    return [path]


def _prototypes(geom: Any, vt: Any, stage: Any, instancer: Any, run: Exported) -> np.ndarray:
    """Define a prototype for each shape and colour that occur together; the number of each particle's, (n,)."""
    looks = np.column_stack([run.header.shape, run.colours])
    kinds, number = np.unique(looks, axis=0, return_inverse=True)
    targets = []
    for k, (shape, *colour) in enumerate(kinds):
        path = instancer.GetPath().AppendPath(f"Prototypes/Kind_{k}")
        mesh = _mesh(geom, vt, stage, path, surface_of(run.header.shapes[int(shape)]))
        mesh.CreateDisplayColorAttr(_vectors(vt, np.array([colour])))
        targets.append(mesh.GetPath())
    instancer.CreatePrototypesRel().SetTargets(targets)
    return number.ravel()


def _obstacles(geom: Any, vt: Any, stage: Any, run: Exported) -> list[tuple[Any, Any]]:
    """Define a mesh for each obstacle; what moves and what turns each."""
    ops = []
    for each in run.obstacles:
        mesh = _mesh(geom, vt, stage, f"/Run/Obstacles/Obstacle_{each.number}", each.surface)
        mesh.GetPrim().SetDisplayName(each.name)
        mesh.CreateDisplayColorAttr(_vectors(vt, each.colour[None]))
        mesh.CreateDisplayOpacityAttr(vt.FloatArray([each.opacity]))
        mesh.CreateDoubleSidedAttr(each.has_two_sides)
        double = geom.XformOp.PrecisionDouble
        ops.append((mesh.AddTranslateOp(double), mesh.AddOrientOp(double)))
    return ops


def _place(gf: Any, ops: tuple[Any, Any], obstacle: DrawnObstacle, time: float, code: Any) -> None:
    """Put an obstacle where it is at a time [s]; the stage has its pose under a time code."""
    (position,), (orientation,) = poses_of([obstacle], time)
    ops[0].Set(gf.Vec3d(*position.tolist()), code)
    ops[1].Set(gf.Quatd(*orientation.tolist()), code)


def _mesh(geom: Any, vt: Any, stage: Any, path: Any, surface: Surface) -> Any:
    """Define a mesh."""
    mesh = geom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(_vectors(vt, surface.vertices))
    mesh.CreateNormalsAttr(_vectors(vt, surface.normals))
    mesh.SetNormalsInterpolation(geom.Tokens.vertex)
    mesh.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(surface.triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(surface.triangles.ravel().astype(np.int32)))
    mesh.CreateSubdivisionSchemeAttr(geom.Tokens.none)
    return mesh


def _vectors(vt: Any, rows: np.ndarray) -> Any:
    return vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rows, dtype=np.float32))
