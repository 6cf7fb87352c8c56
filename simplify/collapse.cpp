#include "simplify/collapse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "simplify/collapse_impl.hpp"
#include "simplify/frozen_vertices.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"

namespace sidewall::simplify {

CollapseEngine::Impl::Impl(const TriangleMesh& m, const Weights& w, std::span<const std::uint8_t> fixed)
    : input(m), weights(w), mesh(m) {
    const std::size_t n = input.vertices.size();
    for (const std::uint32_t h : mesh.leaving) vertices += h != kNoHalfedge;
    const std::vector<std::uint8_t> frozen = frozen_vertices(input, fixed);
    for (std::size_t v = 0; v < n; ++v)
        if (frozen[v]) mesh.state[v].constraint.kind = VertexKind::frozen;
    source.resize(n);
    std::iota(source.begin(), source.end(), 0u);
    witness.resize(n);
    for (std::size_t v = 0; v < n; ++v) witness[v] = mesh.position(static_cast<std::uint32_t>(v));
    where.assign(mesh.corner.size(), BucketQueue::kNone);
}

bool CollapseEngine::Impl::transition_edge(std::uint32_t h) const {
    const auto held = [](const VertexState& s) {
        return s.constraint.kind == VertexKind::frozen || (s.flags & kRegion) != 0;
    };
    return !held(mesh.state[mesh.start(h)]) && !held(mesh.state[mesh.end(h)]);
}

double CollapseEngine::Impl::edge_length(std::uint32_t h) const {
    return (mesh.position(mesh.end(h)) - mesh.position(mesh.start(h))).norm() / mesh.scale;
}

CollapseEngine::CollapseEngine(const TriangleMesh& mesh, const Weights& weights,
                               std::span<const std::uint8_t> fixed)
    : impl_(std::make_unique<Impl>(mesh, weights, fixed)) {}
CollapseEngine::~CollapseEngine() = default;

void CollapseEngine::set_features(std::span<const std::uint8_t> features) {
    const std::size_t n = impl_->input.vertices.size();
    if (features.size() != n)
        throw GeometryError(
            fmt::format("{} feature flags for {} vertices: give one a vertex", features.size(), n));
    for (std::size_t v = 0; v < n; ++v) {
        std::uint8_t& flags = impl_->mesh.state[v].flags;
        flags = static_cast<std::uint8_t>((flags & ~kFeature) | (features[v] != 0 ? kFeature : 0));
    }
    reset_region();
}

void CollapseEngine::reset_region() {
    for (VertexState& state : impl_->mesh.state)
        state.flags =
            static_cast<std::uint8_t>((state.flags & ~kRegion) | (state.flags & kFeature ? kRegion : 0));
}

std::size_t CollapseEngine::grow_region() {
    CollapseMesh& mesh = impl_->mesh;
    std::vector<std::uint32_t> joins;
    impl_->each_edge([&](std::uint32_t h) {
        const std::uint32_t a = mesh.start(h), b = mesh.end(h);
        if (mesh.flagged(a, kRegion) != mesh.flagged(b, kRegion))
            joins.push_back(mesh.flagged(a, kRegion) ? b : a);
    });
    std::size_t added = 0;
    for (const std::uint32_t v : joins) {
        added += !mesh.flagged(v, kRegion);
        mesh.state[v].flags |= kRegion;
    }
    return added;
}

std::size_t CollapseEngine::run(const CollapsePass& pass) {
    const std::size_t before = impl_->vertices;
    impl_->pass = pass;
    if (before <= pass.target_vertices) return 0;
    impl_->run();
    return before - impl_->vertices;
}

void CollapseEngine::report_to(std::function<void(std::size_t)> progress) {
    impl_->progress = std::move(progress);
}

void CollapseEngine::set_max_lengths(std::span<const double> graded, std::span<const double> fixed) {
    const std::size_t n = impl_->input.vertices.size();
    for (const auto& [lengths, kept] :
         {std::pair{graded, &impl_->max_length_at[0]}, {fixed, &impl_->max_length_at[1]}}) {
        if (lengths.size() != n && !lengths.empty())
            throw GeometryError(
                fmt::format("{} edge lengths for {} vertices: give one a vertex", lengths.size(), n));
        kept->resize(lengths.size());
        for (std::size_t v = 0; v < lengths.size(); ++v)
            (*kept)[v] = static_cast<float>(lengths[v] * impl_->mesh.scale);
    }
}

std::size_t CollapseEngine::vertex_count() const {
    return impl_->vertices;
}

std::pair<double, double> CollapseEngine::transition_edges() const {
    double shortest = kInfinity, longest = 0.0;
    impl_->each_edge([&](std::uint32_t h) {
        if (!impl_->transition_edge(h)) return;
        const double length = impl_->edge_length(h);
        shortest = std::min(shortest, length);
        longest = std::max(longest, length);
    });
    return {shortest, longest};
}

TriangleMesh CollapseEngine::take_mesh() const {
    const CollapseMesh& mesh = impl_->mesh;
    const TriangleMesh& input = impl_->input;
    const Box3 box = bounding_box(input);
    TriangleMesh result;
    result.vertices.reserve(impl_->vertices);
    std::vector<std::uint32_t> renamed(input.vertices.size(), 0);
    for (std::uint32_t v = 0; v < renamed.size(); ++v) {
        if (mesh.leaving[v] == kNoHalfedge) continue;
        renamed[v] = static_cast<std::uint32_t>(result.vertices.size());
        if (impl_->source[v] != Impl::kMoved) {
            result.vertices.push_back(input.vertices[impl_->source[v]]);
            continue;
        }
        // Adding the centre back rounds; the box and its sides must not.
        Vec3 p = mesh.to_world(mesh.position(v)).cwiseMax(box.min).cwiseMin(box.max);
        move_into(mesh.state[v].constraint.planes, p, box.min, box.max);
        result.vertices.push_back(p);
    }
    const Attribute* material = input.triangle_attribute("material");
    if (material) result.triangle_attributes.push_back({material->name, 1, material->type, {}});
    for (std::uint32_t t = 0; t < input.triangles.size(); ++t) {
        if (mesh.removed(3 * t)) continue;
        result.triangles.push_back(
            {renamed[mesh.corner[3 * t]], renamed[mesh.corner[3 * t + 1]], renamed[mesh.corner[3 * t + 2]]});
        if (material) result.triangle_attributes[0].values.push_back(material->values[t]);
    }
    return result;
}

}  // namespace sidewall::simplify
