#pragma once
#include <pybind11/numpy.h>

#include <memory>
#include <optional>
#include <vector>

#include "surface/triangle_mesh.hpp"

// NumPy arrays to meshes and back.
namespace sidewall::python {

namespace py = pybind11;

/// A mesh of arrays or nested lists: points of shape (n, 3), triangles of shape (m, 3), their numbers copied.
/// \throws TypeError for arrays of another kind, GeometryError for a shape, a coordinate that is not finite or an
///         index out of range.
std::shared_ptr<TriangleMesh> mesh_of(const py::object& points, const py::object& triangles);

/// Whole numbers, one a triangle; none for None.
/// \throws as mesh_of.
std::vector<std::int32_t> materials_of(const py::object& materials, const TriangleMesh& mesh);

/// Numbers that \p owner keeps, as a read-only array of shape (rows) or, of several columns, (rows, columns).
py::array view(const double* values, std::size_t rows, std::size_t columns, const py::object& owner);

/// An array that owns its numbers, of shape (rows) or (rows, columns) likewise.
template <class T>
py::array_t<T> owned(std::vector<T> values, std::size_t columns = 1) {
    auto* kept = new std::vector<T>(std::move(values));
    const py::capsule owner(kept, [](void* numbers) { delete static_cast<std::vector<T>*>(numbers); });
    std::vector<std::size_t> shape{kept->size() / columns};
    if (columns > 1) shape.push_back(columns);
    return py::array_t<T>(shape, kept->data(), owner);
}

}  // namespace sidewall::python
