#pragma once
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "surface/vec3.hpp"

// Particles of a process model: plain data, no code. Angles in radian, energies in eV, fluxes relative to an
// open horizontal plane. "By material" is a value for every material id, or one for all.
namespace sidewall::flux {

/// Energy at the source: normal(mean, sigma) truncated to positive values. Mean 0: a species without energy,
/// whose yields then depend on the angle alone.
struct Energy {
    double mean = 0.0;
    double sigma = 0.0;
};

/// Direction of a particle that does not stick.
enum class Reemission : unsigned char {
    diffuse,   ///< Lambert about the surface normal: thermal neutrals
    specular,  ///< mirrored
    coned      ///< coned cosine about the mirrored direction: ions
};

/// Reflection of ions, parameters of Belen et al., JVST A 23, 99 (2005). Incidence is measured from the
/// normal.
struct Reflection {
    Reemission kind = Reemission::diffuse;
    /// Probability that a particle that does not stick is reflected: 0 below `from`, 1 above `to`, linear
    /// between. With both 0 every one is (neutrals, mirrors). What is not reflected is absorbed.
    double from = 0.0, to = 0.0;
    double cone = 1.3962634;  ///< half-angle of the cone: pi/2 - min(incidence, cone)
    /// Energy left: normal(E_peak E, spread E) truncated to [0, E]; see energy_peak in reflection.hpp.
    double inflection = 1.55334303;
    double exponent = 10.0;
    double spread = 0.1;
};

/// Dependence of a yield on the incidence theta.
enum class Angular : unsigned char {
    none,        ///< 1
    cosine,      ///< cos theta
    sputter,     ///< max(0, (1 + B sin^2 theta) cos theta); coefficient = {B}
    enhanced,    ///< 1 for cos theta >= 1/2, else max(0, 3 - 6 theta / pi)
    polynomial,  ///< sum of a_k cos^k theta over k = 1, 2, ..., by the sum of a_k; coefficient = {a_1, a_2,
                 ///< ...}
    table        ///< linear between coefficient = values at equally spaced theta from 0 to pi/2
};

/// A tally beside the arrivals: every hit adds its weight times
///     Y = A max(0, sqrt(E) - sqrt(threshold)) f(theta),
/// and A f(theta) for a species without energy; A g(E) f(theta) where `energies` tabulates g. So its flux is the yield-weighted flux, e.g. Y_ie Gamma_i /
/// Gamma_i.
struct Yield {
    std::string name;  ///< labels results
    Angular angular = Angular::none;
    double threshold = 0.0;           ///< eV
    std::vector<double> scale{1.0};   ///< A, by material
    std::vector<double> coefficient;  ///< see Angular
    /// g at sqrt(E) equally spaced from sqrt(threshold), below which it is 0, to sqrt(energy_top), linear between,
    /// negative values as 0; above, the last.
    std::vector<double> energies = {};
    double energy_top = 0.0;  ///< eV
};

/// Sputtered particles: a second generation of weight `yield`, which sticks at each of its hits with probability
/// `sticking`, else is re-emitted diffusely.
struct Redeposition {
    Yield yield;
    Reemission direction =
        Reemission::coned;              ///< it starts in; of coned and specular: about the ion's mirrored one
    std::vector<double> sticking{1.0};  ///< by material
};

/// A bin of a tabulated source: uniform over angles from `beam` and over energies, which are 0 for a species
/// without.
struct SourceBin {
    double angle_from = 0.0, angle_to = 0.0;    ///< radian, below pi/2
    double energy_from = 0.0, energy_to = 0.0;  ///< eV
    double until = 1.0;                         ///< its share and those of the bins before it; 1 of the last
    bool operator==(const SourceBin&) const = default;
};

/// Particles of one kind.
struct Species {
    std::string name = "neutral";
    double source_exponent = 1.0;  ///< n of the source's cos^n about `beam`: 1 thermal, 100 to 1000 ions
    std::vector<double> sticking{
        1.0};                    ///< probability in [0, 1], by material; 0 for ions, whose reflection decides
    Vec3 beam = -Vec3::UnitZ();  ///< the source's axis, unit length, downwards; upward flights are dropped
    bool rotating = false;       ///< the wafer turns: every azimuth of the beam is as likely
    Energy energy{};
    Reflection reflection{};
    std::vector<SourceBin> bins{};  ///< if any, in place of source_exponent and of how energies scatter
    double stop_energy = 0.0;       ///< an ion that a reflection leaves with less is absorbed
    std::vector<Yield> yields{};    ///< a tally each, beside the arrivals
    std::optional<Redeposition> redeposition{};
    bool desorbs = false;  ///< particles of it start on the surface, too: TraceOptions::emission_by_wedge
    /// b of the source's cos (1 + b cos^2) about `beam`, at least -1, in place of source_exponent: what a sputtered
    /// target sends, under-cosine below 0 and over-cosine above (Yamamura et al., Radiat. Eff. Defects Solids 118, 237
    /// (1991)). 0: source_exponent counts.
    double source_beta = 0.0;
    /// Between collisions in the gas, which turn a particle into any direction as likely. Only for species without
    /// energy and redeposition; infinite: none collides.
    double mean_free_path = std::numeric_limits<double>::infinity();
};

/// Fluxes a species yields, in this order everywhere: arrivals, each of its yields, redeposition if it has
/// any.
inline std::size_t tally_count(const Species& species) {
    return 1 + species.yields.size() + (species.redeposition ? 1 : 0);
}

/// Names of a species' fluxes: its own, then "species_yield", then "species_redeposited".
inline std::vector<std::string> tally_names(const Species& species) {
    std::vector<std::string> names{species.name};
    for (const Yield& yield : species.yields) names.push_back(species.name + "_" + yield.name);
    if (species.redeposition) names.push_back(species.name + "_redeposited");
    return names;
}

/// Whether particles of a species do nothing but stick or get re-emitted diffusely: neutrals without energy, yields
/// or redeposition, whose sticking alone decides how much is re-emitted.
inline bool goes_on_diffusely(const Species& species) {
    return species.reflection.kind == Reemission::diffuse && !(species.reflection.to > 0.0) &&
           species.energy.mean == 0.0 && species.yields.empty() && !species.redeposition;
}

/// Whether the source's axis is the vertical.
inline bool is_untilted(const Species& species) {
    return (species.beam + Vec3::UnitZ()).norm() <= 1e-9;
}

/// Whether paths of both species have the same distribution, so that one pass can trace them together: neutrals
/// from the same source that differ in their sticking alone.
inline bool same_paths(const Species& a, const Species& b) {
    return goes_on_diffusely(a) && goes_on_diffusely(b) && a.source_exponent == b.source_exponent &&
           a.beam == b.beam && a.rotating == b.rotating && !a.desorbs && !b.desorbs && a.bins == b.bins &&
           a.source_beta == b.source_beta && a.mean_free_path == b.mean_free_path;
}

/// Ions of Belen et al.: n = 500, 100 +- 10 eV, coned reflection from 70 to 90 degrees, no yields yet.
inline Species ion(std::string name, Energy energy = {100.0, 10.0}, double source_exponent = 500.0) {
    Species species;
    species.name = std::move(name);
    species.source_exponent = source_exponent;
    species.sticking = {0.0};
    species.energy = energy;
    species.reflection = {.kind = Reemission::coned,
                          .from = 70.0 * std::numbers::pi / 180.0,
                          .to = 90.0 * std::numbers::pi / 180.0};
    return species;
}

}  // namespace sidewall::flux
