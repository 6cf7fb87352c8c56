#include <catch2/catch.hpp>

#include "app/models/model.hpp"
#include "app/process/arriving/rates.hpp"
#include "app/process/arriving/trace.hpp"
#include "levelset/layers/make_stack.hpp"
#include "levelset/layers/stack.hpp"

// The worked example of docs/models.md: a model as one would write it in a file of its own.
namespace sidewall::app {
namespace {

enum Tally : std::size_t { kChlorine };  // in the order of flux_names

struct Chlorine {
    ByMaterial rate, sticking{0.5};
    double adsorption = 1.0, desorption = 0.25;
};

std::vector<Key> chlorine_keys(Chlorine& p) {
    return {{"rate", &p.rate, "length/time", "etch rate of a full surface", required(kNotNegative)},
            {"sticking", &p.sticking, "", "on free sites", kProbability},
            {"adsorption", &p.adsorption, "1/time", "sites taken at flux 1", kPositive},
            {"desorption", &p.desorption, "1/time", "of a site", kPositive}};
}

// Chlorine covers free sites and spontaneous desorption empties them: V = -rate theta, with theta = k_a phi /
// (k_a phi + k_d).
Model make_chlorine(const Chlorine& p, const Materials& materials) {
    const std::vector<double> rate = by_material_id(p.rate, materials);

    Model model;
    model.species = {{"chlorine", 1.0, by_material_id(p.sticking, materials)}};
    model.coverages.names = {"chlorine"};
    model.coverages.react = [=](const SurfacePoint& point, double, std::span<double> theta) {
        const double arriving = p.adsorption * point.flux[kChlorine];
        theta[0] = arriving / (arriving + p.desorption);
    };
    model.sticking = [own = model.species](std::size_t k, const SurfacePoint& point) {
        return own[k].sticking[static_cast<std::size_t>(point.material)] * (1.0 - point.coverage[0]);
    };
    model.speed = [=](const SurfacePoint& point) {
        return -rate[static_cast<std::size_t>(point.material)] * point.coverage[0];
    };
    return model;
}

ModelEntry chlorine() {
    return model_entry("chlorine", "adsorption and desorption of chlorine: V = -rate * theta", chlorine_keys,
                       make_chlorine);
}

}  // namespace
}  // namespace sidewall::app

using namespace sidewall;
using namespace sidewall::app;

TEST_CASE("a model in one file: keys, species, coverages and speed are all there is to it") {
    Recipe recipe;
    recipe.domain.extent = {2.0, 2.0};
    recipe.domain.grid_spacing = 0.25;
    recipe.flux.rays = 200'000;
    recipe.simplify.method = "none";
    const ModelEntry entry = chlorine();
    std::any parameters = entry.defaults;
    *target_of<ByMaterial>(entry.keys(parameters), "rate") = ByMaterial{0.0, {{"Si", 2.0}}};
    const Model model = entry.make(parameters, recipe.materials, {});

    // An open wafer: flux 1, so theta = 1 / (1 + 0.25) at any sticking.
    const levelset::MaterialStack stack = levelset::make_stack(domain_of(recipe), {{0, levelset::Shape{}}});
    Timing timing;
    const TracedSurface surface = trace_surface(recipe, model, stack, {}, {.settle = true}, timing);
    REQUIRE(surface.arriving);
    const SurfaceFlux& arriving = *surface.arriving;
    REQUIRE(arriving.coverage.size() == 1);
    REQUIRE(arriving.trace);
    CHECK(arriving.trace->traces >= 2);
    CHECK(arriving.trace->coverage_change <= model.coverages.tolerance);
    double sum = 0.0, area = 0.0;
    for (std::size_t w = 0; w < arriving.wedges.count(); ++w) {
        sum += arriving.wedges.area[w] * arriving.coverage[0][w];
        area += arriving.wedges.area[w];
    }
    CHECK(sum / area == Approx(0.8).epsilon(0.01));
    const levelset::Motion motion = surface_motion(model, stack, surface, timing);
    CHECK(levelset::max_speed(stack, motion) == Approx(1.6).epsilon(0.05));

    // Coverages carried over from an equal surface are settled after one trace.
    const SurfaceField field =
        surface_field(surface.traced(), arriving.wedges, model.coverages.names, arriving.coverage);
    const TracedSurface again = trace_surface(recipe, model, stack, field, {.settle = true}, timing);
    REQUIRE(again.arriving);
    CHECK(again.arriving->trace->traces == 1);
}
