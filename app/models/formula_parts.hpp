#pragma once
#include <set>
#include <string>

#include "app/models/formula_laws.hpp"

// The coverages of a `formula` step, from its keys.
namespace sidewall::app {

/// Reads the laws of the coverages in steady state and of those that take time; names.coverages has the steady ones first.
/// \param taken  names of other things, which gets those of the coverages.
/// \throws KeyError.
void read_coverages(const Expressions& steady, const Expressions& rates, Formula& formula,
                    std::set<std::string>& taken);

/// Reads the laws of diffusion on the materials named, all if none is, after read_coverages.
/// \throws KeyError.
void read_diffusion(const Expressions& laws, const std::vector<std::string>& on, const Materials& materials,
                    Formula& formula);

// Yields of ions written as expressions, as the data that the tracer evaluates.
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
