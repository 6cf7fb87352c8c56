#include "levelset/grid.hpp"

#include <openvdb/tools/Prune.h>
#include <openvdb/tree/LeafManager.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "levelset/grid_leaves.hpp"
#include "levelset/openvdb_grid.hpp"
#include "levelset/rounding.hpp"
#include "surface/error.hpp"
#include "surface/extraction/marching_cubes.hpp"

// The only declaration needed of <openvdb/openvdb.h>, which includes every grid type: compiling it costs half
// as much again as <openvdb/Grid.h>.
namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {
OPENVDB_API void initialize();
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb

namespace sidewall::levelset {

void initialize() {
    static const bool once = [] {
        openvdb::initialize();
        return true;
    }();
    (void)once;
}

GridPtr make_grid(const Domain& domain) {
    initialize();
    GridPtr grid = Grid::create(static_cast<float>(kHalfWidth * domain.spacing));
    // The transform is for other programs only. OpenVDB refuses scales that it takes for zero.
    constexpr double kLeastScale = 1e-4;
    if (domain.spacing > kLeastScale) {
        const auto transform = openvdb::math::Transform::createLinearTransform(domain.spacing);
        transform->postTranslate(openvdb::Vec3d(domain.min[0], domain.min[1], 0.0));
        grid->setTransform(transform);
    }
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    return grid;
}

GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance, double z_min,
                    double z_max) {
    return sample_grid(domain, distance, [&](const Vec3&, double) { return distance; }, z_min, z_max, {});
}

GridPtr sample_grid(const Domain& domain, const std::function<double(const Vec3&)>& distance,
                    const DistanceNear& near, double z_min, double z_max, const std::function<bool()>& stop,
                    const LeafChoice& where) {
    GridPtr grid = make_grid(domain);
    const double dx = domain.spacing, band = kHalfWidth * dx, leaf_side = 8.0 * dx;
    const float background = grid->background();
    const int first = static_cast<int>(std::floor(z_min / dx)) >> 3,
              last = static_cast<int>(std::ceil(z_max / dx)) >> 3;
    const int columns[2] = {(domain.last_node(0) >> 3) + 1, (domain.last_node(1) >> 3) + 1};
    // A leaf can only meet the band if the distance at its centre is below band + half its diagonal.
    const double half_diagonal = 0.5 * std::sqrt(3.0) * leaf_side, reach = band + half_diagonal;
    const auto world = [&](const openvdb::Coord& c) {
        return Vec3(domain.coordinate(0, c.x()), domain.coordinate(1, c.y()), domain.coordinate(2, c.z()));
    };
    tbb::enumerable_thread_specific<std::vector<std::unique_ptr<Leaf>>> made;
    const auto make_leaf = [&](const openvdb::Coord& origin, const Vec3& centre) {
        const auto local = near(centre, half_diagonal);
        auto leaf = std::make_unique<Leaf>(origin, background, false);
        bool any = false;
        for (openvdb::Index offset = 0; offset < Leaf::SIZE; ++offset) {
            const openvdb::Coord c = leaf->offsetToGlobalCoord(offset);
            const auto d = static_cast<float>(without_rounding(local(world(c)), dx));
            const bool active = domain.owns(c.x(), c.y()) && std::abs(d) < background;
            any |= active;
            leaf->setValueOnly(offset, active ? d : std::copysign(background, d));
            if (active) leaf->setValueOn(offset);
        }
        if (any) made.local().push_back(std::move(leaf));
    };
    std::atomic<bool> stopped{false};
    tbb::parallel_for(0, columns[0] * columns[1], [&](int n) {
        if (where && !where(n / columns[1], n % columns[1])) return;
        for (int k = first; k <= last && !stopped; ++k) {
            if (stop && stop()) stopped = true;
            const openvdb::Coord origin(8 * (n / columns[1]), 8 * (n % columns[1]), 8 * k);
            const Vec3 centre = world(origin) + Vec3::Constant(0.5 * leaf_side);
            const double beyond = std::abs(distance(centre)) - reach;
            if (!(beyond > 0.0))
                make_leaf(origin, centre);
            else  // skip the leaves above that the surface is too far from, too
                k += static_cast<int>(std::min(beyond / leaf_side, static_cast<double>(last - k)));
        }
    });
    if (stopped) throw Interrupted("");
    for (auto& list : made)
        for (auto& leaf : list) grid->tree().addLeaf(leaf.release());
    return grid;
}

double distance_at(const Grid& grid, const Domain& domain, const Vec3& point) {
    const Vec3 index = domain.to_index(point);
    const auto accessor = grid.getConstUnsafeAccessor();
    const double background = static_cast<double>(grid.background());
    int base[3];
    double t[3];
    for (int a = 0; a < 3; ++a) {
        base[a] = static_cast<int>(std::floor(index[a]));
        t[a] = index[a] - base[a];
    }
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const int d[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
        double weight = 1.0;
        for (int a = 0; a < 3; ++a) weight *= d[a] ? t[a] : 1.0 - t[a];
        if (weight == 0.0) continue;
        const openvdb::Coord c(domain.source_node(0, base[0] + d[0]), domain.source_node(1, base[1] + d[1]),
                               base[2] + d[2]);
        const Leaf* leaf = accessor.probeConstLeaf(c);
        sum += weight * (leaf              ? static_cast<double>(leaf->getValue(c))
                         : inside(grid, c) ? -background
                                           : background);
    }
    return sum;
}

std::array<double, 2> band_z_range(const Grid& grid, const Domain& domain) {
    openvdb::CoordBBox box;
    if (!grid.tree().evalActiveVoxelBoundingBox(box))
        throw NumericsError(
            "the surface has vanished: no material boundary is left in the domain; shorten the step");
    return {box.min().z() * domain.spacing, box.max().z() * domain.spacing};
}

void trim_band(Grid& grid, const Domain& domain) {
    const float background = grid.background();
    openvdb::tree::LeafManager<Grid::TreeType> leaves(grid.tree());
    std::atomic<bool> any_empty{false};
    leaves.foreach ([&](Leaf& leaf, std::size_t) {
        if (!trim_leaf(leaf, domain, background)) any_empty = true;
    });
    if (any_empty) openvdb::tools::pruneInactive(grid.tree());
}

void add_edges(const surface::SharpVertices& sharp, TriangleMesh& mesh) {
    if (mesh.vertex_attributes.empty() && sharp.kind.empty()) return;
    if (mesh.vertex_attributes.empty())
        mesh.vertex_attributes.push_back({kEdgeAttribute, 1, Scalar::int32, {}});
    std::vector<double>& edge = mesh.vertex_attributes.back().values;
    edge.resize(mesh.vertices.size(), 0.0);
    for (std::size_t n = 0; n < sharp.kind.size(); ++n)
        edge[sharp.first + n] = static_cast<double>(sharp.kind[n]);
}

TriangleMesh extract_surface(const Grid& grid, const Domain& domain, surface::SharpEdges edges) {
    TriangleMesh mesh;
    add_edges(surface::marching_cubes(GridLeaves(grid, domain).list(), lateral_grid(domain), mesh, edges),
              mesh);
    return mesh;
}

}  // namespace sidewall::levelset
