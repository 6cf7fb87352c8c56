#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <vector>

#include "app/process/simulation.hpp"
#include "surface/cut.hpp"
#include "tests/integration/run_program.hpp"

// Final profiles of the shipped recipes against closed forms and another simulator. Trenches run on a strip
// two cells thick: with mirrored sides it is the same infinite trench.
using namespace sidewall;

namespace {

using Point = Eigen::Vector2d;

struct Run {
    double dx = 0.0;
    std::vector<surface::Polyline> lines;  // cut at y = 0
    TriangleMesh surface;

    std::vector<Point> points() const {
        std::vector<Point> all;
        for (const auto& line : lines)
            for (const Vec3& p : line.points) all.emplace_back(p.x(), p.z());
        return all;
    }
    double distance(const Point& q) const {
        double nearest = std::numeric_limits<double>::infinity();
        for (const auto& line : lines)
            for (std::size_t k = 0; k + 1 < line.points.size() + (line.closed ? 1 : 0); ++k) {
                const Vec3 &p = line.points[k], &e = line.points[(k + 1) % line.points.size()];
                const Point a(p.x(), p.z()), ab(e.x() - p.x(), e.z() - p.z());
                const double t =
                    ab.squaredNorm() > 0 ? std::clamp((q - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0) : 0.0;
                nearest = std::min(nearest, (q - a - t * ab).norm());
            }
        return nearest;
    }
};

Run run_config(const std::string& name, const std::vector<std::string>& overrides) {
    const test::Folder folder;
    const app::Recipe recipe = app::load_recipe(SIDEWALL_SOURCE_DIR "/configs/" + name, overrides);
    const app::RunResult result = app::run_recipe(recipe, {.output = folder.path, .quiet = true});
    return {result.summary["grid_spacing"].get<double>(),
            surface::cut_by_plane(result.surface, surface::parse_plane("y=0")), result.surface};
}

// Mean distance between two cuts, over the lengths of both.
double mean_distance(const Run& a, const Run& b) {
    double sum = 0.0, length = 0.0;
    for (const auto& [from, to] : {std::pair{&a, &b}, {&b, &a}})
        for (const auto& line : from->lines)
            for (std::size_t k = 0; k + 1 < line.points.size(); ++k) {
                const Vec3 &p = line.points[k], &q = line.points[k + 1];
                const double d = (q - p).norm();
                sum += d * to->distance(0.5 * (Point(p.x(), p.z()) + Point(q.x(), q.z())));
                length += d;
            }
    return sum / length;
}

// Points x, z of a reference profile in tests/assets/.
std::vector<Point> load_profile(const std::string& file) {
    std::vector<Point> points;
    std::ifstream in(SIDEWALL_SOURCE_DIR "/configs/validation/trench_deposition/" + file);
    std::string line;
    std::getline(in, line);
    while (std::getline(in, line)) {
        double x = 0, z = 0;
        char comma = 0;
        std::istringstream(line) >> x >> comma >> z;
        points.emplace_back(x, z);
    }
    return points;
}

// Compares the hole with another simulator's on the same grid: depth, and radius at depths below the mask.
void compare_hole(const std::string& method) {
    constexpr double kDepth = 2.448;
    const Run result = run_config("sf6o2_hole.toml", {"simplify.method=" + method});
    double lowest = 0.0;
    for (const Point& p : result.points()) lowest = std::min(lowest, p.y());
    CHECK(-lowest == Approx(kDepth).epsilon(0.04));
    for (const auto& [depth, radius] :
         {std::pair{0.1, 0.187}, {0.5, 0.187}, {1.0, 0.187}, {1.5, 0.174}, {2.0, 0.164}}) {
        std::vector<double> walls;
        for (const auto& line : result.lines)
            for (std::size_t k = 0; k + 1 < line.points.size(); ++k) {
                const Vec3 &p = line.points[k], &q = line.points[k + 1];
                if ((p.z() > -depth) == (q.z() > -depth)) continue;
                walls.push_back(p.x() + (-depth - p.z()) / (q.z() - p.z()) * (q.x() - p.x()));
            }
        CAPTURE(depth, radius, walls);
        REQUIRE(walls.size() == 2);
        // At 1 um walls are half a cell nearer to the axis in the mean (0.171), and this is a single section.
        CHECK(0.5 * std::abs(walls[1] - walls[0]) == Approx(radius).margin(0.6 * result.dx));
    }
}

}  // namespace

TEST_CASE(
    "the trench deposition closes over the void that another simulator finds with either of its tracers",
    "[slow]") {
    for (const std::string method : {"none", "lindstrom-turk", "region-bounded"}) {
        const Run result = run_config(
            "trench_deposition.toml",
            {"domain.extent=[10.0, 0.476190476190476]", "flux.rays=50000", "simplify.method=" + method});
        for (const std::string tracer : {"triangles", "disks"}) {
            const std::vector<Point> reference = load_profile(tracer + ".csv");
            REQUIRE(reference.size() > 200);
            double void_error = 0, top_error = 0, seam_error = 0;
            for (const Point& p : reference) {
                if (std::abs(p.x()) > 5.0) continue;  // the other simulator's ghost cells
                const double d = result.distance(p) / result.dx;
                double& error = p.y() > 3.0 && std::abs(p.x()) > 1.0 ? top_error
                                : p.y() < -1.0                       ? void_error
                                                                     : seam_error;
                error = std::max(error, d);
            }
            CAPTURE(method, tracer, void_error, top_error, seam_error);
            CHECK(void_error < 0.6);
            CHECK(top_error < 1.0);
            CHECK(seam_error < 2.0);
        }
    }
}

TEST_CASE("the SF6/O2 hole is as deep and as wide as another simulator's, raw", "[slow]") {
    compare_hole("none");
}

TEST_CASE("the SF6/O2 hole is as deep and as wide as another simulator's, lindstrom-turk", "[slow]") {
    compare_hole("lindstrom-turk");
}

TEST_CASE("the SF6/O2 hole is as deep and as wide as another simulator's, region-bounded", "[slow]") {
    compare_hole("region-bounded");
}

TEST_CASE("profiles at dx, dx/2 and dx/4 converge at first order", "[slow]") {
    struct Row {
        const char* name;
        std::vector<std::string> overrides;
        std::vector<std::string> spacings;
        double order;  // least order of convergence
    };
    for (const Row& row :
         {Row{"quick/trench_deposition.toml",
              {"domain.extent=[10.0, 0.5]", "step[0].duration=1.5"},
              {"0.25", "0.125", "0.0625"},
              0.85},
          // The coarse grid is off by 0.02 dx, little more than the error of the time steps.
          Row{"quick/teos_trench.toml", {"domain.extent=[4.0, 0.25]"}, {"0.125", "0.0625", "0.03125"}, 0.7},
          Row{"quick/deposit_and_etch.toml", {"domain.extent=[4.0, 0.2]"}, {"0.1", "0.05", "0.025"}, 0.85}}) {
        std::vector<Run> runs;
        for (const std::string& spacing : row.spacings) {
            std::vector<std::string> overrides = row.overrides;
            overrides.push_back("domain.grid_spacing=" + spacing);
            overrides.push_back("simplify.method=none");
            runs.push_back(run_config(row.name, overrides));
        }
        const double coarse = mean_distance(runs[0], runs[1]), fine = mean_distance(runs[1], runs[2]);
        CAPTURE(row.name, coarse, fine);
        CHECK(std::log2(coarse / fine) > row.order);
    }
}

TEST_CASE("isotropic deposition is the trench's exact offset") {
    const Run result = run_config("isotropic_deposition.toml", {"domain.extent=[10.0, 0.476190476190476]"});
    double flats = 0, arcs = 0, corners = 0;
    for (const Point& p : result.points()) {
        const double x = std::abs(p.x()), z = p.y();
        if (x > 2.0 && z > 0.0)
            flats = std::max(flats, std::abs(z - 1.5));
        else if (z > 0.0)
            arcs = std::max(arcs, std::abs(std::hypot(x - 2.0, z) - 1.5));
        else if (z > -6.5 + 2 * result.dx)
            flats = std::max(flats, std::abs(x - 0.5));
        else if (x < 0.5 - 2 * result.dx)
            flats = std::max(flats, std::abs(z + 6.5));
        else
            corners = std::max(corners, std::min(std::abs(x - 0.5), std::abs(z + 6.5)));
    }
    CHECK(flats / result.dx < 0.1);
    CHECK(arcs / result.dx < 0.4);
    CHECK(corners / result.dx < 1.0);
}

TEST_CASE("the directional etch of a hole has straight walls, its closed-form floor and an untouched mask",
          "[slow]") {
    const Run result = run_config("directional_hole_etch.toml", {});
    double wall = 0, floor = 0, mask = 0;
    for (const Vec3& p : result.surface.vertices) {
        const double r = std::hypot(p.x(), p.y()), d = -p.z();
        if (d > 0.1 && d < 3.15 - 3 * result.dx)
            wall = std::max(wall, std::abs(r - (1.0 + 0.05 * (3.0 - d / 1.05))));
        if (d > 0.1 && r < 1.0 - 2 * result.dx) floor = std::max(floor, std::abs(d - 3.15));
        if (p.z() > result.dx && p.z() < 0.6 - result.dx) mask = std::max(mask, std::abs(r - 1.0));
        if (p.z() > 0.3 && r > 1.0 + result.dx) mask = std::max(mask, std::abs(p.z() - 0.6));
    }
    CHECK(wall / result.dx < 0.5);
    CHECK(floor / result.dx < 0.5);
    CHECK(mask / result.dx < 0.1);
}

TEST_CASE(
    "the floor of a directional etch is flat up to its walls, which are straight, wherever these lie on the grid") {
    // A beam alone, and one with an isotropic part, from which each wall recedes as soon as it is bare.
    const double sideways = GENERATE(0.0, 0.1);
    for (const double dx : {5.0, 2.5})
        for (const double off : {0.0, 0.06, 0.1, 0.13, 0.4, 0.5, 0.7, 0.8, 0.87}) {
            const app::Recipe recipe = app::parse_recipe(
                fmt::format(
                    "[domain]\nextent = [200.0]\ngrid_spacing = {}\nlength_unit = \"nm\"\n"
                    "boundary = \"reflective\"\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\n"
                    "material = \"Mask\"\nshape = \"trench\"\nthickness = 50.0\ndepth = 50.0\nwidth = {}\n"
                    "[[step]]\nmodel = \"directional\"\nduration = 300.0\n"
                    "directional = {{ Si = {}, Mask = 0.0 }}\nisotropic = {{ Si = {}, Mask = 0.0 }}\n",
                    dx, 100.0 + 2.0 * off * dx, sideways - 1.0, -sideways),
                "floor.toml");
            const test::Folder folder;
            const app::RunResult result = app::run_recipe(recipe, {.output = folder.path, .quiet = true});
            INFO("dx " << dx << ", walls " << off << " cells beside nodes, sideways " << sideways);
            int floor = 0, wall = 0;
            for (const Vec3& p : result.surface.vertices) {
                const double x = std::abs(p.x()) - (50.0 + off * dx), up = p.z() + 300.0;
                CHECK(up > (sideways > 0.0 ? -0.15 : -0.02) * dx);  // the foot, in the last cell
                if (x < -0.4 * dx) {
                    CHECK(std::abs(up) < (sideways > 0.0 ? 0.062 : 0.04) * dx);
                    ++floor;
                }
                if (up > 2.0 * dx && p.z() < -2.0 * dx) {
                    CHECK(x == Approx(sideways * up).margin((sideways > 0.0 ? 0.36 : 0.1) * dx));
                    ++wall;
                }
            }
            CHECK(floor > 10);
            CHECK(wall > 40);
        }
}

TEST_CASE("a mask that a beam wears down keeps its walls up to the rim, and the rim's corners") {
    constexpr double dx = 0.1, top = 0.4;
    for (const auto& [half_x, half_y] : {std::pair(0.5, 0.6), {0.52, 0.6}, {0.16, 0.64}, {0.513, 0.613}})
        for (const double worn : {0.05, 0.1, 0.2}) {
            const app::Recipe recipe = app::parse_recipe(
                fmt::format(
                    "[domain]\nextent = [2.4, 2.4]\ngrid_spacing = {0}\nboundary = \"reflective\"\n"
                    "[[layer]]\nmaterial = \"Si\"\n[[layer]]\nmaterial = \"Mask\"\nshape = \"mask\"\n"
                    "thickness = {1}\npolygons = [{{ points = [-{2}, -{3}, {2}, -{3}, {2}, {3}, -{2}, {3}] }}]\n"
                    "[[step]]\nmodel = \"directional\"\nduration = 1.0\n"
                    "directional = {{ Si = 0.0, Mask = -{4} }}\n",
                    dx, top, half_x, half_y, worn),
                "worn.toml");
            const test::Folder folder;
            const app::RunResult result = app::run_recipe(recipe, {.output = folder.path, .quiet = true});
            CAPTURE(half_x, half_y, worn);
            double sum = 0.0, largest = 0.0;
            int count = 0;
            for (const Vec3& p : result.surface.vertices) {
                if (p.z() < 0.5 * (top - worn)) continue;
                const double x = std::abs(p.x()) - half_x, y = std::abs(p.y()) - half_y,
                             z = p.z() - top + worn;
                const double above = std::max(0.0, z);
                double distance =
                    std::min(std::hypot(x, std::max(0.0, y), above), std::hypot(y, std::max(0.0, x), above));
                if (x >= 0.0 || y >= 0.0) distance = std::min(distance, std::abs(z));
                sum += distance, largest = std::max(largest, distance), ++count;
            }
            CHECK(sum / count < 0.0005);  // half a hundredth of a cell
            CHECK(largest < 0.35 * dx);
        }
}
