#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "app/pictures/render_scene.hpp"
#include "app/process/simulation.hpp"
#include "levelset/grid.hpp"
#include "levelset/layers/checkpoint.hpp"
#include "tests/folder.hpp"

// Sections in pictures against the level sets at the end of a run.
using namespace sidewall;
using namespace sidewall::app;

namespace {

// Areas in the section y = 0 by material, from the pixels of a picture of 300,000 pixels.
template <typename ColourAt>
std::map<std::string, double> count(const Box3& box, const ColourAt& colour_at) {
    std::map<std::string, double> pixels;
    const double h = std::sqrt(box.size().x() * box.size().z() / 3e5);
    for (double z = box.min.z() + 0.5 * h; z < box.max.z(); z += h)
        for (double x = box.min.x() + 0.5 * h; x < box.max.x(); x += h)
            if (const std::string colour = colour_at(Vec3(x, 0.0, z)); !colour.empty())
                pixels[colour] += h * h;
    return pixels;
}

// Areas at a right-angled corner, in cell areas, for exact distances at the nodes. Straight edges cut off
// 1/8, of which trilinear values keep kAtCorner in the mean over all places in a cell, with a standard
// deviation of kScatter over places and directions. Meshes that keep the corner have kAtSharpCorner more.
constexpr double kAtCorner = 0.031, kScatter = 0.036, kAtSharpCorner = 0.125 - kAtCorner;

// \param off  mean distance, in cells, of the fronts along both walls from where the level sets have them.
// \param corners  how many sharp corners a material has in the section.
// \param by_chance  how many corners lie where random numbers have put them.
// \param sharp  the material whose corners the meshes keep.
// \returns the areas shown, by material, and the run's summary.
std::pair<std::map<std::string, double>, Json> compare(const std::string& name,
                                                       const std::vector<std::string>& overrides, double off,
                                                       double corners, double by_chance = 0.0,
                                                       const std::string& sharp = {}) {
    const test::Folder folder;
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name + ".toml", overrides);
    const RunResult run = run_recipe(recipe, {.output = folder.path, .quiet = true});
    const auto stack = levelset::load_checkpoint(folder.path / "checkpoint.vdb", domain_of(recipe)).stack;
    const Result result = read_result(folder.path);
    const RenderScene scene(result, {});
    Box3 box = bounding_box(result.surface);
    box.extend(bounding_box(result.interfaces.front()).min);
    const auto name_of = [&](const Colour& colour) {
        for (const Material& material : recipe.materials)
            if (colour_from_hex(material.colour) == colour) return material.name;
        return std::string("no material");
    };
    // The stack's own rule: the lowest layer that holds a point is its material.
    const auto expected = count(box, [&](const Vec3& p) {
        for (const levelset::Layer& layer : stack.layers)
            if (levelset::distance_at(*layer.phi, stack.domain, p) <= 0.0)
                return recipe.materials[static_cast<std::size_t>(layer.material)].name;
        return std::string();
    });
    SectionReader reader(scene);
    const auto shown = count(box, [&](const Vec3& p) {
        const SectionSample sample = reader.at(p, 1, 1e-6 * stack.domain.spacing);
        return sample.solid < 0.5 ? std::string() : name_of(sample.colour);
    });
    // A point on a front has the colours of both sides.
    double all = 0.0, none = 0.0;
    for (const auto& [material, area] : shown) (expected.contains(material) ? all : none) += area;
    CHECK(none < 1e-4 * all);
    for (const auto& [material, area] : expected) {
        CAPTURE(name, material, area);
        REQUIRE(shown.contains(material));
        CHECK(std::abs(shown.at(material) - area) <
              0.02 * area + off * stack.domain.spacing * 2.0 * box.size().z() +
                  (corners * (material == sharp ? kAtSharpCorner : kAtCorner) +
                   3.0 * std::sqrt(by_chance) * kScatter) *
                      stack.domain.spacing * stack.domain.spacing);
    }
    return {shown, run.summary};
}

}  // namespace

TEST_CASE("a section shows each material on the area that it has in the level sets", "[slow]") {
    // SiGe has five corners on each side.
    auto [shown, summary] = compare("fin_sequence", {}, 0.0, 10.0, 0.0, "SiGe");
    // The wafer is the same all along its 8 nm, and begins without SiGe.
    CHECK(shown.at("SiGe") == Approx(summary["volumes"]["SiGe"]["net"].get<double>() / 8.0).epsilon(0.01));
    // The polymer loses its two ends on each side. The two ridges between scallops take from one of its faces
    // what they give to the other, but for chance: 0.18 +- 0.08 cells are lost over eight seeds, and by the
    // figures above 0.12 +- 0.12.
    compare("bosch_hole", {"step[0].repeat=3"}, 0.0, 4.0, 12.0);
    // In these scallops the mask's interface and the silicon's coincide under the polymer, whose film is a
    // quarter of a cell: 2 % of it is below what straight edges can do. They leave an arc of radius r by h^2
    // / (12 r) in the mean, here a thirty-sixth of a cell; the two sides of the film have most of it in
    // common.
    compare("bosch_hole",
            {"step[0].repeat=3", "domain.grid_spacing=0.1", "domain.extent=[3,3]", "flux.rays=10000"}, 0.01,
            4.0, 12.0);
}
