#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "flux/radiosity/radiosity.hpp"

namespace sidewall::flux {

/// Converts a quantity from wedges to unknowns: area-weighted means over the wedges of each unknown.
std::vector<double> by_unknown(const Exchange::State& s, std::span<const double> wedge);

/// Solves the balance of one species on the rays of an exchange.
class Solver {
  public:
    /// All arguments must outlive the solver.
    /// \throws as solve_flux() for values out of range and arrays that do not fit.
    Solver(const Exchange::State& state, const DiffuseSpecies& species, const SolveOptions& options);

    struct Answer {
        std::vector<double> flux;  ///< by wedge
        std::uint32_t iterations = 0;
    };
    /// Solves for the flux with the samples of some groups of rays.
    /// \param groups bits of the groups.
    /// \param guess  a flux by wedge to start from; may be empty.
    /// \throws as solve_flux.
    Answer solve(std::uint32_t groups, std::span<const double> guess, double tolerance) const;

    /// Solutions of the balance of all rays for the given right-hand sides, by unknown. The balance is
    /// symmetric, so these are adjoint solutions, too.
    std::vector<std::vector<double>> respond(const std::vector<std::vector<double>>& rights,
                                             double tolerance) const;

    /// Error of the absorption matrix where sticking varies over an element, as a flux by unknown: the
    /// arrivals by the balance, (absorption + M) (1 - s) flux, less \p flux. 0 where sticking is uniform.
    std::vector<double> absorption_error(std::span<const double> flux) const;

    /// 1 - s, by unknown, never 0.
    std::span<const double> reemitted() const { return reemitted_; }

  private:
    const Exchange::State& s_;
    const DiffuseSpecies& species_;
    const SolveOptions& options_;
    std::vector<double> reemitted_, emission_;  // by unknown
    WedgeMatrix absorption_;
    std::optional<CoarseGridSolver> coarse_;  // of all groups: good enough for some of them
};

}  // namespace sidewall::flux
