#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/process/simulation.hpp"
#include "app/process/wafer.hpp"
#include "app/results/metrology.hpp"
#include "levelset/meshes/extract.hpp"
#include "tests/integration/run_program.hpp"

// Closed voids and seams as figures.
using namespace sidewall;
using namespace sidewall::app;

namespace {

constexpr double kVoidSpacing = 0.05;

struct WaferWithVoids {
    Recipe recipe;
    levelset::MaterialStack stack;
    TriangleMesh surface;

    explicit WaferWithVoids(const std::string& text)
        : recipe(parse_recipe(text + "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n",
                              "voids.toml")),
          stack(initial_state(recipe).stack),
          surface(levelset::extract_surface(stack.top(), stack.domain)) {}
    double operator()(const std::string& name) const {
        return measure_named(recipe, name, stack, surface).value;
    }
};

std::string domain_of_voids(const std::string& extent, const std::string& boundary) {
    return fmt::format(
        "[domain]\nextent = {}\ngrid_spacing = {}\nboundary = {}\n[[layer]]\nmaterial = \"Si\"\n", extent,
        kVoidSpacing, boundary);
}

Json metrology_of(const std::string& text) {
    const test::Folder folder;
    return run_recipe(parse_recipe(text, "voids.toml"), {.output = folder.path, .quiet = true})
        .summary["metrology"];
}

// A trench 1 wide and 2 deep with walls on nodes.
std::string filled_trench(double spacing, const std::string& step) {
    return fmt::format(
               "[domain]\nextent = [4.0]\ngrid_spacing = {}\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\n"
               "width = 1.0\ndepth = 2.0\n[metrology]\nmeasures = [\"depth\", \"cd_at_0.6\", \"seam_depth\", "
               "\"voids\"]\n[[step]]\n",
               spacing) +
           step;
}

}  // namespace

TEST_CASE("a void has its number, volume, top and width, with its mirror image at mirrored sides") {
    // A tube of radius 0.3 along y about z = -1. Its chords cut off up to dx^2 / (8 r), a tenth of a cell
    // with its rounding; its volume, 0.6 % too small within its chords, is that of the front.
    const double r = 0.3, tube = std::numbers::pi * r * r, line = 0.1 * kVoidSpacing, area = 5e-4 * tube;
    for (const auto& [boundary, x, share] : {std::tuple{"reflective", 0.3, 1.0},
                                             {"reflective", 2.0, 0.5},
                                             {"reflective", -2.0, 0.5},
                                             {"periodic", 0.0, 1.0},
                                             {"periodic", 2.0, 1.0}}) {
        const WaferWithVoids wafer(
            domain_of_voids("[4.0]", fmt::format("\"{}\"", boundary)) +
            fmt::format(
                "[[layer]]\nsubtract = true\nshape = \"cylinder\"\nradius = 0.3\nposition = [{}, 0.0]\nz = -1.0\n",
                x));
        INFO(boundary << " at " << x);
        CHECK(wafer("voids") == 1.0);
        CHECK(wafer("void_volume") == Approx(share * tube).margin(area));
        CHECK(wafer("void_volume_whole") == Approx(tube).margin(area));
        CHECK(wafer("void_top") == Approx(1.0 - r).margin(line));
        CHECK(wafer("void_width") == Approx(2.0 * r).margin(2.0 * line));
        // A closed void counts neither for the depth nor for openings.
        CHECK(wafer("depth") == Approx(0.0).margin(2e-3 * kVoidSpacing));
        CHECK(std::isnan(wafer("cd_at_1")));
    }
    const WaferWithVoids none(domain_of_voids("[4.0]", "\"reflective\""));
    CHECK(none("voids") == 0.0);
    CHECK(none("void_volume") == 0.0);
    CHECK(std::isnan(none("void_top")));
}

TEST_CASE("of a ball in the corner of two mirrored sides a quarter is in the domain") {
    const double r = 0.4, ball = 4.0 / 3.0 * std::numbers::pi * std::pow(r, 3), line = 0.1 * kVoidSpacing,
                 volume = 1e-3 * ball;
    const auto wafer = [](const std::string& boundary, double x, double y) {
        return WaferWithVoids(
            domain_of_voids("[2.0, 2.0]", boundary) +
            fmt::format(
                "[[layer]]\nsubtract = true\nshape = \"sphere\"\nradius = 0.4\nposition = [{}, {}]\nz = -0.6\n",
                x, y));
    };
    const WaferWithVoids corner = wafer("\"reflective\"", 1.0, -1.0);
    CHECK(corner("voids") == 1.0);
    CHECK(corner("void_volume") == Approx(0.25 * ball).margin(0.25 * volume));
    CHECK(corner("void_volume_whole") == Approx(ball).margin(volume));
    CHECK(corner("void_width") == Approx(2.0 * r).margin(2.0 * line));
    const WaferWithVoids mixed = wafer("[\"reflective\", \"periodic\"]", 1.0, 1.0);
    CHECK(mixed("voids") == 1.0);
    CHECK(mixed("void_volume") == Approx(0.5 * ball).margin(0.5 * volume));
    CHECK(mixed("void_volume_whole") == Approx(ball).margin(volume));
}

TEST_CASE("a trench that an even film has filled keeps no slit, and its seam ends at the cusp") {
    const auto cusp = [](double film) { return std::sqrt(film * film - 0.25); };
    // Just above the trench the cusp is known to a tenth of a cell, farther up to half of one.
    for (const double spacing : {0.1, 0.05})
        for (const double film : {0.55, 0.7})
            for (const char* step :
                 {"model = \"conformal\"\nmaterial = \"SiO2\"\nthickness = {}\n",
                  "model = \"isotropic\"\nrate = 1.0\ndeposit = \"SiO2\"\nduration = {}\n"}) {
                const Json found =
                    metrology_of(filled_trench(spacing, fmt::format(fmt::runtime(step), film)));
                INFO(step << film << " at " << spacing << ": " << found);
                const double near = (film < 0.6 ? 0.1 : 0.5) * spacing;
                CHECK(found["depth"].get<double>() == Approx(-cusp(film)).margin(near));
                CHECK(found["seam_depth"] == found["depth"]);
                CHECK(found["cd_at_0.6"].is_null());
                CHECK(found["voids"] == 0.0);
            }
    // A film of exactly half the width.
    const Json half =
        metrology_of(filled_trench(0.1, "model = \"conformal\"\nmaterial = \"SiO2\"\nthickness = 0.5\n"));
    CHECK(half["depth"].get<double>() == Approx(0.0).margin(0.01));
    CHECK(half["cd_at_0.6"].is_null());
    for (const double film : {0.3, 0.4}) {
        const Json open = metrology_of(filled_trench(
            0.1, fmt::format("model = \"conformal\"\nmaterial = \"SiO2\"\nthickness = {}\n", film)));
        CHECK(open["seam_depth"].is_null());
        CHECK(open["cd_at_0.6"].get<double>() == Approx(1.0 - 2.0 * film).margin(0.01 * 0.1));
    }
}

TEST_CASE("films and seams are measured as without the voids buried below them") {
    // A trench 1 wide and 1.5 deep, or a flat wafer, and a tube under its floor, or beside it: wider than it
    // and halfway down. A conformal film also lines the tube; an isotropic one fills the trench alone.
    const auto found = [](bool flat, const std::string& tube, bool fills) {
        return metrology_of(
            "[domain]\nextent = [6.0]\ngrid_spacing = 0.1\n[metrology]\nmeasures = [\"film\", "
            "\"seam_depth\", \"voids\"]\n[[layer]]\nmaterial = \"Si\"\n" +
            std::string(flat ? "" : "shape = \"trench\"\nwidth = 1.0\ndepth = 1.5\n") +
            (tube.empty() ? "" : "[[layer]]\nshape = \"cylinder\"\nsubtract = true\naxis = \"y\"\n" + tube) +
            (fills ? "[[step]]\nmodel = \"isotropic\"\nrate = 0.55\nduration = 1.0\ndeposit = \"SiO2\"\n"
                   : "[[step]]\nmodel = \"conformal\"\nmaterial = \"SiO2\"\nthickness = 0.2\n"));
    };
    for (const bool flat : {false, true})
        for (const bool fills : {false, true}) {
            const Json whole = found(flat, "", fills);
            INFO(flat << ' ' << fills);
            CHECK(whole["film_bottom"].get<double>() > (fills ? 0.54 : 0.19));
            CHECK(whole["film_side"].is_null() == (flat || fills));
            CHECK(whole["seam_depth"].is_null() == (flat || !fills));
            for (const char* tube :
                 {"radius = 0.4\nz = -2.5\n", "radius = 0.6\nz = -0.9\nposition = [1.7, 0.0]\n"}) {
                const Json buried = found(flat, tube, fills);
                CHECK(buried["voids"] == 1.0);
                for (const char* name : {"film_top", "film_side", "film_bottom", "seam_depth"}) {
                    INFO(tube << name << ": " << whole[name] << ", " << buried[name]);
                    CHECK(buried[name].is_null() == whole[name].is_null());
                    // Next to a void a front moves less evenly, so that its cusp is a cell higher.
                    const double near = fills ? 0.12 : 1e-3;
                    if (whole[name].is_number() && buried[name].is_number())
                        CHECK(buried[name].get<double>() == Approx(whole[name].get<double>()).margin(near));
                }
            }
        }
}

TEST_CASE("a step ends when a void has closed") {
    const test::Folder folder;
    const Json summary =
        run_recipe(load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/pinch_off.toml",
                               {"step[0].stop=voids > 0",
                                "metrology.measures=[\"voids\", \"seam_depth\", \"depth\"]"}),
                   {.output = folder.path, .quiet = true})
            .summary;
    const Json found = summary["metrology"];
    CHECK(summary["steps"][0]["stopped_by"] == "stop");
    CHECK(found["voids"] == 1.0);
    CHECK(found["void_volume"].get<double>() > 0.1);
    CHECK(found["void_volume_whole"] >= found["void_volume"]);
    // The walls have met above it, and nothing below is open.
    CHECK(found["seam_depth"].get<double>() < found["void_top"].get<double>());
    CHECK(found["depth"] == found["seam_depth"]);
}
