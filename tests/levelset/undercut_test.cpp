// Fronts under a mask against Huygens' construction: all points at one distance from the opening.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "levelset/layers/make_stack.hpp"
#include "tests/levelset/grids.hpp"

using namespace sidewall;
using namespace sidewall::levelset;

namespace {

struct Opening {
    ShapeKind kind;
    double bottom, half,
        thickness;      // height of the mask's underside, half its opening's width, its thickness; in cells
    double film = 0.0;  // thickness of another inert material on the mask's walls; `half` is measured to it
};

// Silicon under an inert mask, etched by \p depth.
struct Undercut {
    Domain domain;
    MaterialStack stack;
    Opening opening;
    double removed = 0.0;  // volume of silicon etched away

    Undercut(const Opening& under, double depth, const AdvectionOptions& options)
        : domain(under.kind == ShapeKind::hole
                     ? make_domain({48.0, 48.0}, 1.0, {Side::reflective, Side::reflective})
                     : make_domain({64.0, 2.0}, 1.0, {Side::reflective, Side::periodic})),
          opening(under) {
        Shape silicon, mask;
        silicon.top = opening.bottom;
        mask.kind = opening.kind;
        mask.top = opening.bottom + opening.thickness;
        mask.width = 2.0 * opening.half;
        mask.radius = opening.half;
        mask.depth = std::numeric_limits<double>::infinity();
        Shape bare = mask;
        bare.width += 2.0 * opening.film;
        bare.radius += opening.film;
        if (opening.film > 0.0)
            stack = make_stack(domain, {{0, silicon}, {1, bare}, {2, mask}});
        else
            stack = make_stack(domain, {{0, silicon}, {1, mask}});
        const auto volume = [&] {
            return test::volume_above_zero(*stack.layers[0].phi, domain, surface::SharpEdges::all_beyond);
        };
        const double before = volume();
        test::move(stack, depth, options,
                   [](std::size_t layer, const Vec3&) { return layer == 0 ? -1.0 : 0.0; });
        removed = before - volume();
    }

    // Largest distance, in cells, of silicon's front from the exact one. The cell below the mask is left out:
    // there marching cubes cuts the corner between the two.
    double front_error(double depth) const {
        double most = 0.0;
        for (const Vec3& p : extract_surface(stack).vertices) {
            if (p.z() > opening.bottom - 1.0) continue;
            const double across =
                opening.kind == ShapeKind::hole ? std::hypot(p.x(), p.y()) : std::abs(p.x());
            const double distance = std::hypot(std::max(0.0, across - opening.half), p.z() - opening.bottom);
            most = std::max(most, std::abs(distance - depth));
        }
        return most;
    }
};

constexpr AdvectionOptions kDefaults{Scheme::weno3, TimeIntegration::euler, 0.5};

}  // namespace

TEST_CASE("an isotropic etch sets out under a mask at once: quarter circles at either side of the opening") {
    // The mask's walls and underside on nodes and between them.
    for (const double depth : {6.0, 12.0})
        for (const double bottom : {0.0, 0.13, 0.4, 0.5})
            for (const double beside : {0.0, 1e-7, -1e-7, 0.13, 0.4, 0.5}) {
                const Opening opening{ShapeKind::trench, bottom, (depth == 6.0 ? 5.0 : 10.0) + beside, 3.0};
                const Undercut etched(opening, depth, kDefaults);
                const double area = 2.0 * opening.half * depth + 0.5 * std::numbers::pi * depth * depth;
                CAPTURE(depth, bottom, beside, etched.removed / 2.0 / area - 1.0);
                CHECK(etched.removed / 2.0 == Approx(area).epsilon(depth == 6.0 ? 0.005 : 0.002));
                // A front that goes under the mask, three cells thick, four times as far is less exact.
                CHECK(etched.front_error(depth) < (depth == 6.0 ? 0.1 : 0.13));
            }
}

TEST_CASE("a film on a mask's walls, however thin, keeps no front from setting out under them") {
    const double depth = 6.0;
    for (const double film : {0.1, 0.24, 0.5, 0.7, 1.2})
        for (const double beside : {-0.5, -0.24, 0.0, 0.24}) {
            const Opening opening{ShapeKind::trench, 0.0, 8.0 + beside, 4.0, film};
            const Undercut etched(opening, depth, kDefaults);
            const double area = 2.0 * opening.half * depth + 0.5 * std::numbers::pi * depth * depth;
            CAPTURE(film, beside, etched.removed / 2.0 / area - 1.0);
            CHECK(etched.removed / 2.0 == Approx(area).epsilon(0.0045));
            CHECK(etched.front_error(depth) < 0.1);
        }
}

TEST_CASE("the quarter circle under a mask depends neither on the scheme nor on the time step") {
    const Opening opening{ShapeKind::trench, 0.0, 10.0, 6.0};
    const double area = 20.0 * 12.0 + 0.5 * std::numbers::pi * 144.0;
    for (const AdvectionOptions& options : {AdvectionOptions{Scheme::weno3, TimeIntegration::euler, 0.1},
                                            AdvectionOptions{Scheme::weno3, TimeIntegration::rk3, 0.5},
                                            AdvectionOptions{Scheme::weno5, TimeIntegration::euler, 0.5}}) {
        const Undercut etched(opening, 12.0, options);
        CAPTURE(options.cfl, etched.removed / 2.0 / area - 1.0);
        CHECK(etched.removed / 2.0 == Approx(area).epsilon(0.003));
        CHECK(etched.front_error(12.0) < 0.2);
    }
}

TEST_CASE("an isotropic etch under a mask with a round hole leaves a quarter of a torus") {
    for (const double beside : {0.0, 0.4}) {
        const Opening opening{ShapeKind::hole, 0.13, 8.0 + beside, 4.0};
        const double depth = 10.0, r = opening.half, pi = std::numbers::pi;
        const Undercut etched(opening, depth, kDefaults);
        // Half the volume of all points within the depth of a disc, by Steiner's formula.
        const double volume =
            pi * r * r * depth + 0.5 * pi * pi * r * depth * depth + 2.0 / 3.0 * pi * depth * depth * depth;
        CAPTURE(beside, etched.removed / volume - 1.0);
        CHECK(etched.removed == Approx(volume).epsilon(0.006));
        CHECK(etched.front_error(depth) < 0.25);
    }
}
