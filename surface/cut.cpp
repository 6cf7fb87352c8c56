#include "surface/cut.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/parallel.hpp"
#include "surface/topology.hpp"

namespace sidewall::surface {
namespace {

// Vertices or triangles per parallel task.
constexpr std::size_t kGrain = 8192;

constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// The axis of an axis-aligned plane, or -1.
int plane_axis(const Plane& plane) {
    for (int k = 0; k < 3; ++k)
        if (plane.normal[k] != 0.0 && plane.normal[(k + 1) % 3] == 0.0 && plane.normal[(k + 2) % 3] == 0.0)
            return k;
    return -1;
}

// Per vertex, whether it counts as above the plane. Those on the plane do, unless no vertex lies below it.
std::vector<std::uint8_t> above(const std::vector<double>& height) {
    const bool at_the_end = std::ranges::none_of(height, [](double h) { return h < 0.0; });
    std::vector<std::uint8_t> up(height.size());
    std::ranges::transform(height, up.begin(), [&](double h) { return at_the_end ? h > 0.0 : h >= 0.0; });
    return up;
}

// Triangles with vertices on both sides of the plane, in mesh order.
std::vector<std::uint32_t> straddling(const TriangleMesh& mesh, const std::vector<std::uint8_t>& up) {
    std::vector<std::vector<std::uint32_t>> parts((mesh.triangles.size() + kGrain - 1) / kGrain);
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
        const std::size_t end = std::min(mesh.triangles.size(), (part + 1) * kGrain);
        for (std::size_t t = part * kGrain; t < end; ++t) {
            const auto [a, b, c] = mesh.triangles[t];
            if (up[a] != up[b] || up[a] != up[c]) parts[part].push_back(static_cast<std::uint32_t>(t));
        }
    });
    std::vector<std::uint32_t> all;
    for (const auto& part : parts) all.insert(all.end(), part.begin(), part.end());
    return all;
}

}  // namespace

Plane parse_plane(const std::string& text) {
    Plane plane;
    const int axis = text.size() > 2 && text[1] == '=' ? text[0] - 'x' : -1;
    if (axis < 0 || axis > 2 || !read_number(std::string_view(text).substr(2), plane.offset) ||
        !std::isfinite(plane.offset))
        throw RecipeError("cut plane '{}': must be x, y or z, '=' and a number, such as y=0", text);
    plane.normal = Vec3::Unit(axis);
    return plane;
}

std::vector<Polyline> cut_by_plane(const TriangleMesh& mesh, const Plane& plane) {
    if (!plane.normal.allFinite() || plane.normal.isZero(0.0) || !std::isfinite(plane.offset))
        throw GeometryError("cannot cut by a plane whose normal is zero or not finite");
    const int axis = plane_axis(plane);
    std::vector<double> height(mesh.vertices.size());
    parallel_each(height.size(), kGrain, [&](std::size_t i) {
        height[i] = axis < 0
                        ? plane.normal.dot(mesh.vertices[i]) - plane.offset
                        : (mesh.vertices[i][axis] - plane.offset / plane.normal[axis]) * plane.normal[axis];
    });
    const std::vector<std::uint8_t> up = above(height);
    const std::vector<std::uint32_t> owner = straddling(mesh, up);
    std::vector<Link> links;
    links.reserve(owner.size());
    // In every triangle that straddles the plane, the cut runs from the edge going down to the edge going up.
    for (const std::uint32_t t : owner) {
        Link& link = links.emplace_back();
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
            if (up[a] == up[b]) continue;
            (up[a] != 0 ? link.from : link.to) = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
        }
    }

    // Interpolated from the lower vertex index to the higher, so that both triangles get the same bits.
    const auto crossing = [&](std::uint64_t edge) {
        const auto a = static_cast<std::uint32_t>(edge >> 32), b = static_cast<std::uint32_t>(edge);
        const double t = height[a] / (height[a] - height[b]);
        Vec3 p = height[b] == 0.0 ? mesh.vertices[b]
                                  : Vec3(mesh.vertices[a] + t * (mesh.vertices[b] - mesh.vertices[a]));
        if (axis >= 0) p[axis] = plane.offset / plane.normal[axis];
        return p;
    };
    std::vector<Polyline> result;
    for (const Chain& chain : join_links(links)) {
        Polyline line;
        line.closed = chain.closed;
        line.points.push_back(crossing(links[chain.links.front()].from));
        for (const std::uint32_t link : chain.links) {
            const Vec3 p = crossing(links[link].to);
            // Around a vertex on the plane successive triangles are cut in that one point: no segment.
            if (p == line.points.back()) continue;
            line.points.push_back(p);
            line.triangles.push_back(owner[link]);
        }
        if (line.closed && line.points.size() > 1 && line.points.front() == line.points.back())
            line.points.pop_back();
        if (line.points.size() > 1) result.push_back(std::move(line));
    }
    return result;
}

std::array<Vec3, 2> plane_axes(const Plane& plane) {
    const int axis = plane_axis(plane);
    if (axis == 0) return {Vec3::UnitY(), Vec3::UnitZ()};
    if (axis == 1) return {Vec3::UnitX(), Vec3::UnitZ()};
    if (axis == 2) return {Vec3::UnitX(), Vec3::UnitY()};
    const Vec3 normal = plane.normal.normalized();
    const Vec3 a = Vec3(-normal.y(), normal.x(), 0.0).normalized();
    return {a, normal.cross(a)};
}

std::string profile_csv(const std::vector<Polyline>& polylines, const Plane& plane) {
    const int axis = plane_axis(plane);
    const auto [a, b] = plane_axes(plane);
    std::string text = axis < 0 ? "a,b,polyline\n"
                                : fmt::format("{},{},polyline\n", kAxisNames[axis == 0 ? 1 : 0],
                                              kAxisNames[axis == 2 ? 1 : 2]);
    for (std::size_t i = 0; i < polylines.size(); ++i) {
        const Polyline& line = polylines[i];
        const std::size_t rows = line.points.size() + (line.closed ? 1 : 0);
        for (std::size_t k = 0; k < rows; ++k) {
            const Vec3& p = line.points[k % line.points.size()];
            fmt::format_to(std::back_inserter(text), "{:.9g},{:.9g},{}\n", a.dot(p), b.dot(p), i);
        }
    }
    return text;
}

}  // namespace sidewall::surface
