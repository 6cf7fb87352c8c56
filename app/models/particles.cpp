#include "app/models/particles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>

#include "app/models/table.hpp"

namespace sidewall::app {
namespace {

// Defaults of neutrals, collimated particles and ions.
constexpr double kThermal = 1.0, kCollimated = 1000.0, kIon = 500.0;  // source exponents
constexpr double kIonEnergy = 100.0, kIonSpread = 0.1;                // eV, and standard deviation over mean

// Throws for the first of the keys that has a value.
void refuse(const std::string& path, const char* rule,
            std::initializer_list<std::pair<const char*, std::optional<double>>> keys) {
    for (const auto& [name, value] : keys)
        if (value) throw KeyError(path + name, rule);
}

double mean_energy(std::span<const flux::SourceBin> bins) {
    double mean = 0.0, before = 0.0;
    for (const flux::SourceBin& bin : bins) {
        mean += (bin.until - before) * 0.5 * (bin.energy_from + bin.energy_to);
        before = bin.until;
    }
    return mean;
}

void make_ion(flux::Species& species, const Particle& p, const std::string& path) {
    species.sticking = {0.0};
    species.energy.mean = p.energy.value_or(kIonEnergy);
    species.energy.sigma = p.energy_spread.value_or(kIonSpread * species.energy.mean);
    if (species.energy.sigma > species.energy.mean)
        throw KeyError(path + "energy_spread", "is larger than the energy; make it smaller");
    if (!p.source_file.empty()) {
        refuse(path, "comes from source_file; drop one of the two",
               {{"energy", p.energy},
                {"energy_spread", p.energy_spread},
                {"source_exponent", p.source_exponent}});
        species.bins = read_source(p.source_file);
        species.energy.mean = mean_energy(species.bins);
        species.energy.sigma = 0.0;
    }
    species.reflection = flux::ion("").reflection;
    species.reflection.from = p.reflect_from_deg.value_or(70.0) * kRadiansPerDegree;
    species.reflection.to = p.reflect_to_deg.value_or(90.0) * kRadiansPerDegree;
    if (species.reflection.from > species.reflection.to)
        throw KeyError(path + "reflect_from_deg", "is above reflect_to_deg; swap them");
}

constexpr double kBoltzmann = 1.380649e-23;                   // J/K
constexpr double kRoomTemperature = 300.0, kNitrogen = 0.37;  // K; nm, diameter of N2

// Mean free path k T / (sqrt(2) pi d^2 p) in metres, from K, m and Pa, of a molecule among equal ones (Bird,
// Molecular Gas Dynamics, 1994, equation 1.13).
double kinetic_free_path(double temperature, double diameter, double pressure) {
    return kBoltzmann * temperature /
           (std::numbers::sqrt2 * std::numbers::pi * diameter * diameter * pressure);
}

struct Measured {
    const char* material;
    double yield;   // atoms or formula units an ion, normal incidence
    double energy;  // eV, argon ions
};

// Argon milling rates R at 500 eV and normal incidence, in um^3/nC (globalsino.com/EM/page1309.html,
// Practical Electron Microscopy and Database, table 1309), converted to yields R density e: Al2O3 0.01667, C
// 0.00733, Cr 0.09667, Cu 0.18333, Ge 0.16667. The table gives 0.51 for silicon and 0.235 for SiO2; the
// models' A_sp give 0.60 and 0.252. Tungsten: Eckstein in Sputtering by Particle Bombardment (Springer 2007),
// Ar on W (db-amdis.org, data set 455); A_sp fits it within 12 % from 200 to 500 eV, and is 2.5 times too
// large at 100 eV, near tungsten's own threshold of 27 eV.
constexpr Measured kMeasured[] = {
    {"Al2O3", 0.0622, 500.0}, {"Carbon", 0.117, 500.0}, {"Cr", 1.29, 500.0},
    {"Cu", 2.49, 500.0},      {"Ge", 1.18, 500.0},      {"W", 0.270, 200.0},
};

// Rounds to three significant digits: the measurements are no more precise.
double three_digits(double number) {
    return std::stod(fmt::format("{:.3g}", number));
}

}  // namespace

std::vector<Key> particle_keys(Particle& p) {
    const Rule angle = or_word("auto", within(0.0, 90.0));
    std::vector<Key> keys = {
        {"name", &p.name, "", "name of the species, which labels its flux in outputs", required()},
        {"kind", &p.kind, "",
         "neutral and collimated species stick or are re-emitted diffusely; ions are reflected at grazing "
         "incidence",
         one_of({"neutral", "collimated", "ion"})},
        {"source_exponent", &p.source_exponent, "",
         "n of the source's angular distribution cos^n; auto: 1 neutral, 1000 collimated, 500 ion",
         or_word("auto", within(0.0, 1e6))},
        {"source_beta", &p.source_beta, "",
         "neutrals: b of the source's angular distribution cos (1 + b cos^2), as of a sputtered target: -1 "
         "to 0 under-cosine, above 0 over-cosine; none: cos^n",
         or_word("none", within(-1.0, 1e6))},
        {"source_file", &p.source_file, "",
         "CSV file, relative to the recipe, with the source's distribution over angles (degree, from the "
         "source's axis). Columns for ions: energy_from, energy_to (eV), angle_from, angle_to, weight, one "
         "bin a row. For neutrals: angle_from, angle_to, weight; or angle and intensity, which is per "
         "solid angle"},
        {"tilt_deg", &p.tilt_deg, "degree", "angle of the source's axis from the vertical",
         within(0.0, 85.0)},
        {"azimuth_deg", &p.azimuth_deg, "degree",
         "direction in which a tilted source's particles fly: 0 is towards +x, 90 towards +y",
         within(-360.0, 360.0)},
        {"rotating", &p.rotating, "", "the wafer turns under the tilted source"},
        {"energy", &p.energy, "eV", "ions: mean energy; auto: 100", or_word("auto", positive_to(1e6))},
        {"energy_spread", &p.energy_spread, "eV",
         "ions: standard deviation of the energy; auto: a tenth of the mean",
         or_word("auto", within(0.0, 1e6))},
        {"reflect_from_deg", &p.reflect_from_deg, "degree",
         "ions: angle of incidence from which some are reflected; auto: 70", angle},
        {"reflect_to_deg", &p.reflect_to_deg, "degree",
         "ions: angle of incidence from which all are reflected; auto: 90", angle},
    };
    append_keys(keys, gas_keys(p.gas));
    return keys;
}

flux::Species species_of(const Particle& p, const std::string& path) {
    flux::Species species;
    species.name = p.name;
    species.source_exponent = p.source_exponent.value_or(p.is_ion()               ? kIon
                                                         : p.kind == "collimated" ? kCollimated
                                                                                  : kThermal);
    if (p.tilt_deg != 0.0) {
        species.beam = tilted_beam(p.tilt_deg, p.azimuth_deg);
        species.rotating = p.rotating;
    }
    if (p.is_ion()) {
        if (p.source_beta)
            throw KeyError(path + "source_beta", "is for neutrals; ions have source_exponent or source_file");
        make_ion(species, p, path);
        return species;
    }
    refuse(path, "is for ions; set kind = \"ion\" or drop it",
           {{"energy", p.energy},
            {"energy_spread", p.energy_spread},
            {"reflect_from_deg", p.reflect_from_deg},
            {"reflect_to_deg", p.reflect_to_deg}});
    if (p.source_beta && !p.source_file.empty())
        throw KeyError(path + "source_beta", "comes from source_file; drop one of the two");
    if (!p.source_beta && p.source_file.empty()) return species;
    if (p.source_exponent)
        raise_key(path + "source_exponent", "comes from {}; drop one of the two",
                  p.source_beta ? "source_beta" : "source_file");
    species.source_exponent = kThermal;
    if (p.source_beta)
        species.source_beta = *p.source_beta;
    else
        species.bins = read_source_angles(p.source_file);
    return species;
}

std::string species_path(std::size_t k) {
    return fmt::format("species[{}].", k);
}

void refuse_duplicate_names(const std::vector<flux::Species>& species) {
    for (std::size_t k = 0; k < species.size(); ++k)
        for (std::size_t other = 0; other < k; ++other)
            for (const std::string& name : flux::tally_names(species[k]))
                if (std::ranges::count(flux::tally_names(species[other]), name) > 0)
                    throw KeyError(species_path(k) + "name",
                                   "is taken; give every species a name of its own");
}

std::vector<Key> gas_keys(Gas& gas) {
    return {
        {"mean_free_path", &gas.mean_free_path, "length",
         "neutrals: mean free path between collisions in the gas, which scatter in all directions equally; "
         "none: no collisions, unless pressure is given",
         or_word("none", kPositive)},
        {"pressure", &gas.pressure, "Pa",
         "neutrals: pressure p of the gas, which gives a mean free path of k T / (sqrt(2) pi d^2 p); none: "
         "no collisions, unless mean_free_path is given",
         or_word("none", positive_to(1e7))},
        {"temperature", &gas.temperature, "K",
         "T: temperature of the gas, for the mean free path by pressure; auto: 300",
         or_word("auto", positive_to(1e4))},
        {"molecule_diameter", &gas.molecule_diameter, "nm",
         "d: diameter of the gas molecules, for the mean free path by pressure; auto: 0.37, nitrogen",
         or_word("auto", within(0.01, 10.0))},
    };
}

void add_gas(Gas gas, const std::string& path, Model& model) {
    // Throws for the first key with a value, from key number \p first on.
    const auto refuse_from = [&](std::size_t first, const char* rule) {
        const std::vector<Key> keys = gas_keys(gas);
        for (std::size_t k = first; k < keys.size(); ++k)
            if (*std::get<std::optional<double>*>(keys[k].target)) throw KeyError(path + keys[k].name, rule);
    };
    flux::Species& species = model.species.back();
    if (species.reflection.kind != flux::Reemission::diffuse)
        refuse_from(
            0,
            "is for neutrals, which a collision leaves thermal; ions keep much of their direction: drop it, "
            "and widen their source by source_exponent or source_file");
    if (gas.mean_free_path) {
        refuse_from(1, "cannot be combined with mean_free_path; drop one of the two");
        species.mean_free_path = *gas.mean_free_path;
    }
    if (gas.pressure) {
        model.free_paths.resize(model.species.size(), 0.0);
        model.free_paths.back() =
            kinetic_free_path(gas.temperature.value_or(kRoomTemperature),
                              1e-9 * gas.molecule_diameter.value_or(kNitrogen), *gas.pressure);
        return;
    }
    refuse_from(2, "belongs to pressure; give one, or drop this");
}

Key sputter_threshold_key(double& threshold) {
    return {"sputter_threshold", &threshold, "eV", "E_sp: ion energy below which nothing is sputtered",
            kNotNegative};
}

Key sputter_angle_key(double& coefficient) {
    return {"sputter_angle", &coefficient, "",
            "B_sp of the angular factor of sputtering, (1 + B_sp sin^2 theta) cos theta at incidence theta",
            kNotNegative};
}

Key enhanced_threshold_key(double& threshold) {
    return {"enhanced_threshold", &threshold, "eV",
            "E_ie: ion energy below which ions do not enhance the etching", kNotNegative};
}

std::vector<Key> reflection_keys(Cone& cone) {
    return {{"cone", &cone.cone, "degree",
             "theta_min: reflected ions leave in a cone about the mirrored direction; its half-angle is 90 "
             "less the incidence, at least 90 less this",
             within(0.0, 90.0)},
            {"inflection", &cone.inflection, "degree",
             "theta_i: angle of incidence above which the share of energy that a reflected ion keeps rises "
             "linearly",
             within(1.0, 89.99)},
            {"energy_exponent", &cone.energy_exponent, "",
             "n_l: below theta_i (inflection) the share of energy that a reflected ion keeps goes as "
             "(theta/theta_i)^n_l",
             within(0.0, 1e3)}};
}

void set_reflection(const Cone& cone, flux::Species& ion) {
    ion.reflection.cone = kRadiansPerDegree * cone.cone;
    ion.reflection.inflection = kRadiansPerDegree * cone.inflection;
    ion.reflection.exponent = cone.energy_exponent;
}

std::vector<Key> ion_keys(Ions& p) {
    std::vector<Key> keys = {
        {"energy", &p.energy, "eV", "mean energy of the ions", positive_to(1e6), "ion_energy"},
        {"energy_spread", &p.energy_spread, "eV", "standard deviation of the ions' energy", within(0.0, 1e6),
         "ion_energy_spread"},
        {"ion_exponent", &p.ion_exponent, "", "n of the ions' angular distribution cos^n", within(0.0, 1e6)},
        {"reflect_from_deg", &p.reflect_from_deg, "degree",
         "angle of incidence from which some ions are reflected", within(0.0, 90.0), "reflection_from"},
        {"reflect_to_deg", &p.reflect_to_deg, "degree",
         "angle of incidence from which all ions are reflected", within(0.0, 90.0), "reflection_to"}};
    append_keys(keys, reflection_keys(p.cone));
    return keys;
}

flux::Species ion_species(const Ions& p, std::vector<flux::Yield> yields) {
    flux::Species ion = flux::ion("ion", {p.energy, p.energy_spread}, p.ion_exponent);
    ion.reflection.from = kRadiansPerDegree * p.reflect_from_deg;
    ion.reflection.to = kRadiansPerDegree * p.reflect_to_deg;
    if (ion.reflection.to <= ion.reflection.from)
        throw KeyError("reflect_to_deg", "must be greater than reflect_from_deg");
    set_reflection(p.cone, ion);
    ion.stop_energy = std::ranges::min(yields, {}, &flux::Yield::threshold).threshold;
    ion.yields = std::move(yields);
    return ion;
}

Vec3 tilted_beam(double tilt_deg, double azimuth_deg) {
    const double tilt = tilt_deg * kRadiansPerDegree, azimuth = azimuth_deg * kRadiansPerDegree;
    Vec3 beam(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth), -std::cos(tilt));
    for (int axis = 0; axis < 2; ++axis)
        if (std::abs(beam[axis]) < 1e-12) beam[axis] = 0.0;  // cos(90 degrees) is not quite 0
    return beam;
}

std::vector<double> densities(const Materials& materials) {
    std::vector<double> result;
    for (const Material& material : materials) result.push_back(material.density);
    return result;
}

std::vector<std::uint8_t> marked(const std::vector<std::string>& names, const Materials& materials) {
    std::vector<std::uint8_t> flags(materials.size(), 0);
    for (const std::string& name : names) flags[static_cast<std::size_t>(*material_id(materials, name))] = 1;
    return flags;
}

ByMaterial sputter_yields(double threshold, double silicon) {
    // SiO2: La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003). The ideal mask has the same yield
    // (Belen et al. as in ViennaPS), but hardly etches because its density is high.
    constexpr double kOxide = 0.0139;
    ByMaterial yields{std::nullopt,
                      {{"Si", silicon}, {"PolySi", silicon}, {"SiO2", kOxide}, {"Mask", kOxide}}};
    for (const auto& [material, yield, energy] : kMeasured)
        yields.named[material] = three_digits(yield / (std::sqrt(energy) - std::sqrt(threshold)));
    return yields;
}

}  // namespace sidewall::app
