#include "levelset/motion/sample_speeds.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <span>

namespace sidewall::levelset {

double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration) {
    std::size_t layer = exposed(stack, motion, sample);
    const std::size_t below = stack.layers.size() - 1;
    double speed = motion.law.speed(sample, layer, normal);
    double moved = 0.0, time_left = duration;
    if (layer < below && speed < 0.0) {
        // From below, out of the layer and into what lies on it.
        const double rest = -static_cast<double>(motion.thickness[sample * below + layer]);
        if (rest > 0.0) {
            if (-speed * time_left <= rest) return speed;
            time_left -= rest / -speed;
            return -(rest - std::min(0.0, motion.law.speed(sample, layer + 1, normal)) * time_left) /
                   duration;
        }
    }
    while (layer > 0 && speed < 0.0) {
        const double depth = static_cast<double>(motion.thickness[sample * below + layer - 1]);
        if (-speed * time_left <= depth - moved) break;
        time_left -= std::max(0.0, depth - moved) / -speed;
        moved = std::max(moved, depth);
        --layer;
        // Layers that have no thickness here are not met.
        const double touching = thinnest_film(stack.domain);
        while (layer > 0 &&
               static_cast<double>(motion.thickness[sample * below + layer - 1]) <= moved + touching)
            --layer;
        speed = std::min(0.0, motion.law.speed(sample, layer, normal));
    }
    return moved > 0.0 ? -(moved - speed * time_left) / duration : speed;
}

namespace {

// Whether an etch no faster than `most` stays in the layer that is bare at a sample all through the time
// step.
bool stays(const MaterialStack& stack, const Motion& motion, std::size_t sample, std::size_t layer,
           double distance) {
    const std::size_t below = stack.layers.size() - 1;
    if (layer < below) {
        const double rest = -static_cast<double>(motion.thickness[sample * below + layer]);
        if (rest > 0.0 && distance > rest) return false;
    }
    return layer == 0 || distance <= static_cast<double>(motion.thickness[sample * below + layer - 1]);
}

// The first sample of each kind, by kind; as many as there are samples where none is of it.
std::array<std::size_t, kKinds> first_of_kinds(std::span<const std::uint8_t> kind) {
    using First = std::array<std::size_t, kKinds>;
    First none;
    none.fill(kind.size());
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, kind.size(), 16384), none,
        [&](const auto& range, First first) {
            for (std::size_t n = range.end(); n-- > range.begin();)
                first[kind[n]] = std::min(first[kind[n]], n);
            return first;
        },
        [](First a, const First& b) {
            for (std::size_t k = 0; k < kKinds; ++k) a[k] = std::min(a[k], b[k]);
            return a;
        });
}

// Evaluates a layer's V once for all samples of a kind.
template <class Value>
class ByKind {
  public:
    template <class Ask>
    ByKind(const MaterialStack& stack, const Motion& motion, Ask&& ask)
        : motion_(motion), layers_(stack.layers.size()) {
        if (motion.law.kind.empty()) return;
        const std::array<std::size_t, kKinds> first = first_of_kinds(motion.law.kind);
        table_.resize(kKinds * layers_);
        for (std::size_t kind = 0; kind < kKinds; ++kind)
            for (std::size_t k = 0; k < layers_ && first[kind] < motion.law.kind.size(); ++k)
                table_[kind * layers_ + k] = ask(first[kind], k);
    }
    const Value& at(std::size_t sample, std::size_t layer) const {
        return table_[motion_.law.kind[sample] * layers_ + layer];
    }

  private:
    const Motion& motion_;
    std::size_t layers_;
    std::vector<Value> table_;
};

template <class Value, class Ask, class Use>
void each_sample(const MaterialStack& stack, const Motion& motion, Ask&& ask, Use&& use) {
    const ByKind<Value> table(stack, motion, ask);
    const bool by_kind = !motion.law.kind.empty();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, motion.extension.samples.size(), 1024),
                      [&](const auto& range) {
                          for (std::size_t n = range.begin(); n != range.end(); ++n) {
                              const std::size_t layer = exposed(stack, motion, n);
                              if (!motion.law.inert.empty() && motion.law.inert[layer]) continue;
                              use(n, layer, by_kind ? table.at(n, layer) : ask(n, layer));
                          }
                      });
}

}  // namespace

SampleSpeeds sample_speeds(const MaterialStack& stack, const Motion& motion, Scheme scheme, double duration) {
    using Way = SampleSpeeds::Way;
    SampleSpeeds speeds{stack, motion, scheme, duration, {}, {}, {}, false};
    const std::size_t count = motion.extension.samples.size();
    speeds.way.assign(count, Way::still);
    speeds.first.resize(std::max(count, std::size_t{1}), 0.0f);
    speeds.all_constant = !motion.law.depends_on_normal;
    if (!motion.law.depends_on_normal) {
        const auto ask = [&](std::size_t n, std::size_t layer) {
            return motion.law.speed(n, layer, Vec3::UnitZ());
        };
        each_sample<double>(stack, motion, ask, [&](std::size_t n, std::size_t layer, double v) {
            if (v < 0.0 && !stays(stack, motion, n, layer, -v * duration))
                v = speed_over(stack, motion, n, Vec3::UnitZ(), duration);
            speeds.first[n] = static_cast<float>(v);
            if (v != 0.0) speeds.way[n] = Way::constant;
        });
    } else if (motion.law.beam_speed && scheme == Scheme::lax_friedrichs && motion.law.dissipation.empty()) {
        speeds.second.resize(count);
        each_sample<BeamSpeed>(stack, motion, motion.law.beam_speed,
                               [&](std::size_t n, std::size_t layer, const BeamSpeed& v) {
                                   const double etch = std::max({0.0, -v.always, -v.facing - v.always});
                                   if (etch > 0.0 && !stays(stack, motion, n, layer, etch * duration)) {
                                       speeds.way[n] = Way::general;
                                       return;
                                   }
                                   speeds.first[n] = static_cast<float>(v.facing);
                                   speeds.second[n] = static_cast<float>(v.always);
                                   if (v.facing != 0.0 || v.always != 0.0) speeds.way[n] = Way::beam;
                               });
    } else {
        for (std::size_t n = 0; n < count; ++n)
            if (motion.law.inert.empty() || !motion.law.inert[exposed(stack, motion, n)])
                speeds.way[n] = Way::general;
    }
    return speeds;
}

}  // namespace sidewall::levelset
