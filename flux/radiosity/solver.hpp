#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "flux/radiosity/radiosity.hpp"

namespace sidewall::flux {

/// A quantity by wedge as means over the wedges that are one unknown.
std::vector<double> by_unknown(const Exchange::State& s, std::span<const double> wedge);

/// The balance of one species on the rays of an exchange.
class Solver {
  public:
    /// All arguments must outlive the solver.
    /// \throws as solve_flux for values out of range and arrays that do not fit.
    Solver(const Exchange::State& state, const DiffuseSpecies& species, const SolveOptions& options);

    struct Answer {
        std::vector<double> flux;  ///< by wedge
        std::uint32_t iterations = 0;
    };
    /// The flux from some of the groups of rays.
    /// \param groups their bits.
    /// \param guess  a flux by wedge to start from; may be empty.
    /// \throws as solve_flux.
    Answer solve(std::uint32_t groups, std::span<const double> guess, double tolerance) const;

    /// Solutions of the balance of all rays for any right-hand sides, by unknown. It is symmetric: they are
    /// adjoint, too.
    std::vector<std::vector<double>> respond(const std::vector<std::vector<double>>& rights,
                                             double tolerance) const;

    /// Error of the absorption where sticking varies over an element, as a flux by unknown: arrivals by the
    /// balance, emission and absorption together, less \p flux by unknown. 0 where sticking is uniform.
    std::vector<double> absorption_error(std::span<const double> flux) const;

    /// 1 - s, by unknown, never 0.
    std::span<const double> reemitted() const { return reemitted_; }

  private:
    const Exchange::State& s_;
    const DiffuseSpecies& species_;
    const SolveOptions& options_;
    std::vector<double> reemitted_, emission_;  // by unknown
    WedgeMatrix absorption_;
    std::optional<CoarseGridSolver> coarse_;  // of all groups: close enough for some of them
};

}  // namespace sidewall::flux
