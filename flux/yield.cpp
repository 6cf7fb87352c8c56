#include "flux/yield.hpp"

#include "flux/sampling.hpp"

namespace sidewall::flux {

double mean_energy_factor(const Yield& yield, const Energy& energy) {
    constexpr int kEnergies = 1024;
    constexpr double kReach = 8.0;  // standard deviations
    if (!(energy.mean > 0.0)) return 1.0;
    double energetic = 0.0, density = 0.0;
    for (int i = 0; i < kEnergies; ++i) {
        const double z = kReach * (2.0 * (i + 0.5) / kEnergies - 1.0), here = energy.mean + energy.sigma * z;
        if (!(here > 0.0)) continue;
        energetic += std::exp(-0.5 * z * z) * energy_factor(yield, true, here);
        density += std::exp(-0.5 * z * z);
    }
    return density > 0.0 ? energetic / density : 0.0;
}

double mean_energy_factor(const Yield& yield, const SourceBin& bin) {
    constexpr int kParts = 16;
    double sum = 0.0;
    for (int i = 0; i < kParts; ++i)
        sum += energy_factor(yield, true,
                             bin.energy_from + (i + 0.5) / kParts * (bin.energy_to - bin.energy_from)) /
               kParts;
    return sum;
}

namespace {

// mean_yield for a tabulated source: midpoint rule with kParts angles in each bin.
double mean_of_bins(const Species& species, const Yield& yield) {
    constexpr int kParts = 16;
    const int azimuths = species.beam.z() == -1.0 ? 1 : 64;
    double sum = 0.0, kept = 0.0, before = 0.0;
    for (const SourceBin& bin : species.bins) {
        double angular = 0.0;
        for (int i = 0; i < kParts; ++i) {
            const double angle = bin.angle_from + (i + 0.5) / kParts * (bin.angle_to - bin.angle_from);
            for (int k = 0; k < azimuths; ++k) {
                const Vec3 d =
                    direction_around(species.beam, std::cos(angle), std::sin(angle), (k + 0.5) / azimuths);
                if (!(d.z() < -1e-6)) continue;
                angular += (bin.until - before) * angular_factor(yield, -d.z());
                kept += bin.until - before;
            }
        }
        sum += angular * mean_energy_factor(yield, bin);
        before = bin.until;
    }
    return kept > 0.0 ? yield.scale[0] * sum / kept : 0.0;
}

}  // namespace

double mean_yield(const Species& species, const Yield& yield) {
    if (!species.bins.empty()) return mean_of_bins(species, yield);
    // On an open wafer every particle arrives, so that the mean is over the source's density of directions.
    // Rotating the wafer changes no incidence.
    constexpr int kPolar = 256;
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
    return kept > 0.0 ? yield.scale[0] * angular / kept * mean_energy_factor(yield, species.energy) : 0.0;
}

}  // namespace sidewall::flux
