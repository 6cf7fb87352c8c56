#include "levelset/shapes/lithography.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>

#include "levelset/shapes/outline.hpp"
#include "surface/error.hpp"

using namespace sidewall::levelset;

namespace {

// Bound on an outline's error at pixels of p = sigma / 5: 0.076 p^2 / sigma for an edge within a pixel, and
// p^2 / (8 sigma^2) times the distance from the edge, at most sigma, between pixels.
constexpr double kError = 0.01;  // sigmas

Domain box(double x, double y, Side side = Side::reflective) {
    return make_domain({x, y}, 0.1, {side, side});
}

Polygon rectangle(double x0, double y0, double x1, double y1) {
    return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

// Share of a Gaussian's integral below \p x.
double below(double x, double sigma) {
    return 0.5 * std::erfc(-x / (sigma * std::numbers::sqrt2));
}

// Root of a falling function, by bisection.
double root(const std::function<double(double)>& f, double low, double high) {
    for (int n = 0; n < 100; ++n) (f(0.5 * (low + high)) > 0.0 ? low : high) = 0.5 * (low + high);
    return low;
}

Outline outline_of(const std::vector<Polygon>& polygons, const Blur& blur, const Domain& domain) {
    Shape shape;
    shape.kind = ShapeKind::mask;
    shape.polygons = resist_contours(polygons, blur, domain).outlines;
    shape.contours = true;
    return outline(shape, domain);
}

}  // namespace

TEST_CASE(
    "a blurred straight edge stays at half the dose, and lies where the error function says at others") {
    const Domain domain = box(4.0, 2.0);
    for (const double sigma : {0.05, 0.1, 0.3})
        for (const double threshold : {0.2, 0.35, 0.5, 0.75}) {
            const Outline edge =
                outline_of({rectangle(-9.0, -9.0, 0.313, 9.0)}, {{sigma}, {}, threshold}, domain);
            const double x = root([&](double at) { return below(0.313 - at, sigma) - threshold; }, -2.0, 2.0);
            if (threshold == 0.5) CHECK(x == Approx(0.313));
            const double error = kError * std::max(sigma, 0.1 * domain.spacing / sigma);
            for (const double y : {-1.0, -0.37, 0.2, 1.0}) CHECK(std::abs(edge(x, y)) < error);
            CHECK(edge(x + 0.2, 0.0) == Approx(0.2).margin(error));
            CHECK(edge(x - 0.2, 0.0) == Approx(-0.2).margin(error));
        }
}

TEST_CASE("an edge at any angle is blurred alike") {
    const Domain domain = box(4.0, 4.0);
    const double sigma = 0.1, threshold = 0.3, angle = 0.5;
    const double c = std::cos(angle), s = std::sin(angle);
    // The half-plane u < 0, where u is the coordinate along (c, s).
    const Polygon half{{-9.0 * s, 9.0 * c},
                       {9.0 * s, -9.0 * c},
                       {9.0 * (s - c), -9.0 * (c + s)},
                       {-9.0 * (s + c), 9.0 * (c - s)}};
    const Outline edge = outline_of({half}, {{sigma}, {}, threshold}, domain);
    const double u = root([&](double at) { return below(-at, sigma) - threshold; }, -2.0, 2.0);
    // All points lie beyond the blur's reach, 5.5 sigma, from the sides, where the wafer is mirrored.
    for (const double v : {-1.0, -0.33, 0.0, 0.8})
        CHECK(std::abs(edge(u * c - v * s, u * s + v * c)) < kError * sigma);
}

TEST_CASE("a corner rounds as the product of two error functions") {
    const Domain domain = box(4.0, 4.0);
    const double sigma = 0.12;
    for (const double threshold : {0.25, 0.5}) {
        const Outline corner =
            outline_of({rectangle(-9.0, -9.0, 0.0, 0.0)}, {{sigma}, {}, threshold}, domain);
        for (const double x : {-0.6, -0.2, -0.1, -0.03}) {
            const auto dose = [&](double y) { return below(-x, sigma) * below(-y, sigma); };
            if (dose(-1.0) <= threshold) continue;
            const double y = root([&](double at) { return dose(at) - threshold; }, -1.0, 1.0);
            CHECK(std::abs(corner(x, y)) < kError * sigma);
            CHECK(std::abs(corner(y, x)) < kError * sigma);
        }
    }
}

TEST_CASE(
    "a narrow line is as wide as the difference of error functions says, with several Gaussians by weight") {
    const Domain domain = box(9.0, 1.0);
    // From sigmas that share their pixels to one on pixels 16 times as large. Images of the line at the sides
    // lie at least 5.5 sigma away.
    for (const auto& [width, wide] :
         {std::pair(0.15, 0.2), {0.2, 0.2}, {0.5, 0.2}, {0.2, 0.09}, {0.3, 0.11}, {0.5, 0.8}}) {
        const Blur blur{{0.05, wide}, {3.0, 1.0}, 0.4};
        const Outline line = outline_of({rectangle(-0.5 * width, -9.0, 0.5 * width, 9.0)}, blur, domain);
        const auto dose = [&](double x) {
            double sum = 0.0;
            for (std::size_t k = 0; k < 2; ++k)
                sum += 0.25 * blur.weights[k] *
                       (below(0.5 * width - x, blur.sigmas[k]) - below(-0.5 * width - x, blur.sigmas[k]));
            return sum - 0.4;
        };
        const double half = root(dose, 0.0, 1.0);
        REQUIRE(half > 0.03);
        CHECK(std::abs(line(half, 0.1)) < kError * 0.05);
        CHECK(std::abs(line(-half, 0.1)) < kError * 0.05);
        CHECK(line(0.0, 0.1) == Approx(-half).margin(kError * 0.05));
    }
}

TEST_CASE("many Gaussians cost what one does, and stop when asked to") {
    // 4e7 pixels, on which the widest sigma alone would take 2e12 multiplications.
    const Domain domain = make_domain({40.0, 40.0}, 0.032, {Side::periodic, Side::periodic});
    const Blur blur{{0.032, 1.0, 8.0}, {}, 0.5};
    const std::vector<Polygon> half{rectangle(-9.0, -99.0, 9.0, 99.0)};
    CHECK_THROWS_AS(resist_contours(half, blur, domain, [] { return true; }), sidewall::Interrupted);
    CHECK_THROWS_WITH(resist_contours(half, {std::vector<double>(30, 0.032), {}, 0.5}, domain),
                      Catch::Contains("multiplications"));
}

TEST_CASE("what is too narrow to print vanishes and is told, overlaps count once and a ring keeps its hole") {
    const Domain domain = box(4.0, 4.0);
    const double sigma = 0.1;
    // The dose in a line's middle is erf(width / (2 sqrt(2) sigma)): 0.38 and 0.68 for one and two sigmas.
    const Polygon lost = rectangle(-1.55, -9.0, -1.45, 9.0), kept = rectangle(-1.1, -9.0, -0.9, 9.0);
    const Polygon ring{{0.0, -1.0}, {1.6, -1.0}, {1.6, 1.0}, {0.0, 1.0},  {0.0, -1.0},
                       {0.5, -0.5}, {0.5, 0.5},  {1.1, 0.5}, {1.1, -0.5}, {0.5, -0.5}};
    const ResistContours result = resist_contours({lost, kept, kept, ring}, {{sigma}, {}, 0.5}, domain);
    CHECK(result.lost == std::vector<std::size_t>{0});
    CHECK(result.most > std::erf(2.5 / std::numbers::sqrt2));  // amid the ring's bars, 5 sigma wide
    CHECK(result.most < 1.0);
    const Outline all = outline_of({lost, kept, kept, ring}, {{sigma}, {}, 0.5}, domain);
    CHECK(all(-1.5, 0.0) > 0.0);
    const double half =
        root([&](double x) { return below(0.1 - x, sigma) - below(-0.1 - x, sigma) - 0.5; }, 0.0, 1.0);
    CHECK(all(-1.0, 0.3) == Approx(-half).margin(kError * sigma));
    CHECK(all(0.8, 0.0) == Approx(0.3).margin(kError * sigma));  // within the hole
    CHECK(all(0.25, 0.0) == Approx(-0.25).margin(kError * sigma));
    CHECK(resist_contours({lost}, {{sigma}, {}, 0.5}, domain).outlines.empty());
}

TEST_CASE("a layout goes on beyond the sides as the wafer does") {
    const double sigma = 0.2;
    // A line that ends at reflective sides is straight up to them.
    const Outline line = outline_of({rectangle(-0.5, -1.0, 0.5, 1.0)}, {{sigma}, {}, 0.3}, box(4.0, 2.0));
    for (const double y : {-1.0, -0.9, 0.95, 1.0}) CHECK(line(0.7, y) == Approx(line(0.7, 0.0)).margin(1e-5));
    // On periodic sides a rectangle prints the same wherever it lies.
    const Domain periodic = box(4.0, 2.0, Side::periodic);
    const Outline one = outline_of({rectangle(-0.5, -0.3, 0.5, 0.3)}, {{sigma}, {}, 0.3}, periodic),
                  other = outline_of({rectangle(1.3, 0.5, 2.3, 1.1)}, {{sigma}, {}, 0.3}, periodic);
    for (const double x : {-0.6, 0.0, 0.55})
        for (const double y : {-0.4, 0.0, 0.35})
            CHECK(one(x, y) == Approx(other(wrapped(x + 1.8, periodic, 0), wrapped(y + 0.8, periodic, 1)))
                                   .margin(kError * sigma));
}
