#pragma once
#include <cstdint>
#include <vector>

#include "levelset/motion/advection_options.hpp"
#include "levelset/motion/motion.hpp"

namespace sidewall::levelset {

/// Mean speed over a time step of \p duration: an etch that reaches another layer goes on with that layer's speed.
double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration);

/// The derivative of \p speed_of(n) by the unit normal n at \p normal, along the surface.
Vec3 slope_of(const Vec3& normal, const std::function<double(const Vec3&)>& speed_of);

/// What a Runge-Kutta stage needs to know of the samples' speeds, found once for all nodes that share them.
struct SampleSpeeds {
    enum class Way : std::uint8_t {
        still,        ///< V is 0
        constant,     ///< V = first, whatever the normal
        as_distance,  ///< V = first, and |grad phi| = 1: nodes at the edge of a body that etches; one growth
                      ///< everywhere
        beam,         ///< V(n) = first max(0, n . d) + second
        general       ///< evaluated at every node, by speed_over
    };
    const MaterialStack& stack;
    const Motion& motion;
    Scheme scheme;
    double duration;
    std::vector<Way> way;              ///< by sample
    std::vector<float> first, second;  ///< by sample; the first ones are 0 where V is, and never empty
    /// By sample, or empty: the derivative of V by the normal at SpeedLaw::normal, along the surface; V is first there.
    std::vector<Eigen::Vector3f> slope{};
    double fastest_wave = 0.0;  ///< the largest sum over the axes of |dH/dp|, where slope is known
    bool all_constant = false;  ///< every way is still or constant

    /// The sample that a node moves by whose speed is evaluated there: of an edge node, that of the nearest surface point.
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
