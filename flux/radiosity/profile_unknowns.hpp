#pragma once
#include <cstdint>
#include <vector>

#include "flux/tracer/flight.hpp"
#include "flux/wedges.hpp"

namespace sidewall::flux {

/// Unknowns of a profile, a surface that is the same at all y, for its exchange: the two
/// ends of an edge along y are one unknown, and the two triangles of the rectangle between two such edges one
/// facet. On a sector (flux/revolution.hpp) both ends of a ring are one unknown, and its segments are facets.
struct ProfileUnknowns {
    Wedges unknowns;                     ///< corner and area by unknown; `first` is left empty
    std::vector<std::uint32_t> unknown;  ///< by wedge
    std::vector<std::uint32_t>
        partner;  ///< the other triangle of the rectangle; empty if the mesh is no profile
};

/// \returns every wedge as an unknown of its own, and no partners, unless \p geometry is straight and its triangles
///        pair up, each two with the same wedges, or has a revolution.
/// \note O(n log n).
ProfileUnknowns make_profile_unknowns(const Geometry& geometry, const Wedges& wedges);

}  // namespace sidewall::flux
