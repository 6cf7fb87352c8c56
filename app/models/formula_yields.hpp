#pragma once
#include "app/models/formula_laws.hpp"

// Yields of ions written as expressions, as the data that the tracer evaluates.
namespace sidewall::app {

/// A yield of an ion species: each hit counts angular * energy * scale.
struct YieldLaw {
    std::string name, angular = "1", energy = "1";
    ByMaterial scale{1.0};
};

std::vector<Key> yield_keys(YieldLaw& yield);

/// The yield: a law that is a polynomial in cos without a constant, up to the eighth power, as that; another as a
/// table. Linear in sqrt(E) between 1024 energies from the first that has a yield on.
/// \param path  of its keys, e.g. "species[0].yields[1].".
/// \throws KeyError for expressions that cannot be read, have no finite value or are nowhere positive.
flux::Yield read_yield(const YieldLaw& law, const std::string& path, const flux::Species& ion,
                       const Names& names);

}  // namespace sidewall::app
