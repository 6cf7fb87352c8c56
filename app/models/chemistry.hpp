#pragma once
#include <array>
#include <cmath>
#include <cstddef>

// Surface kinetics as pure functions. Rates are in sites per area and time, all in the same unit. A rate may
// be zero: the steady state is then the exact one-sided limit.
namespace sidewall::app {

/// Gain and loss of one of several adsorbates. Steady state: gain (free sites) = loss * coverage.
struct Adsorbate {
    double gain = 0.0, loss = 0.0;
};

/// Steady state of adsorbates that compete for free sites: theta_k = r_k / (1 + sum of r), r = gain / loss.
/// Those without loss share all sites by their gains. For two adsorbates: Belen et al., JVST A 23, 99 (2005).
template <std::size_t N>
std::array<double, N> competing_coverages(const std::array<Adsorbate, N>& adsorbates) {
    std::array<double, N> theta{};
    double sum = 1.0, kept = 0.0;
    for (std::size_t k = 0; k < N; ++k) {
        const auto [gain, loss] = adsorbates[k];
        if (!(gain > 0.0)) continue;
        theta[k] = loss > 0.0 ? gain / loss : INFINITY;
        if (std::isinf(theta[k]))
            kept += gain;
        else
            sum += theta[k];
    }
    for (std::size_t k = 0; k < N; ++k)
        theta[k] = kept > 0.0 ? (std::isinf(theta[k]) ? adsorbates[k].gain / kept : 0.0) : theta[k] / sum;
    return theta;
}

/// Coverages of La Magna and Garozzo, J. Electrochem. Soc. 150, F178 (2003).
struct FluorocarbonCoverage {
    double etchant = 0.0;             ///< share of the substrate's sites
    double polymer = 0.0;             ///< 1: the surface is buried and polymer grows
    double etchant_on_polymer = 0.0;  ///< share of the polymer's sites
};

/// Rates per area and time of what arrives and leaves, yields included.
struct FluorocarbonRates {
    double etchant = 0.0;             ///< Gamma_e beta_e
    double etchant_on_polymer = 0.0;  ///< Gamma_e beta_ep
    double polymer = 0.0;             ///< Gamma_p beta_p
    double polymer_removal = 0.0;     ///< Y_p Gamma_i
    double polymer_loss = 1.0;        ///< delta_p
    double enhanced = 0.0;            ///< k_ie Y_ie Gamma_i
    double evaporation = 0.0;         ///< k_ev F_ev
};

/// The steady state of a fluorocarbon plasma's coverages.
inline FluorocarbonCoverage fluorocarbon_coverage(const FluorocarbonRates& r) {
    const auto ratio = [](double part, double whole) { return part > 0.0 ? part / whole : 0.0; };
    FluorocarbonCoverage theta;
    theta.etchant_on_polymer = ratio(r.etchant_on_polymer, r.etchant_on_polymer + r.polymer_removal);
    const double loss = r.polymer_removal * theta.etchant_on_polymer + r.polymer_loss;
    theta.polymer = r.polymer >= loss ? (r.polymer > 0.0 ? 1.0 : 0.0) : r.polymer / loss;
    theta.etchant = ratio(r.etchant * (1.0 - theta.polymer), r.enhanced + r.evaporation + r.etchant);
    return theta;
}

/// Exact coverage after \p time of d theta/dt = (gain (1 - theta) - loss theta) / sites, from \p theta on.
inline double pulsed_coverage(double theta, double gain, double loss, double sites, double time) {
    const double rate = gain + loss;
    if (rate <= 0.0) return theta;
    const double steady = gain / rate;
    return steady + (theta - steady) * std::exp(-rate * time / sites);
}

}  // namespace sidewall::app
