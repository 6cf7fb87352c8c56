#include "levelset/shapes/mesh_body.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "surface/distance.hpp"
#include "surface/files/mesh_io.hpp"
#include "surface/topology.hpp"
#include "surface/winding_number.hpp"

namespace sidewall::levelset {
namespace {

// Bodies that touch others are extended by this, in dx, so that no gas is left between them.
constexpr double kContact = 1e-3;

constexpr double kNearSide = 5.0;          // in dx; wider than any narrow band
constexpr double kPeriodTolerance = 1e-6;  // of a period: tolerance of bodies that reach from side to side

// Whether an opening lies off the domain's sides. One that reaches all four sides is the rim of a surface
// over the domain, and one with each of its edges along a side is the end of a body there.
bool is_off_sides(std::span<const Vec3> rim, const Domain& domain) {
    const auto sides_at = [&](const Vec3& p) {
        unsigned sides = 0;
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const double at = p[static_cast<Eigen::Index>(axis)];
            sides |= (at <= domain.min[axis] + domain.spacing ? 1u : 0u) << 2 * axis |
                     (at >= domain.max[axis] - domain.spacing ? 2u : 0u) << 2 * axis;
        }
        return sides;
    };
    unsigned reached = 0, before = sides_at(rim.back());
    bool along = true;
    for (const Vec3& p : rim) {
        const unsigned here = sides_at(p);
        along = along && (before & here) != 0;
        reached |= here;
        before = here;
    }
    return !along && reached != 15;
}

bool contains(const Box3& outer, const Box3& inner) {
    return (outer.min.array() <= inner.min.array()).all() && (inner.max.array() <= outer.max.array()).all();
}

// A closed body with the cavities in it, or what lies below open surfaces.
struct MeshPart {
    Box3 bounds;
    std::vector<std::uint32_t> triangles;
    double volume = 0.0;
    bool open = false;
};

// The parts of the mesh that are connected by edges.
std::vector<MeshPart> connected_parts(const TriangleMesh& mesh) {
    const surface::EdgeTable table = surface::edge_table(mesh);
    surface::DisjointSets sets(mesh.triangles.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e)
        for (const std::uint32_t corner : table.corners[e]) sets.join(table.corners[e][0] / 3, corner / 3);
    std::vector<MeshPart> parts(mesh.triangles.size());
    for (std::size_t e = 0; e < table.edges.size(); ++e)
        if (table.corners[e].size() == 1) parts[sets.root(table.corners[e][0] / 3)].open = true;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
        MeshPart& part = parts[sets.root(t)];
        part.triangles.push_back(t);
        for (const std::uint32_t v : mesh.triangles[t]) part.bounds.extend(mesh.vertices[v]);
        part.volume += area_vector(mesh, t).dot(mesh.vertices[mesh.triangles[t][0]]);
    }
    std::erase_if(parts, [](const MeshPart& part) { return part.triangles.empty(); });
    return parts;
}

// Whether a part repeats a period away along an axis; a wall from side to side is cut at the sides instead.
bool is_repeated(const MeshPart& part, const Domain& domain, std::size_t axis) {
    const double length = domain.max[axis] - domain.min[axis];
    return !part.open && domain.side[axis] == Side::periodic &&
           part.bounds.size()[static_cast<Eigen::Index>(axis)] < length * (1.0 - kPeriodTolerance);
}

// Number of closed bodies that reach over periodic sides.
std::size_t bodies_over_sides(const TriangleMesh& mesh, const Domain& domain) {
    std::size_t over = 0;
    for (const MeshPart& part : connected_parts(mesh)) {
        bool reaches = false;
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const auto a = static_cast<Eigen::Index>(axis);
            const double tiny = kContact * domain.spacing;
            reaches |= is_repeated(part, domain, axis) && part.volume > 0.0 &&
                       (part.bounds.min[a] < domain.min[axis] - tiny ||
                        part.bounds.max[a] > domain.max[axis] + tiny);
        }
        over += reaches ? 1 : 0;
    }
    return over;
}

// Adds copies of closed parts a period away, where that puts some of them in the domain or near it.
void repeat_over_sides(TriangleMesh& mesh, const Domain& domain) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        const double period = domain.max[axis] - domain.min[axis], near = kNearSide * domain.spacing;
        if (domain.side[axis] != Side::periodic) continue;
        for (const MeshPart& part : connected_parts(mesh))
            for (const double by : {-period, period}) {
                if (!is_repeated(part, domain, axis) || part.bounds.max[a] + by < domain.min[axis] - near ||
                    part.bounds.min[a] + by > domain.max[axis] + near)
                    continue;
                std::map<std::uint32_t, std::uint32_t> copies;  // by vertex
                for (const std::uint32_t t : part.triangles) {
                    Triangle copy = mesh.triangles[t];
                    for (std::uint32_t& v : copy) {
                        const auto [at, is_new] =
                            copies.emplace(v, static_cast<std::uint32_t>(mesh.vertices.size()));
                        if (is_new) mesh.vertices.push_back(mesh.vertices[v] + by * Vec3::Unit(a));
                        v = at->second;
                    }
                    mesh.triangles.push_back(copy);
                }
            }
    }
}

void add(MeshPart& to, const MeshPart& part) {
    to.triangles.insert(to.triangles.end(), part.triangles.begin(), part.triangles.end());
    to.bounds.extend(part.bounds.min);
    to.bounds.extend(part.bounds.max);
}

// The body below all open surfaces, if there are any, and the closed bodies with their cavities.
std::vector<MeshPart> bodies_of(const TriangleMesh& mesh) {
    MeshPart below{.open = true};
    std::vector<MeshPart> bodies, cavities;
    for (MeshPart& part : connected_parts(mesh)) {
        if (part.open)
            add(below, part);
        else
            (part.volume < 0.0 ? cavities : bodies).push_back(std::move(part));
    }
    for (const MeshPart& cavity : cavities) {
        MeshPart* around = &below;
        double least = kInfinity;
        for (MeshPart& body : bodies)
            if (const double size = body.bounds.size().prod();
                contains(body.bounds, cavity.bounds) && size < least) {
                around = &body;
                least = size;
            }
        add(*around, cavity);
    }
    if (!below.triangles.empty()) bodies.insert(bodies.begin(), std::move(below));
    return bodies;
}

// Bodies with disjoint boxes, so that the nearest triangle tells inside from outside, except for closed
// bodies that overlap themselves.
struct DisjointBodies {
    std::vector<Box3> bounds;
    TriangleMesh mesh;
    bool open = false;
};

// The bodies of a mesh, sorted into such groups by first fit.
std::vector<DisjointBodies> groups_apart(const TriangleMesh& mesh) {
    std::vector<DisjointBodies> groups;
    for (const MeshPart& part : bodies_of(mesh)) {
        const auto fits = [&](const DisjointBodies& group) {
            return std::ranges::none_of(group.bounds, [&](const Box3& b) { return overlap(b, part.bounds); });
        };
        auto group = std::ranges::find_if(groups, fits);
        if (group == groups.end()) group = groups.insert(group, {{}, {mesh.vertices, {}, {}, {}}});
        group->bounds.push_back(part.bounds);
        group->open |= part.open;
        for (const std::uint32_t t : part.triangles) group->mesh.triangles.push_back(mesh.triangles[t]);
    }
    return groups;
}

// Signed distance from a group of bodies.
struct GroupDistance {
    surface::SignedDistance distance;
    std::optional<surface::WindingNumber> winding;  // of closed bodies only
    Box3 bounds;

    // The winding number is undefined on the surface: the point is moved outwards by \p contact first. If it
    // is inside even then, the nearest wall lies between bodies that overlap.
    double at(const Vec3& p, double contact) const {
        const surface::DistanceSample sample = distance.at(p);
        if (sample.distance < 0.0 || !winding || !overlap(bounds, {p, p})) return sample.distance;
        const bool inner = winding->at(p + contact * sample.rise) > 0.5;
        return inner ? -std::max(sample.distance, contact) : sample.distance;
    }
};

}  // namespace

ImportedMesh import_mesh(const std::string& file, const Domain& domain) {
    ImportedMesh imported{surface::read_mesh(file)};
    imported.repairs = surface::repair(
        imported.mesh, {.closes = [&](std::span<const Vec3> rim) { return is_off_sides(rim, domain); }});
    imported.bounds = bounding_box(imported.mesh);
    imported.over = bodies_over_sides(imported.mesh, domain);
    repeat_over_sides(imported.mesh, domain);
    return imported;
}

Body mesh_body(const Shape& shape, const Domain& domain) {
    const TriangleMesh mesh = import_mesh(shape.file, domain).mesh;
    const Box3 bounds = bounding_box(mesh);
    std::vector<DisjointBodies> groups = groups_apart(mesh);
    if (groups.size() == 1) groups.front().mesh = mesh;  // in the file's order
    const auto distances = std::make_shared<std::vector<GroupDistance>>();
    distances->reserve(groups.size());
    for (const DisjointBodies& group : groups) {
        distances->push_back({surface::SignedDistance(group.mesh), std::nullopt, bounds});
        if (!group.open) distances->back().winding.emplace(group.mesh);
    }
    const double contact = kContact * domain.spacing;
    const auto distance = [distances, contact](const Vec3& p) {
        double least = distances->front().at(p, contact);
        for (std::size_t k = 1; k < distances->size(); ++k)
            least = std::min(least, (*distances)[k].at(p, contact) - contact);
        return least;
    };
    // Undersides are lowered by `contact`, so that a body on the wafer reaches into it.
    return {[distance, contact](const Vec3& p) {
                const double here = distance(p);
                return std::abs(here) < contact ? std::min(here, distance(p + contact * Vec3::UnitZ()))
                                                : here;
            },
            bounds.min.z(), bounds.max.z()};
}

}  // namespace sidewall::levelset
