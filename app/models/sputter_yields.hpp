#pragma once
#include "app/schema/keys.hpp"

namespace sidewall::app {

/// A_sp by material of the physical sputtering yield A_sp max(0, sqrt E - sqrt threshold) at normal incidence,
/// in atoms or formula units an ion, for ions of argon's mass. No value for materials without a published one.
/// \param threshold  eV; where A comes from a yield, it fits that yield with this threshold.
/// \param silicon    A_sp of silicon in the model's own table.
ByMaterial sputter_yields(double threshold, double silicon);

}  // namespace sidewall::app
