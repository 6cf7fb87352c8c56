#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "flux/species.hpp"

namespace sidewall::flux {

/// f(theta) of a yield, for a cosine of the incidence in [0, 1].
inline double angular_factor(const Yield& yield, double cosine) {
    const auto& a = yield.coefficient;
    switch (yield.angular) {
        case Angular::none:
            return 1.0;
        case Angular::cosine:
            return cosine;
        case Angular::sputter:
            return std::max(0.0, (1.0 + a[0] * (1.0 - cosine * cosine)) * cosine);
        case Angular::enhanced:
            return cosine >= 0.5 ? 1.0 : std::max(0.0, 3.0 - 6.0 * std::acos(cosine) * std::numbers::inv_pi);
        case Angular::polynomial: {
            double sum = 0.0, value = 0.0;
            for (std::size_t k = a.size(); k-- > 0;) {
                sum += a[k];
                value = (value + a[k]) * cosine;
            }
            return std::max(0.0, value / sum);
        }
        case Angular::table: {
            const double intervals = static_cast<double>(a.size() - 1);
            const double at = std::acos(cosine) * 2.0 * std::numbers::inv_pi * intervals;
            const std::size_t i = std::min(static_cast<std::size_t>(at), a.size() - 2);
            const double part = at - static_cast<double>(i);
            return std::max(0.0, (1.0 - part) * a[i] + part * a[i + 1]);
        }
    }
    return 0.0;
}

/// g(E) of a yield: max(0, sqrt(E) - sqrt(threshold)) unless it is tabulated; 1 for a species without energy.
inline double energy_factor(const Yield& yield, bool has_energy, double energy) {
    if (has_energy && !yield.energies.empty()) {
        const auto& g = yield.energies;
        const double top = static_cast<double>(g.size() - 1);
        const double from = std::sqrt(yield.threshold), reach = std::sqrt(yield.energy_top) - from;
        const double above = std::sqrt(energy) - from;
        if (above < 0.0) return 0.0;
        const double at = std::min(top, above / reach * top);
        const std::size_t i = std::min(static_cast<std::size_t>(at), g.size() - 2);
        const double part = at - static_cast<double>(i);
        return std::max(0.0, (1.0 - part) * g[i] + part * g[i + 1]);
    }
    return has_energy ? std::max(0.0, std::sqrt(energy) - std::sqrt(yield.threshold)) : 1.0;
}

/// Yield Y = A g(E) f(theta) of a hit on \p material.
inline double yield_of(const Yield& yield, std::size_t material, bool has_energy, double energy,
                       double cosine) {
    return yield.scale[yield.scale.size() == 1 ? 0 : material] * energy_factor(yield, has_energy, energy) *
           angular_factor(yield, cosine);
}

/// Mean of g(E) over the source's energies, by a midpoint rule; 1 for a species without energy.
double mean_energy_factor(const Yield& yield, const Energy& energy);
/// Mean of g(E) over the energies of a bin of a tabulated source.
double mean_energy_factor(const Yield& yield, const SourceBin& bin);

/// Mean yield of a species' particles on an open horizontal wafer of material 0, over the source's angles and
/// energies. Midpoint rules, relative error about 1e-4. \p yield need not be one of the species'.
double mean_yield(const Species& species, const Yield& yield);

}  // namespace sidewall::flux
