#include "app/python/arrays.hpp"

#include <fmt/format.h>
#include <pybind11/stl.h>

namespace sidewall::python {
namespace {

py::array array_of(const py::object& values, const char* name) {
    if (py::array array = py::array::ensure(values)) return array;
    PyErr_Clear();
    throw py::type_error(fmt::format("{} must be an array", name));
}

std::string shape_of(const py::array& array) {
    std::string text;
    for (py::ssize_t k = 0; k < array.ndim(); ++k)
        text += fmt::format("{}{}", k > 0 ? ", " : "", array.shape(k));
    return "(" + text + ")";
}

void require_rows_of_three(const py::array& array, const char* name) {
    if (array.ndim() != 2 || array.shape(1) != 3)
        throw GeometryError("{} has the shape {}: must be (n, 3)", name, shape_of(array));
}

// Refuses floats: conversion would drop their fractions.
py::array_t<std::int64_t, py::array::c_style | py::array::forcecast> whole_numbers(const py::array& array,
                                                                                   const char* name) {
    if (array.dtype().kind() != 'i' && array.dtype().kind() != 'u')
        throw py::type_error(fmt::format("{} must be an array of whole numbers", name));
    return array;
}

py::array_t<double, py::array::c_style | py::array::forcecast> numbers(const py::array& array,
                                                                       const char* name) {
    if (const char kind = array.dtype().kind(); kind != 'f' && kind != 'i' && kind != 'u')
        throw py::type_error(fmt::format("{} must be an array of numbers", name));
    return array;
}

py::array read_only(py::array array) {
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return array;
}

// The attribute as an array: a copy if its numbers are int32, else a view.
py::object column(const Attribute& attribute, const py::object& owner) {
    const auto columns = static_cast<std::size_t>(attribute.components);
    if (attribute.type == Scalar::int32)
        return owned(std::vector<std::int32_t>(attribute.values.begin(), attribute.values.end()), columns);
    return view(attribute.values.data(), attribute.values.size() / columns, columns, owner);
}

py::dict columns(const std::vector<Attribute>& attributes, const py::object& owner) {
    py::dict dict;
    for (const Attribute& attribute : attributes) dict[attribute.name.c_str()] = column(attribute, owner);
    return dict;
}

py::array points_of(const py::object& self) {
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    const auto& vertices = self.cast<const TriangleMesh&>().vertices;
    return view(vertices.empty() ? nullptr : vertices[0].data(), vertices.size(), 3, self);
}

py::array triangles_of(const py::object& self) {
    const auto& triangles = self.cast<const TriangleMesh&>().triangles;
    return read_only(py::array_t<std::uint32_t>(std::vector<std::size_t>{triangles.size(), 3},
                                                triangles.empty() ? nullptr : triangles[0].data(), self));
}

}  // namespace

std::shared_ptr<TriangleMesh> mesh_of(const py::object& points, const py::object& triangles) {
    const auto places = numbers(array_of(points, "points"), "points");
    const auto corners = whole_numbers(array_of(triangles, "triangles"), "triangles");
    require_rows_of_three(places, "points");
    require_rows_of_three(corners, "triangles");
    auto mesh = std::make_shared<TriangleMesh>();
    const auto p = places.unchecked<2>();
    mesh->vertices.reserve(static_cast<std::size_t>(p.shape(0)));
    for (py::ssize_t i = 0; i < p.shape(0); ++i) {
        mesh->vertices.emplace_back(p(i, 0), p(i, 1), p(i, 2));
        if (!mesh->vertices.back().allFinite())
            throw GeometryError("points[{}] = ({}, {}, {}): must be finite", i, p(i, 0), p(i, 1), p(i, 2));
    }
    const auto t = corners.unchecked<2>();
    mesh->triangles.resize(static_cast<std::size_t>(t.shape(0)));
    for (py::ssize_t i = 0; i < t.shape(0); ++i)
        for (py::ssize_t k = 0; k < 3; ++k) {
            if (t(i, k) < 0 || t(i, k) >= p.shape(0))
                throw GeometryError("triangles[{}] = ({}, {}, {}): there are {} points, counted from 0", i,
                                    t(i, 0), t(i, 1), t(i, 2), p.shape(0));
            mesh->triangles[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)] =
                static_cast<std::uint32_t>(t(i, k));
        }
    return mesh;
}

std::vector<std::int32_t> material_ids(const py::object& materials, const TriangleMesh& mesh) {
    if (materials.is_none()) return {};
    const auto ids = whole_numbers(array_of(materials, "material"), "material");
    if (ids.ndim() != 1 || static_cast<std::size_t>(ids.shape(0)) != mesh.triangles.size())
        throw GeometryError("material has the shape {}: must be ({},), one a triangle", shape_of(ids),
                            mesh.triangles.size());
    std::vector<std::int32_t> list;
    for (py::ssize_t i = 0; i < ids.shape(0); ++i) {
        if (ids.at(i) < std::numeric_limits<std::int32_t>::min() ||
            ids.at(i) > std::numeric_limits<std::int32_t>::max())
            throw GeometryError("material[{}] = {}: must fit 32 bits", i, ids.at(i));
        list.push_back(static_cast<std::int32_t>(ids.at(i)));
    }
    return list;
}

py::array view(const double* values, std::size_t rows, std::size_t columns, const py::object& owner) {
    std::vector<std::size_t> shape{rows};
    if (columns > 1) shape.push_back(columns);
    return read_only(py::array_t<double>(shape, values, owner));
}

void add_mesh(py::module_& module) {
    py::class_<TriangleMesh, std::shared_ptr<TriangleMesh>>(module, "Mesh", R"(A triangle mesh.

Its arrays are read-only views of its memory, not copies, and keep it alive.
It unpacks into two arrays: points, triangles = mesh.)")
        .def_property_readonly("points", &points_of, "(n, 3) float64, world units")
        .def_property_readonly(
            "triangles", &triangles_of,
            "(m, 3) uint32: indices of points, counter-clockwise seen from outside the material")
        .def_property_readonly(
            "point_data",
            [](const py::object& self) {
                return columns(self.cast<const TriangleMesh&>().vertex_attributes, self);
            },
            "dict of arrays by name, one row a point")
        .def_property_readonly(
            "triangle_data",
            [](const py::object& self) {
                return columns(self.cast<const TriangleMesh&>().triangle_attributes, self);
            },
            "dict of arrays by name, one row a triangle; integers such as `material` are copies as int32")
        .def("__iter__",
             [](const py::object& self) {
                 return py::make_tuple(points_of(self), triangles_of(self)).attr("__iter__")();
             })
        .def("__repr__", [](const TriangleMesh& mesh) {
            return fmt::format("<sidewall.Mesh: {} points, {} triangles>", mesh.vertices.size(),
                               mesh.triangles.size());
        });
}

}  // namespace sidewall::python
