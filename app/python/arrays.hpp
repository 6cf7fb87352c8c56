#pragma once
#include <pybind11/numpy.h>

#include <memory>
#include <vector>

#include "surface/error.hpp"
#include "surface/triangle_mesh.hpp"

// Conversions between NumPy arrays and meshes.
namespace sidewall::python {

namespace py = pybind11;

/// Copies arrays or nested lists into a mesh: points of shape (n, 3), triangles of shape (m, 3).
/// \throws TypeError for arrays of another type; GeometryError for another shape, a coordinate that is not
///         finite or an index out of range.
std::shared_ptr<TriangleMesh> mesh_of(const py::object& points, const py::object& triangles);

/// Material ids, one a triangle, from an array of whole numbers; empty for None.
/// \throws as mesh_of.
std::vector<std::int32_t> material_ids(const py::object& materials, const TriangleMesh& mesh);

/// A read-only array over numbers of \p owner, of shape (rows) or, with several columns, (rows, columns).
py::array view(const double* values, std::size_t rows, std::size_t columns, const py::object& owner);

/// An array that owns \p values, of shape (rows) or, with several columns, (rows, columns).
template <class T>
py::array_t<T> owned(std::vector<T> values, std::size_t columns = 1) {
    auto* kept = new std::vector<T>(std::move(values));
    const py::capsule owner(kept, [](void* numbers) { delete static_cast<std::vector<T>*>(numbers); });
    std::vector<std::size_t> shape{kept->size() / columns};
    if (columns > 1) shape.push_back(columns);
    return py::array_t<T>(shape, kept->data(), owner);
}

}  // namespace sidewall::python
