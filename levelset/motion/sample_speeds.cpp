#include "levelset/motion/sample_speeds.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "levelset/motion/crystal_edges.hpp"
#include "surface/basis.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

// The mean speed over a time step of a front that begins in \p layer.
double speed_from(const MaterialStack& stack, const Motion& motion, std::size_t sample, std::size_t layer,
                  const Vec3& normal, double duration) {
    const std::size_t below = stack.layers.size() - 1;
    double speed = motion.law.speed(sample, layer, normal);
    double moved = 0.0, time_left = duration;
    if (layer < below && speed < 0.0) {
        // An etch from below: out of the layer and into the one above.
        const double rest = -static_cast<double>(motion.extension.thickness[sample * below + layer]);
        if (rest > 0.0) {
            if (-speed * time_left <= rest) return speed;
            time_left -= rest / -speed;
            return -(rest - std::min(0.0, motion.law.speed(sample, layer + 1, normal)) * time_left) /
                   duration;
        }
    }
    while (layer > 0 && speed < 0.0) {
        const double depth = static_cast<double>(motion.extension.thickness[sample * below + layer - 1]);
        if (-speed * time_left <= depth - moved) break;
        time_left -= std::max(0.0, depth - moved) / -speed;
        moved = std::max(moved, depth);
        --layer;
        // Skips layers without thickness here.
        const double touching = thinnest_film(stack.domain);
        while (layer > 0 && static_cast<double>(motion.extension.thickness[sample * below + layer - 1]) <=
                                moved + touching)
            --layer;
        speed = std::min(0.0, motion.law.speed(sample, layer, normal));
    }
    return moved > 0.0 ? -(moved - speed * time_left) / duration : speed;
}

// Whether an etch of at most \p distance stays in the layer that is bare at a sample.
bool stays(const MaterialStack& stack, const Motion& motion, std::size_t sample, std::size_t layer,
           double distance) {
    const std::size_t below = stack.layers.size() - 1;
    if (layer < below) {
        const double rest = -static_cast<double>(motion.extension.thickness[sample * below + layer]);
        if (rest > 0.0 && distance > rest) return false;
    }
    return layer == 0 ||
           distance <= static_cast<double>(motion.extension.thickness[sample * below + layer - 1]);
}

// The V of every layer, evaluated once for all samples of a speed class.
template <class Value>
class ByClass {
  public:
    template <class Ask>
    ByClass(const MaterialStack& stack, const Motion& motion, Ask&& ask)
        : motion_(motion), layers_(stack.layers.size()) {
        const std::span<const std::uint8_t> classes = motion.law.speed_class;
        if (classes.empty()) return;
        const std::array<std::size_t, kSpeedClasses> first = first_of_classes(classes);
        table_.resize(kSpeedClasses * layers_);
        for (std::size_t c = 0; c < kSpeedClasses; ++c)
            for (std::size_t k = 0; k < layers_ && first[c] < classes.size(); ++k)
                table_[c * layers_ + k] = ask(first[c], k);
    }
    const Value& at(std::size_t sample, std::size_t layer) const {
        return table_[motion_.law.speed_class[sample] * layers_ + layer];
    }

  private:
    const Motion& motion_;
    std::size_t layers_;
    std::vector<Value> table_;
};

template <class Value, class Ask, class Use>
void each_sample(const MaterialStack& stack, const Motion& motion, Ask&& ask, Use&& use) {
    const ByClass<Value> table(stack, motion, ask);
    const bool by_class = !motion.law.speed_class.empty();
    surface::parallel_each(motion.extension.samples.size(), 1024, [&](std::size_t n) {
        const std::size_t layer = exposed(stack, motion.extension, n);
        if (!motion.law.inert.empty() && motion.law.inert[layer]) return;
        use(n, layer, by_class ? table.at(n, layer) : ask(n, layer));
    });
}

// Sets the speeds at the edges of bodies, which recede from the start: V at the surface's normal there, if
// that is known, or crystal_edge_speed.
void set_edges(const MaterialStack& stack, const Motion& motion, double duration, SampleSpeeds& speeds) {
    using Way = SampleSpeeds::Way;
    const bool crystal = !motion.law.dissipation.empty();
    if (motion.law.depends_on_normal && motion.law.normal.empty() && !crystal) return;
    const std::size_t plain = motion.extension.plain();
    // Whether the cover of a body etches at more than kLike of its rate, so that the edge itself recedes.
    const auto cover_goes = [&](std::size_t k) {
        constexpr double kLike = 0.5;
        if (motion.law.normal.empty()) return false;
        const std::size_t at = motion.extension.nearest[k], body = motion.extension.body[k],
                          cover = exposed(stack, motion.extension, at);
        return cover != body &&
               motion.law.max_etch_rate(at, cover) > kLike * motion.law.max_etch_rate(at, body);
    };
    surface::parallel_each(motion.extension.body.size(), 1024, [&](std::size_t k) {
        const std::size_t n = plain + k, body = motion.extension.body[k];
        if (body == Extension::kNoBody || cover_goes(k)) return;
        if (!motion.law.inert.empty() && motion.law.inert[body]) return;
        const Vec3 normal =
            motion.law.normal.empty() ? Vec3(Vec3::UnitZ()) : motion.law.normal[n].cast<double>().eval();
        const std::optional<double> of_edge =
            crystal ? crystal_edge_speed(
                          stack, motion.law.planes, motion.extension.samples[n], body,
                          motion.law.max_etch_rate(n, body),
                          [&](const Vec3& at) { return speed_from(stack, motion, n, body, at, duration); })
                    : speed_from(stack, motion, n, body, normal, duration);
        if (!of_edge) return;
        const double v = *of_edge;
        if (v == 0.0) speeds.way[n] = Way::still;
        if (!(v < 0.0)) return;
        speeds.first[n] = static_cast<float>(v);
        const bool shaded = !motion.extension.shaded.empty() && motion.extension.shaded[k] != 0;
        speeds.way[n] = shaded ? Way::constant : Way::as_distance;
    });
}

}  // namespace

Vec3 slope_of(const Vec3& normal, const std::function<double(const Vec3&)>& speed_of) {
    constexpr double kTilt = 0.02;
    const auto [s, t] = basis_around(normal);
    Vec3 slope = Vec3::Zero();
    for (const Vec3& along : {Vec3(s), Vec3(t)})
        slope += (speed_of((normal + kTilt * along).normalized()) -
                  speed_of((normal - kTilt * along).normalized())) /
                 (2.0 * kTilt) * along;
    return slope;
}

double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration) {
    return speed_from(stack, motion, sample, exposed(stack, motion.extension, sample), normal, duration);
}

SampleSpeeds sample_speeds(const MaterialStack& stack, const Motion& motion, Scheme scheme, double duration) {
    using Way = SampleSpeeds::Way;
    SampleSpeeds speeds{stack, motion, scheme, duration, {}, {}, {}, {}, 0.0, false};
    const std::size_t count = motion.extension.samples.size();
    speeds.way.assign(count, Way::still);
    speeds.first.resize(std::max(count, std::size_t{1}), 0.0f);
    // A uniform growth keeps phi a distance. Differences are too small beside convex edges: arcs would lag.
    const bool one_growth = motion.law.same_growth && motion.law.keeps_edges && count == 1;
    speeds.all_constant = !motion.law.depends_on_normal && motion.extension.body.empty() && !one_growth;
    if (!motion.law.depends_on_normal) {
        const auto ask = [&](std::size_t n, std::size_t layer) {
            return motion.law.speed(n, layer, Vec3::UnitZ());
        };
        each_sample<double>(stack, motion, ask, [&](std::size_t n, std::size_t layer, double v) {
            if (v < 0.0 && !stays(stack, motion, n, layer, -v * duration))
                v = speed_from(stack, motion, n, layer, Vec3::UnitZ(), duration);
            speeds.first[n] = static_cast<float>(v);
            if (v != 0.0) speeds.way[n] = one_growth ? Way::as_distance : Way::constant;
        });
    } else if (motion.law.beam_speed && scheme == Scheme::lax_friedrichs && motion.law.dissipation.empty()) {
        speeds.second.resize(count);
        const auto set = [&](std::size_t n, std::size_t layer, const BeamSpeed& v) {
            const double etch = std::max({0.0, -v.always, -v.facing - v.always});
            speeds.way[n] = v.facing == 0.0 && v.always == 0.0                               ? Way::still
                            : etch > 0.0 && !stays(stack, motion, n, layer, etch * duration) ? Way::general
                                                                                             : Way::beam;
            speeds.first[n] = static_cast<float>(v.facing);
            speeds.second[n] = static_cast<float>(v.always);
        };
        each_sample<BeamSpeed>(stack, motion, motion.law.beam_speed, set);
        // Nodes at the edge of a body move at its speed, as the floor beside them does.
        surface::parallel_each(motion.extension.body.size(), 1024, [&](std::size_t k) {
            const std::size_t n = motion.extension.plain() + k, body = motion.extension.body[k];
            const BeamSpeed v = motion.law.beam_speed(n, body);
            if (v.facing < 0.0 && v.always <= 0.0) set(n, body, v);
        });
    } else {
        const std::vector<Eigen::Vector3f>& normals = motion.law.normal;
        speeds.slope.resize(normals.size(), Eigen::Vector3f::Zero());
        surface::parallel_each(count, 256, [&](std::size_t n) {
            if (!motion.law.inert.empty() && motion.law.inert[exposed(stack, motion.extension, n)]) return;
            speeds.way[n] = Way::general;
            if (normals.empty() || n >= motion.extension.plain()) return;
            const auto speed_of = [&](const Vec3& normal) {
                return speed_over(stack, motion, n, normal, duration);
            };
            const Vec3 normal = normals[n].cast<double>();
            speeds.first[n] = static_cast<float>(speed_of(normal));
            speeds.slope[n] = slope_of(normal, speed_of).cast<float>();
        });
        for (std::size_t n = 0; n < normals.size(); ++n)
            speeds.fastest_wave = std::max(
                speeds.fastest_wave,
                static_cast<double>(
                    (std::abs(speeds.first[n]) * normals[n].cwiseAbs() + speeds.slope[n].cwiseAbs()).sum()));
    }
    set_edges(stack, motion, duration, speeds);
    return speeds;
}

}  // namespace sidewall::levelset
