#pragma once
#include "app/models/model.hpp"

// The gas above the wafer, in which neutrals may collide on their way (flux/tracer/gas_collisions.hpp).
namespace sidewall::app {

/// mean_free_path, or what it follows from: pressure, temperature, molecule_diameter.
std::vector<Key> gas_keys();

/// k T / (sqrt(2) pi d^2 p) in metres, from K, m and Pa: a molecule among others of its kind (Bird, Molecular Gas
/// Dynamics, 1994, equation 1.13).
double kinetic_free_path(double temperature, double diameter, double pressure);

/// Gives the model's last species the mean free path that its keys tell, if they tell one.
/// \param path  of the keys, e.g. "species[1].", for messages.
/// \throws KeyError if they are given for ions, or do not fit together.
void add_gas(const Values& values, const std::string& path, Model& model);

}  // namespace sidewall::app
