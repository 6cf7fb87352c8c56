#include "surface/repair.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "flux/random.hpp"
#include "surface/error.hpp"
#include "tests/flux/flux_meshes.hpp"
#include "tests/flux/traces.hpp"
#include "tests/surface/surface_meshes.hpp"

using namespace sidewall;
using namespace sidewall::flux;
using Catch::Matchers::Contains;
using surface::repair;
using surface::Repairs;
using test::soup;

namespace {

TriangleMesh good_trench() {
    return extrude(trench_profile(2.0, 0.5, {0.5}, {0.5}), 1.0, 3);
}

void turn(TriangleMesh& mesh, std::size_t t) {
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
}

TriangleMesh octahedron() {
    TriangleMesh mesh;
    mesh.vertices = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}};
    return mesh;
}

}  // namespace

TEST_CASE("a sound mesh is left alone") {
    for (auto mesh : {good_trench(), octahedron()}) {
        const auto before = mesh.triangles;
        const Repairs repairs = repair(mesh);
        CHECK(repairs.welded == 0);
        CHECK(repairs.turned == 0);
        CHECK(mesh.triangles == before);
    }
}

TEST_CASE("a surface wholly inside out is turned over, as one piece or as loose triangles") {
    for (const auto& sound : {good_trench(), octahedron()}) {
        auto mesh = sound;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) turn(mesh, t);
        auto loose = soup(mesh);
        CHECK(repair(mesh).turned == mesh.triangles.size());
        CHECK(mesh.triangles == sound.triangles);
        CHECK(repair(loose).turned == mesh.triangles.size());
        CHECK(enclosed_volume(loose) == Approx(enclosed_volume(sound)));
    }
}

TEST_CASE("loose triangles whose corners rounding put apart are merged, and others are not") {
    for (const auto& sound : {good_trench(), octahedron()})
        for (const double noise : {1e-9, 1e-6}) {
            auto mesh = soup(sound);
            std::uint32_t corner = 0;  // makes the noise differ by corner and axis
            for (Vec3& p : mesh.vertices)
                for (int k = 0; k < 3; ++k) p[k] += noise * (0.1 * ((7 * ++corner) % 11) - 0.5);
            const std::size_t loose = mesh.vertices.size();
            const Repairs repairs = repair(mesh);
            CHECK(repairs.nearby == loose - sound.vertices.size());
            CHECK(repairs.welded == 0);
            CHECK(mesh.vertices.size() == sound.vertices.size());
            CHECK(enclosed_volume(mesh) == Approx(enclosed_volume(sound)).margin(50 * noise));
            CHECK_THAT(surface::repair_summary(repairs), Contains("vertices less than"));
        }
    // Closed meshes are not merged, however fine: this needle's tip is 1e-7 wide.
    auto needle = octahedron();
    for (std::size_t v = 0; v < 4; ++v) needle.vertices[v] *= 1e-7;
    CHECK(repair(needle).nearby == 0);
    CHECK(needle.vertices.size() == 6);
    // The needle keeps all of its faces as loose triangles, too.
    auto tip = soup(needle);
    repair(tip);
    CHECK(tip.triangles.size() == 8);
    CHECK(enclosed_volume(tip) == Approx(enclosed_volume(needle)));
    // Open strips 1e-6 wide and 1 apart are not merged either.
    std::vector<TriangleMesh> strips;
    for (const double x : {0.0, 1.0})
        strips.push_back(extrude({{x, 0.0}, {x + 1e-6, 0.0}, {x + 2e-6, 0.0}, {x + 3e-6, 0.0}}, 1e-6, 1));
    auto apart_by_far = test::joined(strips);
    CHECK(repair(apart_by_far).nearby == 0);
    CHECK(apart_by_far.triangles.size() == 12);
    // A gap of a thousandth of the size stays.
    auto apart = soup(octahedron());
    for (std::size_t v = 0; v < 3; ++v) apart.vertices[v].z() += 2e-3;
    CHECK(repair(apart, {.face_gas = false}).nearby == 0);
}

TEST_CASE("a floating body inside out is turned over, but a buried cavity, which nobody sees, stays") {
    auto mesh = extrude({{-2.0, 0.0}, {2.0, 0.0}}, 4.0, 5);
    const std::size_t ground = mesh.triangles.size();
    for (const double z : {3.0, -3.0}) {  // inside out: wrong above, right for a cavity
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3& p : octahedron().vertices) mesh.vertices.push_back(p + Vec3(0.0, 2.0, z));
        for (const auto& [a, b, c] : octahedron().triangles)
            mesh.triangles.push_back({first + a, first + c, first + b});
    }
    const auto before = mesh.triangles;
    CHECK(repair(mesh).turned == 8);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        CHECK((mesh.triangles[t] == before[t]) == (t < ground || t >= ground + 8));
    const auto result =
        trace(mesh, {Boundary::periodic, Boundary::periodic}, {"n", 1.0, {0.5}}, {.rays = 32'000});
    CHECK(result.leaked == 0);
}

TEST_CASE("a shell that shows front and back is refused") {
    auto mesh = octahedron();  // without a face, the inside of the opposite lower one is seen
    mesh.triangles.erase(mesh.triangles.begin(), mesh.triangles.begin() + 2);
    CHECK_THROWS_AS(repair(mesh), GeometryError);
    CHECK_THROWS_WITH(repair(mesh), Contains("shows its front in some places and its back in others"));
}

TEST_CASE("some triangles turned over are turned back") {
    for (auto mesh : {good_trench(), octahedron()}) {
        const auto before = mesh.triangles;
        turn(mesh, 1);
        turn(mesh, 5);
        CHECK(repair(mesh).turned == 2);
        const auto same = [](const Triangle& a, const Triangle& b) {
            return a == b || a == Triangle{b[1], b[2], b[0]} || a == Triangle{b[2], b[0], b[1]};
        };
        for (std::size_t t = 0; t < before.size(); ++t) CHECK(same(mesh.triangles[t], before[t]));
    }
}

TEST_CASE("orientations at random become outwards for a closed surface, upwards for an open one") {
    for (std::uint64_t seed = 0; seed < 20; ++seed)
        for (auto mesh : {good_trench(), octahedron()}) {
            const double volume = enclosed_volume(mesh);
            for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) turn(mesh, t);  // no majority
            for (std::size_t t = 0; t + 1 < mesh.triangles.size(); t += 2)
                if (draw(random_key(seed, 0, 0), t, 0).uniform(0) < 0.5) {
                    turn(mesh, t);
                    turn(mesh, t + 1);
                }
            repair(mesh);
            CHECK(enclosed_volume(mesh) == Approx(volume));
            if (mesh.vertices.size() > 6)
                CHECK_NOTHROW(lateral_box(mesh, {Boundary::reflective, Boundary::periodic}));
        }
}

TEST_CASE("triangles with vertices of their own are welded, and traced as one surface") {
    auto mesh = soup(good_trench());
    mesh.vertex_attributes.push_back({"height", 1, Scalar::float64, {}});
    for (const Vec3& p : mesh.vertices) mesh.vertex_attributes[0].values.push_back(p.z());
    const std::size_t loose = mesh.vertices.size(), shared = good_trench().vertices.size();
    const Repairs repairs = repair(mesh);
    CHECK(repairs.welded == loose - shared);
    CHECK(mesh.vertices.size() == good_trench().vertices.size());
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        CHECK(mesh.vertex_attributes[0].values[v] == mesh.vertices[v].z());
    const auto result =
        trace(mesh, {Boundary::periodic, Boundary::periodic}, {"n", 1.0, {0.5}}, {.rays = 32'000});
    CHECK(result.leaked == 0);
    auto twisted = soup(good_trench());
    turn(twisted, 7);
    CHECK(repair(twisted).turned == 1);
}

TEST_CASE("a Moebius strip is refused") {
    TriangleMesh mesh;
    constexpr int kPieces = 12;
    for (int i = 0; i < kPieces; ++i) {
        const double a = 2.0 * std::numbers::pi * i / kPieces, half = 0.5 * a;
        for (const double s : {-0.4, 0.4})
            mesh.vertices.emplace_back((2.0 + s * std::cos(half)) * std::cos(a),
                                       (2.0 + s * std::cos(half)) * std::sin(a), s * std::sin(half));
    }
    for (std::uint32_t i = 0; i < kPieces; ++i) {
        const bool last = i + 1 == kPieces;  // glued with a half turn
        const std::uint32_t a = 2 * i, b = a + 1, c = last ? 1 : a + 2, d = last ? 0 : a + 3;
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({b, d, c});
    }
    CHECK_THROWS_AS(repair(mesh), GeometryError);
    CHECK_THROWS_WITH(repair(mesh), Contains("one side only"));
}

TEST_CASE("what is hidden takes the orientation of most of its area, whatever openings get lids") {
    auto mesh = extrude({{-2.0, 0.0}, {2.0, 0.0}}, 4.0, 5);
    const std::size_t ground = mesh.triangles.size();
    const auto add = [&](double z, bool turned, std::size_t left_out) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3& p : octahedron().vertices) mesh.vertices.push_back(p + Vec3(0.0, 2.0, z));
        const auto triangles = octahedron().triangles;
        for (std::size_t t = left_out; t < triangles.size(); ++t) {
            const auto& [a, b, c] = triangles[t];
            mesh.triangles.push_back(turned ? Triangle{first + a, first + c, first + b}
                                            : Triangle{first + a, first + b, first + c});
        }
    };
    add(-3.0, true, 0);  // a cavity
    const auto sound = mesh.triangles;
    turn(mesh, ground);
    const bool opening = GENERATE(false, true);
    if (opening) add(3.0, false, 1);
    const Repairs repairs = repair(mesh, {.closes = [](std::span<const Vec3> rim) {
                                       return (rim[0] - rim[rim.size() / 2]).norm() < 3.0;
                                   }});
    CHECK(repairs.closed == (opening ? 1 : 0));
    CHECK(repairs.turned == 1);
    for (std::size_t t = 0; t < sound.size(); ++t) CHECK(mesh.triangles[t] == sound[t]);
}
