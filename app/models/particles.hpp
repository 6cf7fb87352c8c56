#pragma once
#include "app/models/model.hpp"

// Particles that a recipe describes: what the models with a list of species share.
namespace sidewall::app {

/// name, kind, the source and its tilt, of neutrals the gas, and of ions energy and reflection.
std::vector<Key> particle_keys();

/// The species that they describe, without a neutral's sticking and an ion's yields. Ions have sticking 0: reflection
/// decides what becomes of them.
/// \param path  of its keys, e.g. "species[1].", for messages.
/// \throws KeyError for keys that belong to another kind, and for an energy spread or angles that do not fit.
flux::Species particle(const Values& values, const std::string& path);

bool is_ion(const Values& values);

/// Path of the keys of species \p k of the list `species`.
std::string species_path(std::size_t k);

/// Refuses a list in which two species have the same name.
/// \throws KeyError
void refuse_twins(const std::vector<flux::Species>& species);

}  // namespace sidewall::app
