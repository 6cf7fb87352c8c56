#include "surface/tetrahedra/tetrahedralize.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/tetrahedra/tet_io.hpp"
#include "tests/folder.hpp"
#include "tests/tet_checks.hpp"

using namespace sidewall;
using namespace sidewall::surface;

namespace {

Front plane(const Vec3& normal, double offset) {
    return [n = Vec3(normal.normalized()), offset](const Vec3& p) {
        return DistanceSample{n.dot(p) - offset, n, {}};
    };
}

Front sphere(const Vec3& centre, double radius) {
    return [centre, radius](const Vec3& p) {
        const Vec3 way = p - centre;
        const double r = way.norm();
        return DistanceSample{r - radius, r > 0.0 ? Vec3(way / r) : Vec3(0.0, 0.0, 1.0), {}};
    };
}

TetOptions unit_box(double size) {
    TetOptions options;
    options.box.min = {0.0, 0.0, 0.0};
    options.box.max = {1.0, 1.0, 1.0};
    options.size = size;
    options.least = 0.3 * size;
    options.tolerance = 0.03 * size;
    options.thin = 1e-4 * size;
    return options;
}

}  // namespace

TEST_CASE("a box of two materials below a plane is filled exactly") {
    TetOptions options = unit_box(0.13);
    const std::vector<Front> fronts{plane({0.0, 0.0, 1.0}, 0.3718), plane({0.0, 0.0, 1.0}, 0.7293)};
    for (const bool outside : {false, true}) {
        options.outside = outside;
        const TetMesh mesh = tetrahedralize(fronts, options);
        const std::size_t top = test::check_tets(mesh, options.box, !outside);
        CHECK((top > 0) == !outside);
        const TetQuality quality = measure_tets(mesh);
        // The distance to a plane is linear, so that linear interpolation finds the cuts exactly. In general
        // a cut is found to 1e-4 of an edge.
        CHECK(quality.volume[0] == Approx(0.3718).epsilon(1e-9));
        CHECK(quality.volume[1] == Approx(0.7293 - 0.3718).epsilon(1e-9));
        if (outside) CHECK(quality.volume[2] == Approx(1.0 - 0.7293).epsilon(1e-9));
        CHECK(quality.longest_edge < 1.0);
        // Regions meet at shared interfaces: no face lies between regions 0 and 2.
        for (const auto& [face, regions] : test::faces_of(mesh))
            if (regions.size() == 2) CHECK(std::abs(regions[0] - regions[1]) <= 1);
    }
}

TEST_CASE("planes that meet the sides of the box and each other at any angle keep the sides flat") {
    TetOptions options = unit_box(0.11);
    // The lower plane crosses the upper one along a line. The inner body is the intersection of both
    // half-spaces: its distance is the greater of the two.
    const Front low = plane({0.45, -0.2, 1.0}, 0.52), high = plane({-0.35, 0.15, 1.0}, 0.48);
    const Front inner = [low, high](const Vec3& p) {
        const DistanceSample a = low(p), b = high(p);
        return a.distance > b.distance ? a : b;
    };
    const std::vector<Front> fronts{inner, high};
    const TetMesh mesh = tetrahedralize(fronts, options);
    CHECK(test::check_tets(mesh, options.box, true) > 0);
    // Both volumes, by summing 2000 x 2000 columns, to 1e-6.
    double lower = 0.0, both = 0.0;
    constexpr int kColumns = 2000;
    for (int i = 0; i < kColumns; ++i)
        for (int j = 0; j < kColumns; ++j) {
            const double x = (i + 0.5) / kColumns, y = (j + 0.5) / kColumns;
            const double a = 0.52 * Vec3(0.45, -0.2, 1.0).norm() - 0.45 * x + 0.2 * y;
            const double b = 0.48 * Vec3(-0.35, 0.15, 1.0).norm() + 0.35 * x - 0.15 * y;
            lower += std::min(a, b);
            both += b;
        }
    const TetQuality quality = measure_tets(mesh);
    constexpr double kAll = static_cast<double>(kColumns) * kColumns;
    CHECK(quality.volume[0] + quality.volume[1] == Approx(both / kAll).epsilon(1e-4));
    CHECK(quality.volume[0] == Approx(lower / kAll).epsilon(2e-3));
}

TEST_CASE("a sphere in a box is met to the square of the edges' length") {
    const double exact = 4.0 / 3.0 * std::numbers::pi * 0.027;
    double before = 0.0;
    for (const double size : {0.16, 0.08}) {
        TetOptions options = unit_box(size);
        options.tolerance = 1.0;  // so large that it shortens no edges
        options.outside = true;
        const std::vector<Front> fronts{sphere({0.52, 0.47, 0.51}, 0.3)};
        const TetMesh mesh = tetrahedralize(fronts, options);
        test::check_tets(mesh, options.box, false);
        const TetQuality quality = measure_tets(mesh);
        CHECK(quality.volume[0] + quality.volume[1] == Approx(1.0).epsilon(1e-12));
        const double error = std::abs(quality.volume[0] - exact) / exact;
        // Chords of length L lie L^2 / 8 R below a sphere of radius R. Averaged over both directions, the
        // volume is off by at most L^2 / 4 R^2 of itself.
        CHECK(error < size * size / (4.0 * 0.09));
        if (before > 0.0) CHECK(error < 0.5 * before);
        before = error;
    }
}

TEST_CASE("films thinner than the edges asked for are kept with their volume") {
    TetOptions options = unit_box(0.2);
    const Vec3 centre(0.5, 0.5, 0.0);
    const std::vector<Front> fronts{sphere(centre, 0.35), sphere(centre, 0.38)};
    options.least = 0.02;
    options.tolerance = 0.0015;
    const TetMesh mesh = tetrahedralize(fronts, options);
    CHECK(test::check_tets(mesh, options.box, true) > 0);
    const double half = 2.0 / 3.0 * std::numbers::pi;
    const TetQuality quality = measure_tets(mesh);
    CHECK(quality.volume[0] == Approx(half * std::pow(0.35, 3)).epsilon(0.005));
    CHECK(quality.volume[1] == Approx(half * (std::pow(0.38, 3) - std::pow(0.35, 3))).epsilon(0.005));
}

TEST_CASE("fronts are offset until volumes hold, by no more than they may be") {
    TetOptions options = unit_box(0.16);
    options.tolerance = 1.0;  // shortens no edges: their chords cut off over half a percent
    const double inner = 0.25, outer = 0.4;
    const auto ball = [](double radius) { return 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3); };
    const Vec3 centre(0.5, 0.5, 0.5);
    const std::vector<Front> fronts{sphere(centre, inner), sphere(centre, outer)};
    const std::vector<double> exact{ball(inner), ball(outer) - ball(inner), 1.0 - ball(outer)};
    const auto worst = [&](const TetMesh& mesh, std::size_t regions) {
        const TetQuality quality = measure_tets(mesh);
        double most = 0.0;
        for (std::size_t r = 0; r < regions; ++r)
            most = std::max(most, std::abs(quality.volume[r] / exact[r] - 1.0));
        return most;
    };
    const auto off_fronts = [&](const TetMesh& mesh) {
        double farthest = 0.0;
        for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t)
            if (mesh.region[t] == 0)
                for (const std::uint32_t v : mesh.tetrahedra[t])
                    farthest = std::max(farthest, (mesh.vertices[v] - centre).norm() - inner);
        return farthest;
    };
    for (const bool outside : {false, true}) {
        options.outside = outside;
        options.volume.clear();
        const TetMesh plain = tetrahedralize(fronts, options);
        CHECK(worst(plain, 2) > 0.005);
        options.material = outside ? std::vector<int>{0, 1, 2} : std::vector<int>{0, 1};
        options.volume.assign(exact.begin(), exact.begin() + (outside ? 3 : 2));
        options.shift = 0.02;
        const TetMesh mesh = tetrahedralize(fronts, options);
        test::check_tets(mesh, options.box, !outside);
        CHECK(mesh.tetrahedra == plain.tetrahedra);
        CHECK(worst(mesh, outside ? 3 : 2) <= 1e-4);
        CHECK(off_fronts(mesh) < options.shift + 1e-3);
        options.shift = 1e-3;
        const TetMesh bounded = tetrahedralize(fronts, options);
        CHECK(worst(bounded, 2) < worst(plain, 2));
        CHECK(worst(bounded, 2) > 0.001);
        for (std::size_t v = 0; v < plain.vertices.size(); ++v)
            REQUIRE((bounded.vertices[v] - plain.vertices[v]).norm() <= 1.000001 * options.shift);
        options.scrap = 1.0;  // above both volumes: four times the shift is allowed
        const TetMesh farther = tetrahedralize(fronts, options);
        CHECK(worst(farther, 2) <= 1e-4);
        for (std::size_t v = 0; v < plain.vertices.size(); ++v)
            REQUIRE((farther.vertices[v] - plain.vertices[v]).norm() <= 4.000001 * options.shift);
        options.scrap = 0.0;
    }
    // Two regions of one material: only their total volume is prescribed.
    options.outside = false;
    options.material = {0, 0};
    options.volume = {ball(outer)};
    options.shift = 0.02;
    const TetQuality both = measure_tets(tetrahedralize(fronts, options));
    CHECK((both.volume[0] + both.volume[1]) / ball(outer) == Approx(1.0).margin(1e-4));
}

TEST_CASE("tetrahedra come out the same each time, and too many are refused") {
    TetOptions options = unit_box(0.1);
    const std::vector<Front> fronts{sphere({0.5, 0.5, 0.2}, 0.4), plane({0.1, 0.0, 1.0}, 0.7)};
    // Bodies must be nested, so the outer one is the union.
    const std::vector<Front> nested{fronts[0], [&](const Vec3& p) {
                                        const DistanceSample a = fronts[0](p), b = fronts[1](p);
                                        return a.distance < b.distance ? a : b;
                                    }};
    const TetMesh one = tetrahedralize(nested, options), two = tetrahedralize(nested, options);
    test::check_tets(one, options.box, true);
    CHECK(one.tetrahedra == two.tetrahedra);
    CHECK(one.vertices == two.vertices);
    CHECK(one.region == two.region);
    options.most = 500;
    CHECK_THROWS_AS(tetrahedralize(nested, options), NumericsError);
}

TEST_CASE("the smallest angle between faces of known tetrahedra") {
    const Vec3 a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), d(0, 0, 1);
    CHECK(std::acos(smallest_dihedral_cosine(a, b, c, d)) == Approx(std::acos(1.0 / std::sqrt(3.0))));
    CHECK(smallest_dihedral_cosine(a, c, b, d) == 2.0);
    CHECK(smallest_dihedral_cosine(a, b, c, Vec3(1, 1, 0)) == 2.0);
    const Vec3 r(1, 1, 1), s(1, -1, -1), t(-1, 1, -1), u(-1, -1, 1);
    const bool positive = tet_volume(r, s, t, u) > 0.0;
    CHECK(smallest_dihedral_cosine(r, positive ? s : t, positive ? t : s, u) == Approx(1.0 / 3.0));
}

TEST_CASE("Gmsh's file names groups of triangles and tetrahedra and has every number to the last bit") {
    TetMesh mesh;
    mesh.vertices = {{0.1, 0, 0}, {1, 0, 0}, {0, 1.0 / 3.0, 0}, {0, 0, 1}};
    mesh.tetrahedra = {{0, 1, 2, 3}};
    mesh.region = {0};
    mesh.regions = {"Si \"p\""};
    mesh.triangles = {{0, 2, 1}};
    mesh.boundary = {1};
    mesh.boundaries = {"x-min", "bottom"};
    const test::Folder folder;
    write_tets(folder.path / "one.msh", mesh);
    CHECK(
        read_whole_file(folder.path / "one.msh") ==
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"x-min\"\n2 2 \"bottom\"\n3 3 \"Si 'p'\"\n"
        "$EndPhysicalNames\n$Nodes\n4\n1 0.1 0 0\n2 1 0 0\n3 0 0.3333333333333333 0\n4 0 0 1\n$EndNodes\n"
        "$Elements\n2\n1 2 2 2 2 1 3 2\n2 4 2 3 3 1 2 3 4\n$EndElements\n");
}
