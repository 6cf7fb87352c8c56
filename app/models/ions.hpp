#pragma once
#include <numbers>

#include "app/models/model.hpp"

// What the plasma models share: the keys of their ions, and the numbers by material.
namespace sidewall::app {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// energy, energy_spread, ion_exponent and the angles of reflection.
std::vector<Key> ion_keys(double source_exponent = 500.0);

/// The species they describe, without yields, that stops below \p threshold (eV).
flux::Species ion_species(const Values& values, double threshold);

/// Unit direction of a beam tilted from straight down, towards an azimuth counted from x to y; degrees. Along
/// an axis it is that axis to the last bit.
Vec3 tilted_beam(double tilt_deg, double azimuth_deg);

/// A_sp by material of the physical sputtering yield A_sp max(0, sqrt E - sqrt threshold) at normal incidence,
/// in atoms or formula units an ion, for ions of argon's mass. No value for materials without a published one.
/// \param threshold  eV; where A comes from a yield, it fits that yield with this threshold.
/// \param silicon    A_sp of silicon in the model's own table.
ByMaterial sputter_yields(double threshold, double silicon);

/// sum(rates) / rho is in nm/s. By material id, 1e22 /cm^3.
std::vector<double> densities(const Materials& materials);

}  // namespace sidewall::app
