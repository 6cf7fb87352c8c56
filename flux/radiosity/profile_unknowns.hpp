#pragma once
#include <cstdint>
#include <vector>

#include "flux/tracer/flight.hpp"
#include "flux/wedges.hpp"

namespace sidewall::flux {

/// Unknowns of the exchange of a profile, a surface that is the same at all y. The two ends of an edge along
/// y are one unknown; the two triangles of the rectangle between two such edges are one facet. On a sector
/// (flux/revolution.hpp) both ends of a ring are one unknown, and its segments are facets.
struct ProfileUnknowns {
    Wedges unknowns;                     ///< corner and area by unknown; `first` is left empty
    std::vector<std::uint32_t> unknown;  ///< unknown of each wedge
    std::vector<std::uint32_t> partner;  ///< the other triangle of the facet; empty if the mesh is no profile
};

/// Finds the unknowns of a sector, or of a straight geometry whose triangles pair up with the same wedges. In
/// any other mesh every wedge is an unknown, without partners.
/// \note O(n log n).
ProfileUnknowns make_profile_unknowns(const Geometry& geometry, const Wedges& wedges);

}  // namespace sidewall::flux
