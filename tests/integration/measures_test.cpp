#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "app/process/simulation.hpp"
#include "app/process/wafer.hpp"
#include "app/recipe/figure_names.hpp"
#include "app/results/metrology.hpp"
#include "levelset/meshes/extract.hpp"
#include "surface/error.hpp"
#include "tests/integration/run_program.hpp"

// Figures without a material, at sides of the domain, and by step.
using namespace sidewall;
using namespace sidewall::app;

namespace {

Json summary_of_run(const std::string& text) {
    const test::Folder folder;
    return run_recipe(parse_recipe(text, "measures.toml"), {.output = folder.path, .quiet = true}).summary;
}

// A trench from \p left to \p right, 1.5 deep, and a step.
std::string trench_at(const std::string& boundary, double spacing, double left, double right,
                      const std::string& step) {
    return fmt::format(
               "[domain]\nextent = [4.0]\ngrid_spacing = {}\nboundary = [\"{}\", \"periodic\"]\n[simplify]\nmethod = \"none\"\n"
               "[metrology]\nmeasures = [\"depth\", \"film\", \"cd_at_0.5\"]\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\n"
               "width = {}\ndepth = 1.5\nposition = [{}, 0.0]\n[[step]]\n",
               spacing, boundary, right - left, 0.5 * (left + right)) +
           step;
}

const std::string kEvenFilm = "model = \"isotropic\"\nduration = 0.5\nrate = 0.4\ndeposit = \"SiO2\"\n";

}  // namespace

TEST_CASE("figures without a material are those after its strip") {
    const std::string
        silicon = "[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\nwidth = 1.2\ndepth = 1.0\n",
        polymer =
            "[[layer]]\nmaterial = \"Polymer\"\nshape = \"trench\"\nthickness = 0.2\nwidth = 0.7\n"
            "depth = 0.9\n",
        step = "[[step]]\nmodel = \"isotropic\"\nduration = 1.0\nrate = -0.1\n",
        domain = "[domain]\nextent = [4.0]\ngrid_spacing = 0.05\n";
    const Recipe recipe = parse_recipe(domain + silicon + polymer + step, "measures.toml");
    const levelset::MaterialStack stack = initial_state(recipe).stack;
    const TriangleMesh surface = levelset::extract_surface(stack);
    const auto figure = [&](const std::string& name) {
        return measure_named(recipe, name, stack, surface).value;
    };
    constexpr double kOnNodes = 2.0 * (1e-3 + 1e-9) * 0.05;  // each face on nodes is 1e-3 cells off them
    CHECK(figure("cd_at_0.4") == Approx(0.7).margin(kOnNodes));
    CHECK(figure("cd_at_0.4_without_Polymer") == Approx(1.2).margin(kOnNodes));
    CHECK(figure("depth_without_Polymer") == Approx(1.0).margin(kOnNodes));
    CHECK(figure("thickness_Polymer_at_0_without_Polymer") == Approx(0.0).margin(kOnNodes));
    CHECK(figure("cd_at_0.4") == Approx(0.7).margin(kOnNodes));  // the polymer stays on the wafer
    CHECK(figure("cd_at_0.4_without_W") == figure("cd_at_0.4"));
    CHECK(figure("cd_at_0.4_without_Si") == figure("cd_at_0.4"));  // the substrate stays

    // The figures equal those after a step that strips the polymer.
    const std::string
        asked =
            "[metrology]\nmeasures = [\"undercut\", \"bow\", \"bow_without_Polymer\", \"scallops\", \"aspect_ratio\", \"sidewall_angle\", "
            "\"aspect_ratio_without_Polymer\", \"sidewall_angle_without_Polymer\"]\n",
        strip = "[[step]]\nmodel = \"strip\"\nmaterial = \"Polymer\"\n",
        still = "[[step]]\nmodel = \"planarize\"\nheight = 3.0\n";
    const Json with = summary_of_run(domain + silicon + polymer + asked + still)["metrology"],
               after = summary_of_run(domain + silicon + polymer + asked + strip)["metrology"];
    for (const std::string name : {"aspect_ratio", "sidewall_angle", "bow"}) {
        CHECK(with[name + "_without_Polymer"] == after[name]);
    }
    CHECK(with["aspect_ratio"] != after["aspect_ratio"]);
}

TEST_CASE("a figure without a material that there is none of, or of no figure, is refused") {
    const Recipe recipe = parse_recipe(
        "[domain]\nextent = [4.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\n[[step]]\n"
        "model = \"isotropic\"\nduration = 1.0\nrate = -0.1\nstop = \"depth_without_Polymer > 0.05\"\n",
        "measures.toml");
    CHECK(word_of(recipe, "scallop_pitch_without_Polymer"));
    CHECK(word_of(recipe, "depth_without_photoresist"));       // a common word for a material
    CHECK_FALSE(word_of(recipe, "scallops_without_Polymer"));  // stands for several
    CHECK_FALSE(word_of(recipe, "depth_without_Polimer"));
    CHECK_FALSE(word_of(recipe, "mean_rate_without_Polymer"));
    CHECK_FALSE(word_of(recipe, "_without_Polymer"));
    CHECK_THROWS_AS(require_measure(recipe, "thickness_Si_at_9_without_Polymer", "measures[0]"), KeyError);
}

TEST_CASE("a trench over a side of the domain gives the figures of the wafer shifted by whole cells") {
    for (const double spacing : {0.1, 0.05}) {
        const Json inside = summary_of_run(trench_at("periodic", spacing, 0.0, 1.0, kEvenFilm))["metrology"];
        for (const auto& [left, right] :
             {std::pair{1.4, 2.4}, {1.5, 2.5}, {-2.4, -1.4}, {1.0, 2.0}, {-2.0, -1.0}}) {
            const Json found =
                summary_of_run(trench_at("periodic", spacing, left, right, kEvenFilm))["metrology"];
            INFO(left << " to " << right << " at " << spacing << ": " << found);
            for (const char* name : {"depth", "film_top", "film_side", "film_bottom", "cd_at_0.5"}) {
                // Faces on nodes may lie a thousandth of a cell off them on either side.
                CHECK(found[name].get<double>() == Approx(inside[name].get<double>()).margin(4e-3 * spacing));
            }
            for (const char* name : {"film_top", "film_side", "film_bottom"})
                CHECK(found[name].get<double>() == Approx(0.2).margin(4e-3 * spacing));
        }
        // A trench up to the mirror at x = 2 is 2 wide with its image.
        const Json half = summary_of_run(trench_at("reflective", spacing, 1.0, 2.0, kEvenFilm))["metrology"];
        CHECK(half["film_bottom"].get<double>() == Approx(0.2).margin(4e-3 * spacing));
        CHECK(half["film_side"].get<double>() == Approx(0.2).margin(4e-3 * spacing));
        CHECK(half["cd_at_0.5"].get<double>() == Approx(1.6).margin(4e-3 * spacing));
    }
}

TEST_CASE("the film on the floor of half a feature at a mirror is that of the whole") {
    for (const double spacing : {0.1, 0.05})
        for (const double width : {0.8, 1.2}) {
            const Json half = summary_of_run(
                trench_at("reflective", spacing, 2.0 - 0.5 * width, 2.0, kEvenFilm))["metrology"];
            INFO(width << " at " << spacing << ": " << half);
            CHECK(half["film_bottom"].get<double>() == Approx(0.2).margin(4e-3 * spacing));
            CHECK(half["step_coverage_bottom"].get<double>() == Approx(1.0).margin(0.04 * spacing / 0.2));
        }
}

TEST_CASE("what no step grows has added nothing, and rates are by step") {
    const std::string wafer =
        "[domain]\nextent = [2.0]\ngrid_spacing = 0.1\n[[layer]]\nmaterial = \"Si\"\nshape = \"trench\"\n"
        "width = 0.83\ndepth = 0.57\n[metrology]\nmeasures = [\"depth\"]\n";
    const Json summary = summary_of_run(
        wafer +
        "[[step]]\nmodel = \"directional\"\nduration = 2.0\ndirectional = 0.1\ndeposit = \"SiO2\"\n"
        "[[step]]\nmodel = \"isotropic\"\nduration = 0.5\nrate = { SiO2 = -0.1, Si = 0.0 }\n"
        "[[step]]\nmodel = \"planarize\"\nheight = 3.0\n");
    INFO(summary["volumes"] << summary["steps"]);
    CHECK(summary["metrology"]["added_volume_Si"] == 0.0);
    CHECK(summary["volumes"]["Si"]["gross_added"] == 0.0);
    // The directional film grows on flat faces alone, by 0.1 a time unit as seen from above. The isotropic
    // etch also takes walls, of which this film has none.
    CHECK(summary["steps"][0]["mean_rate"].get<double>() == Approx(0.1).epsilon(0.02));
    CHECK(summary["steps"][1]["mean_rate"].get<double>() < -0.09);
    CHECK(summary["steps"][2]["mean_rate"].is_null());  // polishing takes no time
    const double whole = summary["metrology"]["mean_rate"].get<double>();
    CHECK(whole == Approx((2.0 * summary["steps"][0]["mean_rate"].get<double>() +
                           0.5 * summary["steps"][1]["mean_rate"].get<double>()) /
                          2.5)
                       .epsilon(1e-4));
}

TEST_CASE("errors of a mask's volume in steps that leave it alone do not add up") {
    const test::Folder folder;
    const Json volumes = run_recipe(load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/faraday_cage.toml"),
                                    {.output = folder.path, .quiet = true})
                             .summary["volumes"];
    INFO(volumes);
    for (const char* material : {"Si", "Mask"})
        CHECK(volumes[material]["gross_removed"].get<double>() ==
              Approx(-volumes[material]["net"].get<double>()).epsilon(1e-5));
    CHECK(volumes["Mask"]["gross_removed"].get<double>() < 0.01 * 0.5);  // a hundredth of the mask
}
