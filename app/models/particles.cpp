#include "app/models/particles.hpp"

#include <fmt/format.h>

#include "app/models/gas_keys.hpp"
#include "app/models/ions.hpp"
#include "app/models/table.hpp"

namespace sidewall::app {
namespace {

// What `auto` stands for, by kind.
constexpr double kThermal = 1.0, kCollimated = 1000.0, kIon = 500.0;  // source exponents
constexpr double kIonEnergy = 100.0, kIonSpread = 0.1;                // eV, and as a share of it

using Number = std::optional<double>;

double mean_energy(std::span<const flux::SourceBin> bins) {
    double mean = 0.0, before = 0.0;
    for (const flux::SourceBin& bin : bins) {
        mean += (bin.until - before) * 0.5 * (bin.energy_from + bin.energy_to);
        before = bin.until;
    }
    return mean;
}

void make_ion(flux::Species& species, const Values& values, const std::string& path) {
    species.sticking = {0.0};
    species.energy.mean = values.get<Number>("energy").value_or(kIonEnergy);
    species.energy.sigma = values.get<Number>("energy_spread").value_or(kIonSpread * species.energy.mean);
    if (species.energy.sigma > species.energy.mean)
        throw KeyError(path + "energy_spread", "is larger than the energy; make it smaller");
    if (const auto& file = values.get<std::string>("source_file"); !file.empty()) {
        for (const char* name : {"energy", "energy_spread", "source_exponent"})
            if (values.get<Number>(name))
                throw KeyError(path + name, "comes from source_file; drop one of the two");
        species.bins = read_source(file);
        species.energy.mean = mean_energy(species.bins);
        species.energy.sigma = 0.0;
    }
    species.reflection = flux::ion("").reflection;
    species.reflection.from = values.get<Number>("reflect_from_deg").value_or(70.0) * kRadiansPerDegree;
    species.reflection.to = values.get<Number>("reflect_to_deg").value_or(90.0) * kRadiansPerDegree;
    if (species.reflection.from > species.reflection.to)
        throw KeyError(path + "reflect_from_deg", "is above reflect_to_deg; swap them");
}

}  // namespace

std::vector<Key> particle_keys() {
    const Rule angle{.min = 0.0, .max = 90.0, .word = "auto"};
    std::vector<Key> keys = {
        {"name", std::string(), "", "labels the flux in outputs", required()},
        {"kind",
         std::string("neutral"),
         "",
         "neutral and collimated species stick or are re-emitted diffusely; ions are reflected at grazing "
         "incidence",
         {.choices = {"neutral", "collimated", "ion"}}},
        {"source_exponent",
         Number(),
         "",
         "n of the source's cos^n; auto: 1 neutral, 1000 collimated, 500 ion",
         {.min = 0.0, .max = 1e6, .word = "auto"}},
        {"source_beta",
         Number(),
         "",
         "neutrals: b of a source cos (1 + b cos^2), which a sputtered target is: -1 to 0 under-cosine, above 0 "
         "over-cosine; none: cos^n",
         {.min = -1.0, .max = 1e6, .word = "none"}},
        {"source_file", std::string(), "",
         "CSV beside the recipe, of how many come from which angle (degree, from the source's axis). Ions: energy_from, "
         "energy_to (eV), angle_from, angle_to, weight, a bin a row. Neutrals: angle_from, angle_to, weight; or angle "
         "and intensity, what the source sends per solid angle"},
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
    };
    for (Key& key : gas_keys()) keys.push_back(std::move(key));
    return keys;
}

flux::Species particle(const Values& values, const std::string& path) {
    const auto& kind = values.get<std::string>("kind");
    flux::Species species;
    species.name = values.get<std::string>("name");
    species.source_exponent = values.get<Number>("source_exponent")
                                  .value_or(kind == "ion"          ? kIon
                                            : kind == "collimated" ? kCollimated
                                                                   : kThermal);
    if (const double tilt = values.get<double>("tilt_deg"); tilt != 0.0) {
        species.beam = tilted_beam(tilt, values.get<double>("azimuth_deg"));
        species.rotating = values.get<bool>("rotating");
    }
    if (is_ion(values)) {
        if (values.get<Number>("source_beta"))
            throw KeyError(path + "source_beta", "is for neutrals; ions have source_exponent or source_file");
        make_ion(species, values, path);
        return species;
    }
    for (const char* name : {"energy", "energy_spread", "reflect_from_deg", "reflect_to_deg"})
        if (values.get<Number>(name))
            throw KeyError(path + name, "is for ions; set kind = \"ion\" or drop it");
    const auto& file = values.get<std::string>("source_file");
    const Number beta = values.get<Number>("source_beta");
    if (beta && !file.empty())
        throw KeyError(path + "source_beta", "comes from source_file; drop one of the two");
    if (!beta && file.empty()) return species;
    if (values.get<Number>("source_exponent"))
        throw KeyError(path + "source_exponent", fmt::format("comes from {}; drop one of the two",
                                                             beta ? "source_beta" : "source_file"));
    species.source_exponent = kThermal;
    if (beta)
        species.source_beta = *beta;
    else
        species.bins = read_source_angles(file);
    return species;
}

bool is_ion(const Values& values) {
    return values.get<std::string>("kind") == "ion";
}

std::string species_path(std::size_t k) {
    return fmt::format("species[{}].", k);
}

void refuse_twins(const std::vector<flux::Species>& species) {
    for (std::size_t k = 0; k < species.size(); ++k)
        for (std::size_t other = 0; other < k; ++other)
            if (species[other].name == species[k].name)
                throw KeyError(species_path(k) + "name", "is taken; give every species a name of its own");
}

}  // namespace sidewall::app
