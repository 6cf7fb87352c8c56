#include "app/process/estimate/fastest_speed.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sidewall::app {

double fastest_speed(const Model& model, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double at_first) {
    double fastest = 0.0;
    for (std::size_t n = 0; n < motion.extension.samples.size(); ++n) {
        const std::size_t bare = exposed(stack, motion, n);
        for (std::size_t k = 0; k < stack.layers.size(); ++k) {
            const double v = motion.speed(n, k, Vec3::UnitZ());
            const bool own_film = k > bare && stack.layers[k].material == model.deposit;
            if (std::isfinite(v) && (v > 0.0 || !own_film)) fastest = std::max(fastest, std::abs(v));
        }
    }
    if (stack.coarser) fastest = fastest_speed(model, *stack.coarser, *motion.coarser, fastest);
    if (model.depends_on_normal && fastest > 0.0) fastest = std::max(fastest, model.max_speed.value_or(0.0));
    return std::max(fastest, at_first);
}

double speed_to_stop(const Step& step, const levelset::MaterialStack& stack, const levelset::Motion& motion,
                     double fastest) {
    if (!step.stop_depth) return fastest;
    if (stack.coarser)
        return speed_to_stop(step, *stack.coarser, *motion.coarser, fastest);  // which is everywhere
    const auto height = [](const levelset::SurfaceSample& s) {
        return s.node.z() + static_cast<double>(s.foot.z());
    };
    double lowest = std::numeric_limits<double>::infinity(), speed = 0.0;
    for (const levelset::SurfaceSample& s : motion.extension.samples) lowest = std::min(lowest, height(s));
    for (std::size_t n = 0; n < motion.extension.samples.size(); ++n)
        if (height(motion.extension.samples[n]) < lowest + 1.0)
            speed = std::max(speed, std::abs(motion.speed(n, exposed(stack, motion, n), Vec3::UnitZ())));
    return speed;
}

}  // namespace sidewall::app
