#include "levelset/meshes/pieces.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <tuple>
#include <unordered_map>

#include "surface/parallel.hpp"
#include "surface/ray_scene.hpp"
#include "surface/turn.hpp"

namespace sidewall::levelset {
namespace {

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

// Vertices or triangles of one task.
constexpr std::size_t kPart = 256;

// A vertex on a periodic side and its place there, in units of 1e-5 dx.
struct SideVertex {
    long long along, z;
    std::uint32_t vertex;
    auto place() const { return std::tie(along, z); }
    bool operator<(const SideVertex& o) const { return place() < o.place(); }
};

// Disjoint sets of 0..n-1 that many threads may join at once. A parent is always a lower member, so that the
// root is the lowest, in any order of joins (Jayanti and Tarjan, Distributed Computing 34 (2021) 413).
class SharedSets {
  public:
    explicit SharedSets(std::size_t n) : parent_(n) {
        for (std::uint32_t i = 0; i < n; ++i) parent_[i].store(i, std::memory_order_relaxed);
    }
    std::uint32_t root(std::uint32_t i) {
        for (;;) {
            const std::uint32_t parent = parent_[i].load(std::memory_order_relaxed);
            if (parent == i) return i;
            // Path halving: an ancestor stays one, whatever other threads write.
            const std::uint32_t next = parent_[parent].load(std::memory_order_relaxed);
            if (next != parent) parent_[i].store(next, std::memory_order_relaxed);
            i = next;
        }
    }
    void join(std::uint32_t a, std::uint32_t b) {
        // Most pairs are in one set already, and most of those have the same parent.
        if (parent_[a].load(std::memory_order_relaxed) == parent_[b].load(std::memory_order_relaxed)) return;
        for (;;) {
            a = root(a);
            b = root(b);
            if (a == b) return;
            std::uint32_t high = std::max(a, b);
            if (parent_[high].compare_exchange_strong(high, std::min(a, b), std::memory_order_relaxed))
                return;
        }
    }

  private:
    std::vector<std::atomic<std::uint32_t>> parent_;
};

template <class Use>
void parallel(std::size_t count, Use&& use) {
    surface::parallel_each(count, kPart, [&](std::size_t n) { use(static_cast<std::uint32_t>(n)); });
}

// The vertices on the low and on the high side of an axis, sorted.
std::array<std::vector<SideVertex>, 2> on_sides(const TriangleMesh& surface, int axis, const Domain& domain) {
    const double unit = 1e-5 * domain.spacing;
    const std::array ends{domain.min[static_cast<std::size_t>(axis)],
                          domain.max[static_cast<std::size_t>(axis)]};
    std::array<std::vector<SideVertex>, 2> list;
    std::vector<std::uint8_t> side(surface.vertices.size());  // 1: low side, 2: high side, 0: neither
    parallel(side.size(), [&](std::uint32_t v) {
        const double at = surface.vertices[v][axis];
        side[v] = at == ends[0] ? 1 : at == ends[1] ? 2 : 0;
    });
    for (std::uint32_t v = 0; v < side.size(); ++v) {
        if (side[v] == 0) continue;
        const Vec3& p = surface.vertices[v];
        list[side[v] - 1u].push_back({std::llround(p[1 - axis] / unit), std::llround(p.z() / unit), v});
    }
    for (std::vector<SideVertex>& one : list) std::sort(one.begin(), one.end());
    return list;
}

SharedSets connected(const TriangleMesh& surface) {
    SharedSets sets(surface.vertices.size());
    parallel(surface.triangles.size(), [&](std::uint32_t t) {
        const auto [a, b, c] = surface.triangles[t];
        sets.join(a, b);
        sets.join(b, c);
    });
    return sets;
}

// Joins vertices on a high periodic side with their images on the low side.
void join_across_sides(const TriangleMesh& surface, const Domain& domain, SharedSets& sets) {
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (domain.side[a] != Side::periodic) continue;
        const auto [low, high] = on_sides(surface, axis, domain);
        auto from = low.begin();
        for (const SideVertex& v : high) {
            while (from != low.end() && *from < v) ++from;
            if (from != low.end() && from->place() == v.place()) sets.join(from->vertex, v.vertex);
        }
    }
}

std::vector<std::uint32_t> roots(SharedSets& sets, std::size_t count) {
    std::vector<std::uint32_t> root(count);
    parallel(count, [&](std::uint32_t v) { root[v] = sets.root(v); });
    return root;
}

bool any_periodic(const Domain& domain) {
    return domain.side[0] == Side::periodic || domain.side[1] == Side::periodic;
}

// The roots among \p within that have triangles, by their first triangles, and the place of each in the list.
struct Roots {
    std::vector<std::uint32_t> list;
    std::vector<std::atomic<std::uint32_t>> place;

    Roots(const TriangleMesh& surface, const std::vector<std::uint32_t>& within) : place(within.size()) {
        // At first, place holds the lowest triangle of each root.
        for (std::uint32_t v = 0; v < within.size(); ++v)
            if (within[v] == v) place[v].store(kNoVertex, std::memory_order_relaxed);
        parallel(surface.triangles.size(), [&](std::uint32_t t) {
            std::atomic<std::uint32_t>& lowest = place[within[surface.triangles[t][0]]];
            std::uint32_t known = lowest.load(std::memory_order_relaxed);
            while (t < known && !lowest.compare_exchange_weak(known, t, std::memory_order_relaxed)) continue;
        });
        for (std::uint32_t v = 0; v < within.size(); ++v)
            if (within[v] == v && of(v) != kNoVertex) list.push_back(v);
        std::sort(list.begin(), list.end(), [&](std::uint32_t a, std::uint32_t b) { return of(a) < of(b); });
        for (std::uint32_t k = 0; k < list.size(); ++k) place[list[k]].store(k, std::memory_order_relaxed);
    }
    std::uint32_t of(std::uint32_t root) const { return place[root].load(std::memory_order_relaxed); }
};

// The contribution of consecutive vertices or triangles of one root to its piece.
struct Share {
    std::uint32_t place;
    Box3 box;
    std::uint32_t top = kNoVertex;
    double covered = 0.0;
};

// Calls use(number, share) for the numbers 0 .. count - 1, with the share of place(number), except where that
// is kNoVertex.
// \returns the shares in the order of their numbers.
template <class Place, class Use>
std::vector<Share> shares(std::size_t count, Place&& place, Use&& use) {
    std::vector<std::vector<Share>> parts((count + kPart - 1) / kPart);
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t part) {
        std::vector<Share>& list = parts[part];
        const std::size_t end = std::min(count, (part + 1) * kPart);
        for (auto n = static_cast<std::uint32_t>(part * kPart); n < end; ++n) {
            const std::uint32_t at = place(n);
            if (at == kNoVertex) continue;
            if (list.empty() || list.back().place != at) list.push_back({at, {}});
            use(n, list.back());
        }
    });
    std::vector<Share> all;
    for (const std::vector<Share>& list : parts) all.insert(all.end(), list.begin(), list.end());
    return all;
}

// A triangle's area seen from above, negative if it faces down, and its mean height above a level. The
// domain's sides are vertical and add nothing.
struct Seen {
    double up, height;
};

Seen seen(const TriangleMesh& surface, const Triangle& t, double level) {
    const auto& [a, b, c] = t;
    const Vec3 &x = surface.vertices[a], u = surface.vertices[b] - x, v = surface.vertices[c] - x;
    return {0.5 * (u.x() * v.y() - u.y() * v.x()), x.z() + (u.z() + v.z()) / 3.0 - level};
}

}  // namespace

double volume_over(const TriangleMesh& surface, std::size_t triangle, double level, const Domain& domain) {
    const Triangle& t = surface.triangles[triangle];
    const Seen here = seen(surface, t, level);
    if (!domain.axial) return here.up * here.height;
    // Mean of r times height: the midpoint rule is exact for a product of linear functions.
    double mean = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 middle = 0.5 * (surface.vertices[t[k]] + surface.vertices[t[(k + 1) % 3]]);
        mean += middle.x() * (middle.z() - level) / 3.0;
    }
    return here.up * mean / share_of_turn(domain.max[1] - domain.min[1], 1.0);
}

std::vector<std::uint32_t> piece_of_vertices(const TriangleMesh& surface, const Domain& domain) {
    SharedSets sets = connected(surface);
    join_across_sides(surface, domain, sets);
    return roots(sets, surface.vertices.size());
}

std::vector<SurfacePiece> surface_pieces(const TriangleMesh& surface, const Domain& domain) {
    const std::size_t count = surface.vertices.size();
    SharedSets sets = connected(surface);
    const std::vector<std::uint32_t> within = roots(sets, count);  // sides not joined yet
    const Roots inner(surface, within);
    if (any_periodic(domain) && inner.list.size() > 1) join_across_sides(surface, domain, sets);
    std::vector<SurfacePiece> pieces;
    std::unordered_map<std::uint32_t, std::uint32_t> number;  // index of a piece, by its part
    std::vector<std::uint32_t> piece(inner.list.size()), box(inner.list.size());  // by place
    for (std::size_t k = 0; k < inner.list.size(); ++k) {
        const std::uint32_t part = sets.root(inner.list[k]);
        piece[k] = number.try_emplace(part, static_cast<std::uint32_t>(pieces.size())).first->second;
        if (piece[k] == pieces.size()) pieces.push_back({0, 0.0, part, part, {}});
        std::vector<Box3>& boxes = pieces[piece[k]].boxes;
        box[k] = static_cast<std::uint32_t>(boxes.size());
        boxes.emplace_back();
    }
    const auto higher = [&](std::uint32_t v, std::uint32_t than) {
        return surface.vertices[v].z() > surface.vertices[than].z();
    };
    const auto at_vertex = [&](std::uint32_t v) { return inner.of(within[v]); };
    const auto add_vertex = [&](std::uint32_t v, Share& own) {
        own.box.extend(surface.vertices[v]);
        if (own.top == kNoVertex || higher(v, own.top)) own.top = v;
    };
    for (const Share& share : shares(count, at_vertex, add_vertex)) {
        SurfacePiece& of = pieces[piece[share.place]];
        Box3& whole = of.boxes[box[share.place]];
        whole.extend(share.box.min);
        whole.extend(share.box.max);
        if (higher(share.top, of.top)) of.top = share.top;
    }
    std::vector<double> covered(pieces.size(), 0.0);
    const auto at_triangle = [&](std::uint32_t t) { return at_vertex(surface.triangles[t][0]); };
    const auto add_triangle = [&](std::uint32_t t, Share& own) {
        own.covered += seen(surface, surface.triangles[t], 0.0).up;
    };
    for (const Share& share : shares(surface.triangles.size(), at_triangle, add_triangle))
        covered[piece[share.place]] += share.covered;
    const double area = (domain.max[0] - domain.min[0]) * (domain.max[1] - domain.min[1]);
    bool encloses = false;
    for (std::size_t n = 0; n < pieces.size(); ++n) {
        pieces[n].cover = static_cast<int>(std::lround(covered[n] / area));
        encloses = encloses || pieces[n].cover == 0;
    }
    for (std::uint32_t t = 0; encloses && t < surface.triangles.size(); ++t) {
        SurfacePiece& of = pieces[piece[at_triangle(t)]];
        if (of.cover != 0) continue;
        // Heights above a vertex of the piece, so that small volumes keep their digits.
        of.volume += volume_over(surface, t, surface.vertices[of.part].z(), domain);
    }
    return pieces;
}

std::vector<std::uint8_t> sealed_off(const TriangleMesh& surface, std::vector<SurfacePiece> pieces,
                                     const Domain& domain) {
    if (std::none_of(pieces.begin(), pieces.end(), [](const SurfacePiece& p) { return p.shuts_in(); }))
        return {};
    const std::vector<std::uint32_t> part = piece_of_vertices(surface, domain);
    std::vector<std::uint32_t> facing_up_most(part.size(),
                                              kNoVertex);  // by vertex: triangle largest from above
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
        for (const std::uint32_t v : surface.triangles[t])
            if (facing_up_most[v] == kNoVertex ||
                area_vector(surface, t).z() > area_vector(surface, facing_up_most[v]).z())
                facing_up_most[v] = t;

    // From the highest piece down: a body enclosed by gas is sealed off if the gas above it is a void's.
    const surface::RayScene scene(surface);
    std::stable_sort(pieces.begin(), pieces.end(), [&](const SurfacePiece& a, const SurfacePiece& b) {
        return surface.vertices[a.top].z() > surface.vertices[b.top].z();
    });
    std::vector<std::uint8_t> sealed(part.size(), 0);  // by part
    for (const SurfacePiece& piece : pieces) {
        if (piece.shuts_in()) {
            sealed[piece.part] = 1;
            continue;
        }
        // The ray starts inside a triangle: the top may lie on a side, where a ray may miss the surface.
        const auto above = scene.closest_hit(triangle_centroid(surface, facing_up_most[piece.top]),
                                             Vec3::UnitZ(), 1e-2 * domain.spacing, kInfinity);
        if (above) sealed[piece.part] = sealed[part[surface.triangles[above.triangle][0]]];
    }
    std::vector<std::uint8_t> result;
    for (const Triangle& t : surface.triangles) result.push_back(sealed[part[t[0]]]);
    return result;
}

}  // namespace sidewall::levelset
