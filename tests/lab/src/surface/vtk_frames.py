"""Frames of VTK's Point Gaussian mapper, unlit and of one size, to be run in turns with `surfelshop bench`.

    python3 vtk_frames.py MESH.obj        (Debian: python3-vtk9; a display, such as Xvfb)

Prints CPU and wall milliseconds of a frame with its read-back, medians of nine views around the points.
"""

import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray

SIZES = (512, 1024, 2048)
N_FRAMES = 9
# Standard deviation of the Gaussians, in the longest side of the points' box; their rectangles reach three of them.
SIGMA = 0.002


def points_of(path):
    with open(path) as lines:
        rows = [line.split()[1:4] for line in lines if line.startswith("v ")]
    return numpy.array(rows, numpy.float32)


def actor_of(points):
    n = len(points)
    places = vtk.vtkPoints()
    places.SetData(numpy_to_vtk(points, deep=1))
    cells = numpy.empty((n, 2), numpy.int64)
    cells[:, 0], cells[:, 1] = 1, numpy.arange(n)
    vertices = vtk.vtkCellArray()
    vertices.SetCells(n, numpy_to_vtkIdTypeArray(cells.ravel(), deep=1))
    cloud = vtk.vtkPolyData()
    cloud.SetPoints(places)
    cloud.SetVerts(vertices)
    mapper = vtk.vtkPointGaussianMapper()
    mapper.SetInputData(cloud)
    mapper.SetScaleFactor(float(SIGMA * (points.max(0) - points.min(0)).max()))
    mapper.EmissiveOff()
    actor = vtk.vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.8, 0.5, 0.2)
    return actor


def main():
    renderer = vtk.vtkRenderer()
    renderer.AddActor(actor_of(points_of(sys.argv[1])))
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.AddRenderer(renderer)
    pixels = vtk.vtkUnsignedCharArray()
    for size in SIZES:
        window.SetSize(size, size)
        renderer.ResetCamera()
        window.Render()
        cpu, wall = [], []
        for _ in range(N_FRAMES):
            renderer.GetActiveCamera().Azimuth(360 / N_FRAMES)
            renderer.ResetCameraClippingRange()
            began = time.process_time(), time.perf_counter()
            window.Render()
            window.GetRGBACharPixelData(0, 0, size - 1, size - 1, 0, pixels)
            cpu.append(1e3 * (time.process_time() - began[0]))
            wall.append(1e3 * (time.perf_counter() - began[1]))
        middle = [sorted(times)[N_FRAMES // 2] for times in (cpu, wall)]
        print(f"{size}: CPU {middle[0]:.0f} ms, wall {middle[1]:.0f} ms", flush=True)


main()
