#pragma once
#include "app/models/model.hpp"

// The gas above the wafer, in which neutrals may collide on their way (flux/tracer/gas_collisions.hpp).
namespace sidewall::app {

/// The gas in a recipe's units: its mean free path, or what that follows from. Absent: no collisions, or a default.
struct Gas {
    std::optional<double> mean_free_path, pressure, temperature, molecule_diameter;
};

std::vector<Key> gas_keys(Gas& gas);

/// k T / (sqrt(2) pi d^2 p) in metres, from K, m and Pa: a molecule among others of its kind (Bird, Molecular Gas
/// Dynamics, 1994, equation 1.13).
double kinetic_free_path(double temperature, double diameter, double pressure);

/// Gives the model's last species the mean free path in \p gas, if there is one.
/// \param path  of the gas's keys, e.g. "species[1].", for messages.
/// \throws KeyError if they are given for ions, or do not fit together.
void add_gas(Gas gas, const std::string& path, Model& model);

}  // namespace sidewall::app
