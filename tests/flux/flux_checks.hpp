#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tests/flux/traces.hpp"

// Means of traced fluxes over groups of triangles, with standard errors from independent traces, and
// integrals of exact fluxes over the same triangles, to compare the two.
namespace sidewall::flux {

using Groups = std::vector<std::vector<std::size_t>>;  // of triangles

/// Mean flux of every species, traced together, on every group, over independent traces of \p rays in all;
/// another \p stream has other random numbers. The standard error is the scatter of the traces: it holds
/// whatever the correlation between triangles.
std::vector<std::vector<Mean>> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                                          std::span<const Species> species, std::uint64_t rays,
                                          std::uint32_t stream, const Groups& groups,
                                          std::span<const std::int32_t> materials = {},
                                          double roulette = 1.0);

std::vector<Mean> over_seeds(const TriangleMesh& mesh, std::array<Boundary, 2> boundary,
                             const Species& species, std::uint64_t rays, std::uint32_t stream,
                             const Groups& groups, std::span<const std::int32_t> materials = {},
                             double roulette = 1.0);

/// Mean of \p f over the triangle: values at the centres of 64 equal parts.
double mean_over_triangle(const TriangleMesh& mesh, std::size_t t,
                          const std::function<double(const Vec3&)>& f);

/// Area-weighted mean of \p f over the triangles of a group.
double mean_over(const TriangleMesh& mesh, const std::vector<std::size_t>& group,
                 const std::function<double(const Vec3&)>& f);

/// Checks many means against exact values. Each must be within 0.5 %. By chance 1 in 250 lies beyond 3
/// standard errors (Student's t of 63 degrees of freedom), which verdict() allows for.
class Comparison {
  public:
    void check(const Mean& mean, double truth);
    /// To be called once, at the end.
    void verdict() const;

  private:
    int count_ = 0, beyond_ = 0;
    double squares_ = 0.0;
};

}  // namespace sidewall::flux
