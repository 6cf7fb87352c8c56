#pragma once
#include "app/models/model.hpp"

// Particles that a recipe describes: what the models with a list of species share.
namespace sidewall::app {

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
