"""USD for Blender, Omniverse and usdview: one PointInstancer, with a prototype for each shape and colour.

Time codes are the numbers of frames, which come at the rate that the stage names; quaternions have half precision, as
the schema wants them (5e-4).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from particlesim.core.atomic_write import atomic_write
from particlesim.core.extras import require
from particlesim.geometry.surface import surface_of
from particlesim.trajectory.export import Exported

_NAMES = "Usd", "UsdGeom", "Vt"


def usd_modules() -> tuple[Any, ...]:
    """The modules Usd, UsdGeom and Vt. MissingExtraError without usd-core."""
    return tuple(require(f"pxr.{name}", "usd", "usd-core") for name in _NAMES)


def write_usd(path: Path, run: Exported) -> list[Path]:
    """Write a stage. MissingExtraError without usd-core; OSError if it cannot be written."""
    usd, geom, vt = usd_modules()
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
        surface = surface_of(run.header.shapes[int(shape)])
        mesh = geom.Mesh.Define(stage, instancer.GetPath().AppendPath(f"Prototypes/Kind_{k}"))
        mesh.CreatePointsAttr(_vectors(vt, surface.vertices))
        mesh.CreateNormalsAttr(_vectors(vt, surface.normals))
        mesh.SetNormalsInterpolation(geom.Tokens.vertex)
        mesh.CreateFaceVertexCountsAttr(vt.IntArray.FromNumpy(np.full(len(surface.triangles), 3, dtype=np.int32)))
        mesh.CreateFaceVertexIndicesAttr(vt.IntArray.FromNumpy(surface.triangles.ravel().astype(np.int32)))
        mesh.CreateSubdivisionSchemeAttr(geom.Tokens.none)
        mesh.CreateDisplayColorAttr(_vectors(vt, np.array([colour])))
        targets.append(mesh.GetPath())
    instancer.CreatePrototypesRel().SetTargets(targets)
    return number.ravel()


def _vectors(vt: Any, rows: np.ndarray) -> Any:
    return vt.Vec3fArray.FromNumpy(np.ascontiguousarray(rows, dtype=np.float32))
