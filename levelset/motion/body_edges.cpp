#include "levelset/motion/body_edges.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "levelset/layers/layer_depths.hpp"
#include "levelset/motion/sample_index.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/rounding.hpp"
#include "surface/parallel.hpp"

namespace sidewall::levelset {
namespace {

// Cells (dx): a body begins at a foot point if at most this deep below; at an edge the mesh is half a cell
// off.
constexpr double kBeginsHere = 0.75;
// Cells (dx): a thinner film is no cover of a body, as the grid holds no gap under it.
constexpr double kThinnestCover = 0.75;

void find_thickness(const MaterialStack& stack, Extension& extension) {
    const std::size_t below = stack.layers.size() - 1;
    const auto& samples = extension.samples;
    // A leaf's samples are consecutive. The range that holds the first of them takes them all, so that the
    // leaf's surroundings are read once.
    const auto leaf = [&](std::size_t n) -> Eigen::Vector3i {
        return samples[n].node.unaryExpr([](int i) { return i >> 3; });
    };
    const auto next_leaf = [&](std::size_t n) {
        while (n > 0 && n < samples.size() && leaf(n) == leaf(n - 1)) ++n;
        return n;
    };
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size(), 128), [&](const auto& range) {
        LayerDepths depths(stack);
        const std::size_t end = next_leaf(range.end());
        for (std::size_t n = next_leaf(range.begin()); n < end; ++n) {
            const std::span<float> depth = std::span(extension.thickness).subspan(n * below, below);
            const Eigen::Vector3i& node = samples[n].node;
            if (!extension.top_alone(n))
                depths.at(node.cast<double>() + samples[n].foot.cast<double>(), node, depth);
        }
    });
}

// Values of a stack's level sets at single nodes, ghosts included.
class StackValues {
  public:
    explicit StackValues(const MaterialStack& stack)
        : stack_(stack), top_(stack.top().getConstUnsafeAccessor()) {
        for (std::size_t k = 0; k + 1 < stack.layers.size(); ++k)
            layers_.push_back(stack.layers[k].phi->getConstUnsafeAccessor());
    }
    float top(const openvdb::Coord& node) const { return top_.getValue(own(node)); }
    float layer(std::size_t k, const openvdb::Coord& node) const {
        const openvdb::Coord c = own(node);
        if (layers_[k].isValueOn(c)) return layers_[k].getValue(c);
        const float background = stack_.top().background();
        return inside(*stack_.layers[k].phi, c) ? -background : background;
    }
    // The lowest layer that holds a solid node.
    std::size_t body(const openvdb::Coord& node, float touching) const {
        std::size_t k = 0;
        while (k < layers_.size() && layer(k, node) > touching) ++k;
        return k;
    }

  private:
    openvdb::Coord own(const openvdb::Coord& node) const {
        if (stack_.domain.owns(node.x(), node.y())) return node;
        return {stack_.domain.source_node(0, node.x()), stack_.domain.source_node(1, node.y()), node.z()};
    }

    const MaterialStack& stack_;
    Grid::ConstUnsafeAccessor top_;
    std::vector<Grid::ConstUnsafeAccessor> layers_;
};

// Whether a layer ends near the surface point at \p nearest: it is bare at a node beside the point, and at
// more than a third of the solid nodes around where it is covered, the cover is thicker than \p cover.
// \param bare_at_point  the layer that is bare at the point. If it is another layer, only it and what it lies
// on count: a mask under a thin film covers the layer. Where the film lies on the layer directly, the film is
// the cover.
bool ends_at(const StackValues& values, std::size_t layer, std::size_t bare_at_point,
             const openvdb::Coord& nearest, float touching, float cover) {
    const auto each_node = [&](int reach, auto&& use) {
        for (int x = -reach; x <= reach; ++x)
            for (int y = -reach; y <= reach; ++y)
                for (int z = -reach; z <= reach; ++z) use(nearest.offsetBy(x, y, z));
    };
    bool is_bare = false;
    each_node(1, [&](const openvdb::Coord& node) {
        is_bare = is_bare || values.layer(layer, node) - values.top(node) <= touching;
    });
    if (!is_bare) return false;
    int thick = 0, thin = 0, under_film = 0;
    each_node(2, [&](const openvdb::Coord& node) {
        const float top = values.top(node);
        if (top >= 0.0f) return;
        const float depth = values.layer(layer, node) - top;
        if (depth <= touching) return;
        if (bare_at_point != layer) {
            const std::size_t body = values.body(node, touching);
            const bool film_alone =
                body <= layer && layer + 1 < bare_at_point &&
                values.layer(layer, node) <= values.layer(bare_at_point - 1, node) + touching;
            under_film += film_alone && depth <= cover ? 1 : 0;
            if (!film_alone && (body <= layer || body > bare_at_point)) return;
        }
        (depth > cover ? thick : thin) += 1;
    });
    return 2 * thick > thin && thick > under_film;
}

// A node at the edge of its body.
struct EdgeNode {
    openvdb::Index node;
    std::uint32_t sample;
    std::uint32_t body;
};

std::vector<EdgeNode> edge_nodes(const MaterialStack& stack, const Extension& extension, const Leaf& leaf,
                                 const std::int32_t* entries) {
    const std::size_t below = stack.layers.size() - 1;
    const auto in_cells = [&](double n) { return static_cast<float>(n * stack.domain.spacing); };
    const auto touching = static_cast<float>(thinnest_film(stack.domain));
    std::vector<EdgeNode> found;
    const StackValues values(stack);
    struct Answer {
        openvdb::Coord nearest;
        std::size_t body, bare;
        bool ends;
    };
    std::vector<Answer> answers;  // few: nodes beside an edge share its points
    const auto ends = [&](const SurfaceSample& at, std::size_t body, std::size_t bare) {
        openvdb::Coord nearest;  // node nearest to the foot point; ties go towards the sample's node
        for (int a = 0; a < 3; ++a)
            nearest[a] = at.node[a] + static_cast<int>(std::lround((1.0f - kTie) * at.foot[a]));
        for (const Answer& answer : answers)
            if (answer.nearest == nearest && answer.body == body && answer.bare == bare) return answer.ends;
        const bool result = ends_at(values, body, bare, nearest, touching, in_cells(kThinnestCover));
        answers.push_back({nearest, body, bare, result});
        return result;
    };
    for (auto it = leaf.cbeginValueOn(); it; ++it) {
        const std::int32_t entry = SampleIndex::sample(entries[it.pos()]);
        if (entry < 0 || *it > 0.0f) continue;
        const auto sample = static_cast<std::size_t>(entry);
        // A body begins here only if it, or a lower one, is near the surface.
        const auto depths = std::span(extension.thickness).subspan(sample * below, below);
        if (std::ranges::none_of(depths, [&](float depth) { return depth <= in_cells(kBeginsHere); }))
            continue;
        const std::size_t bare = exposed(stack, extension, sample),
                          body = values.body(it.getCoord(), touching);
        if (body > bare || body == below) continue;
        if (body < bare && extension.thickness[sample * below + body] > in_cells(kBeginsHere)) continue;
        const SurfaceSample& at = extension.samples[sample];
        if (ends(at, body, bare))
            found.push_back({it.pos(), static_cast<std::uint32_t>(sample), static_cast<std::uint32_t>(body)});
    }
    return found;
}

bool any_layer_at(const MaterialStack& stack, const openvdb::Coord& origin) {
    return std::any_of(stack.layers.begin(), stack.layers.end() - 1, [&](const Layer& layer) {
        return layer.phi->tree().probeConstLeaf(origin) != nullptr;
    });
}

void add_sample(const EdgeNode& edge, const openvdb::Coord& node, std::size_t below, std::int32_t& entry,
                Extension& extension) {
    entry = static_cast<std::int32_t>(extension.samples.size()) | SampleIndex::kShared;
    SurfaceSample sample = extension.samples[edge.sample];
    const Eigen::Vector3i own(node.x(), node.y(), node.z());
    sample.foot += (sample.node - own).cast<float>();
    sample.node = own;
    extension.samples.push_back(sample);
    extension.body.push_back(edge.body);
    extension.nearest.push_back(edge.sample);
    if (!extension.alone.empty()) extension.alone.push_back(0);
    for (std::size_t k = 0; k < below; ++k)
        extension.thickness.push_back(extension.thickness[edge.sample * below + k]);
}

}  // namespace

std::size_t exposed(const MaterialStack& stack, const Extension& extension, std::size_t sample) {
    const std::size_t below = stack.layers.size() - 1;
    const auto touching = static_cast<float>(thinnest_film(stack.domain));
    for (std::size_t k = 0; k < below; ++k)
        if (extension.thickness[sample * below + k] <= touching) return k;
    return below;
}

void find_bodies(const MaterialStack& stack, Extension& extension, Below look_for) {
    const std::size_t below = stack.layers.size() - 1;
    if (below == 0) return;
    extension.thickness.assign(extension.samples.size() * below, stack.top().background());
    if (look_for == Below::nothing) return;
    find_thickness(stack, extension);
    if (look_for == Below::depths) return;

    std::vector<const Leaf*> leaves;
    stack.top().tree().getNodes(leaves);
    std::vector<std::vector<EdgeNode>> edges(leaves.size());
    surface::parallel_each(leaves.size(), 4, [&](std::size_t n) {
        const std::int32_t* entries = extension.sample_of->find(leaves[n]->origin());
        if (entries != nullptr && any_layer_at(stack, leaves[n]->origin()))
            edges[n] = edge_nodes(stack, extension, *leaves[n], entries);
    });
    if (std::all_of(edges.begin(), edges.end(), [](const auto& of_leaf) { return of_leaf.empty(); })) return;
    const auto index = std::make_shared<SampleIndex>(*extension.sample_of);
    for (std::size_t n = 0; n < leaves.size(); ++n)
        for (const EdgeNode& edge : edges[n])
            add_sample(edge, leaves[n]->offsetToGlobalCoord(edge.node), below, index->of(n)[edge.node],
                       extension);
    extension.sample_of = index;
}

}  // namespace sidewall::levelset
