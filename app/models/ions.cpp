#include "app/models/ions.hpp"

#include <cmath>

namespace sidewall::app {

std::vector<Key> ion_keys(double source_exponent) {
    return {{"energy",
             100.0,
             "eV",
             "mean energy of the ions",
             {.min = 0.0, .max = 1e6, .above_min = true},
             "ion_energy"},
            {"energy_spread",
             10.0,
             "eV",
             "its standard deviation",
             {.min = 0.0, .max = 1e6},
             "ion_energy_spread"},
            {"ion_exponent", source_exponent, "", "n of the ions' cos^n", {.min = 0.0, .max = 1e6}},
            {"reflect_from_deg",
             70.0,
             "degree",
             "incidence from which ions start to be reflected",
             {.min = 0.0, .max = 90.0},
             "reflection_from"},
            {"reflect_to_deg",
             90.0,
             "degree",
             "incidence from which all are",
             {.min = 0.0, .max = 90.0},
             "reflection_to"},
            {"cone",
             80.0,
             "degree",
             "theta_min: half-angle of the reflected cone is 90 less incidence or this",
             {.min = 0.0, .max = 90.0}},
            {"inflection",
             89.0,
             "degree",
             "theta_i of the energy a reflected ion keeps",
             {.min = 1.0, .max = 89.99}},
            {"energy_exponent", 10.0, "", "n_l of that energy", {.min = 0.0, .max = 1e3}}};
}

flux::Species ion_species(const Values& values, double threshold) {
    flux::Species ion = flux::ion("ion", {values.get<double>("energy"), values.get<double>("energy_spread")},
                                  values.get<double>("ion_exponent"));
    ion.reflection.from = kRadiansPerDegree * values.get<double>("reflect_from_deg");
    ion.reflection.to = kRadiansPerDegree * values.get<double>("reflect_to_deg");
    if (ion.reflection.to <= ion.reflection.from)
        throw KeyError("reflect_to_deg", "must be greater than reflect_from_deg");
    ion.reflection.cone = kRadiansPerDegree * values.get<double>("cone");
    ion.reflection.inflection = kRadiansPerDegree * values.get<double>("inflection");
    ion.reflection.exponent = values.get<double>("energy_exponent");
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

}  // namespace sidewall::app
