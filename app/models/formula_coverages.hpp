#pragma once
#include <set>
#include <string>

#include "app/models/formula_laws.hpp"

// The coverages of a `formula` step, from its keys.
namespace sidewall::app {

/// Reads `coverages` and `coverage_rates`; names.coverages has the steady ones first.
/// \param taken  names of other things, which gets those of the coverages.
/// \throws KeyError.
void read_coverages(const Values& values, Formula& formula, std::set<std::string>& taken);

/// Reads `diffusion` and `diffuses_on`, after read_coverages.
/// \throws KeyError.
void read_diffusion(const Values& values, const Materials& materials, Formula& formula);

}  // namespace sidewall::app
