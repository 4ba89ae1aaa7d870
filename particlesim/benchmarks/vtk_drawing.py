"""The same particles drawn by VTK, off screen: what the drawing of movies is measured against.

Spheres are VTK's own fast path, point sprites shaded as spheres; hulls are glyphs. Without shadows and without smooth
edges, which would take VTK longer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (registers what draws)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkGlyph3DMapper,
    vtkPointGaussianMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

from particlesim.geometry.shapes import CATALOGUE

# What VTK runs for each pixel of a point's triangle: a disc, darker towards its rim as a ball is.
_BALL = """//VTK::Color::Impl
float square = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);
if (square > 1.0) discard;
diffuseColor *= sqrt(1.0 - square);
ambientColor *= sqrt(1.0 - square);
"""

# A triangle about a circle of radius 1 has its corners at distance 2.
_TRIANGLE = 2.0


def vtk_pictures(drawn: Any, size: tuple[int, int], moved: Callable[[Any, int], np.ndarray]) -> Iterator[np.ndarray]:
    """Picture after picture of a Crowd (see drawing_bench), (height, width, 3) uint8; ``moved`` places it in each."""
    scene = vtkRenderer()
    scene.SetBackground(1.0, 1.0, 1.0)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(*size)
    window.AddRenderer(scene)
    reader = vtkWindowToImageFilter()
    reader.SetInput(window)
    reader.ReadFrontBufferOff()
    parts = []
    for number, shape in enumerate(drawn.shapes):
        members = np.flatnonzero(drawn.number == number)
        points, data = _points(drawn, members)
        actor = vtkActor()
        actor.SetMapper(_balls(data, drawn, members) if shape == "sphere" else _glyphs(data, shape, drawn, members))
        scene.AddActor(actor)
        parts.append((points, data, members))
    scene.ResetCamera()
    camera = scene.GetActiveCamera()
    camera.Azimuth(30.0)
    camera.Elevation(20.0)
    k = 0
    while True:
        position = moved(drawn, k).astype(np.float32)
        for points, data, members in parts:
            points.SetData(numpy_to_vtk(position[members], deep=1))
            data.Modified()
        camera.Azimuth(0.6)
        scene.ResetCameraClippingRange()
        window.Render()
        reader.Modified()
        reader.Update()
        pixels = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
        yield pixels.reshape(size[1], size[0], -1)
        k += 1


def _points(drawn: Any, members: np.ndarray) -> tuple[vtkPoints, vtkPolyData]:
    """The members' places, with colours and quaternions; the places are put in later."""
    points, data = vtkPoints(), vtkPolyData()
    points.SetData(numpy_to_vtk(drawn.position[members].astype(np.float32), deep=1))
    data.SetPoints(points)
    speed = np.linalg.norm(drawn.velocity[members], axis=1)
    shade = (255.0 * np.minimum(speed / 4.0, 1.0)).astype(np.uint8)
    colour = numpy_to_vtk(np.column_stack([shade, 255 - shade, np.full_like(shade, 120)]), deep=1)
    colour.SetName("colour")
    data.GetPointData().SetScalars(colour)
    orientation = numpy_to_vtk(drawn.orientation[members].astype(np.float32), deep=1)
    orientation.SetName("orientation")
    data.GetPointData().AddArray(orientation)
    return points, data


def _balls(data: vtkPolyData, drawn: Any, members: np.ndarray) -> vtkPointGaussianMapper:
    mapper = vtkPointGaussianMapper()
    mapper.SetInputData(data)
    mapper.SetScaleFactor(0.5 * float(drawn.size[members[0]]))
    mapper.SetBoundScale(_TRIANGLE)
    mapper.EmissiveOff()
    mapper.SetSplatShaderCode(_BALL)
    return mapper


def _glyphs(data: vtkPolyData, shape: str, drawn: Any, members: np.ndarray) -> vtkGlyph3DMapper:
    mapper = vtkGlyph3DMapper()
    mapper.SetInputData(data)
    mapper.SetSourceData(_surface(shape))
    mapper.SetScaleModeToNoDataScaling()
    mapper.SetScaleFactor(float(drawn.size[members[0]]))
    mapper.OrientOn()
    mapper.SetOrientationModeToQuaternion()
    mapper.SetOrientationArray("orientation")
    return mapper


def _surface(shape: str) -> vtkPolyData:
    """A hull of size 1, face by face; without normals VTK shades each of them flat."""
    hull = CATALOGUE[shape]()
    surface, points, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(hull.vertices.astype(np.float32), deep=1))
    for loop in hull.faces:
        cells.InsertNextCell(len(loop), list(loop))
    surface.SetPoints(points)
    surface.SetPolys(cells)
    return surface
