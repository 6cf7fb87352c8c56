// Importance of rays by adjoint solutions. With A e = b the balance, a ray of weight w between a and b that
// is off by a part d of itself changes a mean z e of the emission by
//
//     d w (psi_a - psi_b) (e_b - e_a),      A psi = z
//
// and a ray to the source by d w psi_a (source - e_a). For the relative error of every unknown at once, z is
// a random sign over the emission there: the mean of the squares over a few such z is what the rays from a
// place contribute to the variance, and rays in proportion to its square root are best spent.
#include "flux/radiosity/adjoint_importance.hpp"

#include <algorithm>
#include <cmath>

#include "flux/radiosity/solver.hpp"
#include "flux/random.hpp"

namespace sidewall::flux {
namespace {

using Values = std::vector<double>;

constexpr std::size_t kSigns = 6;    // random z; the square root of a sixth off
constexpr double kTolerance = 1e-2;  // of the responses
constexpr double kFaintest = 1e-6;   // of the brightest emission: what is below need not be as exact
constexpr std::uint32_t kSignStream = 0xfffeffffu;  // no species and no gather has this number

// The rows z.
std::vector<Values> signs_over(const Exchange::State& s, const Values& emitted) {
    double brightest = 0.0;
    for (const double e : emitted) brightest = std::max(brightest, e);
    const RandomKey key = random_key(s.options.seed, s.options.time_step, kSignStream);
    std::vector<Values> rows(kSigns, Values(emitted.size(), 0.0));
    for (std::size_t k = 0; k < kSigns; ++k)
        for (std::size_t i = 0; i < emitted.size(); ++i) {
            const bool up = (draw(key, i, static_cast<std::uint32_t>(k)).word[0] & 1u) != 0;
            const double size = std::max(emitted[i], kFaintest * brightest);
            if (s.profile.unknowns.area[i] > 0.0 && size > 0.0) rows[k][i] = (up ? 1.0 : -1.0) / size;
        }
    return rows;
}

double value_at(const Wedges& w, const Values& x, std::uint32_t triangle, float u, float v) {
    return interpolate(w, x, triangle, static_cast<double>(u), static_cast<double>(v));
}

// Adds what each triangle's rays contribute to the variance of \p species, as a share of all.
void add_variance(const Exchange::State& s, const DiffuseSpecies& species, const RadiosityFlux& flux,
                  const SolveOptions& options, Values& variance) {
    const Solver solver(s, species, options);
    const Wedges& w = s.profile.unknowns;
    Values emitted = by_unknown(s, flux.wedge.flux);
    for (std::size_t i = 0; i < emitted.size(); ++i) emitted[i] *= solver.reemitted()[i];
    const std::vector<Values> responses = solver.respond(signs_over(s, emitted), kTolerance);
    Values own(variance.size(), 0.0);
    for (const SampleGroup& group : s.groups) {
        for (const PairSample& pair : group.pairs) {
            const double change =
                static_cast<double>(pair.weight) * (value_at(w, emitted, pair.b, pair.bu, pair.bv) -
                                                    value_at(w, emitted, pair.a, pair.au, pair.av));
            double squares = 0.0;
            for (const Values& psi : responses)
                squares += std::pow(
                    value_at(w, psi, pair.a, pair.au, pair.av) - value_at(w, psi, pair.b, pair.bu, pair.bv),
                    2.0);
            own[pair.a] += 0.5 * change * change * squares;
            own[pair.b] += 0.5 * change * change * squares;
        }
        const double scale = lobe_scale(species.source_exponent, s.geometry.straight);
        for (const ExitSample& exit : group.exits) {
            const auto cosine = static_cast<double>(exit.cosine);
            const double source =
                cosine > 0.0 ? species.source * scale * lobe(species.source_exponent, cosine) : 0.0;
            const double change =
                static_cast<double>(exit.weight) * (source - value_at(w, emitted, exit.a, exit.au, exit.av));
            double squares = 0.0;
            for (const Values& psi : responses)
                squares += std::pow(value_at(w, psi, exit.a, exit.au, exit.av), 2.0);
            own[exit.a] += change * change * squares;
        }
    }
    double sum = 0.0;
    for (const double v : own) sum += v;
    if (!(sum > 0.0) || !std::isfinite(sum)) return;
    for (std::size_t t = 0; t < own.size(); ++t) variance[t] += own[t] / sum;
}

}  // namespace

void set_importance(Exchange& exchange, std::span<const DiffuseSpecies> species,
                    std::span<const RadiosityFlux> fluxes, const SolveOptions& options) {
    const Exchange::State& s = exchange.state();
    Values variance(s.geometry.mesh.triangles.size(), 0.0);
    for (std::size_t k = 0; k < species.size(); ++k)
        add_variance(s, species[k], fluxes[k], options, variance);
    exchange.set_start_variance(variance);
    place_residual_rays(exchange, fluxes);
}

void place_residual_rays(Exchange& exchange, std::span<const RadiosityFlux> fluxes) {
    const Exchange::State& s = exchange.state();
    const TriangleMesh& mesh = s.geometry.mesh;
    Values shares(mesh.triangles.size(), 0.0);
    for (const RadiosityFlux& flux : fluxes) {
        const Values error = errors_of(expected_bends(mesh, s.wedges, flux.wedge.flux));
        double sum = 0.0;
        for (std::size_t t = 0; t < error.size(); ++t) sum += triangle_area(mesh, t) * error[t];
        for (std::size_t t = 0; t < error.size() && sum > 0.0; ++t) shares[t] += error[t] / sum;
    }
    exchange.set_residual_error(shares);
}

}  // namespace sidewall::flux
