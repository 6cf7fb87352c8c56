#pragma once
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "surface/vec3.hpp"

// Particles of a process model, as plain data. Angles in radian, energies in eV, fluxes relative to an open
// horizontal plane. "By material" means one value for every material id, or a single one for all.
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
    specular,  ///< mirrored at the surface
    coned      ///< coned cosine about the specular direction: ions
};

/// Reflection of ions, with parameters of Belen et al., JVST A 23, 99 (2005). Incidence from the normal.
struct Reflection {
    Reemission kind = Reemission::diffuse;
    /// Probability of reflection of a particle that does not stick: 0 below incidence `from`, 1 above `to`,
    /// linear between; 1 if both are 0 (neutrals, mirrors). A particle that is not reflected is absorbed.
    double from = 0.0, to = 0.0;
    double cone = 1.3962634;  ///< the cone's half-angle is pi/2 - min(incidence, cone)
    /// Energy after reflection: normal(E_peak E, spread E) truncated to [0, E]; energy_peak in
    /// reflection.hpp.
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
    polynomial,  ///< (sum of a_k cos^k theta) / (sum of a_k), k = 1, 2, ...; coefficient = {a_1, a_2, ...}
    table        ///< linear between coefficient = values at equally spaced theta from 0 to pi/2
};

/// A yield, tallied beside the arrivals: every hit adds its weight times
///     Y = A max(0, sqrt(E) - sqrt(threshold)) f(theta),
/// or A g(E) f(theta) where `energies` tabulates g, or A f(theta) for a species without energy. The flux of
/// this tally is the yield-weighted flux, e.g. Y_ie Gamma_i / Gamma_i.
struct Yield {
    std::string name;  ///< labels results
    Angular angular = Angular::none;
    double threshold = 0.0;           ///< eV
    std::vector<double> scale{1.0};   ///< A, by material
    std::vector<double> coefficient;  ///< of f, see Angular
    /// Values of g at equally spaced sqrt(E) from sqrt(threshold) to sqrt(energy_top), linear between. Below,
    /// g is 0; above, the last value; negative values count as 0.
    std::vector<double> energies = {};
    double energy_top = 0.0;  ///< eV
};

/// Redeposition of sputtered particles. A hit starts a particle of the hit's weight times `yield`; at each of
/// its own hits it sticks with probability `sticking`, else it is re-emitted diffusely.
struct Redeposition {
    Yield yield;
    Reemission direction =
        Reemission::coned;              ///< of its start; coned, specular: about the ion's specular direction
    std::vector<double> sticking{1.0};  ///< by material
};

/// A bin of a tabulated source: uniform over angles from `beam` and over energies (0 if the species has
/// none).
struct SourceBin {
    double angle_from = 0.0, angle_to = 0.0;    ///< radian, below pi/2
    double energy_from = 0.0, energy_to = 0.0;  ///< eV
    double until = 1.0;                         ///< cumulative share up to this bin; 1 in the last
    bool operator==(const SourceBin&) const = default;
};

/// One sort of particle: a neutral or an ion.
struct Species {
    std::string name = "neutral";
    double source_exponent = 1.0;  ///< n of the source's cos^n about `beam`: 1 thermal, ions 100 to 1000
    std::vector<double> sticking{
        1.0};                    ///< probability in [0, 1], by material; 0 for ions, whose reflection decides
    Vec3 beam = -Vec3::UnitZ();  ///< the source's axis, unit length, downwards; upward ones are redrawn
    bool rotating = false;       ///< the wafer turns: all azimuths of the beam are equally likely
    Energy energy{};
    Reflection reflection{};
    std::vector<SourceBin> bins{};  ///< if any, replace source_exponent and the energies' distribution
    double stop_energy = 0.0;       ///< eV; an ion that has less after a reflection is absorbed
    std::vector<Yield> yields{};    ///< one tally each, beside the arrivals
    std::optional<Redeposition> redeposition{};
    bool desorbs = false;  ///< also starts on the surface, see TraceOptions::emission_by_wedge
    /// b of a source cos (1 + b cos^2) about `beam`, at least -1, as of a sputtered target: under-cosine for
    /// b < 0, over-cosine for b > 0 (Yamamura et al., Radiat. Eff. Defects Solids 118, 237 (1991)). 0:
    /// source_exponent holds.
    double source_beta = 0.0;
    /// Mean free path in the gas, world units. A collision gives a particle an isotropic direction. Only for
    /// species without energy and redeposition; infinite: no collisions.
    double mean_free_path = std::numeric_limits<double>::infinity();
};

/// Number of a species' tallies, which are always in this order: arrivals, each yield, redeposition if any.
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

/// Whether particles of a species only stick or are re-emitted diffusely: neutrals without energy, yields or
/// redeposition, whose sticking alone decides how much is re-emitted.
inline bool only_reemits_diffusely(const Species& species) {
    return species.reflection.kind == Reemission::diffuse && !(species.reflection.to > 0.0) &&
           species.energy.mean == 0.0 && species.yields.empty() && !species.redeposition;
}

/// Whether the source's axis is the vertical.
inline bool is_untilted(const Species& species) {
    return (species.beam + Vec3::UnitZ()).norm() <= 1e-9;
}

/// Whether the paths of both species have the same distribution, so that one pass can trace them together.
/// True of neutrals from equal sources that differ only in their sticking.
inline bool same_paths(const Species& a, const Species& b) {
    return only_reemits_diffusely(a) && only_reemits_diffusely(b) && a.source_exponent == b.source_exponent &&
           a.beam == b.beam && a.rotating == b.rotating && !a.desorbs && !b.desorbs && a.bins == b.bins &&
           a.source_beta == b.source_beta && a.mean_free_path == b.mean_free_path;
}

/// Ions as in Belen et al.: n = 500, 100 +- 10 eV, coned reflection from 70 to 90 degrees; without yields.
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
