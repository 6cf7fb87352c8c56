#pragma once
#include <cstddef>
#include <cstdint>

namespace sidewall::levelset {

/// Spatial discretisation of d(phi)/dt + V |grad phi| = 0.
enum class Scheme : std::uint8_t { engquist_osher, weno3, weno5, lax_friedrichs };

enum class TimeIntegration : std::uint8_t { euler, rk2, rk3 };

/// Number of Runge-Kutta stages of a scheme; each may have separate speeds.
constexpr std::size_t stage_count(TimeIntegration scheme) {
    return scheme == TimeIntegration::euler ? 1 : scheme == TimeIntegration::rk2 ? 2 : 3;
}

/// How the front is moved.
struct AdvectionOptions {
    Scheme scheme = Scheme::weno3;
    TimeIntegration time_integration = TimeIntegration::euler;
    double cfl = 0.5;  ///< the front moves at most this fraction of a grid spacing a time step, in
                       ///< (0, 0.5]: beyond, the schemes are unstable
    bool operator==(const AdvectionOptions&) const = default;
};

/// Width in leaves of the margin around a level's columns (levelset/layers/levels.hpp) that a scheme and the
/// re-distancing after it need.
constexpr int margin_for(const AdvectionOptions& options) {
    const int reach = options.scheme == Scheme::weno5 ? 3 : options.scheme == Scheme::engquist_osher ? 1 : 2;
    // A stage reads `reach` nodes, re-distancing four, and the layers beside a node one, of a leaf's eight.
    return static_cast<int>(stage_count(options.time_integration)) * reach + 4 < 8 ? 1 : 2;
}

}  // namespace sidewall::levelset
