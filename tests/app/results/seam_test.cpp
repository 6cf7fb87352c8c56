#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "app/results/cut_profile.hpp"

using namespace sidewall;
using namespace sidewall::app;

// Seams of films in a trench 1 wide and 2 deep, on profiles whose points are known.
namespace {

Profile profile_through(const std::vector<std::pair<double, double>>& points) {
    Profile profile{.lines = {surface::Polyline()}, .along = Vec3::UnitX(), .mirrors = {}, .shifts = {}};
    for (const auto& [x, z] : points) profile.lines[0].points.emplace_back(x, 0.0, z);
    return profile;
}

constexpr double kTrenchCell = 0.05;

const Profile kTrench = profile_through({{-2, 0}, {-0.5, 0}, {-0.5, -2}, {0.5, -2}, {0.5, 0}, {2, 0}});

// An even film that has filled the trench: arcs about its upper edges.
Profile filled_by(double film) {
    std::vector<std::pair<double, double>> points;
    for (int k = -200; k <= 200; ++k) {
        const double x = 0.01 * k, beside = std::abs(std::abs(x) - 0.5);
        points.emplace_back(x, std::abs(x) < 0.5 ? std::sqrt(film * film - beside * beside) : film);
    }
    return profile_through(points);
}

}  // namespace

TEST_CASE("a seam ends where even films on both walls have met highest") {
    for (const double film : {0.5, 0.55, 0.7, 1.5})
        CHECK(seam_depth(filled_by(film), kTrench, kTrenchCell) ==
              Approx(-std::sqrt(film * film - 0.25)).margin(1e-9));
    // Half a trench beside a mirror plane, filled by the film.
    Profile half = profile_through({{-2, 0}, {-0.5, 0}, {-0.5, -2}, {0, -2}}), film = filled_by(0.55);
    film.lines[0].points.resize(201);
    half.mirrors = film.mirrors = {-2.0, 0.0};
    CHECK(seam_depth(film, half, kTrenchCell) == Approx(-std::sqrt(0.55 * 0.55 - 0.25)).margin(1e-9));
    // The seam begins above a void, which is no part of the open surface.
    const Profile notch = profile_through({{-2, 0.3}, {-0.3, 0.3}, {0, -0.4}, {0.3, 0.3}, {2, 0.3}});
    CHECK(seam_depth(notch, kTrench, kTrenchCell) == Approx(0.4));
}

TEST_CASE("films that have not met, or have come from the floor alone, leave no seam") {
    const Profile open =
        profile_through({{-2, 0.4}, {-0.1, 0.4}, {-0.1, -1.6}, {0.1, -1.6}, {0.1, 0.4}, {2, 0.4}});
    CHECK(std::isnan(seam_depth(open, kTrench, kTrenchCell)));
    for (const double level : {-1.0, -0.3}) {
        const Profile risen =
            profile_through({{-2, 0}, {-0.5, 0}, {-0.5, level}, {0.5, level}, {0.5, 0}, {2, 0}});
        CHECK(std::isnan(seam_depth(risen, kTrench, kTrenchCell)));
    }
    CHECK(std::isnan(
        seam_depth(profile_through({{-2, 0.1}, {2, 0.1}}), kTrench, kTrenchCell)));  // after polishing
    CHECK(std::isnan(
        seam_depth(profile_through({{-2, 0.1}, {2, 0.1}}), profile_through({{-2, 0}, {2, 0}}), kTrenchCell)));
}

TEST_CASE(
    "a groove without a film has no seam, wherever its tip lies in a cell, and one with a film has it") {
    // Walls 20 degrees off the vertical. Rounding, films too thin to count and rounded meshes raise the tip.
    const double steep = std::tan(70.0 * std::acos(-1.0) / 180.0);
    const auto groove = [&](double tip, double along) {
        return profile_through(
            {{-2, 0}, {along - 1.5 / steep, 0}, {along, tip}, {along + 1.5 / steep, 0}, {2, 0}});
    };
    for (const double along : {0.0, 0.2 * kTrenchCell, 0.5 * kTrenchCell}) {
        const Profile bare = groove(-1.5, along);
        for (const double raised : {0.0, 1e-15, 1e-9, 0.02 * kTrenchCell, 0.7 * kTrenchCell})
            CHECK(std::isnan(seam_depth(groove(-1.5 + raised, along), bare, kTrenchCell)));
        const double film = 0.1, cusp = -1.5 + film / std::cos(70.0 * std::acos(-1.0) / 180.0);
        CHECK(seam_depth(groove(cusp, along), bare, kTrenchCell) == Approx(-cusp));
    }
    // An etched groove over a boundary that is flat but for rounding.
    const Profile flat =
        profile_through({{-2, -2}, {-0.5, -2}, {-0.4, -2 - 1e-9}, {0.4, -2 - 1e-9}, {2, -2}});
    CHECK(std::isnan(seam_depth(groove(-1.5, 0.0), flat, kTrenchCell)));
}

TEST_CASE("the film on a flat floor beside a floating bar is measured midway between the bar and its copy") {
    // A bar 1 wide floats 0.4 above the floor of a periodic wafer. The film of 0.3 fills the gap below it.
    Profile below = profile_through({{-2, 0}, {-1, 0}, {-0.6, -1e-12}, {0.6, 0}, {1, 0}, {1.9, 0}, {2, 0}}),
            film = profile_through({{-2, 0.3}, {-0.8, 0.3}, {-0.8, 1.2}, {0.8, 1.2}, {0.8, 0.3}, {2, 0.3}});
    below.lines.push_back({.points = {{-0.5, 0, 0.4}, {0.5, 0, 0.4}, {0.5, 0, 0.9}, {-0.5, 0, 0.9}},
                           .triangles = {},
                           .closed = true});
    below.shifts = film.shifts = {-4.0, 4.0};
    for (const double sign : {1.0, -1.0}) {
        for (Profile* profile : {&below, &film})
            for (surface::Polyline& line : profile->lines)
                for (Vec3& p : line.points) p.x() *= sign;
        const Film found = film_between(film, below, 0.1);
        CHECK(found.top == Approx(0.3));
        CHECK(found.bottom == Approx(0.3));
    }
}

TEST_CASE(
    "a bare floor has a film of no thickness, also where its mesh rounds a corner more than the one below") {
    const Profile surface =
        profile_through({{-2, 0.3}, {-0.4, 0.3}, {-0.4, -2.02}, {0.4, -2.02}, {0.4, 0.3}, {2, 0.3}});
    const Film found = film_between(surface, kTrench, 0.1);
    CHECK(found.top == Approx(0.3));
    CHECK(found.bottom == 0.0);
}
