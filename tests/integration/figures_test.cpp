#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "app/process/simulation.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/results/cut_profile.hpp"
#include "app/results/figure_values.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"
#include "tests/integration/run_program.hpp"

// Figures by name on wafers whose measures are known, and steps that end at them.
using namespace sidewall;
using namespace sidewall::app;

namespace {

const std::string kProfileDomain =
    "[domain]\nextent = [4.0]\ngrid_spacing = 0.05\n[simplify]\nmethod = \"none\"\n";
const std::string kSilicon = "[[layer]]\nmaterial = \"Si\"\n";
const std::string kIsotropicStep = "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n";

struct Wafer {
    Recipe recipe;
    levelset::MaterialStack stack;
    TriangleMesh surface;

    explicit Wafer(const std::string& text)
        : recipe(parse_recipe(text, "figures.toml")),
          stack(initial_state(recipe).stack),
          surface(levelset::extract_surface(stack.top(), stack.domain)) {}
    double operator()(const std::string& name) const {
        return measure_named(recipe, name, stack, surface).value;
    }
};

Json run_profile(const std::string& text) {
    const test::Folder folder;
    return run_recipe(parse_recipe(text, "figures.toml"), {.output = folder.path, .quiet = true}).summary;
}

std::string figures_refusal(const std::string& text) {
    try {
        parse_recipe(text, "figures.toml");
    } catch (const RecipeError& error) {
        return error.what();
    }
    return "accepted";
}

// Tolerance of plane faces, a thousandth of a cell each; corners are off by a larger part of a cell.
constexpr double kFace = 2.0 * (1e-3 + 1e-9) * 0.05;

}  // namespace

TEST_CASE("widths, thicknesses and volumes of a line and of a lined trench are those they were made with") {
    const Wafer line(kProfileDomain + kSilicon +
                     "[[layer]]\nmaterial = \"SiO2\"\nshape = \"fin\"\nwidth = 0.6\nheight = 0.5\n" +
                     kIsotropicStep);
    CHECK(line("cd_SiO2_at_-0.25") == Approx(0.6).margin(kFace));
    CHECK(std::isnan(line("cd_SiO2_at_0.25")));
    CHECK(std::isnan(line("cd_Si_at_0.25")));  // silicon fills this height
    CHECK(line("thickness_SiO2_at_0.1") == Approx(0.5).margin(kFace));
    CHECK(line("thickness_SiO2_at_1") == Approx(0.0).margin(kFace));
    CHECK(line("volume_SiO2") == Approx(0.6 * 0.5).margin(4.0 * 0.05 * 0.05));
    CHECK(line("cd_at_-0.25") == Approx(4.0 - 0.6).margin(kFace));  // over the mirrored sides

    const Wafer lined(
        kProfileDomain +
        "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.2\ndepth = 1.0\n"
        "[[layer]]\nmaterial = \"W\"\nshape = \"trench\"\nthickness = 0.2\nwidth = 0.7\ndepth = 0.9\n" +
        kIsotropicStep);
    CHECK(lined("wall_W_at_0.4") == Approx(0.25).margin(kFace));
    CHECK(lined("wall_Si_at_0.4") == Approx(0.0).margin(kFace));
    CHECK(lined("thickness_W_at_0") == Approx(0.3).margin(kFace));
    CHECK(lined("thickness_W_at_1.5") == Approx(0.2).margin(kFace));
    CHECK(lined("cd_W_at_0.4") == Approx(0.25).margin(kFace));
    CHECK(lined("cd_at_0.4") == Approx(0.7).margin(kFace));
    CHECK(lined("volume_W") == Approx(4.0 * 0.2 + 1.2 * 1.0 - 0.7 * 0.9).margin(8.0 * 0.05 * 0.05));
}

TEST_CASE("walls and openings that cross a periodic side are measured as any others") {
    // A line with its lining, in the middle and across the side, where half of it lies at either end.
    const auto wafer = [](double x) {
        return Wafer(
            fmt::format(
                "[domain]\nextent = [4.0]\ngrid_spacing = 0.05\nboundary = \"periodic\"\n"
                "[simplify]\nmethod = \"none\"\n[[layer]]\nmaterial = \"Si\"\n[[layer]]\n"
                "material = \"W\"\nshape = \"fin\"\nwidth = 0.6\nheight = 0.5\nposition = [{0}, 0.0]\n"
                "[[layer]]\nmaterial = \"SiO2\"\nshape = \"fin\"\nwidth = 1.0\nheight = 0.8\n"
                "top = 0.0\nposition = [{0}, 0.0]\n",
                x) +
            kIsotropicStep);
    };
    const double near = 1.01 * kFace;  // faces on nodes are that far off them, but for rounding
    for (const double x : {0.0, 1.9, 2.0}) {
        const Wafer line = wafer(x);
        INFO("at " << x);
        CHECK(line("cd_W_at_-0.25") == Approx(0.6).margin(near));
        CHECK(line("wall_SiO2_at_-0.25") == Approx(0.2).margin(near));
        CHECK(line("cd_at_-0.25") == Approx(3.0).margin(near));
    }
}

TEST_CASE("a film in a trench over a side is measured as one in the middle") {
    // A film of 0.2 on top, 0.25 on the walls and 0.3 on the floor of a trench 1.2 wide and 1 deep.
    const auto wafer = [](const std::string& boundary, double x) {
        return Wafer(
            fmt::format("[domain]\nextent = [4.0]\ngrid_spacing = 0.05\nboundary = \"{0}\"\n"
                        "[simplify]\nmethod = \"none\"\n"
                        "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.2\ndepth = 1.0\n"
                        "position = [{1}, 0.0]\n[[layer]]\nmaterial = \"W\"\nshape = \"trench\"\n"
                        "thickness = 0.2\nwidth = 0.7\ndepth = 0.9\nposition = [{1}, 0.0]\n",
                        boundary, x) +
            kIsotropicStep);
    };
    const double near = 1.01 * kFace;
    for (const auto& [boundary, x] : {std::pair("periodic", 0.0),
                                      {"periodic", 1.7},
                                      {"periodic", 2.0},
                                      {"periodic", -1.8},
                                      {"reflective", 0.0},
                                      {"reflective", 2.0},
                                      {"reflective", -2.0}}) {
        const Wafer film = wafer(boundary, x);
        INFO(boundary << " at " << x);
        CHECK(film("film_top") == Approx(0.2).margin(near));
        CHECK(film("film_side") == Approx(0.25).margin(near));
        CHECK(film("film_bottom") == Approx(0.3).margin(near));
        CHECK(film("step_coverage_side") == Approx(1.25).margin(near / 0.2 * 2.25));
        CHECK(film("step_coverage_bottom") == Approx(1.5).margin(near / 0.2 * 2.5));
    }
}

TEST_CASE("a mirrored wafer, and one in nm, has the same figures") {
    // A film of 0.3 on a trench inside of the domain and a narrower half one at a side, which it fills.
    const auto figures = [](double mirror, double unit) {
        const auto at = [&](double length) { return fmt::format("{:.9g}", length * unit); };
        const auto trench = [&](double width, double depth, double x) {
            return "[[layer]]\nsubtract = true\nshape = \"trench\"\nwidth = " + at(width) +
                   "\ndepth = " + at(depth) + "\nposition = [" + at(mirror * x) + ", 0.0]\n";
        };
        Json found =
            run_profile("[domain]\nextent = [" + at(3.0) + "]\ngrid_spacing = " + at(0.1) +
                        "\nlength_unit = " + (unit == 1.0 ? "\"um\"\n" : "\"nm\"\n") + kSilicon +
                        trench(0.83, 1.3, -0.57) + trench(0.5, 0.9, 1.5) +
                        "[metrology]\nmeasures = [\"film\", \"depth\", \"sidewall_angle\", \"bow\"]\n"
                        "[[step]]\nmodel = \"conformal\"\nmaterial = \"W\"\nthickness = " +
                        at(0.3) + "\n")["metrology"];
        for (const char* name : {"film_top", "film_side", "film_bottom", "depth", "bow"})
            if (found[name].is_number()) found[name] = found[name].get<double>() / unit;
        return found;
    };
    const Json one = figures(1.0, 1.0);
    CHECK(one["film_top"].get<double>() == Approx(0.3).margin(1.01 * 2.0 * kFace));
    CHECK(one["film_side"].get<double>() == Approx(0.3).margin(0.02 * 0.1));
    for (const auto& [mirror, unit] : {std::pair(-1.0, 1.0), {1.0, 1000.0}}) {
        const Json other = figures(mirror, unit);
        INFO(one << " and " << other);
        for (const char* name : {"film_top", "film_side", "film_bottom", "depth", "sidewall_angle", "bow"}) {
            REQUIRE(other[name].is_number() == one[name].is_number());
            if (one[name].is_number())
                CHECK(other[name].get<double>() ==
                      Approx(one[name].get<double>()).margin(0.002 * 0.1).epsilon(1e-5));
        }
    }
}

TEST_CASE("widths are those of bodies that reach no side, not of the gas between them") {
    // A closed square, and the lines at the ends of what spans the domain.
    Profile square{.lines = {{.points = {{-0.4, 0, -2}, {0.4, 0, -2}, {0.4, 0, 0.3}, {-0.4, 0, 0.3}},
                              .triangles = {},
                              .closed = true}},
                   .along = Vec3::UnitX(),
                   .mirrors = {-1.0, 1.0},
                   .shifts = {}};
    const Stretches solid = solid_at(square, -1.0);
    REQUIRE(solid.size() == 3);  // with its images
    CHECK(solid[1] == std::pair(-0.4, 0.4));
    CHECK(widest_opening(square, -1.0).second - widest_opening(square, -1.0).first == Approx(1.2));
    CHECK(solid_below(square, 0.0) == Stretches{{-2.0, 0.3}});
}

TEST_CASE("an even film has its thickness on the wall, too, where its floor reaches halfway up the trench") {
    for (const double dx : {0.1, 0.05})
        for (const double depth : {1.0, 0.97})
            for (const double cells : {-0.2, -0.1, -0.02, 0.0, 0.02, 0.1, 0.9}) {
                const double film = 0.5 * depth + cells * dx;
                const Json found = run_profile(fmt::format(
                    "[domain]\nextent = [5.0]\ngrid_spacing = {}\n[[layer]]\nmaterial = \"Si\"\n"
                    "shape = \"trench\"\nwidth = 3.0\ndepth = {}\n[[step]]\nmodel = \"conformal\"\n"
                    "material = \"W\"\nthickness = {}\n[metrology]\nmeasures = [\"film\"]\n",
                    dx, depth, film))["metrology"];
                INFO(dx << ", " << depth << " deep, " << cells << " cells over half: " << found);
                for (const char* name : {"film_top", "film_side", "film_bottom"}) {
                    REQUIRE(found[name].is_number());
                    CHECK(found[name].get<double>() == Approx(film).margin(0.01 * dx));
                }
                CHECK(found["step_coverage_side"].get<double>() == Approx(1.0).margin(0.02 * dx / film));
            }
}

TEST_CASE("a film halfway down at the ceiling of a cavity is no film on a wall") {
    // A film of 0.1 everywhere; a cavity as wide as the domain begins below the trench's upper half.
    const auto film = [](double ceiling) {
        return run_profile(
            kProfileDomain + kSilicon +
            fmt::format("[[layer]]\nshape = \"trench\"\nsubtract = true\nwidth = 1.2\ndepth = 1.0\n"
                        "[[layer]]\nshape = \"gap\"\nsubtract = true\nz = {}\nheight = {}\nlength = 3.0\n",
                        0.5 * (ceiling - 1.0), ceiling + 1.0) +
            "[[step]]\nmodel = \"conformal\"\nmaterial = \"W\"\nthickness = 0.1\n"
            "[metrology]\nmeasures = [\"film\"]\n")["metrology"];
    };
    const Json at = film(-0.5), below = film(-0.7);
    CHECK(at["film_side"].is_null());
    CHECK(below["film_side"].get<double>() == Approx(0.1).margin(0.01 * 0.05));
    for (const Json& found : {at, below}) {
        CHECK(found["film_top"].get<double>() == Approx(0.1).margin(0.01 * 0.05));
        CHECK(found["film_bottom"].get<double>() == Approx(0.1).margin(0.01 * 0.05));
    }
}

TEST_CASE("an even film is as thick on a floor that is deeper in one of its corners") {
    const test::Folder folder;
    std::ofstream(folder.path / "floor.csv")
        << "-2, 0\n-0.6, 0\n-0.6, -1\n0.4, -1\n0.6, -1.0095\n0.6, 0\n2, 0\n";
    std::ofstream(folder.path / "floor.toml")
        << kProfileDomain + "[[layer]]\nmaterial = \"Si\"\nshape = \"profile\"\nfile = \"floor.csv\"\n" +
               "[[step]]\nmodel = \"conformal\"\nmaterial = \"W\"\nthickness = 0.1\n" +
               "[metrology]\nmeasures = [\"film\"]\n";
    const Json found = run_recipe(load_recipe((folder.path / "floor.toml").string()),
                                  {.output = folder.path / "run", .quiet = true})
                           .summary["metrology"];
    CHECK(found["film_bottom"].get<double>() == Approx(0.1).margin(0.02 * 0.05));
    CHECK(found["step_coverage_bottom"].get<double>() == Approx(1.0).margin(0.02));
}

TEST_CASE("rounding of a flat base does not choose where the film on it is measured") {
    // A film 0.5 thick with a hump. Its base is lowest anywhere, by rounding or by the shift of faces on
    // nodes of a coarser level. The top is measured where the profile begins, the floor in its middle.
    const double dx = 0.1;
    for (const double ripple : {1e-15, 1e-12, 8e-3 * dx})
        for (int lowest = 0; lowest <= 64; lowest += 4) {
            Profile base{.lines = {surface::Polyline()}, .along = Vec3::UnitX(), .mirrors = {}, .shifts = {}},
                surface = base;
            for (int i = 0; i <= 64; ++i) {
                const double x = -3.2 + dx * i;
                base.lines[0].points.emplace_back(x, 0.0, i == lowest || i == lowest + 1 ? -ripple : 0.0);
                surface.lines[0].points.emplace_back(x, 0.0, 0.5 + 0.3 * std::exp(-std::pow(x - 0.3, 2)));
            }
            const Film film = film_between(surface, base, dx);
            INFO(ripple << " at " << lowest);
            CHECK(film.top == Approx(surface.lines[0].points[0].z()).margin(1.01 * ripple));
            CHECK(film.bottom == Approx(0.5 + 0.3 * std::exp(-0.09)).margin(1.01 * ripple));
            CHECK(std::isnan(film.side));
            CHECK_FALSE(film.filled);
        }
}

TEST_CASE("a film beside a bump is measured at one place on grids of all levels") {
    for (const std::string levels : {"1", "2", "3"}) {
        const Json found = run_profile(
            "[domain]\nextent = [12.8, 12.8]\ngrid_spacing = 0.2\n[grid]\nlevels = " + levels +
            "\n[[layer]]\nmaterial = \"Si\"\nshape = \"box\"\nsize = [0.6, 0.6]\nheight = 0.4\n"
            "position = [1.1, 0.4]\n[[step]]\nmodel = \"isotropic\"\nduration = 2.0\nrate = 0.5\n"
            "deposit = \"SiO2\"\n[[step]]\nmodel = \"isotropic\"\nduration = 1.0\n"
            "rate = { SiO2 = -0.5 }\n[metrology]\ncut = \"y=0\"\n"
            "measures = [\"film\", \"thickness_SiO2_at_-6.3\", \"thickness_SiO2_at_0\"]\n")["metrology"];
        INFO(levels << " levels: " << found);
        // Corners of the surface and of its base lie on verticals of the grid: the same to a float's
        // rounding.
        CHECK(found["film_top"].get<double>() ==
              Approx(found["thickness_SiO2_at_-6.3"].get<double>()).margin(1e-6));
        CHECK(found["film_bottom"].get<double>() ==
              Approx(found["thickness_SiO2_at_0"].get<double>()).margin(1e-6));
        CHECK(found["film_side"].is_null());
    }
}

TEST_CASE("a stop at a figure that cannot be is refused, or told when its step has ended", "[foreign]") {
    const auto with = [](const std::string& stop) {
        return kProfileDomain + kSilicon + kIsotropicStep + "stop = \"" + stop + "\"\n";
    };
    CHECK(figures_refusal(with("thickness_SiO2_at_0 < 0.1")).find("step[0].stop") != std::string::npos);
    CHECK(figures_refusal(with("thickness_SiO2_at_0 < 0.1"))
              .find("there is no SiO2 on the wafer in this step") != std::string::npos);
    CHECK(figures_refusal(with("volume_W > 1")).find("name another material") != std::string::npos);
    CHECK(figures_refusal(with("thickness_Si_at_0 < 1")).find("has no end below") != std::string::npos);
    CHECK(figures_refusal(with("thickness_Si_at_2.5 < 1")).find("outside the domain") != std::string::npos);
    CHECK(figures_refusal(with("volume_Si < 1")) == "accepted");
    // A film of an earlier step is on the wafer until it is stripped.
    const std::string film = "[[step]]\nmodel = \"conformal\"\nmaterial = \"SiO2\"\nthickness = 0.3\n",
                      strip = "[[step]]\nmodel = \"strip\"\nmaterial = \"SiO2\"\n",
                      stop = kIsotropicStep + "stop = \"thickness_SiO2_at_0 < 0.1\"\n";
    CHECK(figures_refusal(kProfileDomain + kSilicon + film + stop) == "accepted");
    CHECK(figures_refusal(kProfileDomain + kSilicon + film + strip + stop).find("no SiO2") !=
          std::string::npos);

    // A flat wafer has no opening.
    const test::Folder folder;
    std::ofstream(folder.path / "flat.toml") << with("cd_at_0.05 > 1.0");
    const auto quiet = test::run_program(folder.path, "run flat.toml -o quiet --quiet");
    CHECK(quiet.exit_code == 0);
    CHECK(quiet.output.empty());
    const auto ran = test::run_program(folder.path, "run flat.toml -o run");
    INFO(ran.output);
    CHECK(ran.exit_code == 0);
    CHECK(ran.output.find(
              "step 1 (1 isotropic): ended by its duration: it was to stop at cd_at_0.05, which the wafer "
              "does not have") != std::string::npos);
}

TEST_CASE("a folder is measured without the files that its recipe names", "[foreign]") {
    const test::Folder folder;
    std::ofstream(folder.path / "bump.csv") << "-0.5, 0\n-0.5, 0.4\n0.5, 0.4\n0.5, 0\n-0.5, 0\n";
    std::ofstream(folder.path / "bump.toml")
        << kProfileDomain + kSilicon +
               "[[layer]]\nmaterial = \"W\"\nshape = \"profile\"\nfile = \"bump.csv\"\n" +
               "[[step]]\nmodel = \"planarize\"\nheight = 2.0\n";
    REQUIRE(test::run_program(folder.path, "run bump.toml -o run --quiet").exit_code == 0);
    std::filesystem::remove(folder.path / "bump.csv");
    std::filesystem::rename(folder.path / "run", folder.path / "moved");
    const auto measured = test::run_program(folder.path, "inspect moved --measure cd_W_at_-0.2 --json -");
    INFO(measured.output);
    REQUIRE(measured.exit_code == 0);
    CHECK(Json::parse(measured.output)["measures"]["cd_W_at_-0.2"]["value"].get<double>() ==
          Approx(1.0).margin(kFace));
}

TEST_CASE("a layer's recess is how far it stands back behind its neighbours") {
    const Wafer wafer(
        kProfileDomain + kSilicon +
        "[[layer]]\nshape = \"stack\"\nmaterials = [\"SiGe\", \"Si\"]\nthicknesses = [0.4, 0.4]\n"
        "repeat = 1\n"
        "[[layer]]\nsubtract = true\nshape = \"trench\"\nwidth = 1.0\ndepth = 1.0\ntop = 0.8\n"
        "[[layer]]\nsubtract = true\nshape = \"gap\"\nz = 0.2\nheight = 0.4\nlength = 1.5\n" +
        kIsotropicStep);
    CHECK(wafer("recess_SiGe") == Approx(0.25).margin(0.1 * 0.05));  // the end of the recess is rounded
    // Within a cell of a corner the boundary of two materials is slanted, and either may be at the wall.
    CHECK(wafer("recess_Si") == Approx(0.0).margin(0.05));
    CHECK(std::isnan(wafer("recess_W")));

    // A mask that is not etched has no recess, however narrow the pit's floor is at first.
    const Json pit = run_profile(
        kProfileDomain +
        "[metrology]\nmeasures = [\"recess_Mask\", \"wall_Mask_at_-0.2\", \"cd_at_-0.2\"]\n" + kSilicon +
        "[[layer]]\nmaterial = \"Mask\"\nshape = \"trench\"\nthickness = 0.4\nwidth = 1.0\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = 0.5\nrate = { Si = -1.0 }\n")["metrology"];
    CHECK(pit["recess_Mask"].get<double>() == Approx(0.0).margin(0.5 * 0.05));
    // The mask's wall reaches from its opening to the next one in the mirrored wafer.
    CHECK(pit["cd_at_-0.2"].get<double>() == Approx(1.0).margin(0.1 * 0.05));
    CHECK(pit["wall_Mask_at_-0.2"].get<double>() == Approx(3.0).margin(0.1 * 0.05));
}

TEST_CASE("roughness is three standard deviations of edges and width") {
    // Edges that follow a wave of this amplitude along y, in phase or against each other.
    constexpr double kAmplitude = 0.1, kLength = 2.0;
    const auto wafer = [&](double phase) {
        std::string points;
        constexpr int kPoints = 80;
        const auto add = [&](double x, double y) {
            points += fmt::format("{}{:.6f}, {:.6f}", points.empty() ? "" : ", ", x, y);
        };
        const auto wave = [](double y) {
            return kAmplitude * std::sin(2.0 * std::numbers::pi * y / kLength);
        };
        for (int k = 0; k <= kPoints; ++k) {
            const double y = kLength * (static_cast<double>(k) / kPoints - 0.5);
            add(0.4 + wave(y), y);
        }
        for (int k = kPoints; k >= 0; --k) {
            const double y = kLength * (static_cast<double>(k) / kPoints - 0.5);
            add(-0.4 + phase * wave(y), y);
        }
        return Wafer(
            "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.05\nboundary = \"periodic\"\n" + kSilicon +
            "[[layer]]\nmaterial = \"Resist\"\nshape = \"mask\"\nthickness = 0.4\npolygons = [{ points = [" +
            points + "] }]\n" + kIsotropicStep);
    };
    // Over 40 rows of whole waves the sample's variance is a^2/2 * 40/39; edges follow the outline to 2 % of
    // a cell.
    const double edge = 3.0 * kAmplitude * std::sqrt(0.5 * 40.0 / 39.0), slack = 3.0 * 0.02 * 0.05;
    const Wafer together = wafer(1.0), against = wafer(-1.0);
    CHECK(together("ler_at_-0.2") == Approx(edge).margin(slack));
    CHECK(together("lwr_at_-0.2") == Approx(0.0).margin(slack));
    CHECK(against("ler_at_-0.2") == Approx(edge).margin(slack));
    CHECK(against("lwr_at_-0.2") == Approx(2.0 * edge).margin(2.0 * slack));

    // Edges of one opening are not mixed with those of its mirror image or of an equal opening.
    const Wafer straight(
        "[domain]\nextent = [4.0, 2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 0.8\n"
        "depth = 1.0\nposition = [-1.0, 0.0]\n[[layer]]\nsubtract = true\nshape = \"trench\"\nwidth = 0.8\ndepth = 1.0\n"
        "position = [1.0, 0.0]\n" +
        kIsotropicStep);
    CHECK(straight("ler_at_0.5") == Approx(0.0).margin(1e-3 * 0.1));
}

TEST_CASE("a step ends where a figure passes a value, within a twentieth of a cell of the front's way") {
    const std::string wafer = kProfileDomain + kSilicon + "[[layer]]\nmaterial = \"SiO2\"\nthickness = 0.5\n";
    const std::string etch = "[[step]]\nmodel = \"isotropic\"\nduration = 9.0\nrate = -0.1\n";
    const Json depth = run_profile(wafer + etch + "stop = \"depth > 0.123\"\n");
    CHECK(depth["metrology"]["depth"].get<double>() == Approx(0.123).margin(0.05 * 0.05));
    CHECK(depth["steps"][0]["stopped_by"] == "stop");
    const Json same = run_profile(wafer + etch + "stop_depth = 0.123\n");
    CHECK(depth["time"] == same["time"]);
    const Json volume = run_profile(wafer + etch + "stop = \"volume_SiO2 <= 0.8\"\n");  // from 2.0
    CHECK(volume["time"].get<double>() == Approx(3.0).margin(0.05 * 0.05 / 0.1));
    const Json film =
        run_profile(wafer +
                    "[[step]]\nmodel = \"isotropic\"\nduration = 9.0\nrate = 0.1\ndeposit = \"W\"\n"
                    "stop = \"thickness_W_at_0.5>0.321\"\n");
    CHECK(film["time"].get<double>() == Approx(3.21).margin(0.05 * 0.05 / 0.1));
    const Json width = run_profile(
        kProfileDomain + "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.0\ndepth = 1.0\n" +
        etch + "stop = \"cd_at_0.5 > 1.3\"\n");
    CHECK(width["time"].get<double>() == Approx(1.5).margin(0.05 * 0.05 / 0.1 + 0.02));
    // A figure that does not exist, or is not reached, leaves the whole duration.
    CHECK(run_profile(
              wafer +
              "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\nstop = \"cd_at_0.5 > 9\"\n")
              ["time"] == 1.0);
}

TEST_CASE("bad figures and conditions are refused with the nearest name", "[foreign]") {
    const std::string wafer = kProfileDomain + kSilicon;
    const auto stop = [&](const std::string& text) {
        return figures_refusal(wafer + kIsotropicStep + "stop = \"" + text + "\"\n");
    };
    for (const auto& [text, advice] : std::vector<std::pair<std::string, std::string>>{
             {"dept > 2", "did you mean depth?"},
             {"cd_SiO3_at_0.5 > 2", "did you mean cd_SiO2_at_0.5?"},
             {"depth = 2", "> or <"},
             {"depth > two", "is no number"},
             {"depth >", "is no number"},
             {"depth > nan", "is no number"},
             {"film > 2", "several figures"},
             {"cd > 2", "e.g. cd_at_0.5"},
             {"mean_rate > 2", "when the run has ended"},
             {"thickness_Si_at_9 > 2", "outside the domain"},
             {"> 2", "see sidewall models metrology"}}) {
        const std::string message = stop(text);
        CAPTURE(text, message);
        CHECK(message.find("figures.toml:") == 0);
        CHECK(message.find("step[0].stop = ") != std::string::npos);
        CHECK(message.find(advice) != std::string::npos);
    }
    const auto measures = [&](const std::string& name) {
        return figures_refusal(wafer + kIsotropicStep + "[metrology]\nmeasures = [\"depth\", \"" + name +
                               "\"]\n");
    };
    CHECK(measures("recess_SiO2") == "accepted");
    CHECK(measures("volume_SiGe") == "accepted");
    CHECK(measures("depht").find("did you mean depth?") != std::string::npos);
    CHECK(measures("wall_W_at_x").find("metrology.measures[1] = ") != std::string::npos);
    // A place has one spelling, so that a table has one column for it.
    CHECK(measures("ler_at_0.50") != "accepted");
}

TEST_CASE("sweeps and fits may ask for figures by name") {
    Recipe recipe = parse_recipe(kProfileDomain + kSilicon + kIsotropicStep, "figures.toml");
    want_measure(recipe, "wall_SiO2_at_0.5", "--measure");
    want_measure(recipe, "cd_at_-0.5", "--measure");
    CHECK(recipe.metrology.measures == std::vector<std::string>{"depth", "wall_SiO2_at_0.5", "cd"});
    CHECK(recipe.metrology.cd_depths == std::vector<double>{-0.5});
    CHECK_THROWS_WITH(want_measure(recipe, "wal_SiO2_at_0.5", "--measure"),
                      Catch::Contains("did you mean wall_SiO2_at_0.5?"));
}
