#include "levelset/meshes/volume.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "levelset/meshes/extract.hpp"
#include "levelset/openvdb_grid.hpp"
#include "surface/parallel.hpp"
#include "surface/turn.hpp"

namespace sidewall::levelset {
namespace {

// Cells: second difference of a circle with a radius of two cells. A larger one is a kink.
constexpr double kMostBend = 0.5;

// Harmonic mean of two second differences: close to both if they are similar, small if only one is large (a
// kink), and 0 if their signs differ.
double harmonic_mean(double a, double b) {
    return a * b > 0.0 ? 2.0 * a * b / (a + b) : 0.0;
}

// Signed distance to the front within a grid cell: trilinear between the corners, corrected along each axis
// by second differences.
class CellDistance {
  public:
    CellDistance(const Grid::ConstUnsafeAccessor& grid, const Domain& domain, const std::array<int, 3>& low) {
        const auto at = [&](int x, int y, int z) {
            return static_cast<double>(grid.getValue(
                {domain.source_node(0, low[0] + x), domain.source_node(1, low[1] + y), low[2] + z}));
        };
        const double most = kMostBend * domain.spacing;
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
                for (int k = 0; k < 2; ++k) corner_[i][j][k] = at(i, j, k);
                for (int axis = 0; axis < 3; ++axis) {
                    std::array<double, 4> v;  // along a cell edge, with one node beyond either end
                    for (int k = 0; k < 4; ++k)
                        v[k] = axis == 0 ? at(k - 1, i, j) : axis == 1 ? at(i, k - 1, j) : at(i, j, k - 1);
                    const double first = v[0] - 2.0 * v[1] + v[2], last = v[1] - 2.0 * v[2] + v[3];
                    smooth_ = smooth_ && std::abs(first) < most && std::abs(last) < most;
                    bend_[axis][i][j] = harmonic_mean(first, last);
                }
            }
    }
    bool smooth() const { return smooth_; }
    // \param s  position from the cell's low corner, in cells.
    double at(const Vec3& s) const {
        const auto share = [](int high, double along) { return high ? along : 1.0 - along; };
        double sum = 0.0;
        for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
                for (int k = 0; k < 2; ++k)
                    sum += share(i, s.x()) * share(j, s.y()) * share(k, s.z()) * corner_[i][j][k];
                for (int axis = 0; axis < 3; ++axis)
                    sum -= 0.5 * s[axis] * (1.0 - s[axis]) * share(i, s[axis == 0 ? 1 : 0]) *
                           share(j, s[axis == 2 ? 1 : 2]) * bend_[axis][i][j];
            }
        return sum;
    }

  private:
    double corner_[2][2][2], bend_[3][2][2];
    bool smooth_ = true;
};

// By triangle of a layer's surface: volume between it and the front that it stands for, from the distance at
// its edges' midpoints; 0 at edges of the mesh and on wafers of several levels.
auto volumes_beyond(const TriangleMesh& mesh, const MaterialStack& stack, std::size_t layer) {
    return
        [&mesh, &domain = stack.domain, &phi = *stack.layers[layer].phi, coarser = stack.coarser != nullptr,
         edges = mesh.vertex_attribute(kEdgeAttribute)](std::size_t t) {
            const auto& corners = mesh.triangles[t];
            const auto on_edge = [&](std::uint32_t v) { return edges->values[v] != 0.0; };
            if (coarser || (edges && std::ranges::any_of(corners, on_edge))) return 0.0;
            const Vec3 low = domain.to_index(triangle_centroid(mesh, t)).array().floor();
            const CellDistance distance(
                phi.getConstUnsafeAccessor(), domain,
                {static_cast<int>(low.x()), static_cast<int>(low.y()), static_cast<int>(low.z())});
            if (!distance.smooth()) return 0.0;
            double mean = 0.0;
            for (std::size_t k = 0; k < 3; ++k) {
                const Vec3 p = 0.5 * (mesh.vertices[corners[k]] + mesh.vertices[corners[(k + 1) % 3]]);
                const double turn =
                    domain.axial ? p.x() / share_of_turn(domain.max[1] - domain.min[1], 1.0) : 1.0;
                mean -= turn * distance.at(domain.to_index(p) - low) / 3.0;
            }
            return triangle_area(mesh, t) * mean;
        };
}

}  // namespace

double volume_of(const MaterialStack& stack, std::size_t layer) {
    const TriangleMesh mesh = extract_surface(stack, layer, surface::SharpEdges::all_beyond);
    const auto beyond = volumes_beyond(mesh, stack, layer);
    std::vector<double> volumes(mesh.triangles.size());
    surface::parallel_each(volumes.size(), 1024, [&](std::size_t t) {
        volumes[t] = volume_over(mesh, t, 0.0, stack.domain) + beyond(t);
    });
    return std::accumulate(volumes.begin(), volumes.end(), 0.0);
}

std::vector<SurfacePiece> surface_pieces(const TriangleMesh& surface, const MaterialStack& stack) {
    std::vector<SurfacePiece> pieces = surface_pieces(surface, stack.domain);
    if (std::ranges::count(pieces, 0, &SurfacePiece::cover) == 0) return pieces;
    const std::vector<std::uint32_t> part = piece_of_vertices(surface, stack.domain);
    std::vector<SurfacePiece*> closed(part.size());  // by part
    for (SurfacePiece& piece : pieces)
        if (piece.cover == 0) closed[piece.part] = &piece;
    const auto beyond = volumes_beyond(surface, stack, stack.layers.size() - 1);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t)
        if (SurfacePiece* piece = closed[part[surface.triangles[t][0]]]) piece->volume += beyond(t);
    return pieces;
}

}  // namespace sidewall::levelset
