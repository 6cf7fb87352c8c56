#include <fmt/format.h>

#include <algorithm>

#include "app/models/ions.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

// What `auto` stands for, by kind.
constexpr double kThermal = 1.0, kCollimated = 1000.0, kIon = 500.0;  // source exponents
constexpr double kIonEnergy = 100.0, kIonSpread = 0.1;                // eV, and as a share of it
constexpr double kSputterThreshold = 20.0, kEnhancedThreshold = 15.0, kSputterB = 9.3;  // Belen et al. 2005

using Number = std::optional<double>;

std::string key(std::size_t k, const std::string& name) {
    return fmt::format("species[{}].{}", k, name);
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

void make_ion(flux::Species& species, const Values& values, std::size_t k) {
    species.energy.mean = values.get<Number>("energy").value_or(kIonEnergy);
    species.energy.sigma = values.get<Number>("energy_spread").value_or(kIonSpread * species.energy.mean);
    if (species.energy.sigma > species.energy.mean)
        throw KeyError(key(k, "energy_spread"), "is larger than the energy; make it smaller");
    species.reflection = flux::ion("").reflection;
    species.reflection.from = values.get<Number>("reflect_from_deg").value_or(70.0) * kRadiansPerDegree;
    species.reflection.to = values.get<Number>("reflect_to_deg").value_or(90.0) * kRadiansPerDegree;
    if (species.reflection.from > species.reflection.to)
        throw KeyError(key(k, "reflect_from_deg"), "is above reflect_to_deg; swap them");
    if (auto yield = yield_of(values, species, k)) {
        species.stop_energy = yield->threshold;
        species.yields.push_back(std::move(*yield));
    }
}

flux::Species make_species(const Values& values, std::size_t k, const Materials& materials) {
    const auto& kind = values.get<std::string>("kind");
    const bool is_ion = kind == "ion";
    flux::Species species;
    species.name = values.get<std::string>("name");
    species.source_exponent = values.get<Number>("source_exponent")
                                  .value_or(is_ion                 ? kIon
                                            : kind == "collimated" ? kCollimated
                                                                   : kThermal);
    species.sticking = by_material_id(values.get<ByMaterial>("sticking"), materials);
    if (const double tilt = values.get<double>("tilt_deg"); tilt != 0.0) {
        species.beam = tilted_beam(tilt, values.get<double>("azimuth_deg"));
        species.rotating = values.get<bool>("rotating");
    }
    if (is_ion) {
        // Reflection decides what becomes of an ion, not sticking.
        if (values.get<ByMaterial>("sticking") != ByMaterial{1.0})
            throw KeyError(key(k, "sticking"),
                           "is for neutrals; set reflect_from_deg and reflect_to_deg for ions");
        species.sticking = {0.0};
        make_ion(species, values, k);
        return species;
    }
    for (const char* name : {"energy", "energy_spread", "reflect_from_deg", "reflect_to_deg", "threshold"})
        if (values.get<Number>(name))
            throw KeyError(key(k, name), "is for ions; set kind = \"ion\" or drop it");
    if (values.get<std::string>("yield") != "none")
        throw KeyError(key(k, "yield"), "is for ions; set kind = \"ion\" or drop it");
    return species;
}

// V = sum over species k of rate_k(material) * flux_k.
Model make(const Values& values, const Materials& materials) {
    const auto& list = values.get<std::vector<Values>>("species");
    Model model;
    std::vector<std::vector<double>> rates;
    std::vector<std::size_t> counts;  // which flux a rate multiplies
    std::size_t tallies = 0;
    bool grows = false;
    for (std::size_t k = 0; k < list.size(); ++k) {
        flux::Species species = make_species(list[k], k, materials);
        for (const flux::Species& other : model.species)
            if (other.name == species.name)
                throw KeyError(key(k, "name"), "is taken; give every species a name of its own");
        counts.push_back(tallies + (species.yields.empty() ? 0 : 1));
        tallies += flux::tally_count(species);
        model.species.push_back(std::move(species));
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
    const Rule angle{.min = 0.0, .max = 90.0, .word = "auto"};
    const std::vector<Key> species = {
        {"name", std::string(), "", "labels the flux in outputs", required()},
        {"kind",
         std::string("neutral"),
         "",
         "neutral and collimated species stick or are re-emitted diffusely; ions are reflected at grazing "
         "incidence",
         {.choices = {"neutral", "collimated", "ion"}}},
        {"rate", ByMaterial{}, "length/time",
         "speed at flux 1, or at a flat wafer's yield; positive grows, negative etches; 0 for materials a "
         "table leaves out",
         required()},
        {"sticking", ByMaterial{1.0}, "", "probability that a hit sticks; else it is re-emitted diffusely",
         kProbability},
        {"source_exponent",
         Number(),
         "",
         "n of the source's cos^n; auto: 1 neutral, 1000 collimated, 500 ion",
         {.min = 0.0, .max = 1e6, .word = "auto"}},
        {"tilt_deg", 0.0, "degree", "of the source's axis from the vertical", {.min = 0.0, .max = 85.0}},
        {"azimuth_deg", 0.0, "degree", "it flies to, from x to y", {.min = -360.0, .max = 360.0}},
        {"rotating", false, "", "the wafer turns under the tilted source"},
        {"energy",
         Number(),
         "eV",
         "ions: mean; auto: 100",
         {.min = 0.0, .max = 1e6, .above_min = true, .word = "auto"}},
        {"energy_spread",
         Number(),
         "eV",
         "ions: standard deviation; auto: a tenth of the energy",
         {.min = 0.0, .max = 1e6, .word = "auto"}},
        {"reflect_from_deg", Number(), "degree", "ions: least incidence that reflects; auto: 70", angle},
        {"reflect_to_deg", Number(), "degree", "ions: incidence from which all reflect; auto: 90", angle},
        {"yield",
         std::string("none"),
         "",
         "ions: what the rate multiplies instead of the flux, 1 on a flat wafer",
         {.choices = {"none", "sputter", "ion_enhanced"}}},
        {"threshold",
         Number(),
         "eV",
         "ions: below it there is no yield; auto: 20 sputter, 15 ion_enhanced",
         {.min = 0.0, .max = 1e6, .word = "auto"}},
    };
    return {"multi_particle",
            "any number of neutrals and ions: V = sum of rate * flux",
            {{"species", std::vector<Values>(), "", "at least one", {.required = true, .keys = species}},
             deposit_key()},
            make};
}

}  // namespace sidewall::app
