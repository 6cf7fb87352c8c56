#pragma once
#include <vector>

#include "app/evaluation/validate.hpp"

// Parts of the table of validation_cases(), a file each.
namespace sidewall::app {

/// Shapes known from closed forms.
std::vector<ValidationCase> validation_shapes();

/// Runs that another simulator has made, too.
std::vector<ValidationCase> validation_simulators();

}  // namespace sidewall::app
