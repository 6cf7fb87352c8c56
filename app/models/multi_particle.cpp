#include <fmt/format.h>

#include <algorithm>

#include "app/models/model.hpp"

namespace sidewall::app {
namespace {

constexpr double kThermal = 1.0, kCollimated = 1000.0;  // source exponents

// V = sum over species k of rate_k(material) * flux_k.
Model make(const Values& values, const Materials& materials) {
    const auto& list = values.get<std::vector<Values>>("species");
    Model model;
    std::vector<std::vector<double>> rates;
    bool grows = false;
    for (std::size_t k = 0; k < list.size(); ++k) {
        const Values& species = list[k];
        const auto& name = species.get<std::string>("name");
        for (const flux::Species& other : model.species)
            if (other.name == name)
                throw KeyError(fmt::format("species[{}].name", k),
                               "is taken; give every species a name of its own");
        const double exponent = species.get<std::string>("kind") == "collimated" ? kCollimated : kThermal;
        model.species.push_back({name,
                                 species.get<std::optional<double>>("source_exponent").value_or(exponent),
                                 by_material_id(species.get<ByMaterial>("sticking"), materials)});
        rates.push_back(by_material_id(species.get<ByMaterial>("rate"), materials));
        grows = grows || *std::max_element(rates.back().begin(), rates.back().end()) > 0.0;
    }
    model.deposit = film(values, materials, grows);
    model.speed = [rates](const SurfacePoint& point) {
        double speed = 0.0;
        for (std::size_t k = 0; k < rates.size(); ++k)
            speed += rates[k][static_cast<std::size_t>(point.material)] * point.flux[k];
        return speed;
    };
    return model;
}

}  // namespace

ModelEntry multi_particle() {
    const std::vector<Key> species = {
        {"name", std::string(), "", "labels the flux in outputs", required()},
        {"kind",
         std::string("neutral"),
         "",
         "sets the default source_exponent",
         {.choices = {"neutral", "collimated"}}},
        {"rate", ByMaterial{}, "length/time",
         "speed at flux 1; positive grows, negative etches; 0 for materials a table leaves out", required()},
        {"sticking", ByMaterial{1.0}, "", "probability that a hit sticks; else it is re-emitted diffusely",
         kProbability},
        {"source_exponent",
         std::optional<double>(),
         "",
         "n of the source's cos^n; auto: 1 neutral, 1000 collimated",
         {.min = 0.0, .max = 1e6, .word = "auto"}},
    };
    return {"multi_particle",
            "any number of neutral and collimated species: V = sum of rate * flux",
            {{"species", std::vector<Values>(), "", "at least one", {.required = true, .keys = species}},
             deposit_key()},
            make};
}

}  // namespace sidewall::app
