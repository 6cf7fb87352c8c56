#pragma once
#include <Eigen/SparseCore>
#include <cstdint>
#include <span>
#include <vector>

#include "flux/lateral.hpp"
#include "surface/triangle_mesh.hpp"

// Diffusion along a surface, by linear finite elements on its triangles.
namespace sidewall::app {

/// The elements of d c/dt = div(D grad c) on a surface: nodes are the vertices that diffusing triangles have, those of a
/// periodic side left out, which follow from the opposite side's edges.
struct DiffusionElements {
    /// By node: integral of its hat function, length^2; positive.
    std::vector<double> area;
    /// By pair of nodes: integral of D grad . grad, the cotangent formula (Pinkall and Polthier, Exp. Math. 2 (1993)
    /// 15). Symmetric; rows sum to 0, so that nothing is lost. Nothing passes the surface's open rim.
    Eigen::SparseMatrix<double> stiffness;
    /// The value of vertex v is sum(weight[i] * value of node[i]) over i from first[v] up to first[v + 1]; an empty sum
    /// where no diffusing triangle is.
    std::vector<std::uint32_t> first, node;
    std::vector<double> weight;
};

/// \param diffusivity  D of every triangle, at least 0, length^2/time; triangles with 0 take no part.
/// \param box  whose periodic sides are one: what leaves at one end enters at the other.
/// \throws GeometryError if \p diffusivity has another length than the triangles.
/// \note O(n) but for the periodic sides, whose vertices are each compared with all edges of the opposite side.
DiffusionElements diffusion_elements(const TriangleMesh& mesh, std::span<const double> diffusivity,
                                     const flux::LateralBox& box = {});

/// The values of all nodes after \p time of d c/dt = source - decay c + div(D grad c), by one step of backward Euler with
/// lumped masses: first order in time, second in the size of triangles, stable for any \p time.
///
/// Without diffusion a node would reach (before + time source)/(1 + time decay), and the differential equation never leaves
/// the range of these. Linear elements do, slightly, where triangles are obtuse: what lies beyond is cut off, and what that adds or
/// takes is spread over all nodes by the room that they have. So a coverage whose source and decay keep it in [0, 1]
/// stays there, and the balance is exact.
/// \param before  by node.
/// \param source, decay  by node, per time; decay at least 0.
/// \throws NumericsError if the equations have no finite solution.
/// \note the same bits on any number of threads: one thread.
std::vector<double> diffused(const DiffusionElements& elements, std::span<const double> before, double time,
                             std::span<const double> source, std::span<const double> decay);

}  // namespace sidewall::app
