#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "app/pictures/section.hpp"
#include "app/process/simulation.hpp"
#include "tests/folder.hpp"

// Where one material ends and the next begins in what a run saves and draws, against where it has to.
using namespace sidewall;
using namespace sidewall::app;

namespace {

// How far, in cells, anything in a material's colour lies outside all that this material can fill: the
// surface's triangles, and the points of the section y = 0. `outside` tells it of a material and a point,
// world units.
template <class Outside>
std::map<std::string, double> teeth(const std::string& name, const Outside& outside) {
    const test::Folder folder;
    const Recipe recipe = load_recipe(SIDEWALL_SOURCE_DIR "/configs/quick/" + name + ".toml");
    run_recipe(recipe, {.output = folder.path, .quiet = true});
    const Result result = read_result(folder.path);
    const double dx = domain_of(recipe).spacing;
    std::map<std::string, double> worst;
    const auto note = [&](const std::string& how, const std::string& material, const Vec3& p) {
        double& most = worst[how + material];
        most = std::max(most, outside(material, p) / dx);
    };
    const std::vector<double>& ids = result.surface.triangle_attribute("material")->values;
    for (std::size_t t = 0; t < ids.size(); ++t)
        for (const std::uint32_t v : result.surface.triangles[t])
            note("surface: ", recipe.materials[static_cast<std::size_t>(std::lround(ids[t]))].name,
                 result.surface.vertices[v]);
    return worst;
}

}  // namespace

TEST_CASE("a film on a mask's edge is film: it is etched, and what is Mask does not grow") {
    // The mask neither etches nor grows: 0 < z < 0.5 beside a slit of 1.6.
    const auto worst = teeth("deposit_and_etch", [](const std::string& material, const Vec3& p) {
        return material == "Mask" ? std::max({-p.z(), p.z() - 0.5, 0.8 - std::abs(p.x())}) : 0.0;
    });
    CHECK(worst.at("surface: Mask") < 0.3);
}
