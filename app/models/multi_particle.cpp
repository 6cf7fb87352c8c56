#include <algorithm>

#include "app/models/particles.hpp"
#include "flux/yield.hpp"

namespace sidewall::app {
namespace {

constexpr double kSputterThreshold = 20.0, kEnhancedThreshold = 15.0, kSputterB = 9.3;  // Belen et al. 2005

struct ParticleWithRate {
    Particle particle;
    ByMaterial rate, sticking{1.0};
    std::string yield = "none";
    std::optional<double> threshold;
};

struct MultiParticle {
    std::vector<ParticleWithRate> species;
    std::string deposit;
};

std::vector<Key> particle_with_rate_keys(ParticleWithRate& p) {
    std::vector<Key> keys = particle_keys(p.particle);
    keys.insert(
        keys.begin() + 2,
        {{"rate", &p.rate, "length/time",
          "speed by this species on an open flat wafer (flux 1); positive grows, negative etches; 0 for "
          "materials a table leaves out",
          required()},
         {"sticking", &p.sticking, "", "probability that a hit sticks; else it is re-emitted diffusely",
          kProbability}});
    keys.push_back({"yield", &p.yield, "",
                    "ions: yield that weights each hit in the flux that the rate multiplies, scaled to 1 "
                    "on a flat wafer",
                    one_of({"none", "sputter", "ion_enhanced"})});
    keys.push_back({"threshold", &p.threshold, "eV",
                    "ions: energy below which the yield is 0; auto: 20 sputter, 15 ion_enhanced",
                    or_word("auto", within(0.0, 1e6))});
    return keys;
}

std::vector<Key> multi_particle_keys(MultiParticle& p) {
    return {{"species", table_list(p.species, particle_with_rate_keys), "",
             "the neutrals and ions, at least one", required()},
            deposit_key(p.deposit)};
}

// The yield that replaces the arrivals in V, scaled to 1 on a flat wafer; none if the recipe names none.
std::optional<flux::Yield> yield_of(const ParticleWithRate& p, const flux::Species& ions,
                                    const std::string& path) {
    if (p.yield == "none") {
        if (p.threshold) throw KeyError(path + "threshold", "belongs to a yield; name one, or drop it");
        return std::nullopt;
    }
    flux::Yield yield;
    yield.name = "yield";
    const bool sputters = p.yield == "sputter";
    if (sputters) {
        yield.angular = flux::Angular::sputter;
        yield.coefficient = {kSputterB};
    } else {
        yield.angular = flux::Angular::enhanced;
    }
    yield.threshold = p.threshold.value_or(sputters ? kSputterThreshold : kEnhancedThreshold);
    const double flat = flux::mean_yield(ions, yield);
    if (!(flat > 0.0))
        throw KeyError(
            path + "threshold",
            "lies above the mean energy, or makes the yield on a flat wafer 0, to which the rate is "
            "scaled; lower it");
    yield.scale = {1.0 / flat};
    return yield;
}

flux::Species make_species(const ParticleWithRate& p, const std::string& path, const Materials& materials) {
    flux::Species species = species_of(p.particle, path);
    if (p.particle.is_ion()) {
        if (p.sticking != ByMaterial{1.0})
            throw KeyError(path + "sticking",
                           "is for neutrals; set reflect_from_deg and reflect_to_deg for ions");
        if (auto yield = yield_of(p, species, path)) {
            species.stop_energy = yield->threshold;
            species.yields.push_back(std::move(*yield));
        }
        return species;
    }
    species.sticking = by_material_id(p.sticking, materials);
    if (p.threshold) throw KeyError(path + "threshold", "is for ions; set kind = \"ion\" or drop it");
    if (p.yield != "none") throw KeyError(path + "yield", "is for ions; set kind = \"ion\" or drop it");
    return species;
}

// V = sum over species k of rate_k(material) * flux_k.
Model make_multi_particle(const MultiParticle& p, const Materials& materials) {
    Model model;
    std::vector<std::vector<double>> rates;
    std::vector<std::size_t> counts;  // index of the flux that each rate multiplies
    std::size_t tallies = 0;
    bool grows = false;
    for (std::size_t k = 0; k < p.species.size(); ++k) {
        const std::string path = species_path(k);
        flux::Species species = make_species(p.species[k], path, materials);
        counts.push_back(tallies + (species.yields.empty() ? 0 : 1));
        tallies += flux::tally_count(species);
        model.species.push_back(std::move(species));
        refuse_duplicate_names(model.species);
        add_gas(p.species[k].particle.gas, path, model);
        model.species_keys.push_back(path);
        rates.push_back(by_material_id(p.species[k].rate, materials));
        grows = grows || *std::max_element(rates.back().begin(), rates.back().end()) > 0.0;
    }
    model.deposit = film(p.deposit, materials, grows);
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
    return model_entry("multi_particle", "any number of neutrals and ions: V = sum of rate * flux",
                       multi_particle_keys, make_multi_particle);
}

}  // namespace sidewall::app
