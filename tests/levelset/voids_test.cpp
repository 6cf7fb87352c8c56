#include "levelset/meshes/pieces.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "levelset/meshes/extract.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

double ball(const Vec3& p, const Vec3& centre, double radius) {
    return (p - centre).norm() - radius;
}

// The surface of a field, negative in the material, and flags of its triangles that are sealed off.
struct Sealed {
    TriangleMesh surface;
    std::vector<std::uint8_t> flags;
    Sealed(const Domain& domain, const std::function<double(const Vec3&)>& phi)
        : surface(extract_surface(*sample_grid(domain, phi, -16.0, 16.0), domain)),
          flags(sealed_off(surface, surface_pieces(surface, domain), domain)) {}
};

}  // namespace

TEST_CASE("a surface in one piece has no closed void, nor has one with a body in the gas above it") {
    const Domain domain = make_domain({24.0, 24.0}, 1.0, {Side::reflective, Side::reflective});
    CHECK(Sealed(domain, [](const Vec3& p) { return p.z() - 0.3; }).flags.empty());
    CHECK(Sealed(domain, [](const Vec3& p) {
              return std::min(p.z() - 0.3, ball(p, {0.0, 0.0, 6.2}, 3.1));
          }).flags.empty());
}

TEST_CASE("a void is sealed off with the body that lies in it, also where it goes through a side") {
    const auto side = GENERATE(Side::reflective, Side::periodic);
    const Domain domain = make_domain({24.0, 24.0}, 1.0, {side, side});
    for (const double x : {0.0, 12.0}) {
        const Sealed sealed(domain, [x](const Vec3& p) {
            Vec3 q = p;  // the nearest periodic copy
            if (q.x() < x - 12.0) q.x() += 24.0;
            const double holed = std::max(p.z() - 0.3, -ball(q, {x, 0.0, -8.1}, 5.2));
            return std::min({holed, ball(q, {x, 0.0, -8.1}, 2.2), ball(p, {0.0, 0.0, 6.2}, 3.1)});
        });
        REQUIRE(sealed.flags.size() == sealed.surface.triangles.size());
        for (std::size_t t = 0; t < sealed.flags.size(); ++t)
            CHECK(sealed.flags[t] == (triangle_centroid(sealed.surface, t).z() < -1.0 ? 1 : 0));
    }
}

TEST_CASE("a pocket that opens through a periodic side only is not sealed off") {
    // A shaft at x = -7 down to a tunnel that leaves through the side x = -12 and ends at x = 7.
    const auto phi = [](const Vec3& p) {
        const double shaft = std::max(std::abs(p.x() + 7.0) - 2.2, -10.1 - p.z());
        const double tunnel = std::max(std::abs(p.z() + 8.0) - 2.1, std::min(p.x() + 7.0, 7.0 - p.x()));
        return std::max(p.z() - 0.3, -std::min(shaft, tunnel));
    };
    CHECK(Sealed(make_domain({24.0, 4.0}, 1.0, {Side::periodic, Side::periodic}), phi).flags.empty());
    const Sealed walled(make_domain({24.0, 4.0}, 1.0, {Side::reflective, Side::periodic}), phi);
    REQUIRE(walled.flags.size() == walled.surface.triangles.size());
    for (std::size_t t = 0; t < walled.flags.size(); ++t)
        CHECK(walled.flags[t] == (triangle_centroid(walled.surface, t).x() > 0.0 &&
                                          triangle_centroid(walled.surface, t).z() < -1.0
                                      ? 1
                                      : 0));
}
