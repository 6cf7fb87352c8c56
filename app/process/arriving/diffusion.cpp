#include "app/process/arriving/diffusion.hpp"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Vector = Eigen::VectorXd;
using Terms = std::vector<std::pair<std::uint32_t, double>>;  // vertices or nodes with weights

constexpr std::uint32_t kNone = 0xffffffffu;

// Tolerance for a coordinate on a side, as a share of the extent.
constexpr double kOnSide = 1e-6;

bool takes_part(const TriangleMesh& mesh, std::span<const double> diffusivity, std::size_t t) {
    // A triangle whose area is rounding transmits nothing.
    const auto& [a, b, c] = mesh.triangles[t];
    const double longest = std::max({(mesh.vertices[b] - mesh.vertices[a]).squaredNorm(),
                                     (mesh.vertices[c] - mesh.vertices[b]).squaredNorm(),
                                     (mesh.vertices[a] - mesh.vertices[c]).squaredNorm()});
    return diffusivity[t] > 0.0 && triangle_area(mesh, t) > 1e-12 * longest;
}

// Edges of exactly one diffusing triangle.
std::vector<std::pair<std::uint32_t, std::uint32_t>> rim(const TriangleMesh& mesh,
                                                         std::span<const double> diffusivity) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3 && diffusivity[t] > 0.0; ++k)
            ++count[std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3])];
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& [edge, triangles] : count)
        if (triangles == 1) edges.push_back(edge);
    return edges;
}

// Expresses each vertex on the max side of an axis by the two ends of the nearest edge on the min side.
std::map<std::uint32_t, Terms> followers(const TriangleMesh& mesh,
                                         const std::vector<std::pair<std::uint32_t, std::uint32_t>>& edges,
                                         const flux::LateralBox& box, std::size_t axis) {
    std::map<std::uint32_t, Terms> result;
    if (box.boundary[axis] != flux::Boundary::periodic) return result;
    const auto a = static_cast<Eigen::Index>(axis);
    const double extent = box.max[axis] - box.min[axis];
    const auto on = [&](std::uint32_t v, double side) {
        return std::abs(mesh.vertices[v][a] - side) <= kOnSide * extent;
    };
    std::vector<std::pair<std::uint32_t, std::uint32_t>> opposite;
    std::vector<std::uint32_t> at_max;
    for (const auto& [v, w] : edges) {
        if (on(v, box.min[axis]) && on(w, box.min[axis])) opposite.emplace_back(v, w);
        if (on(v, box.max[axis]) && on(w, box.max[axis])) at_max.insert(at_max.end(), {v, w});
    }
    for (const std::uint32_t v : at_max) {
        if (result.contains(v)) continue;
        Vec3 point = mesh.vertices[v];
        point[a] = box.min[axis];
        double nearest = kInfinity;
        Terms terms;
        for (const auto& [p, q] : opposite) {
            const Vec3 along = mesh.vertices[q] - mesh.vertices[p];
            const double length2 = along.squaredNorm();
            const double t =
                length2 > 0.0 ? std::clamp((point - mesh.vertices[p]).dot(along) / length2, 0.0, 1.0) : 0.0;
            const double distance2 = (point - mesh.vertices[p] - t * along).squaredNorm();
            // An edge farther away than its length belongs to another outline.
            if (distance2 > length2 || distance2 >= nearest) continue;
            nearest = distance2;
            terms.clear();
            if (t < 1.0) terms.emplace_back(p, 1.0 - t);
            if (t > 0.0) terms.emplace_back(q, t);
        }
        if (!terms.empty()) result[v] = std::move(terms);
    }
    return result;
}

Terms resolved(std::uint32_t vertex, const std::array<std::map<std::uint32_t, Terms>, 2>& follow) {
    Terms terms{{vertex, 1.0}};
    for (const auto& by_vertex : follow) {
        Terms next;
        for (const auto& [v, weight] : terms) {
            const auto found = by_vertex.find(v);
            if (found == by_vertex.end())
                next.emplace_back(v, weight);
            else
                for (const auto& [w, share] : found->second) next.emplace_back(w, weight * share);
        }
        terms = std::move(next);
    }
    return terms;
}

// Numbers the nodes and expresses the vertices by them. \returns the number of nodes.
std::size_t number_nodes(const TriangleMesh& mesh, std::span<const double> diffusivity,
                         const flux::LateralBox& box, DiffusionElements& elements) {
    std::vector<std::uint8_t> used(mesh.vertices.size(), 0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (diffusivity[t] > 0.0)
            for (const std::uint32_t v : mesh.triangles[t]) used[v] = 1;
    std::array<std::map<std::uint32_t, Terms>, 2> follow;
    if (std::ranges::count(box.boundary, flux::Boundary::periodic) > 0) {
        const auto edges = rim(mesh, diffusivity);
        for (std::size_t axis = 0; axis < 2; ++axis) follow[axis] = followers(mesh, edges, box, axis);
    }
    std::vector<std::uint32_t> number(mesh.vertices.size(), kNone);
    std::uint32_t nodes = 0;
    for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
        elements.first.push_back(static_cast<std::uint32_t>(elements.node.size()));
        if (used[v] == 0) continue;
        for (const auto& [w, weight] : resolved(v, follow)) {
            if (number[w] == kNone) number[w] = nodes++;
            elements.node.push_back(number[w]);
            elements.weight.push_back(weight);
        }
    }
    elements.first.push_back(static_cast<std::uint32_t>(elements.node.size()));
    return nodes;
}

[[noreturn]] void refuse() {
    throw NumericsError(
        "diffusion along the surface has no finite solution: check its coefficient and the rates of what diffuses");
}

// Solves by conjugate gradients; if they do not converge (very stiff equations), by a direct factorisation.
Vector solved(const Sparse& matrix, const Vector& right, const Vector& guess) {
    Eigen::ConjugateGradient<Sparse, Eigen::Lower | Eigen::Upper> iteration;
    iteration.setTolerance(1e-13);
    iteration.setMaxIterations(2000);
    iteration.compute(matrix);
    Vector result = iteration.solveWithGuess(right, guess);
    if (iteration.info() == Eigen::Success && result.allFinite()) return result;
    const Eigen::SimplicialLDLT<Sparse> factors(matrix);
    if (factors.info() == Eigen::Success) result = factors.solve(right);
    if (factors.info() != Eigen::Success || !result.allFinite()) refuse();
    return result;
}

// Cuts values to the range, and spreads the difference over all nodes in proportion to their distance from
// the range's end, so that the sum of mass times value is \p total again.
void repair(const Vector& mass, double total, double low, double high, Vector& values) {
    values = values.cwiseMax(low).cwiseMin(high);
    const double lacking = total - mass.dot(values);
    const double end = lacking > 0.0 ? high : low;
    const double room = mass.dot(Vector((Vector::Constant(values.size(), end) - values).cwiseAbs()));
    if (!(room > 0.0)) return;
    const double share = std::min(1.0, std::abs(lacking) / room);
    values += share * (Vector::Constant(values.size(), end) - values);
}

}  // namespace

DiffusionElements diffusion_elements(const TriangleMesh& mesh, std::span<const double> diffusivity,
                                     const flux::LateralBox& box) {
    if (diffusivity.size() != mesh.triangles.size())
        throw GeometryError("diffusion along a surface needs a coefficient for every triangle");
    DiffusionElements elements;
    const std::size_t nodes = number_nodes(mesh, diffusivity, box, elements);
    elements.area.assign(nodes, 0.0);
    std::vector<Eigen::Triplet<double>> entries;
    double all = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!takes_part(mesh, diffusivity, t)) continue;
        const Triangle& triangle = mesh.triangles[t];
        const double area = triangle_area(mesh, t);
        all += area;
        std::array<Vec3, 3> edge;  // opposite to each corner
        for (std::size_t k = 0; k < 3; ++k)
            edge[k] = mesh.vertices[triangle[(k + 2) % 3]] - mesh.vertices[triangle[(k + 1) % 3]];
        const auto each = [&](std::size_t k, auto&& use) {
            for (std::uint32_t i = elements.first[triangle[k]]; i < elements.first[triangle[k] + 1]; ++i)
                use(elements.node[i], elements.weight[i]);
        };
        for (std::size_t k = 0; k < 3; ++k) {
            each(k, [&](std::uint32_t i, double weight) { elements.area[i] += weight * area / 3.0; });
            for (std::size_t l = 0; l < 3; ++l) {
                const double value = diffusivity[t] * edge[k].dot(edge[l]) / (4.0 * area);
                each(k, [&](std::uint32_t i, double u) {
                    each(l, [&](std::uint32_t j, double v) {
                        entries.emplace_back(static_cast<int>(i), static_cast<int>(j), u * v * value);
                    });
                });
            }
        }
    }
    // A tiny area lets nodes of triangles without area keep their values.
    for (double& area : elements.area) area = std::max(area, 1e-30 * all);
    elements.stiffness.resize(static_cast<Eigen::Index>(nodes), static_cast<Eigen::Index>(nodes));
    elements.stiffness.setFromTriplets(entries.begin(), entries.end());
    return elements;
}

std::vector<double> diffused(const DiffusionElements& elements, std::span<const double> before, double time,
                             std::span<const double> source, std::span<const double> decay) {
    const auto n = static_cast<Eigen::Index>(elements.area.size());
    if (n == 0) return {};
    Vector mass(n), reacted(n);  // values with source and decay alone
    for (Eigen::Index i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        mass[i] = elements.area[k] * (1.0 + time * decay[k]);
        reacted[i] = (before[k] + time * source[k]) / (1.0 + time * decay[k]);
    }
    if (!reacted.allFinite() || !mass.allFinite()) refuse();
    const Vector right = mass.cwiseProduct(reacted);
    Sparse matrix = time * elements.stiffness;
    matrix += Sparse(mass.asDiagonal());
    Vector after = solved(matrix, right, reacted);
    repair(mass, right.sum(), reacted.minCoeff(), reacted.maxCoeff(), after);
    return {after.begin(), after.end()};
}

}  // namespace sidewall::app
