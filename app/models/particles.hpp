#pragma once
#include <numbers>

#include "app/models/model.hpp"
#include "app/schema/keys.hpp"

// The particles that a recipe describes, shared by the models that have species.
namespace sidewall::app {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// Reflection of ions (flux::Reflection), in degree: `cone`, which makes the half-angle of the reflected cone
/// 90 - min(incidence, cone), and the angle of inflection.
struct Cone {
    double cone = 80.0, inflection = 89.0, energy_exponent = 10.0;
};

std::vector<Key> reflection_keys(Cone& cone);

/// Keys of all models of plasma etching: the thresholds E_sp and E_ie in eV, and B_sp.
Key sputter_threshold_key(double& threshold);
Key sputter_angle_key(double& coefficient);
Key enhanced_threshold_key(double& threshold);
void set_reflection(const Cone& cone, flux::Species& ion);

/// Ions of a plasma: energy and its standard deviation (eV), exponent n of the source's cos^n, and the
/// incidence (degree) from which some and from which all are reflected.
struct Ions {
    double energy = 100.0, energy_spread = 10.0, ion_exponent = 500.0;
    double reflect_from_deg = 70.0, reflect_to_deg = 90.0;
    Cone cone;
};

std::vector<Key> ion_keys(Ions& ions);

/// The species of these ions. An ion stops below the smallest threshold of its \p yields.
flux::Species ion_species(const Ions& ions, std::vector<flux::Yield> yields);

/// Unit direction of a beam tilted from straight down towards an azimuth, counted from x to y; both in
/// degree. A component along x or y that is 0 but for rounding is exactly 0.
Vec3 tilted_beam(double tilt_deg, double azimuth_deg);

/// Density of each material by id, in 1e22 /cm^3. Rates in 1e15 /cm^2/s over a density give nm/s.
std::vector<double> densities(const Materials& materials);

/// By material id: 1 for the named materials, else 0.
/// \pre \p materials has all names.
std::vector<std::uint8_t> marked(const std::vector<std::string>& names, const Materials& materials);

/// A_sp by material of the sputtering yield A_sp max(0, sqrt E - sqrt threshold) at normal incidence, in
/// atoms or formula units an ion of argon's mass. None for materials without a published yield.
/// \param threshold  in eV. An A_sp that comes from a measured yield reproduces it with this threshold.
/// \param silicon    A_sp of silicon in the model's table.
ByMaterial sputter_yields(double threshold, double silicon);

/// The gas of a recipe: its mean free path or what determines it. No value: no collisions, or a default.
struct Gas {
    std::optional<double> mean_free_path, pressure, temperature, molecule_diameter;
};

std::vector<Key> gas_keys(Gas& gas);

/// Sets the mean free path of the model's last species from \p gas, if it gives one.
/// \param path  prefix of the gas's keys, e.g. "species[1].", for messages.
/// \throws KeyError if the keys are given for ions, or contradict each other.
void add_gas(Gas gas, const std::string& path, Model& model);

/// A particle of a recipe's list `species`: its source; for neutrals also the gas, for ions energy and
/// reflection. Numbers without a value take the defaults of the kind.
struct Particle {
    std::string name, kind = "neutral";
    std::optional<double> source_exponent, source_beta;
    std::string source_file;
    double tilt_deg = 0.0, azimuth_deg = 0.0;
    bool rotating = false;
    std::optional<double> energy, energy_spread, reflect_from_deg, reflect_to_deg;
    Gas gas;

    bool is_ion() const { return kind == "ion"; }
};

std::vector<Key> particle_keys(Particle& particle);

/// The species that the keys describe, still without sticking (neutrals) or yields (ions). Ions get sticking
/// 0: reflection decides whether they leave.
/// \param path  prefix of the keys, e.g. "species[1].", for messages.
/// \throws KeyError for keys of the other kind, a spread above the energy and angles in the wrong order.
flux::Species species_of(const Particle& particle, const std::string& path);

/// Prefix of the keys of species \p k of the list `species`, e.g. "species[1].".
std::string species_path(std::size_t k);

/// Refuses a list in which two species have the same name.
/// \throws KeyError
void refuse_duplicate_names(const std::vector<flux::Species>& species);

}  // namespace sidewall::app
