#include <tbb/global_control.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <tuple>

#include "levelset/layers/make_stack.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"
#include "surface/quality.hpp"
#include "surface/topology.hpp"
#include "tests/geometry/self_intersections.hpp"
#include "tests/levelset/grids.hpp"
#include "tests/levelset/sharp_solids.hpp"

// Vertices that extraction puts on sharp edges and corners of the surface.
using namespace sidewall;
using namespace sidewall::levelset;
using namespace sidewall::test;
using surface::SharpEdges;

namespace {

constexpr double kWallOffsets[] = {0.0, 0.13, 0.4, 0.5};  // of walls from nodes, in cells
constexpr double kSlant = 17.0 * std::numbers::pi / 180.0;

GridPtr grid_of(const Domain& domain, const Distance& solid) {
    return sample_grid(domain, solid, -30.0, 30.0);
}

struct Distances {
    double mean = 0.0, largest = 0.0;
};
// Distances of a mesh from a solid, in cells, at ten points of each triangle; the mean is weighted by area.
Distances distances(const TriangleMesh& mesh, const Distance& solid) {
    constexpr int kParts = 4;
    Distances result;
    double area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        for (int i = 0; i < kParts; ++i)
            for (int j = 0; j < kParts - i; ++j) {
                const double u = (i + 1.0 / 3.0) / kParts, v = (j + 1.0 / 3.0) / kParts;
                const double d = std::abs(
                    solid((1.0 - u - v) * mesh.vertices[a] + u * mesh.vertices[b] + v * mesh.vertices[c]));
                result.mean += d * triangle_area(mesh, t);
                area += triangle_area(mesh, t);
                result.largest = std::max(result.largest, d);
            }
    }
    result.mean /= area;
    return result;
}

void check_near(const Domain& domain, const Distance& solid, double mean, double largest) {
    const Distances d = distances(extract_surface(*grid_of(domain, solid), domain, SharpEdges::all), solid);
    CHECK(d.mean < mean);
    CHECK(d.largest < largest);
}

void check_sound(const TriangleMesh& sharp, const TriangleMesh& plain) {
    const auto topology = surface::analyse_topology(sharp), before = surface::analyse_topology(plain);
    CHECK(topology.manifold());
    CHECK(topology.oriented());
    CHECK(topology.degenerate_triangles == 0);
    CHECK(topology.duplicate_triangles == 0);
    CHECK(topology.isolated_vertices == before.isolated_vertices);
    CHECK(topology.boundary_loops.size() == before.boundary_loops.size());
    if (topology.boundary_loops.size() > 0) CHECK(surface::boundary_on_rectangle(sharp, topology));
    CHECK(test::self_intersections(sharp) == 0);
}

// The grid of a seed's random solid; none where the solid is thinner than the band can resolve.
std::optional<GridPtr> random_grid(const Domain& domain, unsigned seed) {
    std::mt19937 random(seed);
    const GridPtr grid = grid_of(domain, random_solid(random));
    try {
        extract_surface(*grid, domain);
    } catch (const NumericsError&) {
        return std::nullopt;
    }
    return grid;
}

void check_random_solids(unsigned from, unsigned to) {
    unsigned checked = 0;
    for (unsigned seed = from; seed < to; ++seed) {
        const Domain domain = unit_domain(24, seed % 2 == 0 ? Side::periodic : Side::reflective);
        const auto grid = random_grid(domain, seed);
        if (!grid) continue;
        CAPTURE(seed);
        check_sound(extract_surface(**grid, domain, SharpEdges::all), extract_surface(**grid, domain));
        ++checked;
    }
    CHECK(checked > (to - from) / 2);
}

std::map<int, int> kinds(const TriangleMesh& mesh) {
    std::map<int, int> count;
    for (const double kind : mesh.vertex_attribute(kEdgeAttribute)->values) ++count[static_cast<int>(kind)];
    return count;
}

}  // namespace

TEST_CASE("plane faces meet in their edges, wherever they lie between nodes") {
    const Domain strip = make_domain({40.0, 4.0}, 1.0, {Side::reflective, Side::periodic});
    for (const double off : kWallOffsets) {
        CAPTURE(off);
        const auto steps = [&](double half, double height) {
            return Line{{-90.0, off},
                        {-half + off, off},
                        {-half + off, off + height},
                        {half + off, off + height},
                        {half + off, off},
                        {90.0, off}};
        };
        const Line groove{{-90.0, off}, {-7.0 + off, off}, {off, off - 9.9}, {7.0 + off, off}, {90.0, off}};
        // Faces on nodes are put a thousandth of a cell beside them (kNodeClearance). Marching cubes alone is
        // off by up to 0.4 cells, 0.01 in the mean.
        check_near(strip, below_line(steps(7.0, -12.0)), 0.0011, 0.0015);
        check_near(strip, below_line(steps(7.0, -12.0), kSlant), 0.001, 0.03);
        check_near(strip, below_line(groove), 0.0011, 0.04);
        check_near(strip, below_line(groove, kSlant), 0.001, 0.03);
        check_near(strip, below_line(steps(1.5, 10.0)), 0.0011, 0.0015);
    }
}

TEST_CASE(
    "corners of blocks, pits and posts are as near as their edges but where three planes meet in one cell") {
    const Domain box = unit_domain(40);
    for (const double off : kWallOffsets) {
        CAPTURE(off);
        const Vec3 at(off, off, off);
        const auto block = [&](const Eigen::Matrix3d& turn) -> Distance {
            return [=](const Vec3& p) { return box_distance(turn * (p - at), Vec3(8.0, 6.0, 7.0)); };
        };
        check_near(box, block(turned(0.0, 0.0)), 0.0011, 0.0015);
        check_near(box, block(turned(kSlant, 0.0)), 0.001, 0.25);
        check_near(box, block(turned(kSlant, 0.5)), 0.003, 0.4);  // marching cubes: mean 0.023
        check_near(box, on_floor(at, -9.0), 0.0011, 0.25);
        check_near(box, on_floor(at, 9.0), 0.0011, 0.25);
    }
}

TEST_CASE("a round rim is sharp, and its wall stays the chords of marching cubes") {
    const Domain box = unit_domain(40);
    for (const double off : kWallOffsets)
        for (const double radius : {10.0, 5.0}) {
            CAPTURE(off, radius);
            // Chords of one cell are off by 1 / (12 r) in the mean; those along cell diagonals are longer. A
            // top on nodes lies kNodeClearance beside them.
            check_near(
                box, [=](const Vec3& p) { return cylinder_distance(p - Vec3::Constant(off), radius, 8.0); },
                1.0 / (12.0 * radius) + surface::kNodeClearance, 0.2);
        }
}

TEST_CASE("the floor of a round hole reaches its wall, wherever it lies between nodes") {
    // With a radius of 8.75 cells, the wall crosses edges of the floor's cells beyond their middle along the
    // axes. The chords of the wall take 0.2 % off the circle.
    constexpr double kDx = 0.02, kRadius = 8.75 * kDx;
    const Domain domain = make_domain({1.0, 1.0}, kDx, {Side::reflective, Side::reflective});
    for (const double below : {0.0, 0.002, 0.03, 0.07, 0.2, 0.5}) {
        const MaterialStack stack = make_stack(
            domain, {{0, {.kind = ShapeKind::plane, .top = -below * kDx}},
                     {1, {.kind = ShapeKind::hole, .top = 0.4, .radius = kRadius, .depth = kInfinity}}});
        const TriangleMesh mesh = extract_surface(stack);
        double floor = 0.0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
            if (std::ranges::all_of(mesh.triangles[t], [&](std::uint32_t v) {
                    return std::abs(mesh.vertices[v].z() + below * kDx) < 0.05 * kDx;
                }))
                floor += 0.5 * area_vector(mesh, t).z();
        CAPTURE(below);
        CHECK(floor == Approx(std::numbers::pi * kRadius * kRadius).epsilon(0.01));
    }
}

TEST_CASE("a sphere has no edges, and its mesh is that of marching cubes to the bit") {
    for (const double radius : {10.0, 4.0}) {
        const Domain domain = unit_domain(30);
        const GridPtr grid = sphere_grid(domain, radius, {0.13, 0.2, 0.3});
        const TriangleMesh plain = extract_surface(*grid, domain),
                           sharp = extract_surface(*grid, domain, SharpEdges::all);
        CHECK(sharp.vertices == plain.vertices);
        CHECK(sharp.triangles == plain.triangles);
        CHECK(sharp.vertex_attributes.empty());
    }
}

TEST_CASE("edges have their kinds, and models may ask for the hollow ones alone") {
    const Domain domain = unit_domain(40);
    const GridPtr pit = grid_of(domain, on_floor(Vec3::Constant(0.5), -9.0));
    const auto all = kinds(extract_surface(*pit, domain, SharpEdges::all)),
               hollow = kinds(extract_surface(*pit, domain, SharpEdges::hollow));
    const int foot = all.at(int(surface::EdgeKind::hollow)), rim = all.at(int(surface::EdgeKind::convex));
    CHECK(all.at(int(surface::EdgeKind::corner)) == 8);
    CHECK(foot > rim);  // the foot has four edges and four upright ones
    CHECK(rim > 40);
    CHECK(hollow.at(int(surface::EdgeKind::hollow)) == foot);
    CHECK(hollow.count(int(surface::EdgeKind::convex)) == 0);
}

TEST_CASE("both sides of a periodic axis have the same vertices on edges") {
    const Domain domain = unit_domain(24, Side::periodic);
    for (unsigned seed = 1; seed <= 20; ++seed) {
        const auto grid = random_grid(domain, seed);
        if (!grid) continue;
        const TriangleMesh mesh = extract_surface(**grid, domain, SharpEdges::all);
        CAPTURE(seed);
        for (const int axis : {0, 1}) {
            std::set<std::pair<double, double>> sides[2];
            for (const Vec3& p : mesh.vertices)
                for (const std::size_t side : {0u, 1u})
                    if (p[axis] == (side == 0 ? domain.min : domain.max)[static_cast<std::size_t>(axis)])
                        sides[side].emplace(p[1 - axis], p.z());
            CHECK(sides[0] == sides[1]);
        }
    }
}

TEST_CASE("profiles of one, two and three cells are as sound as wide wafers") {
    for (const double cells : {1.0, 2.0, 3.0})
        for (const Side side : {Side::periodic, Side::reflective}) {
            const Domain domain = make_domain({40.0, cells}, 1.0, {Side::reflective, side});
            for (const double turn : {0.0, kSlant}) {
                const GridPtr grid = grid_of(
                    domain,
                    below_line(
                        {{-90.0, 0.4}, {-6.6, 0.4}, {-6.6, -11.6}, {7.4, -11.6}, {7.4, 0.4}, {90.0, 0.4}},
                        turn));
                CAPTURE(cells, side == Side::periodic, turn);
                const TriangleMesh mesh = extract_surface(*grid, domain, SharpEdges::all);
                check_sound(mesh, extract_surface(*grid, domain));
                // A slice one cell wide has no vertices between its sides: flux/tracer traces in its plane.
                if (cells == 1.0)
                    CHECK(std::all_of(mesh.vertices.begin(), mesh.vertices.end(), [&](const Vec3& p) {
                        return side == Side::reflective || p.y() == domain.min[1] || p.y() == domain.max[1];
                    }));
            }
        }
}

TEST_CASE("no triangles of random solids intersect") {
    check_random_solids(1, 101);
}

TEST_CASE("no triangles of a thousand random solids intersect", "[slow]") {
    check_random_solids(101, 1701);
}

TEST_CASE("sharp edges have the same bytes with 1 and 2 threads") {
    const Domain domain = unit_domain(24);
    const GridPtr grid = random_grid(domain, 3).value();
    TriangleMesh meshes[2];
    for (const std::size_t threads : {1u, 2u}) {
        tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        meshes[threads - 1] = extract_surface(*grid, domain, SharpEdges::all);
    }
    CHECK(meshes[0].vertices == meshes[1].vertices);
    CHECK(meshes[0].triangles == meshes[1].triangles);
}
