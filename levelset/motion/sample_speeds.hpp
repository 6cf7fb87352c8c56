#pragma once
#include <cstdint>
#include <vector>

#include "levelset/motion/advection_options.hpp"
#include "levelset/motion/motion.hpp"

namespace sidewall::levelset {

/// Mean speed over a time step of \p duration: an etch that reaches another layer goes on with that layer's speed.
double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration);

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
    bool all_constant = false;         ///< every way is still or constant

    bool moves(std::int32_t sample) const {
        return sample >= 0 && way[static_cast<std::size_t>(sample)] != Way::still;
    }
};
SampleSpeeds sample_speeds(const MaterialStack& stack, const Motion& motion, Scheme scheme, double duration);

}  // namespace sidewall::levelset
