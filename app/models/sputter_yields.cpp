#include "app/models/sputter_yields.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace sidewall::app {
namespace {

struct Measured {
    const char* material;
    double yield;   // atoms or formula units an ion, normal incidence
    double energy;  // eV, of argon
};

// Milling rates R of argon at 500 eV and normal incidence, in um^3/nC (globalsino.com/EM/page1309.html,
// Practical Electron Microscopy and Database, table 1309), as yields R density e: Al2O3 0.01667, C 0.00733,
// Cr 0.09667, Cu 0.18333, Ge 0.16667. They give 0.51 for silicon and 0.235 for SiO2; the values below give
// 0.60 and 0.252. Tungsten: Eckstein in Sputtering by Particle Bombardment (Springer 2007), Ar on W
// (db-amdis.org, data set 455); within 12 % from 200 to 500 eV, and 2.5 times too much at 100 eV, so near to
// its own threshold of 27 eV.
constexpr Measured kMeasured[] = {
    {"Al2O3", 0.0622, 500.0}, {"Carbon", 0.117, 500.0}, {"Cr", 1.29, 500.0},
    {"Cu", 2.49, 500.0},      {"Ge", 1.18, 500.0},      {"W", 0.270, 200.0},
};

// The measurements deserve no more digits.
double three_digits(double number) {
    return std::stod(fmt::format("{:.3g}", number));
}

}  // namespace

ByMaterial sputter_yields(double threshold, double silicon) {
    // SiO2: La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003). The ideal mask has it, too (Belen et
    // al. as in ViennaPS), and hardly sputters for its density.
    constexpr double kOxide = 0.0139;
    ByMaterial yields{std::nullopt,
                      {{"Si", silicon}, {"PolySi", silicon}, {"SiO2", kOxide}, {"Mask", kOxide}}};
    for (const auto& [material, yield, energy] : kMeasured)
        yields.named[material] = three_digits(yield / (std::sqrt(energy) - std::sqrt(threshold)));
    return yields;
}

}  // namespace sidewall::app
