#include <algorithm>

#include "app/models/gas_keys.hpp"
#include "app/models/particles.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

constexpr double kSputterThreshold = 20.0, kEnhancedThreshold = 15.0, kSputterB = 9.3;  // Belen et al. 2005

using Number = std::optional<double>;

std::string key(std::size_t k, const std::string& name) {
    return species_path(k) + name;
}

// The yield a rate multiplies instead of arrivals, scaled to 1 on a flat wafer.
std::optional<flux::Yield> yield_of(const Values& values, const flux::Species& ions, std::size_t k) {
    const auto& word = values.get<std::string>("yield");
    const auto threshold = values.get<Number>("threshold");
    if (word == "none") {
        if (threshold) throw KeyError(key(k, "threshold"), "belongs to a yield; name one, or drop it");
        return std::nullopt;
    }
    flux::Yield yield;
    yield.name = "yield";
    if (word == "sputter") {
        yield.angular = flux::Angular::sputter;
        yield.coefficient = {kSputterB};
    } else {
        yield.angular = flux::Angular::enhanced;
    }
    yield.threshold = threshold.value_or(word == "sputter" ? kSputterThreshold : kEnhancedThreshold);
    const double flat = flux::mean_yield(ions, yield);
    if (!(flat > 0.0))
        throw KeyError(
            key(k, "threshold"),
            "lies above the mean energy, or the yield of a flat wafer vanishes; rates are scaled to that");
    yield.scale = {1.0 / flat};
    return yield;
}

flux::Species make_species(const Values& values, std::size_t k, const Materials& materials) {
    flux::Species species = particle(values, species_path(k));
    if (is_ion(values)) {
        // Reflection decides what becomes of an ion, not sticking.
        if (values.get<ByMaterial>("sticking") != ByMaterial{1.0})
            throw KeyError(key(k, "sticking"),
                           "is for neutrals; set reflect_from_deg and reflect_to_deg for ions");
        if (auto yield = yield_of(values, species, k)) {
            species.stop_energy = yield->threshold;
            species.yields.push_back(std::move(*yield));
        }
        return species;
    }
    species.sticking = by_material_id(values.get<ByMaterial>("sticking"), materials);
    if (values.get<Number>("threshold"))
        throw KeyError(key(k, "threshold"), "is for ions; set kind = \"ion\" or drop it");
    if (values.get<std::string>("yield") != "none")
        throw KeyError(key(k, "yield"), "is for ions; set kind = \"ion\" or drop it");
    return species;
}

// V = sum over species k of rate_k(material) * flux_k.
Model make_multi_particle(const Values& values, const Materials& materials) {
    const auto& list = values.get<std::vector<Values>>("species");
    Model model;
    std::vector<std::vector<double>> rates;
    std::vector<std::size_t> counts;  // which flux a rate multiplies
    std::size_t tallies = 0;
    bool grows = false;
    for (std::size_t k = 0; k < list.size(); ++k) {
        flux::Species species = make_species(list[k], k, materials);
        counts.push_back(tallies + (species.yields.empty() ? 0 : 1));
        tallies += flux::tally_count(species);
        model.species.push_back(std::move(species));
        refuse_twins(model.species);
        add_gas(list[k], key(k, ""), model);
        model.species_keys.push_back(key(k, ""));
        rates.push_back(by_material_id(list[k].get<ByMaterial>("rate"), materials));
        grows = grows || *std::max_element(rates.back().begin(), rates.back().end()) > 0.0;
    }
    model.deposit = film(values, materials, grows);
    model.speed = [rates, counts](const SurfacePoint& point) {
        double speed = 0.0;
        for (std::size_t k = 0; k < rates.size(); ++k)
            speed += rates[k][static_cast<std::size_t>(point.material)] * point.flux[counts[k]];
        return speed;
    };
    return model;
}

}  // namespace

ModelEntry multi_particle() {
    std::vector<Key> species = particle_keys();
    species.insert(
        species.begin() + 2,
        {{"rate", ByMaterial{}, "length/time",
          "speed at flux 1, or at a flat wafer's yield; positive grows, negative etches; 0 for materials a "
          "table leaves out",
          required()},
         {"sticking", ByMaterial{1.0}, "", "probability that a hit sticks; else it is re-emitted diffusely",
          kProbability}});
    species.push_back({"yield",
                       std::string("none"),
                       "",
                       "ions: what the rate multiplies instead of the flux, 1 on a flat wafer",
                       {.choices = {"none", "sputter", "ion_enhanced"}}});
    species.push_back({"threshold",
                       Number(),
                       "eV",
                       "ions: below it there is no yield; auto: 20 sputter, 15 ion_enhanced",
                       {.min = 0.0, .max = 1e6, .word = "auto"}});
    return {"multi_particle",
            "any number of neutrals and ions: V = sum of rate * flux",
            {{"species", std::vector<Values>(), "", "at least one", {.required = true, .keys = species}},
             deposit_key()},
            make_multi_particle};
}

}  // namespace sidewall::app
