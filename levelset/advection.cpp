#include "levelset/advection.hpp"

#include <fmt/format.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/tick_count.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "levelset/block.hpp"
#include "levelset/layer_depths.hpp"
#include "levelset/limits.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/redistance.hpp"
#include "levelset/upwind.hpp"
#include "surface/error.hpp"

namespace sidewall::levelset {

std::size_t exposed(const MaterialStack& stack, const Motion& motion, std::size_t sample) {
    const std::size_t below = stack.layers.size() - 1;
    const auto touching = static_cast<float>(kExposed * stack.domain.spacing);
    for (std::size_t k = 0; k < below; ++k)
        if (motion.thickness[sample * below + k] <= touching) return k;
    return below;
}

namespace {

using LeafManager = openvdb::tree::LeafManager<Grid::TreeType>;
using IndexLeaves = openvdb::tree::LeafManager<const IndexTree>;

// Mean speed over a time step: an etch that reaches another layer goes on with that layer's speed.
double speed_over(const MaterialStack& stack, const Motion& motion, std::size_t sample, const Vec3& normal,
                  double duration) {
    std::size_t layer = exposed(stack, motion, sample);
    const std::size_t below = stack.layers.size() - 1;
    double speed = motion.speed(sample, layer, normal);
    double moved = 0.0, time_left = duration;
    if (layer < below && speed < 0.0) {
        // From below, out of the layer and into what lies on it.
        const double rest = -static_cast<double>(motion.thickness[sample * below + layer]);
        if (rest > 0.0) {
            if (-speed * time_left <= rest) return speed;
            time_left -= rest / -speed;
            return -(rest - std::min(0.0, motion.speed(sample, layer + 1, normal)) * time_left) / duration;
        }
    }
    while (layer > 0 && speed < 0.0) {
        const double depth = static_cast<double>(motion.thickness[sample * below + layer - 1]);
        if (-speed * time_left <= depth - moved) break;
        time_left -= std::max(0.0, depth - moved) / -speed;
        moved = std::max(moved, depth);
        --layer;
        // Layers that have no thickness here are not met.
        const double touching = kExposed * stack.domain.spacing;
        while (layer > 0 &&
               static_cast<double>(motion.thickness[sample * below + layer - 1]) <= moved + touching)
            --layer;
        speed = std::min(0.0, motion.speed(sample, layer, normal));
    }
    return moved > 0.0 ? -(moved - speed * time_left) / duration : speed;
}

template <class SpeedOf>
double hamiltonian(const Vec3& p, SpeedOf&& speed) {
    const double length = p.norm();
    return length > 0.0 ? length * speed(Vec3(p / length)) : 0.0;
}

// |dH/dp| is a central difference over this part of |p|: H has kinks, and is homogeneous in p.
constexpr double kShift = 1e-3, kLeastGradient = 1e-6;

// The largest |dH/dp| by axis at the one-sided gradients and between them.
template <class SpeedOf>
Vec3 local_dissipation(const Vec3& minus, const Vec3& plus, SpeedOf&& speed) {
    Vec3 dissipation = Vec3::Zero();
    for (const Vec3& p : {minus, Vec3(0.5 * (minus + plus)), plus}) {
        const double shift = kShift * std::max(p.norm(), kLeastGradient);
        for (int axis = 0; axis < 3; ++axis) {
            Vec3 low = p, high = p;
            low[axis] -= shift;
            high[axis] += shift;
            dissipation[axis] =
                std::max(dissipation[axis],
                         std::abs(hamiltonian(high, speed) - hamiltonian(low, speed)) / (2.0 * shift));
        }
    }
    return dissipation;
}

// What a Runge-Kutta stage needs besides phi; values per sample where V does not depend on the normal.
struct StageInput {
    const MaterialStack& stack;
    const Motion& motion;
    const AdvectionOptions& options;
    double duration;
    std::vector<float> speed;
};

template <int R>
void hamiltonian_row(const Block<R>& block, int x, int y, const std::int32_t* sample, const StageInput& in,
                     Row& h) {
    const auto dx = static_cast<float>(in.stack.domain.spacing), inv_dx = 1.0f / dx;
    const float* v = &block.value[static_cast<std::size_t>(Block<R>::at(x, y, 0))];
    Row growing{}, etching{};
    std::array<OneSided, 3> d;
    for (std::size_t a = 0; a < 3; ++a) {
        const int stride = Block<R>::kStride[a];
        if constexpr (R == 3)
            one_sided_5(v, stride, inv_dx, dx, d[a]);
        else if constexpr (R == 2)
            one_sided_3(v, stride, inv_dx, dx, d[a]);
        else
            one_sided_1(v, stride, d[a]);
        add_upwind_square(d[a], R > 1, growing, etching);
    }
    for (std::size_t n = 0; n < kLanes; ++n) {
        h[n] = 0.0f;
        if (sample[n] < 0) continue;
        const auto index = static_cast<std::size_t>(sample[n]);
        float speed = 0.0f;
        if (in.motion.depends_on_normal) {
            const Vec3 minus(d[0].minus[n] * inv_dx, d[1].minus[n] * inv_dx, d[2].minus[n] * inv_dx);
            const Vec3 plus(d[0].plus[n] * inv_dx, d[1].plus[n] * inv_dx, d[2].plus[n] * inv_dx);
            const auto speed_of = [&](const Vec3& normal) {
                return speed_over(in.stack, in.motion, index, normal, in.duration);
            };
            if (in.options.scheme == Scheme::lax_friedrichs) {
                const auto& bounds = in.motion.dissipation;
                const Vec3 dissipation = bounds.empty() ? local_dissipation(minus, plus, speed_of)
                                                        : bounds[exposed(in.stack, in.motion, index)];
                const double mean = hamiltonian(Vec3(0.5 * (minus + plus)), speed_of);
                double flux = mean - 0.5 * dissipation.dot(plus - minus);
                if (!bounds.empty()) {
                    // Where V has one sign, so has H: what dissipation alone does to a corner is to fill one
                    // that an etch leaves, or to take from one that grows. Midway between two fronts the mean
                    // is 0.
                    const double sign =
                        mean != 0.0 ? mean : hamiltonian(minus, speed_of) + hamiltonian(plus, speed_of);
                    flux = sign < 0.0 ? std::min(flux, 0.0) : std::max(flux, 0.0);
                }
                h[n] = static_cast<float>(flux);
                continue;
            }
            const Vec3 gradient = minus + plus;
            const double length = gradient.norm();
            speed = length > 0.0 ? static_cast<float>(speed_of(Vec3(gradient / length))) : 0.0f;
        } else {
            speed = in.speed[index];
        }
        h[n] = speed * inv_dx * std::sqrt(speed > 0.0f ? growing[n] : etching[n]);
    }
}

// out = keep * phi0 + (1 - keep) * (phi - dt H(phi)): one stage of a strong-stability-preserving Runge-Kutta
// scheme (Shu and Osher, J. Comput. Phys. 77 (1988) 439). Buffer 1 holds phi0 if keep > 0, buffer 2 receives.
template <int R>
void stage(LeafManager& leaves, const IndexLeaves& samples, const Grid& grid, const StageInput& in,
           float keep) {
    const float background = grid.background();
    const float limit =
        std::nextafter(background, 0.0f);  // a voxel of the band stays one until it is re-distanced
    const auto dt = static_cast<float>(in.duration);
    const std::size_t receive = leaves.auxBuffersPerLeaf();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.leafCount(), 4), [&](const auto& range) {
        const auto accessor = grid.getConstUnsafeAccessor();
        Block<R> block;
        Row h;
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Leaf& leaf = leaves.leaf(n);
            load_block(accessor, in.stack.domain, leaf, background, block);
            const float* phi = leaf.buffer().data();
            const float* phi0 = keep > 0.0f ? leaves.getBuffer(n, 1).data() : nullptr;
            float* out = leaves.getBuffer(n, receive).data();
            std::copy_n(phi, Leaf::SIZE, out);
            const std::int32_t* sample = samples.leaf(n).buffer().data();
            for (int row = 0; row < 64; ++row) {
                const auto first = static_cast<std::size_t>(8 * row);
                const auto active =
                    leaf.getValueMask().template getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
                if (active == 0) continue;
                hamiltonian_row(block, row >> 3, row & 7, sample + first, in, h);
                for (std::size_t z = 0; z < kLanes; ++z) {
                    if (!(active >> z & 1)) continue;
                    const float moved = phi[first + z] - dt * h[z];
                    const float mixed = phi0 ? keep * phi0[first + z] + (1.0f - keep) * moved : moved;
                    out[first + z] = std::clamp(mixed, -limit, limit);
                }
            }
        }
    });
    leaves.swapLeafBuffer(receive);
}

// What each Runge-Kutta stage keeps of phi at the time step's start.
std::span<const float> kept_shares(TimeIntegration scheme) {
    static constexpr float kEuler[] = {0.0f}, kRk2[] = {0.0f, 0.5f}, kRk3[] = {0.0f, 0.75f, 1.0f / 3.0f};
    switch (scheme) {
        case TimeIntegration::rk3:
            return kRk3;
        case TimeIntegration::rk2:
            return kRk2;
        case TimeIntegration::euler:
            break;
    }
    return kEuler;
}

// The same look-up for the voxels of another grid with nearly the same front.
std::shared_ptr<IndexTree> on_voxels_of(const Grid& grid, const IndexTree& sample_of) {
    auto result = std::make_shared<IndexTree>(grid.tree(), -1, openvdb::TopologyCopy());
    openvdb::tree::LeafManager<IndexTree> leaves(*result);
    leaves.foreach ([&](auto& leaf, std::size_t) {
        const auto* from = sample_of.probeConstLeaf(leaf.origin());
        if (from == nullptr) return;
        for (auto it = leaf.beginValueOn(); it; ++it)
            if (from->isValueOn(it.pos())) it.setValue(from->getValue(it.pos()));
    });
    return result;
}

StageInput stage_input(const MaterialStack& stack, const Motion& motion, const AdvectionOptions& options,
                       double duration) {
    StageInput in{stack, motion, options, duration, {}};
    if (motion.depends_on_normal) return in;
    in.speed.resize(motion.extension.samples.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, in.speed.size(), 1024), [&](const auto& range) {
        for (std::size_t n = range.begin(); n != range.end(); ++n)
            in.speed[n] = static_cast<float>(speed_over(stack, motion, n, Vec3::UnitZ(), duration));
    });
    return in;
}

template <int R>
void integrate(MaterialStack& stack, std::span<const Motion> motions, std::size_t stages, double duration,
               const AdvectionOptions& options) {
    Grid& grid = stack.top();
    LeafManager leaves(grid.tree());
    // Buffer 1: phi at the time step's start (Runge-Kutta only); the last one: the stage's result.
    leaves.rebuildAuxBuffers(stages > 1 ? 2 : 1);
    std::optional<StageInput> in;
    std::shared_ptr<IndexTree> sample_of;
    for (std::size_t k = 0; k < stages; ++k) {
        if (k < motions.size()) {
            in.emplace(stage_input(stack, motions[k], options, duration));
            sample_of = motions[k].extension.sample_of;
            if (k > 0) sample_of = on_voxels_of(grid, *sample_of);
        }
        stage<R>(leaves, IndexLeaves(*sample_of), grid, *in, kept_shares(options.time_integration)[k]);
    }
    leaves.removeAuxBuffers();
}

// Marks the nodes of lower layers that were exposed in \p before and did not grow, for cut_layers to set:
// they follow the surface, and nothing that re-distancing changes there can come to lie on them.
void release_exposed(MaterialStack& stack, const Grid& before) {
    const Grid& surface = stack.top();
    for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k) {
        LeafManager leaves(stack.layers[k].phi->tree());
        const float follows = -2.0f * before.background();
        leaves.foreach ([&](Leaf& leaf, std::size_t) {
            const Leaf* old = before.tree().probeConstLeaf(leaf.origin());
            const Leaf* moved = surface.tree().probeConstLeaf(leaf.origin());
            if (!old || !moved) return;
            for (auto it = leaf.beginValueOn(); it; ++it) {
                const openvdb::Index n = it.pos();
                if (old->isValueOn(n) && *it == old->getValue(n) && moved->getValue(n) >= *it)
                    it.setValue(follows);
            }
        });
    }
}

AdvectionSeconds run_stages(MaterialStack& stack, std::span<const Motion> motions, std::size_t stages,
                            double duration, const AdvectionOptions& options) {
    const tbb::tick_count start = tbb::tick_count::now();
    const GridPtr before = stack.layers.size() > 1 ? stack.top().deepCopy() : nullptr;
    switch (options.scheme) {
        case Scheme::weno5:
            integrate<3>(stack, motions, stages, duration, options);
            break;
        case Scheme::weno3:
            integrate<2>(stack, motions, stages, duration, options);
            break;
        case Scheme::lax_friedrichs:
            if (motions.front().dissipation.empty()) {
                integrate<2>(stack, motions, stages, duration, options);
                break;
            }
            [[fallthrough]];
        case Scheme::engquist_osher:
            integrate<1>(stack, motions, stages, duration, options);
            break;
    }
    Grid::TreeType::Ptr limits;
    if (before) {
        limits = limits_of(stack, *before, motions.front(), duration);
        keep_within(stack.top(), *limits);
        release_exposed(stack, *before);
    }
    const tbb::tick_count moved = tbb::tick_count::now();
    redistance(stack.top(), stack.domain);
    if (limits)
        keep_within(stack.top(),
                    *limits);  // distances to a front that turns sharply are off by a part of a cell
    cut_layers(stack);
    return {(moved - start).seconds(), (tbb::tick_count::now() - moved).seconds()};
}

}  // namespace

Motion make_motion(const MaterialStack& stack, Extension extension, SpeedFunction speed,
                   bool depends_on_normal) {
    Motion motion{std::move(extension), std::move(speed), depends_on_normal, {}, {}, {}};
    const std::size_t below = stack.layers.size() - 1;
    if (below == 0) return motion;
    const auto& samples = motion.extension.samples;
    motion.thickness.resize(samples.size() * below);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size(), 512), [&](const auto& range) {
        const LayerDepths depths(stack);
        for (std::size_t n = range.begin(); n != range.end(); ++n) {
            const Eigen::Vector3i& c = samples[n].node;
            const Eigen::Vector3f& foot = samples[n].foot;
            depths.at({c.x() + static_cast<double>(foot.x()), c.y() + static_cast<double>(foot.y()),
                       c.z() + static_cast<double>(foot.z())},
                      std::span(motion.thickness).subspan(n * below, below));
        }
    });
    return motion;
}

double max_speed(const MaterialStack& stack, const Motion& motion) {
    const std::size_t below = stack.layers.size() - 1;
    const auto& samples = motion.extension.samples;
    // Normals enter V(n) only through n . d <= 1 or crystal directions: the grid's axes and diagonals bound
    // it.
    std::vector<Vec3> normals{Vec3::UnitZ()};
    if (motion.depends_on_normal) {
        normals.clear();
        for (int n = 0; n < 27; ++n)
            if (n != 13)
                normals.push_back(
                    Eigen::Vector3i(n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1).cast<double>().normalized());
    }
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, samples.size(), 1024), 0.0,
        [&](const auto& range, double most) {
            for (std::size_t n = range.begin(); n != range.end(); ++n) {
                const std::size_t surface = exposed(stack, motion, n);
                for (std::size_t k = 0; k <= surface; ++k) {
                    const bool reachable =
                        k == surface ||
                        static_cast<double>(motion.thickness[n * below + k]) < stack.domain.spacing;
                    if (!reachable) continue;
                    for (const Vec3& normal : normals) {
                        const double v = motion.speed(n, k, normal);
                        if (!std::isfinite(v)) {
                            const auto& c = samples[n].node;
                            throw NumericsError(fmt::format(
                                "the surface speed at ({:.4g}, {:.4g}, {:.4g}) is {}: check the step's rates "
                                "and fluxes",
                                stack.domain.coordinate(0, c.x()), stack.domain.coordinate(1, c.y()),
                                stack.domain.coordinate(2, c.z()), v));
                        }
                        most = std::max(most, std::abs(v));
                    }
                }
            }
            return most;
        },
        [](double a, double b) { return std::max(a, b); });
}

AdvectionSeconds advect(MaterialStack& stack, std::span<const Motion> motions, double duration,
                        const AdvectionOptions& options) {
    return run_stages(stack, motions, stage_count(options.time_integration), duration, options);
}

AdvectionSeconds advect(MaterialStack& stack, const Motion& motion, double duration,
                        const AdvectionOptions& options) {
    return advect(stack, std::span(&motion, 1), duration, options);
}

void advect_to_stage(MaterialStack& stack, std::span<const Motion> motions, double duration,
                     const AdvectionOptions& options) {
    run_stages(stack, motions, motions.size(), duration, options);
}

}  // namespace sidewall::levelset
