#pragma once
#include <numbers>

#include "app/models/model.hpp"
#include "app/schema/keys.hpp"

// Particles that a recipe describes: what the models with a list of species share.
namespace sidewall::app {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

/// How ions leave the surface that reflects them (flux::Reflection).
struct Cone {
    double cone = 80.0, inflection = 89.0, energy_exponent = 10.0;
};

std::vector<Key> reflection_keys(Cone& cone);
void set_reflection(const Cone& cone, flux::Species& ion);

/// The ions of a plasma: their energy (eV), the source's exponent and the incidence that reflects them.
struct Ions {
    double energy = 100.0, energy_spread = 10.0, ion_exponent = 500.0;
    double reflect_from_deg = 70.0, reflect_to_deg = 90.0;
    Cone cone;
};

std::vector<Key> ion_keys(Ions& ions);

/// The species of these ions, which stops below the least threshold of its \p yields.
flux::Species ion_species(const Ions& ions, std::vector<flux::Yield> yields);

/// Unit direction of a beam tilted from straight down, towards an azimuth counted from x to y; degrees. Along
/// an axis it is that axis to the last bit.
Vec3 tilted_beam(double tilt_deg, double azimuth_deg);

/// Densities by material id, in 1e22 /cm^3: a sum of rates in 1e15 /cm^2/s over one of them is a speed in nm/s.
std::vector<double> densities(const Materials& materials);

/// By material id: 1 for the named materials, else 0.
/// \pre all names are of \p materials.
std::vector<std::uint8_t> marked(const std::vector<std::string>& names, const Materials& materials);

/// A_sp by material of the physical sputtering yield A_sp max(0, sqrt E - sqrt threshold) at normal incidence,
/// in atoms or formula units an ion, for ions of argon's mass. No value for materials without a published one.
/// \param threshold  eV; where A comes from a yield, it fits that yield with this threshold.
/// \param silicon    A_sp of silicon in the model's own table.
ByMaterial sputter_yields(double threshold, double silicon);

/// The gas in a recipe's units: its mean free path, or what that follows from. Absent: no collisions, or a
/// default.
struct Gas {
    std::optional<double> mean_free_path, pressure, temperature, molecule_diameter;
};

std::vector<Key> gas_keys(Gas& gas);

/// Gives the model's last species the mean free path in \p gas, if there is one.
/// \param path  of the gas's keys, e.g. "species[1].", for messages.
/// \throws KeyError if they are given for ions, or do not fit together.
void add_gas(Gas gas, const std::string& path, Model& model);

/// A particle of a recipe's list `species`: its source, of neutrals the gas, of ions energy and reflection. Absent numbers
/// have defaults that depend on the kind.
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

/// The species that the keys describe, without a neutral's sticking and an ion's yields. Ions have sticking 0: reflection
/// decides what becomes of them.
/// \param path  of its keys, e.g. "species[1].", for messages.
/// \throws KeyError for keys that belong to another kind, and for an energy spread or angles that do not fit.
flux::Species species_of(const Particle& particle, const std::string& path);

/// Path of the keys of species \p k of the list `species`.
std::string species_path(std::size_t k);

/// Refuses a list in which two species have the same name.
/// \throws KeyError
void refuse_twins(const std::vector<flux::Species>& species);

}  // namespace sidewall::app
