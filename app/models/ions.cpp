#include "app/models/ions.hpp"

#include <cmath>

namespace sidewall::app {

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

}  // namespace sidewall::app
