#pragma once
#include <cstdint>
#include <vector>

#include "levelset/domain.hpp"
#include "surface/triangle_mesh.hpp"

namespace sidewall::levelset {

/// A connected piece of the wafer's surface, and what it makes of the space: with the domain's sides it either
/// encloses something or lies across the whole domain.
struct SurfacePiece {
    /// How often it covers the domain, seen from above, faces down counted negative: 1 for a wafer's surface,
    /// -1 for an underside (of a wafer that ends below, or of a roof), 0 for what is enclosed.
    int cover = 0;
    double volume =
        0.0;  ///< where cover is 0: of the material in it, or minus that of the gas; as volume_over
    std::uint32_t top = 0;    ///< its highest vertex
    std::uint32_t part = 0;   ///< what piece_of_vertices says of its vertices
    std::vector<Box3> boxes;  ///< around it; one for each of its parts where periodic sides cut it

    /// Material that nothing below holds: its lowest point faces down.
    bool hangs() const { return cover < 0 || (cover == 0 && volume > 0.0); }
    /// Gas that cannot leave upwards: its highest point faces down.
    bool shuts_in() const { return cover < 0 || (cover == 0 && volume < 0.0); }
};

/// The volume between a triangle and a level, negative if it faces down; of an axial domain that of the revolution.
double volume_over(const TriangleMesh& surface, std::size_t triangle, double level, const Domain& domain);

/// For each vertex the lowest one of its piece of the surface. Pieces that meet at periodic sides are one.
/// \param surface  extract_surface of a layer.
/// \note O(n), and O(m log m) in the vertices on periodic sides.
std::vector<std::uint32_t> piece_of_vertices(const TriangleMesh& surface, const Domain& domain);

/// The pieces of the surface, in the order of their lowest vertices.
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
