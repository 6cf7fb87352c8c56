#pragma once
#include <set>
#include <string>

#include "app/models/formula_laws.hpp"

// Coverages of a `formula` step, read from its keys.
namespace sidewall::app {

/// Reads the laws of steady coverages and of those with a rate; names.coverages gets the steady ones first.
/// \param taken  names in use, to which those of the coverages are added.
/// \throws KeyError.
void read_coverages(const Expressions& steady, const Expressions& rates, Formula& formula,
                    std::set<std::string>& taken);

/// Reads the diffusion laws and the materials \p on which they hold (empty: all). Call after read_coverages.
/// \throws KeyError.
void read_diffusion(const Expressions& laws, const std::vector<std::string>& on, const Materials& materials,
                    Formula& formula);

/// A yield of an ion species, written as expressions: each hit counts angular * energy * scale.
struct YieldLaw {
    std::string name, angular = "1", energy = "1";
    ByMaterial scale{1.0};
};

std::vector<Key> yield_keys(YieldLaw& yield);

/// The yield in the form that the tracer evaluates. Angular law: a polynomial in cos, powers 1 to 8, if it is
/// one; else a table. Energy law: linear in sqrt(E) between 1025 points from the threshold up.
/// \param path  prefix of its keys, e.g. "species[0].yields[1].".
/// \throws KeyError for expressions that cannot be read, have no finite value or are nowhere positive.
flux::Yield read_yield(const YieldLaw& law, const std::string& path, const flux::Species& ion,
                       const Names& names);

}  // namespace sidewall::app
