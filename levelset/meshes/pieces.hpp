#pragma once
#include <cstdint>
#include <vector>

#include "levelset/domain.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A connected piece of the wafer's surface. With the domain's sides it encloses a body or a void, or spans
/// the whole domain.
struct SurfacePiece {
    /// How often it covers the domain seen from above, faces down counted negative: 1 for a wafer's surface,
    /// -1 for an underside (of a wafer that ends below, or of a roof), 0 for a closed piece.
    int cover = 0;
    double volume =
        0.0;  ///< if cover is 0: of the enclosed material, or minus that of the gas; see volume_over
    std::uint32_t top = 0;    ///< its highest vertex
    std::uint32_t part = 0;   ///< its number, as piece_of_vertices gives it
    std::vector<Box3> boxes;  ///< around it; one for each part if periodic sides cut it

    /// Bounds material that nothing below supports: its lowest point faces down.
    bool hangs() const { return cover < 0 || (cover == 0 && volume > 0.0); }
    /// Bounds gas that cannot leave upwards: its highest point faces down.
    bool shuts_in() const { return cover < 0 || (cover == 0 && volume < 0.0); }
};

/// Volume between a triangle and z = \p level, negative if it faces down; of the revolution if axial.
double volume_over(const TriangleMesh& surface, std::size_t triangle, double level, const Domain& domain);

/// By vertex: the lowest vertex of its piece of the surface. Pieces that meet at periodic sides count as one.
/// \param surface  extract_surface of a layer.
/// \note O(n), and O(m log m) in the m vertices on periodic sides.
std::vector<std::uint32_t> piece_of_vertices(const TriangleMesh& surface, const Domain& domain);

/// The pieces of the surface, in the order of their first triangles.
std::vector<SurfacePiece> surface_pieces(const TriangleMesh& surface, const Domain& domain);

/// The triangles of the wafer's surface that bound gas cut off from the gas above it, as in a keyhole that
/// deposition has closed.
/// \param surface  extract_surface of the top layer.
/// \param pieces   its surface_pieces.
/// \returns one flag a triangle; empty if no gas is cut off.
/// \note O(1) if no piece shuts gas in, else O(n log n).
std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, std::vector<SurfacePiece> pieces,
                                     const Domain& domain);

}  // namespace sidewall::levelset
