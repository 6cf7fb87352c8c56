"""What VTK (Debian's python3-vtk9) reads from a file of tetrahedra or of blocks, as JSON."""

import json
import sys

from vtkmodules.vtkCommonDataModel import VTK_TETRA, VTK_TRIANGLE, vtkTetra
from vtkmodules.vtkIOXML import vtkXMLMultiBlockDataReader, vtkXMLUnstructuredGridReader


def read(reader, path):
    reader.SetFileName(path)
    reader.Update()
    if reader.GetErrorCode() != 0:
        sys.exit(f"{path}: VTK's error {reader.GetErrorCode()}")
    return reader.GetOutput()


def strings(grid, name):
    array = grid.GetFieldData().GetAbstractArray(name)
    return [array.GetValue(k) for k in range(array.GetNumberOfValues())]


def tetrahedra(path):
    grid = read(vtkXMLUnstructuredGridReader(), path)
    region, boundary = (grid.GetCellData().GetArray(name) for name in ("region", "boundary"))
    region_name, boundary_name = (grid.GetCellData().GetAbstractArray(name) for name in ("region_name", "boundary_name"))
    volumes, kinds, names = {}, {VTK_TETRA: 0, VTK_TRIANGLE: 0}, set()
    for c in range(grid.GetNumberOfCells()):
        kinds[grid.GetCellType(c)] += 1
        names.add((int(region.GetTuple1(c)), region_name.GetValue(c)))
        names.add((int(boundary.GetTuple1(c)), boundary_name.GetValue(c)))
        if grid.GetCellType(c) != VTK_TETRA:
            continue
        points = grid.GetCell(c).GetPoints()
        volume = vtkTetra.ComputeVolume(*(points.GetPoint(k) for k in range(4)))
        of = int(region.GetTuple1(c))
        volumes[of] = volumes.get(of, 0.0) + volume
    return {
        "points": grid.GetNumberOfPoints(),
        "tetrahedra": kinds[VTK_TETRA],
        "triangles": kinds[VTK_TRIANGLE],
        "volumes": [volumes[r] for r in sorted(volumes)],
        "names": sorted(names),
        "regions": strings(grid, "regions"),
        "materials": strings(grid, "materials"),
    }


def blocks(path):
    found = read(vtkXMLMultiBlockDataReader(), path)
    return [found.GetBlock(k).GetNumberOfCells() for k in range(found.GetNumberOfBlocks())]


print(json.dumps(blocks(sys.argv[1]) if sys.argv[1].endswith(".vtm") else tetrahedra(sys.argv[1])))
