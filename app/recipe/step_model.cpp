#include "app/recipe/step_model.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "app/recipe/recipe_domain.hpp"
#include "app/schema/units.hpp"
#include "flux/radiosity/method_choice.hpp"

namespace sidewall::app {
namespace {

void refuse_mirrored_beams(const Model& model, const DomainSection& domain) {
    for (std::size_t k = 0; k < model.species.size(); ++k)
        for (std::size_t axis = 0; axis < 2; ++axis) {
            const flux::Species& species = model.species[k];
            const bool mirrors = domain.boundary[axis] == levelset::Side::reflective;
            if (!mirrors || species.rotating || species.beam[static_cast<Eigen::Index>(axis)] == 0.0)
                continue;
            raise_key((k < model.species_keys.size() ? model.species_keys[k] : "") + "tilt_deg",
                      "tilts the beam along {0}, and the reflective sides across {0} would "
                      "mirror it: set domain.boundary to periodic there, or rotating = true",
                      "xy"[axis]);
        }
}

// Refuses directions, crystals and diffusion that are not symmetric about a round wafer's axis.
void refuse_not_round(const Step& step, const Model& model, const DomainSection& domain) {
    if (!is_axial(domain)) return;
    const char* instead = "drop domain.symmetry and give domain.extent two numbers";
    if (step.model == "wet" || step.model == "epitaxy")
        raise_key("model", "{}: a crystal is not the same all around the axis of a round wafer: {}",
                  step.model, instead);
    for (std::size_t k = 0; k < model.species.size(); ++k)
        if (!model.species[k].rotating && !flux::is_untilted(model.species[k]))
            raise_key(
                (k < model.species_keys.size() ? model.species_keys[k] : "") + "tilt_deg",
                "a tilted beam is not the same all around the axis of a round wafer: set rotating = true, or {}",
                instead);
    for (const auto& direction : {model.visibility, model.beam})
        if (direction && !direction->head<2>().isZero(1e-12))
            raise_key("direction",
                      "is not the same all around the axis of a round wafer: use [0, 0, 1], or {}", instead);
    if (!model.coverages.diffusing.empty())
        raise_key("diffusion", "is not available on a round wafer: {}", instead);
}

// Limits the cost: a path through a feature of n cells has about (n cells / mean free path)^2 collisions.
constexpr double kLeastPath = 0.1;  // cells

void settle_free_paths(Model& model, const DomainSection& domain) {
    for (std::size_t k = 0; k < model.species.size(); ++k) {
        double& path = model.species[k].mean_free_path;
        const bool kinetic = k < model.free_paths.size() && model.free_paths[k] > 0.0;
        if (kinetic) path = model.free_paths[k] / metres_in(domain.length_unit);
        if (!(path < kLeastPath * domain.grid_spacing)) continue;
        raise_key(
            (k < model.species_keys.size() ? model.species_keys[k] : "") +
                (kinetic ? "pressure" : "mean_free_path"),
            "{} below a tenth of grid_spacing: particles would collide too often to be followed; {} it, "
            "or use a smaller grid_spacing",
            kinetic ? fmt::format("makes a mean free path of {:.4g} {},", path, domain.length_unit) : "is",
            kinetic ? "lower" : "raise");
    }
    model.free_paths.clear();
}

}  // namespace

Model make_model(const Step& step, const Materials& materials, const DomainSection& domain) {
    const ModelEntry* entry = find_model(step.model);
    if (entry == nullptr) throw KeyError("model", "must be one of the models that `sidewall models` lists");
    if (!entry->make) return {};
    Model model = entry->make(step.parameters, materials, {domain.length_unit, domain.time_unit});
    refuse_not_round(step, model, domain);
    refuse_mirrored_beams(model, domain);
    settle_free_paths(model, domain);
    for (const flux::Species& species : model.species)
        model.direct.push_back(
            flux::has_direct_flux(species) ? std::make_shared<const flux::DirectFlux>(species) : nullptr);
    if (!model.in_nm_per_s) return model;
    // Value of 1 nm/s in the recipe's length per time.
    const double unit = 1e-9 * seconds_in(domain.time_unit) / metres_in(domain.length_unit);
    for (auto* speed : {&model.speed, &model.hints.max_etch_rate})
        if (*speed) *speed = [own = *speed, unit](const SurfacePoint& point) { return unit * own(point); };
    if (model.hints.max_speed) *model.hints.max_speed *= unit;
    for (Vec3& bound : model.hints.dissipation) bound *= unit;
    model.in_nm_per_s = false;
    return model;
}

std::string why_monte_carlo(const Model& model, std::size_t k) {
    const flux::Species& species = model.species[k];
    const bool sticks = !model.sticking && !species.desorbs &&
                        std::ranges::all_of(species.sticking, [](double s) { return s == 1.0; });
    // Without re-emission each path is one flight, which starts where the source is bright.
    return sticks ? "it sticks wherever it lands" : flux::why_not_radiosity(species);
}

}  // namespace sidewall::app
