#include "flux/yield.hpp"

#include "flux/sampling.hpp"

namespace sidewall::flux {

namespace {

// The mean over a tabulated source, by the middles of parts of its bins.
double mean_of_bins(const Species& species, const Yield& yield) {
    constexpr int kParts = 16;
    const int azimuths = species.beam.z() == -1.0 ? 1 : 64;
    double sum = 0.0, kept = 0.0, before = 0.0;
    for (const SourceBin& bin : species.bins) {
        double angular = 0.0, energetic = 0.0;
        for (int i = 0; i < kParts; ++i) {
            const double part = (i + 0.5) / kParts;
            const double angle = bin.angle_from + part * (bin.angle_to - bin.angle_from);
            energetic +=
                energy_factor(yield, true, bin.energy_from + part * (bin.energy_to - bin.energy_from)) /
                kParts;
            for (int k = 0; k < azimuths; ++k) {
                const Vec3 d =
                    direction_around(species.beam, std::cos(angle), std::sin(angle), (k + 0.5) / azimuths);
                if (!(d.z() < -1e-6)) continue;
                angular += (bin.until - before) * angular_factor(yield, -d.z());
                kept += bin.until - before;
            }
        }
        sum += angular * energetic;
        before = bin.until;
    }
    return kept > 0.0 ? yield.scale[0] * sum / kept : 0.0;
}

}  // namespace

double mean_yield(const Species& species, const Yield& yield) {
    if (!species.bins.empty()) return mean_of_bins(species, yield);
    // Every particle arrives, so that the mean is over the directions as they are drawn. Azimuths of a
    // rotating wafer change no incidence.
    constexpr int kPolar = 256, kEnergies = 1024;
    const int azimuths = species.beam.z() == -1.0 ? 1 : 64;
    double angular = 0.0, kept = 0.0;
    for (int i = 0; i < kPolar; ++i)
        for (int k = 0; k < azimuths; ++k) {
            const Vec3 d = sample_cosine_power(species.beam, species.source_exponent, (i + 0.5) / kPolar,
                                               (k + 0.5) / azimuths);
            if (!(d.z() < -1e-6)) continue;
            angular += angular_factor(yield, -d.z());
            kept += 1.0;
        }
    const auto [mean, sigma] = species.energy;
    const bool has_energy = mean > 0.0;
    double energetic = 0.0, density = 0.0;
    constexpr double kReach = 8.0;  // standard deviations
    for (int i = 0; i < kEnergies; ++i) {
        const double z = kReach * (2.0 * (i + 0.5) / kEnergies - 1.0), energy = mean + sigma * z;
        if (has_energy && !(energy > 0.0)) continue;
        energetic += std::exp(-0.5 * z * z) * energy_factor(yield, has_energy, energy);
        density += std::exp(-0.5 * z * z);
    }
    return kept > 0.0 && density > 0.0 ? yield.scale[0] * angular / kept * energetic / density : 0.0;
}

}  // namespace sidewall::flux
