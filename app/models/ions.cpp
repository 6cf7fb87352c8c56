#include "app/models/ions.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace sidewall::app {
namespace {

struct Measured {
    const char* material;
    double yield;   // atoms or formula units an ion, normal incidence
    double energy;  // eV, of argon
};

// Milling rates R of argon at 500 eV and normal incidence, in um^3/nC (globalsino.com/EM/page1309.html,
// Practical Electron Microscopy and Database, table 1309), as yields R density e: Al2O3 0.01667, C 0.00733,
// Cr 0.09667, Cu 0.18333, Ge 0.16667. They give 0.51 for silicon and 0.235 for SiO2; the values below give
// 0.60 and 0.252. Tungsten: Eckstein in Sputtering by Particle Bombardment (Springer 2007), Ar on W
// (db-amdis.org, data set 455); within 12 % from 200 to 500 eV, and 2.5 times too much at 100 eV, so near to
// its own threshold of 27 eV.
constexpr Measured kMeasured[] = {
    {"Al2O3", 0.0622, 500.0}, {"Carbon", 0.117, 500.0}, {"Cr", 1.29, 500.0},
    {"Cu", 2.49, 500.0},      {"Ge", 1.18, 500.0},      {"W", 0.270, 200.0},
};

// The measurements deserve no more digits.
double three_digits(double number) {
    return std::stod(fmt::format("{:.3g}", number));
}

}  // namespace

std::vector<Key> reflection_keys(Cone& cone) {
    return {{"cone", &cone.cone, "degree",
             "theta_min: half-angle of the reflected cone is 90 less incidence or this", within(0.0, 90.0)},
            {"inflection", &cone.inflection, "degree", "theta_i of the energy a reflected ion keeps",
             within(1.0, 89.99)},
            {"energy_exponent", &cone.energy_exponent, "", "n_l of that energy", within(0.0, 1e3)}};
}

void set_reflection(const Cone& cone, flux::Species& ion) {
    ion.reflection.cone = kRadiansPerDegree * cone.cone;
    ion.reflection.inflection = kRadiansPerDegree * cone.inflection;
    ion.reflection.exponent = cone.energy_exponent;
}

std::vector<Key> ion_keys(Ions& p) {
    std::vector<Key> keys = {
        {"energy", &p.energy, "eV", "mean energy of the ions", positive_to(1e6), "ion_energy"},
        {"energy_spread", &p.energy_spread, "eV", "its standard deviation", within(0.0, 1e6),
         "ion_energy_spread"},
        {"ion_exponent", &p.ion_exponent, "", "n of the ions' cos^n", within(0.0, 1e6)},
        {"reflect_from_deg", &p.reflect_from_deg, "degree", "incidence from which ions start to be reflected",
         within(0.0, 90.0), "reflection_from"},
        {"reflect_to_deg", &p.reflect_to_deg, "degree", "incidence from which all are", within(0.0, 90.0),
         "reflection_to"}};
    append_keys(keys, reflection_keys(p.cone));
    return keys;
}

flux::Species ion_species(const Ions& p, double threshold) {
    flux::Species ion = flux::ion("ion", {p.energy, p.energy_spread}, p.ion_exponent);
    ion.reflection.from = kRadiansPerDegree * p.reflect_from_deg;
    ion.reflection.to = kRadiansPerDegree * p.reflect_to_deg;
    if (ion.reflection.to <= ion.reflection.from)
        throw KeyError("reflect_to_deg", "must be greater than reflect_from_deg");
    set_reflection(p.cone, ion);
    ion.stop_energy = threshold;
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
    // SiO2: La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003). The ideal mask has it, too (Belen et
    // al. as in ViennaPS), and hardly sputters for its density.
    constexpr double kOxide = 0.0139;
    ByMaterial yields{std::nullopt,
                      {{"Si", silicon}, {"PolySi", silicon}, {"SiO2", kOxide}, {"Mask", kOxide}}};
    for (const auto& [material, yield, energy] : kMeasured)
        yields.named[material] = three_digits(yield / (std::sqrt(energy) - std::sqrt(threshold)));
    return yields;
}

}  // namespace sidewall::app
