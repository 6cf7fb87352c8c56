#pragma once
#include <cstdint>
#include <vector>

#include "levelset/motion/advection_options.hpp"
#include "levelset/motion/motion.hpp"

namespace sidewall::levelset {

/// Mean speed over a time step of \p duration: an etch that reaches another layer continues at its speed.
double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration);

/// The derivative of \p speed_of(n) with respect to the unit normal n at \p normal, in the tangent plane.
Vec3 slope_of(const Vec3& normal, const std::function<double(const Vec3&)>& speed_of);

/// Speeds of the samples in a Runge-Kutta stage, found once for all nodes that share a sample.
struct SampleSpeeds {
    enum class Way : std::uint8_t {
        still,        ///< V is 0
        constant,     ///< V = first, whatever the normal
        as_distance,  ///< V = first, and |grad phi| = 1 is assumed: at the edge of a body that etches, or
                      ///< for a uniform growth
        beam,         ///< V(n) = first max(0, n . d) + second
        general       ///< evaluated at every node, by speed_over
    };
    const MaterialStack& stack;
    const Motion& motion;
    Scheme scheme;
    double duration;
    std::vector<Way> way;              ///< by sample
    std::vector<float> first, second;  ///< by sample; first is 0 where V is, and never empty
    /// By sample, or empty: the derivative of V with respect to the normal at SpeedLaw::normal, in the
    /// tangent plane; first is V there.
    std::vector<Eigen::Vector3f> slope{};
    double fastest_wave = 0.0;  ///< the largest sum over the axes of |dH/dp|, where slope is known
    bool all_constant = false;  ///< every way is still or constant

    /// The sample at which a node's speed is evaluated: for an edge node, that of the closest surface point.
    std::size_t evaluated(std::size_t sample) const {
        const std::size_t plain = motion.extension.plain();
        return sample < plain ? sample : motion.extension.nearest[sample - plain];
    }
    bool moves(std::int32_t sample) const {
        return sample >= 0 && way[static_cast<std::size_t>(sample)] != Way::still;
    }
};
SampleSpeeds sample_speeds(const MaterialStack& stack, const Motion& motion, Scheme scheme, double duration);

}  // namespace sidewall::levelset
