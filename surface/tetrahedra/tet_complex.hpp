#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "surface/tetrahedra/tet_mesh.hpp"

// A tetrahedral mesh that is edited in place; internal to the mesher.
namespace sidewall::surface {

/// Where a vertex or an edge lies: on which sides and between which regions. Moves and merges keep it there.
struct Place {
    std::uint8_t sides = 0;    ///< bits of TetComplex::side
    std::vector<int> regions;  ///< that meet there, ascending; `outside` counts even if not meshed

    /// Lower bound of the dimensions in which it may move: 3 inside a region, 2 on a side or an interface, 1
    /// on a line where such meet, 0 in a corner.
    int freedom() const;
    bool operator==(const Place&) const = default;
};

/// Tetrahedra with their vertices, and the tetrahedra around each vertex. All operations keep the mesh
/// conforming; the result depends on their order only.
class TetComplex {
  public:
    std::vector<Vec3> point;         ///< by vertex
    std::vector<std::uint8_t> side;  ///< by vertex: bit 2 a for the low, 2 a + 1 for the high side of axis a
    std::vector<Tetrahedron> tet;    ///< removed ones have kNone first
    std::vector<int> region;         ///< by tetrahedron
    std::vector<std::vector<std::uint32_t>> around;  ///< by vertex: its tetrahedra
    int outside = 0;                                 ///< index of the region around all bodies

    static constexpr std::uint32_t kNone = 0xffffffffu;

    std::uint32_t add_vertex(const Vec3& p, std::uint8_t sides);
    std::uint32_t add_tet(const Tetrahedron& t, int of);
    void remove_tet(std::uint32_t t);
    bool alive(std::uint32_t t) const { return tet[t][0] != kNone; }
    bool has(std::uint32_t t, std::uint32_t v) const {
        const Tetrahedron& c = tet[t];
        return c[0] == v || c[1] == v || c[2] == v || c[3] == v;
    }
    std::vector<std::uint32_t> at_edge(std::uint32_t a, std::uint32_t b) const;
    double volume(const Tetrahedron& t) const {
        return tet_volume(point[t[0]], point[t[1]], point[t[2]], point[t[3]]);
    }
    /// Cosine of the smallest dihedral angle, see smallest_dihedral_cosine().
    double cosine(const Tetrahedron& t) const {
        return smallest_dihedral_cosine(point[t[0]], point[t[1]], point[t[2]], point[t[3]]);
    }
    double cosine(std::uint32_t t) const { return cosine(tet[t]); }
    /// cosine() with a corner of the tetrahedron moved to \p p.
    double cosine_if_moved(std::uint32_t t, std::uint32_t corner, const Vec3& p) const;
    /// The largest cosine() of the tetrahedra at a vertex.
    double cosine_around(std::uint32_t v) const;

    Place place(std::uint32_t v) const;
    Place place(std::uint32_t a, std::uint32_t b) const;

    /// Splits an edge and all tetrahedra at it at \p p. \returns the new vertex.
    std::uint32_t split(std::uint32_t a, std::uint32_t b, const Vec3& p);

    /// Whether \p from may be merged into \p to: the edge has the place of \p from, and the topology is kept.
    bool may_collapse(std::uint32_t from, std::uint32_t to) const;
    /// The largest cosine() of the tetrahedra at \p from that a merge into \p to would leave.
    double cosine_if_collapsed(std::uint32_t from, std::uint32_t to) const;
    void collapse(std::uint32_t from, std::uint32_t to);

    /// Replaces tetrahedra by others of the region \p of that fill the same space.
    void replace(std::span<const std::uint32_t> old, std::span<const Tetrahedron> by, int of);

    std::size_t count() const { return living_; }

  private:
    void add_outside(Place& place, std::vector<std::array<std::uint32_t, 3>>& faces) const;
    std::size_t living_ = 0;
};

}  // namespace sidewall::surface
