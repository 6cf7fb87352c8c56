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

}  // namespace sidewall::app
