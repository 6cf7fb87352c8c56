#pragma once
#include <stdexcept>
#include <string>

#include "surface/files/file.hpp"

// Built-in models written as formula models, for tests that compare the two.
namespace sidewall::test {

/// The shipped quick recipe configs/quick/\p name with its only step replaced by \p step.
inline std::string restated(const std::string& name, const std::string& step) {
    const std::string text = surface::read_whole_file(SIDEWALL_SOURCE_DIR "/configs/quick/" + name);
    const std::size_t begin = text.find("[[step]]"), end = text.find("[flux]");
    if (begin == std::string::npos || end == std::string::npos)
        throw std::runtime_error(name + ": has no step before [flux]");
    return text.substr(0, begin) + step + text.substr(end);
}

/// The step of sf6o2_hole.toml as a formula.
inline const std::string kSf6 = R"TOML([[step]]
model = "formula"
duration = 20.0
species = [
    { name = "ion", kind = "ion", energy = 100.0, energy_spread = 10.0, source_exponent = 1000.0, yields = [
        { name = "sputter", angular = "(1 + 9.3*(1 - cos^2))*cos", energy = "sqrt(E) - sqrt(20)", scale = { Si = 0.0337, Mask = 0.0139 } },
        { name = "enhanced", angular = "cos >= 0.5 ? 1 : 3 - 6*acos(cos)/pi", energy = "sqrt(E) - sqrt(15)", scale = 7.0 },
        { name = "removal", angular = "cos >= 0.5 ? 1 : 3 - 6*acos(cos)/pi", energy = "sqrt(E) - sqrt(10)", scale = 2.0 } ] },
    { name = "etchant", sticking = "0.7*(1 - theta_e - theta_p)" },
    { name = "oxygen", sticking = "1 - theta_e - theta_p" },
]
parameters = { ions = 10.0, fluorine = 4500.0, O = 800.0, k_sigma = 300.0, beta_sigma = 0.04 }
rate = { Si = "-1e-3*(ions*ion_sputter + theta_e*(k_sigma/4 + ions*ion_enhanced))/density", default = "-1e-3*ions*ion_sputter/density" }
[step.coverages]  # of two that compete for free sites: a/(1 + a + b) with a and b the gains over the losses
theta_e = "fluorine*etchant/(k_sigma + 2*ions*ion_enhanced) / (1 + fluorine*etchant/(k_sigma + 2*ions*ion_enhanced) + O*oxygen/(beta_sigma + ions*ion_removal))"
theta_p = "O*oxygen/(beta_sigma + ions*ion_removal) / (1 + fluorine*etchant/(k_sigma + 2*ions*ion_enhanced) + O*oxygen/(beta_sigma + ions*ion_removal))"

)TOML";

/// The step of teos_trench.toml as a formula.
inline const std::string kTeos = R"TOML([[step]]
model = "formula"
duration = 1.0
species = [{ name = "precursor", sticking = "0.1*theta^0.5" }]
coverages = { theta = "min(1, max(0, precursor))" }
rate = "0.3*max(0, precursor)^1.5"
deposit = "SiO2"

)TOML";

}  // namespace sidewall::test
