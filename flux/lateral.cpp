#include "flux/lateral.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "surface/error.hpp"
#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

// Rounding of coordinates that went through a single-precision file, relative to the largest coordinate.
constexpr double kFileRounding = 1e-6;

using Edges = std::vector<std::array<std::uint32_t, 2>>;

std::string text(const Vec3& p) {
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", p.x(), p.y(), p.z());
}

// Edges that are not used once in each direction: on the surface's boundary, at holes, and between triangles
// of opposite orientation.
Edges unpaired_edges(const TriangleMesh& mesh) {
    const surface::EdgeTable table = surface::edge_table(mesh);
    Edges unpaired;
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto corners = table.corners[e];
        const auto start = [&](std::uint32_t corner) { return mesh.triangles[corner / 3][corner % 3]; };
        if (corners.size() != 2 || start(corners[0]) == start(corners[1])) unpaired.push_back(table.edges[e]);
    }
    return unpaired;
}

Vec3 total_area_vector(const TriangleMesh& mesh) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += 0.5 * area_vector(mesh, t);
    return sum;
}

// The first edge that does not lie on a side of the box, or boundary.end().
Edges::const_iterator off_sides(const TriangleMesh& mesh, const Edges& boundary, const LateralBox& box,
                                double tolerance) {
    return std::find_if(boundary.begin(), boundary.end(), [&](const auto& edge) {
        const Vec3 &a = mesh.vertices[edge[0]], &b = mesh.vertices[edge[1]];
        for (int axis = 0; axis < 2; ++axis)
            for (const double plane : {box.min[axis], box.max[axis]})
                if (std::abs(a[axis] - plane) <= tolerance && std::abs(b[axis] - plane) <= tolerance)
                    return false;
        return true;
    });
}

void require_boundary_on_sides(const TriangleMesh& mesh, const Edges& boundary, const LateralBox& box,
                               double tolerance) {
    if (boundary.empty())
        throw GeometryError(
            "the mesh is closed: reflective or periodic sides need a surface that is open at the sides of a "
            "rectangle in x and y; use --boundary open");
    const auto off = off_sides(mesh, boundary, box, tolerance);
    if (off == boundary.end()) return;
    throw GeometryError(
        "the surface has a hole, an inconsistently oriented triangle or an end at the edge {} to "
        "{}, which is not on a side of its bounding rectangle x {:.6g} to {:.6g}, y {:.6g} to "
        "{:.6g}: repair or cut the mesh, or use --boundary open",
        text(mesh.vertices[(*off)[0]]), text(mesh.vertices[(*off)[1]]), box.min[0], box.max[0], box.min[1],
        box.max[1]);
}

// Whether all edges are connected with each other.
bool is_one_piece(const Edges& edges, std::size_t vertices) {
    surface::DisjointSets sets(vertices);
    for (const auto& [a, b] : edges) sets.join(a, b);
    return std::all_of(edges.begin(), edges.end(),
                       [&](const auto& edge) { return sets.root(edge[0]) == sets.root(edges.front()[0]); });
}

}  // namespace

void require_traceable(const TriangleMesh& mesh) {
    if (mesh.triangles.empty()) throw GeometryError("the mesh has no triangle: nothing can be traced");
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!mesh.vertices[i].allFinite()) throw GeometryError("vertex {} is not finite: repair the mesh", i);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t])
            if (v >= mesh.vertices.size())
                throw GeometryError("triangle {} names vertex {}, but there are only {} vertices", t, v,
                                    mesh.vertices.size());
    const Box3 bounds = bounding_box(mesh);
    const double size = bounds.size().maxCoeff();
    const double reach = bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
    if (!(size > 1e-9 && size < 1e9))
        throw GeometryError(
            "the mesh measures {:.3g} length units: choose a unit in which it measures 1e-9 to 1e9", size);
    // Embree's edge functions multiply two edges and more in single precision: smaller areas underflow.
    constexpr double kLeastArea = 1e-17;
    const double area = total_area(mesh) / static_cast<double>(mesh.triangles.size());
    if (area > 0.0 && area < kLeastArea)
        throw GeometryError(
            "the triangles' mean area is {:.3g} square length units: choose a smaller unit, in which it is {:g} or "
            "more",
            area, kLeastArea);
    if (reach > 1e3 * size)
        throw GeometryError(
            "the mesh measures {:.3g} but lies {:.3g} away from the origin, which single "
            "precision does not resolve: "
            "move it to the origin",
            size, reach);
}

LateralBox lateral_box(const TriangleMesh& mesh, std::array<Boundary, 2> boundary) {
    require_traceable(mesh);
    const Box3 bounds = bounding_box(mesh);
    const double tolerance = kFileRounding * bounds.min.cwiseAbs().cwiseMax(bounds.max.cwiseAbs()).maxCoeff();
    LateralBox box{{bounds.min.x(), bounds.min.y()}, {bounds.max.x(), bounds.max.y()}, boundary};
    for (std::size_t a = 0; a < 2; ++a)
        if (boundary[a] == Boundary::periodic) box.period[a] = box.max[a] - box.min[a];
    for (int axis = 0; axis < 2; ++axis)
        if (!(box.max[axis] - box.min[axis] > 1e3 * tolerance))
            throw GeometryError("the mesh has no extent along {}: it cannot receive particles from above",
                                "xy"[axis]);

    const auto ends = unpaired_edges(mesh);
    const bool open = boundary[0] == Boundary::open && boundary[1] == Boundary::open;
    if (!open)
        require_boundary_on_sides(mesh, ends, box, tolerance);
    else
        box.rim_inside =
            off_sides(mesh, ends, box, tolerance) != ends.end() && is_one_piece(ends, mesh.vertices.size());

    // By Stokes' theorem, the area projected on z depends on the boundary alone: it is the rectangle's area
    // if the surface covers that once.
    const double seen = ends.empty() ? enclosed_volume(mesh) : total_area_vector(mesh).z();
    const double slack = 1e-5 * box.area();
    if (seen < (open ? 0.0 : -slack))
        throw GeometryError(
            "the surface is inside out: its normals point into the material; reverse the vertex order of its "
            "triangles");
    if (!open && std::abs(seen - box.area()) > slack)
        throw GeometryError(
            "the surface covers {:.6g} of its bounding rectangle's area {:.6g} seen from above: "
            "its boundary must go once around the rectangle; use --boundary open",
            seen, box.area());
    return box;
}

}  // namespace sidewall::flux
