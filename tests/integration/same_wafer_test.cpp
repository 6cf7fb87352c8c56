#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/integration/run_program.hpp"

// The same wafer at another place or in another unit.
namespace {

using namespace sidewall;
using nlohmann::json;

json figures(const test::Folder& folder, const std::string& recipe) {
    test::write_bytes(folder.path / "recipe.toml", recipe);
    const auto run = test::run_program(folder.path, "run recipe.toml -o out --quiet --overwrite", 120);
    INFO(recipe << run.output);
    REQUIRE(run.exit_code == 0);
    return json::parse(test::read_bytes(folder.path / "out/summary.json"))["metrology"];
}

}  // namespace

TEST_CASE("a wall on a mirror is none: a trench up to it has one wall and no sliver on the other side") {
    const test::Folder folder;
    const json half = figures(
        folder,
        "[domain]\nextent = [4.0]\ngrid_spacing = 0.1\nboundary = [\"reflective\", \"periodic\"]\n"
        "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.0\ndepth = 1.5\nposition = [1.5, 0.0]\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = 0.5\nrate = 0.4\ndeposit = \"SiO2\"\n"
        "[metrology]\nmeasures = [\"depth\"]\n[output]\nprofiles = [\"y=0\"]\n");
    // On the mirror there is only the bottom.
    const app::TextTable profile = app::read_text_table(folder.path / "out/profile_0000.csv");
    const std::size_t x = profile.column("x").value_or(0), z = profile.column("z").value_or(1);
    for (const auto& row : profile.rows)
        if (std::stod(row[x]) > 1.05) CHECK(std::stod(row[z]) == Approx(-1.5).margin(1e-3));
    // Width 4 and one wall of 1.5 under a film of 0.2, less the overlap in the corner, plus the edge's arc.
    const double area = 0.2 * (4.0 + 1.5) - 0.04 + 0.25 * M_PI * 0.04;
    CHECK(half["added_volume_SiO2"].get<double>() == Approx(area).epsilon(0.02));
}

TEST_CASE("a wafer that is shifted by whole cells in a periodic box has the same volumes") {
    const test::Folder folder;
    // The surface of every shape lies on nodes.
    const std::string shape =
        GENERATE(as<std::string>(), "shape = \"box\"\nsize = [0.6, 0.4]\nheight = 0.5\n",
                 "shape = \"fin\"\nwidth = 0.6\nheight = 0.5\n",
                 "shape = \"trench\"\nthickness = 0.5\nwidth = 0.6\ndepth = 0.5\n",
                 "shape = \"hole\"\nthickness = 0.5\nradius = 0.3\ndepth = 0.5\n");
    const auto at = [&](const std::string& position) {
        return figures(
            folder,
            "[domain]\nextent = [2.0, 2.0]\ngrid_spacing = 0.1\n"
            "boundary = [\"periodic\", \"periodic\"]\n[[layer]]\nmaterial = \"Si\"\n"
            "[[layer]]\nmaterial = \"SiO2\"\n" +
                shape + "position = " + position +
                "\n[[step]]\nmodel = \"conformal\"\nthickness = 0.2\nmaterial = \"SiO2\"\n"
                "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = { Si = -0.1, SiO2 = -0.3 }\n");
    };
    const json first = at("[0.0, 0.0]");
    for (const std::string position : {"[0.7, 0.8]", "[-0.3, 0.4]", "[0.2, -0.9]"}) {
        const json shifted = at(position);
        CAPTURE(shape, position);
        REQUIRE(shifted.size() == first.size());
        for (const auto& [name, value] : first.items()) {
            if (name.find("volume") == std::string::npos) continue;  // other figures are those of a section
            CAPTURE(name, value, shifted[name]);
            CHECK(std::abs(shifted[name].get<double>() - value.get<double>()) <=
                  1e-4 * 4.0);  // 1e-3 dx everywhere
        }
    }
}

TEST_CASE("walls beside a periodic side, on it and in the cell before it are those of the shifted wafer") {
    const std::string resist = "[[layer]]\nmaterial = \"Resist\"\nthickness = 0.3\n";
    const auto etch = [](const char* rate) {
        return std::string("[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = { Si = ") + rate +
               ", Resist = 0.0 }\n";
    };
    const auto beam = [](const char* rate) {
        return std::string("[[step]]\nmodel = \"directional\"\nduration = 1.0\ndirectional = { Si = ") +
               rate + ", Resist = 0.0 }\n";
    };
    const std::string film =
        "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = 0.058\ndeposit = \"SiO2\"\n";
    struct Case {
        std::string extent, layer, steps;
        double x;
        std::vector<double> by;
    };
    const Case wafer = GENERATE_COPY(values<Case>({
        // Undercuts, whose fronts reach the side; feet in the cell before it; a film's corners.
        {"2.0", resist + "shape = \"trench\"\nwidth = 0.4\n", etch("-0.1") + beam("-0.2"), -0.1, {-0.7, 0.8}},
        {"2.0", resist + "shape = \"trench\"\nwidth = 0.9\n", etch("-0.4") + beam("-0.4"), 0.2, {0.3, -1.0}},
        {"2.0",
         resist + "shape = \"trench\"\nwidth = 1.07\n",
         beam("-0.42") + etch("-0.096"),
         0.161,
         {0.3, 0.2}},
        {"1.6",
         "[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = 0.245\nwidth = 0.638\n",
         "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = { Si = -0.173, Resist = -0.061 }\n",
         0.26,
         {0.2}},
        {"2.0", "shape = \"trench\"\nwidth = 0.871\ndepth = 1.074\n", film, 0.081, {-0.7, 0.5}},
        {"2.0, 1.2", "shape = \"hole\"\nradius = 0.5\ndepth = 1.1\n", beam("-0.3"), 0.0, {-0.7, -0.6}},
        {"2.0, 1.2",
         "[[layer]]\nmaterial = \"Resist\"\nshape = \"box\"\nsize = [1.1, 0.8]\nheight = 0.3\n",
         etch("-0.5") + beam("-0.5"),
         0.2,
         {0.3, -0.7}},
    }));
    const test::Folder folder;
    const auto at = [&](double x) {
        return figures(folder,
                       "[domain]\nextent = [" + wafer.extent +
                           "]\ngrid_spacing = 0.1\nboundary = [\"periodic\", \"periodic\"]\n"
                           "[[layer]]\nmaterial = \"Si\"\n" +
                           wafer.layer + "position = [" + std::to_string(x) + ", 0.0]\n" + wafer.steps +
                           "[metrology]\nmeasures = [\"depth\", \"cd\", \"film\"]\ncd_depths = [0.05]\n");
    };
    const json first = at(wafer.x);
    const bool is_profile = wafer.extent.find(',') == std::string::npos;
    for (const double by : wafer.by) {
        const json shifted = at(wafer.x + by);
        for (const auto& [name, value] : first.items()) {
            const bool is_volume = name.find("volume") != std::string::npos;
            if ((!is_profile && !is_volume) || name == "mean_rate") continue;  // the section lies elsewhere
            CAPTURE(wafer.layer, wafer.steps, by, name, value, shifted[name]);
            REQUIRE(value.is_number() == shifted[name].is_number());
            if (value.is_number())
                CHECK(std::abs(shifted[name].get<double>() - value.get<double>()) <=
                      1e-4 * (is_volume ? 4.0 : 1.0));  // 1e-3 dx everywhere
        }
    }
}

TEST_CASE(
    "a symmetric wafer with walls and floors on nodes is its own mirror image, after films, etches and beams, too") {
    const test::Folder folder;
    const std::string wafer = GENERATE(
        as<std::string>(), "shape = \"trench\"\nwidth = 1.0\ndepth = 1.5\n",
        "shape = \"trench\"\nwidth = 1.2\ndepth = 0.9\n",
        "[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = 0.3\nwidth = 0.8\ndepth = 0.3\n",
        "[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = 0.3\nwidth = 0.4\ndepth = 0.3\n",
        "[[layer]]\nmaterial = \"Si\"\nshape = \"fin\"\nwidth = 0.8\nheight = 0.6\n");
    const std::string step =
        GENERATE(as<std::string>(), "model = \"isotropic\"\nduration = 1.0\nrate = 0.3\ndeposit = \"SiO2\"\n",
                 "model = \"isotropic\"\nduration = 1.0\nrate = { Si = -0.5 }\n",
                 "model = \"directional\"\nduration = 1.0\ndirectional = -0.4\n",
                 "model = \"directional\"\nduration = 1.0\ndirectional = -0.4\nisotropic = { Si = -0.15 }\n");
    figures(folder, "[domain]\nextent = [4.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n" + wafer +
                        "[[step]]\n" + step + "[output]\nprofiles = [\"y=0\"]\n");
    for (const char* name : {"out/profile_0000.csv", "out/profile_0001.csv"}) {
        const app::TextTable table = app::read_text_table(folder.path / name);
        std::vector<Eigen::Vector2d> line;
        for (const auto& row : table.rows)
            line.emplace_back(std::stod(row[table.column("x").value()]),
                              std::stod(row[table.column("z").value()]));
        double farthest = 0.0;  // distance of the mirrored points from the profile
        for (const Eigen::Vector2d& p : line) {
            const Eigen::Vector2d image(-p.x(), p.y());
            double nearest = std::numeric_limits<double>::infinity();
            for (std::size_t k = 0; k + 1 < line.size(); ++k) {
                const Eigen::Vector2d along = line[k + 1] - line[k];
                const double t = std::clamp(along.dot(image - line[k]) / along.squaredNorm(), 0.0, 1.0);
                nearest = std::min(nearest, (line[k] + t * along - image).norm());
            }
            farthest = std::max(farthest, nearest);
        }
        CAPTURE(wafer, step, name);
        CHECK(farthest <= 1e-4);  // 1e-3 dx
    }
}

TEST_CASE("a recipe in m or nm gives the figures of the same one in um", "[slow]") {
    const test::Folder folder;
    // One time step only: afterwards paths of particles differ by the rounding of positions.
    const std::string step = GENERATE(
        as<std::string>(), "model = \"isotropic\"\nduration = 1.0\n",
        "model = \"single_particle\"\nduration = 0.05\nsticking = 0.3\n[flux]\nmethod = \"monte-carlo\"\nrays = 20000\n[simplify]\nmethod = \"none\"\n");
    const double width = GENERATE(0.83, 0.8);  // off nodes and on them
    const auto figures_in = [&](double um, const std::string& unit) {
        const auto length = [&](double value) {
            char text[32];
            std::snprintf(text, sizeof text, "%.12g", value * um);
            return std::string(text);
        };
        return figures(folder, "[domain]\nextent = [" + length(2.0) + ", " + length(0.4) +
                                   "]\ngrid_spacing = " + length(0.1) + "\nlength_unit = \"" + unit +
                                   "\"\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\n"
                                   "width = " +
                                   length(width) + "\ndepth = " + length(width + 0.2) +
                                   "\n[[step]]\ndeposit = \"SiO2\"\n"
                                   "rate = " +
                                   length(0.15) + "\n" + step +
                                   "[metrology]\nmeasures = [\"depth\", \"film\"]\n");
    };
    const json expected = figures_in(1.0, "um");
    for (const auto& [um, unit] : {std::pair(1e-6, "m"), {1e3, "nm"}}) {
        const json found = figures_in(um, unit);
        for (const char* name : {"depth", "film_top", "film_side", "film_bottom"}) {
            CAPTURE(step, width, unit, name, expected[name], found[name]);
            CHECK(std::abs(found[name].get<double>() / um - expected[name].get<double>()) <=
                  1e-4);  // 1e-3 dx
        }
    }
}

TEST_CASE("walls, floors and films on nodes give the same figures in m and nm as in um") {
    const test::Folder folder;
    // Lengths in <> are written in each unit.
    const auto [wafer, steps] = GENERATE(table<std::string, std::string>({
        {"shape = \"trench\"\nwidth = <0.7>\ndepth = <0.4>\n",
         "model = \"directional\"\nduration = 1.0\ndirectional = { Si = <-0.4> }\n"
         "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = <0.1>\ndeposit = \"SiO2\"\n"},
        {"shape = \"trench\"\nwidth = <1.1>\ndepth = <1.1>\n",
         "model = \"isotropic\"\nduration = 1.0\nrate = { Si = <-0.5> }\n"},
        {"[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = <0.3>\nwidth = <0.9>\ndepth = <0.3>\n",
         "model = \"isotropic\"\nduration = 2.0\nrate = { Si = <-0.1>, Resist = 0.0 }\n"},
        {"[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = <0.3>\nwidth = <0.5>\ndepth = <0.3>\n",
         "model = \"directional\"\nduration = 1.0\ndirectional = { Si = <-0.1>, Resist = 0.0 }\n"
         "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = <0.2>\ndeposit = \"SiO2\"\n"},
        {"shape = \"trench\"\nwidth = <0.564>\ndepth = <0.841>\n",
         "model = \"isotropic\"\nduration = 1.0\nrate = <0.233>\ndeposit = \"SiO2\"\n"},
        {"shape = \"trench\"\nwidth = <1.2>\ndepth = <0.9>\n",
         "model = \"isotropic\"\nduration = 1.0\nrate = { Si = <-0.4> }\n"},
        {"[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = <0.3>\nwidth = <1.2>\ndepth = <0.3>\n",
         "model = \"isotropic\"\nduration = 1.0\nrate = { Si = <-0.5>, Resist = 0.0 }\n"},
        {"[[layer]]\nmaterial = \"Resist\"\nshape = \"trench\"\nthickness = <0.3>\nwidth = <0.4>\ndepth = <0.3>\n",
         "model = \"isotropic\"\nduration = 1.0\nrate = { Si = <-0.2>, Resist = 0.0 }\n"},
    }));
    const std::string recipe =
        "[domain]\nextent = [<2.0>]\ngrid_spacing = <0.1>\n[[layer]]\nmaterial = \"Si\"\n" + wafer +
        "[[step]]\n" + steps + "[metrology]\nmeasures = [\"depth\", \"film\"]\n";
    const auto figures_in = [&](double um, const std::string& unit) {
        std::string text = recipe;
        text.insert(text.find("[[layer]]"), "length_unit = \"" + unit + "\"\n");
        for (std::size_t at; (at = text.find('<')) != std::string::npos;) {
            const std::size_t end = text.find('>', at);
            char length[32];
            std::snprintf(length, sizeof length, "%.12g", std::stod(text.substr(at + 1, end - at - 1)) * um);
            text.replace(at, end + 1 - at, length);
        }
        return figures(folder, text);
    };
    const json expected = figures_in(1.0, "um");
    for (const auto& [um, unit] : {std::pair(1e-6, "m"), {1e3, "nm"}}) {
        const json found = figures_in(um, unit);
        for (const auto& [name, value] : expected.items()) {
            if (value.is_null() || name.find("coverage") != std::string::npos)
                continue;  // quotients of others
            CAPTURE(recipe, unit, name, value, found[name]);
            const bool volume = name.find("volume") != std::string::npos;  // of a profile: an area
            CHECK(std::abs(found[name].get<double>() / (volume ? um * um : um) - value.get<double>()) <=
                  (volume ? 4.0 : 1.0) * 1e-4);  // 1e-3 dx, everywhere on 4 um
        }
    }
}
