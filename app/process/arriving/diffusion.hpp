#pragma once
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "surface/triangle_mesh.hpp"

// Diffusion along a surface, by linear finite elements on its triangles.
namespace sidewall::app {

/// Finite elements for d c/dt = div(D grad c) on a surface. Nodes are the vertices of diffusing triangles;
/// vertices at the far end of a periodic axis are no nodes, but interpolate the edges at the near end.
struct DiffusionElements {
    /// By node: integral of its hat function, length^2; positive.
    std::vector<double> area;
    /// By pair of nodes: integral of D grad . grad, by the cotangent formula (Pinkall and Polthier, Exp.
    /// Math. 2 (1993) 15). Symmetric; rows sum to 0: the amount is conserved, nothing crosses open
    /// boundaries.
    Eigen::SparseMatrix<double> stiffness;
    /// The value of vertex v is the sum of weight[i] * value of node[i] for i from first[v] up to
    /// first[v + 1]; empty without diffusing triangles.
    std::vector<std::uint32_t> first, node;
    std::vector<double> weight;
};

/// \param diffusivity  D of every triangle, at least 0, length^2/time; triangles with 0 take no part.
/// \param box  its periodic sides are joined: what leaves at one enters at the other.
/// \throws GeometryError if \p diffusivity has another length than the triangles.
/// \note O(n), but compares each vertex on a periodic side with all edges on the opposite side.
DiffusionElements diffusion_elements(const TriangleMesh& mesh, std::span<const double> diffusivity,
                                     const flux::LateralBox& box = {});

/// The values of all nodes after \p time of d c/dt = source - decay c + div(D grad c), by one backward Euler
/// step with lumped masses: first order in time, second in the size of triangles, unconditionally stable.
///
/// Without diffusion a node would reach (before + time source)/(1 + time decay). The differential equation
/// stays within the range of these values; linear elements leave it slightly on obtuse triangles. Values
/// beyond it are cut off, and the difference is spread over all nodes in proportion to their distance from
/// the range's end. So the balance is exact, and a coverage stays in [0, 1] if source and decay keep it
/// there.
/// \param before  by node.
/// \param source, decay  by node, per time; decay at least 0.
/// \throws NumericsError if the equations have no finite solution.
/// \note Single-threaded: the same bits on any number of threads.
std::vector<double> diffused(const DiffusionElements& elements, std::span<const double> before, double time,
                             std::span<const double> source, std::span<const double> decay);

}  // namespace sidewall::app
