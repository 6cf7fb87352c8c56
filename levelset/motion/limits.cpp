#include "levelset/motion/limits.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "levelset/block.hpp"
#include "levelset/motion/sample_index.hpp"
#include "levelset/row.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

constexpr float kUnlimited = std::numeric_limits<float>::infinity();
using Values = std::array<float, Leaf::SIZE>;

// The upper limits of phi by the bodies below the surface.
class BodyLimits {
  public:
    BodyLimits(const MaterialStack& stack, const Motion& motion, double duration)
        : stack_(stack), motion_(motion), duration_(duration) {}

    // The largest phi after the time step at a leaf's nodes, by the bodies that they lie in; null: no limit.
    std::unique_ptr<Values> limits(const Leaf& leaf, const float* was) const {
        const std::int32_t* samples = motion_.extension.sample_of->find(leaf.origin());
        if (samples == nullptr) return nullptr;
        std::vector<const Leaf*> layers;
        bool any = false;
        for (std::size_t k = 0; k + 1 < stack_.layers.size(); ++k) {
            layers.push_back(stack_.layers[k].phi->tree().probeConstLeaf(leaf.origin()));
            any = any || layers.back() != nullptr;
        }
        if (!any) return nullptr;
        std::unique_ptr<Values> result;
        for (auto it = leaf.cbeginValueOn(); it; ++it) {
            const std::int32_t sample = SampleIndex::sample(samples[it.pos()]);
            if (sample < 0 || !(was[it.pos()] < 0.0f)) continue;
            const float most = limit(layers, static_cast<std::size_t>(sample), it.pos(), was[it.pos()]);
            if (most == kUnlimited) continue;
            if (!result) {
                result = std::make_unique<Values>();
                result->fill(kUnlimited);
            }
            (*result)[it.pos()] = most;
        }
        return result;
    }

  private:
    float limit(const std::vector<const Leaf*>& layers, std::size_t sample, openvdb::Index node,
                float was) const {
        float least = kUnlimited;
        const auto touching = static_cast<float>(thinnest_film(stack_.domain));
        for (std::size_t k = 1; k <= layers.size(); ++k) {
            if (!layers[k - 1] || !layers[k - 1]->isValueOn(node)) continue;
            if (k < layers.size() && (!layers[k] || !layers[k]->isValueOn(node))) continue;
            const float below = layers[k - 1]->getValue(node);
            const float upper = k < layers.size() ? layers[k]->getValue(node) : was;
            // Only in the body or on its underside; where layers coincide there is no body.
            if (!(upper < 0.0f) || -below > touching || below - upper <= touching) continue;
            const std::size_t own = exposed(stack_, motion_.extension, sample);
            if (k < own) continue;
            const double lost = most_lost(sample, k);
            if (k > own || lost == 0.0)
                least = std::min(least, std::max(upper, -below) + static_cast<float>(lost));
        }
        return least;
    }

    double most_lost(std::size_t sample, std::size_t layer) const {
        if (!motion_.law.inert.empty() && motion_.law.inert[layer]) return 0.0;
        if (!motion_.law.depends_on_normal)
            return std::max(0.0, -motion_.law.speed(sample, layer, Vec3::UnitZ()) * duration_);
        // The normal is unknown here: only a body that etches at no normal is limited.
        const bool inert = motion_.law.max_etch_rate && motion_.law.max_etch_rate(sample, layer) == 0.0;
        return inert ? 0.0 : kInfinity;
    }

    const MaterialStack& stack_;
    const Motion& motion_;
    double duration_;
};

// Loads the limits of a leaf's nodes and of one more node on each side; ghosts take those of their source
// nodes. \returns whether there may be any.
bool load_limits(const Band& band, const Domain& domain, const std::vector<std::unique_ptr<Values>>& own,
                 const openvdb::Coord& origin, Block<1>& block) {
    std::array<const Values*, 3> column{};  // of leaves: below, level with and above the leaf
    int column_x = 0, column_y = 0;
    bool any = false, found = false;
    for (int x = -1; x <= 8; ++x)
        for (int y = -1; y <= 8; ++y) {
            const int i = domain.source_node(0, origin.x() + x), j = domain.source_node(1, origin.y() + y);
            if (!found || i >> 3 != column_x || j >> 3 != column_y) {
                column_x = i >> 3, column_y = j >> 3, found = true;
                for (int n = 0; n < 3; ++n) {
                    const std::int32_t leaf = band.table.find(column_x, column_y, (origin.z() >> 3) + n - 1);
                    const Values* values = leaf < 0 ? nullptr : own[static_cast<std::size_t>(leaf)].get();
                    column[static_cast<std::size_t>(n)] = values;
                    any = any || values != nullptr;
                }
            }
            const auto [below, level, above] = column;
            const auto row = static_cast<std::size_t>((i & 7) << 6 | (j & 7) << 3);
            float* to = &block.value[static_cast<std::size_t>(Block<1>::at(x, y, 0))];
            to[-1] = below ? (*below)[row + 7] : kUnlimited;
            if (level)
                std::copy_n(&(*level)[row], 8, to);
            else
                std::fill_n(to, 8, kUnlimited);
            to[8] = above ? (*above)[row] : kUnlimited;
        }
    return any;
}

// The limits of a leaf's nodes: the lower of their own and of their neighbours' plus dx; null if none.
std::unique_ptr<const Values> with_neighbours(const Leaf& leaf, const Block<1>& own, float dx) {
    auto result = std::make_unique<Values>();
    result->fill(kUnlimited);
    float least = kUnlimited;
    for (int row = 0; row < 64; ++row) {
        const auto active = leaf.getValueMask().getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
        if (active == 0) continue;
        const float* v = &own.value[static_cast<std::size_t>(Block<1>::at(row >> 3, row & 7, 0))];
        Row limit;
        for (std::size_t z = 0; z < kLanes; ++z) {
            const auto n = static_cast<std::ptrdiff_t>(z);
            float beside = kUnlimited;
            for (const int stride : Block<1>::kStride)
                beside = std::min({beside, v[n - stride], v[n + stride]});
            limit[z] = std::min(v[n], beside + dx);
        }
        blend(limit, kLaneMasks[active], result->data() + 8 * row);
    }
    for (const float most : *result) least = std::min(least, most);
    if (least == kUnlimited) return nullptr;
    return result;
}

}  // namespace

Limits::Limits(const MaterialStack& stack, const Band& band, const std::vector<std::uint8_t>& moved,
               const float* before, const Motion& motion, double duration) {
    std::vector<std::unique_ptr<Values>> own(band.leaves.size());
    const BodyLimits bodies(stack, motion, duration);
    const std::vector<std::uint8_t> limiting = with_readers(band, stack.domain, moved);
    const std::vector<std::uint8_t> asked = with_readers(band, stack.domain, limiting);
    surface::parallel_each(own.size(), 4, [&](std::size_t n) {
        if (asked[n]) own[n] = bodies.limits(*band.leaves[n], before + n * Leaf::SIZE);
    });
    std::vector<Limited> limited(own.size());
    surface::parallel_each(own.size(), 4, [&](std::size_t n) {
        if (!limiting[n]) return;
        const Leaf& leaf = *band.leaves[n];
        Block<1> around;
        if (!load_limits(band, stack.domain, own, leaf.origin(), around)) return;
        limited[n] = {leaf.origin(), with_neighbours(leaf, around, static_cast<float>(stack.domain.spacing))};
    });
    for (Limited& leaf : limited)
        if (leaf.most) leaves_.push_back(std::move(leaf));
}

void Limits::keep(Grid& phi) const {
    const float least = std::nextafter(-phi.background(), 0.0f);
    tbb::parallel_for(std::size_t{0}, leaves_.size(), [&](std::size_t n) {
        Leaf* leaf = phi.tree().probeLeaf(leaves_[n].origin);
        if (leaf == nullptr) return;
        float* value = leaf->buffer().data();
        for (std::size_t row = 0; row < 64; ++row) {
            const auto active = leaf->getValueMask().getWord<openvdb::Byte>(static_cast<openvdb::Index>(row));
            const float *most = leaves_[n].most->data() + 8 * row, *v = value + 8 * row;
            int beyond = 0;
            for (std::size_t z = 0; z < kLanes; ++z) beyond |= v[z] > most[z];
            if (beyond == 0) continue;  // most rows; unwritten, they stay in other threads' caches
            Row kept;
            for (std::size_t z = 0; z < kLanes; ++z)
                kept[z] = v[z] > most[z] ? std::max(most[z], least) : v[z];
            blend(kept, kLaneMasks[active], value + 8 * row);
        }
    });
}

}  // namespace sidewall::levelset
