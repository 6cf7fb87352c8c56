#include "surface/tetrahedra/tet_improve.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace sidewall::surface {
namespace {

constexpr std::size_t kMost = 7;  // most vertices around an edge that is removed
constexpr double kGain = 1e-6;    // least gain of a cosine that counts

/// The vertices around an edge in order, so that its tetrahedra are (a, b, ring[i], ring[i + 1]); empty
/// unless they form a closed ring.
std::vector<std::uint32_t> ring_of(const TetComplex& mesh, std::uint32_t a, std::uint32_t b,
                                   const std::vector<std::uint32_t>& tets) {
    std::vector<std::array<std::uint32_t, 2>> pairs;
    for (const std::uint32_t t : tets) {
        std::array<std::uint32_t, 2> rest{};
        std::size_t n = 0;
        for (const std::uint32_t v : mesh.tet[t])
            if (v != a && v != b) rest[n++] = v;
        if (mesh.volume({a, b, rest[0], rest[1]}) < 0.0) std::swap(rest[0], rest[1]);
        pairs.push_back(rest);
    }
    std::vector<std::uint32_t> ring{pairs[0][0]};
    std::uint32_t next = pairs[0][1];
    while (next != ring[0]) {
        if (ring.size() >= pairs.size()) return {};
        ring.push_back(next);
        const auto found =
            std::find_if(pairs.begin(), pairs.end(), [&](const auto& p) { return p[0] == next; });
        if (found == pairs.end()) return {};
        next = (*found)[1];
    }
    if (ring.size() != pairs.size()) ring.clear();
    return ring;
}

bool same_region(const TetComplex& mesh, const std::vector<std::uint32_t>& tets) {
    return std::all_of(tets.begin(), tets.end(),
                       [&](std::uint32_t t) { return mesh.region[t] == mesh.region[tets[0]]; });
}

// Removes an edge inside a region by triangulating the ring of vertices around it (Shewchuk, "Two discrete
// optimization algorithms for the topological improvement of tetrahedral meshes", 2002), if that increases
// the smallest dihedral angle.
bool remove_edge(TetComplex& mesh, std::uint32_t a, std::uint32_t b) {
    const std::vector<std::uint32_t> old = mesh.at_edge(a, b);
    if (old.size() < 3 || old.size() > kMost || !same_region(mesh, old)) return false;
    const std::vector<std::uint32_t> ring = ring_of(mesh, a, b, old);
    if (ring.empty()) return false;
    double before = -1.0;
    for (const std::uint32_t t : old) before = std::max(before, mesh.cosine(t));
    // Optimal triangulation of the ring from i to j (Klincsek, 1980); each triangle is joined to a and to b.
    const std::size_t n = ring.size();
    std::array<std::array<double, kMost>, kMost> widest{};
    std::array<std::array<std::size_t, kMost>, kMost> apex{};
    for (std::size_t span = 2; span < n; ++span)
        for (std::size_t i = 0; i + span < n; ++i) {
            const std::size_t j = i + span;
            widest[i][j] = kInfinity;
            for (std::size_t k = i + 1; k < j; ++k) {
                double here = std::max(k > i + 1 ? widest[i][k] : -1.0, j > k + 1 ? widest[k][j] : -1.0);
                here = std::max(here, mesh.cosine({ring[i], ring[k], ring[j], b}));
                here = std::max(here, mesh.cosine({ring[i], ring[j], ring[k], a}));
                if (here >= widest[i][j]) continue;
                widest[i][j] = here;
                apex[i][j] = k;
            }
        }
    if (widest[0][n - 1] >= before - kGain) return false;
    std::vector<Tetrahedron> by;
    std::vector<std::array<std::size_t, 2>> open{{0, n - 1}};
    while (!open.empty()) {
        const auto [i, j] = open.back();
        open.pop_back();
        if (j - i < 2) continue;
        const std::size_t k = apex[i][j];
        by.push_back({ring[i], ring[k], ring[j], b});
        by.push_back({ring[i], ring[j], ring[k], a});
        open.push_back({i, k});
        open.push_back({k, j});
    }
    // A new edge must not exist elsewhere in the mesh already.
    for (const Tetrahedron& t : by)
        for (const auto& [p, q] : {std::array{t[0], t[1]}, {t[1], t[2]}, {t[0], t[2]}}) {
            const auto at_p = std::find(ring.begin(), ring.end(), p) - ring.begin(),
                       at_q = std::find(ring.begin(), ring.end(), q) - ring.begin();
            const auto apart = static_cast<std::size_t>(std::abs(at_p - at_q));
            if (apart != 1 && apart != n - 1 && !mesh.at_edge(p, q).empty()) return false;
        }
    mesh.replace(old, by, mesh.region[old[0]]);
    return true;
}

// Replaces the face opposite to a corner by an edge (2-3 flip), if both its tetrahedra are in one region and
// that increases the smallest dihedral angle.
bool remove_face(TetComplex& mesh, std::uint32_t t, std::uint32_t corner) {
    std::array<std::uint32_t, 3> face{};
    std::size_t n = 0;
    const Tetrahedron c = mesh.tet[t];
    for (const std::uint32_t v : c)
        if (v != corner) face[n++] = v;
    if (mesh.volume({face[0], face[1], face[2], corner}) < 0.0) std::swap(face[1], face[2]);
    for (const std::uint32_t other : mesh.at_edge(face[0], face[1])) {
        if (other == t || !mesh.has(other, face[2]) || mesh.region[other] != mesh.region[t]) continue;
        std::uint32_t far = 0;
        for (const std::uint32_t v : mesh.tet[other])
            if (v != face[0] && v != face[1] && v != face[2]) far = v;
        if (!mesh.at_edge(corner, far).empty()) return false;
        const double before = std::max(mesh.cosine(t), mesh.cosine(other));
        std::array<Tetrahedron, 3> by{};
        for (std::size_t k = 0; k < 3; ++k) {
            by[k] = {face[k], face[(k + 1) % 3], far, corner};
            // The edge must pass through the face, or one of the three would be inverted.
            if (!(mesh.volume(by[k]) > 0.0) || mesh.cosine(by[k]) >= before - kGain) return false;
        }
        const std::array<std::uint32_t, 2> old{t, other};
        mesh.replace(old, by, mesh.region[t]);
        return true;
    }
    return false;
}

constexpr double kLeastGain = 1e-6;  // least gain of a cosine that counts
constexpr double kRequired = 0.6;    // share of the target angle: smaller angles get forced passes

double cosine_of_deg(double degrees) {
    return std::cos(degrees * std::numbers::pi / 180.0);
}

class Improver {
  public:
    Improver(TetComplex& mesh, std::span<const Front> fronts, const TetOptions& options)
        : mesh_(mesh), fronts_(fronts), options_(options) {}

    void run();

  private:
    std::size_t pass(double target, double slack);
    bool insert(std::uint32_t t);
    bool repair(std::uint32_t t, double slack);
    bool merge(std::uint32_t t, double slack);
    bool move(std::uint32_t v);
    bool flip(std::uint32_t t);
    bool reassign_region(std::uint32_t t, double slack);
    bool keeps_fronts(std::uint32_t from, std::uint32_t to, double slack) const;
    std::optional<Vec3> on_place(const Place& place, const Vec3& p) const;

    TetComplex& mesh_;
    std::span<const Front> fronts_;
    const TetOptions& options_;
    // Forced passes: merges within the slack may change the fronts' topology, and vertices on contact lines
    // may move by the tolerance.
    bool forced_ = false;
};

// Whether the interface around \p from still passes it within \p slack once it is merged into \p to.
bool Improver::keeps_fronts(std::uint32_t from, std::uint32_t to, double slack) const {
    struct Face {
        std::array<std::uint32_t, 2> rest;
        int region;
    };
    std::vector<Face> faces;
    for (const std::uint32_t t : mesh_.around[from]) {
        std::array<std::uint32_t, 3> rest{};
        std::size_t n = 0;
        for (const std::uint32_t v : mesh_.tet[t])
            if (v != from) rest[n++] = v;
        std::sort(rest.begin(), rest.end());
        for (std::size_t k = 0; k < 3; ++k)
            faces.push_back({{rest[k == 0 ? 1 : 0], rest[k == 2 ? 1 : 2]}, mesh_.region[t]});
    }
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.rest < b.rest; });
    const Vec3& p = mesh_.point[from];
    double least = 1e300;
    bool any = false;
    for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
        for (j = i; j < faces.size() && faces[j].rest == faces[i].rest; ++j) {
        }
        if (j - i == 2 && faces[i].region == faces[i + 1].region) continue;
        const auto [b, c] = faces[i].rest;
        if (j - i == 1 && (mesh_.side[from] & mesh_.side[b] & mesh_.side[c]) != 0) continue;
        any = true;
        if (b == to || c == to) continue;
        least = std::min(
            least, closest_point_on_triangle(p, mesh_.point[to], mesh_.point[b], mesh_.point[c]).distance);
    }
    return !any || least <= slack;
}

bool Improver::merge(std::uint32_t t, double slack) {
    const Tetrahedron c = mesh_.tet[t];
    struct Way {
        double cosine;
        std::uint32_t from, to;
    };
    std::vector<Way> ways;
    for (const std::uint32_t from : c) {
        const double before = mesh_.cosine_around(from);
        for (const std::uint32_t to : c) {
            if (from == to || (mesh_.side[from] & ~mesh_.side[to]) != 0) continue;
            const double after = mesh_.cosine_if_collapsed(from, to);
            if (after < before - kLeastGain) ways.push_back({after, from, to});
        }
    }
    std::sort(ways.begin(), ways.end(), [](const Way& a, const Way& b) { return a.cosine < b.cosine; });
    for (const Way& way : ways)
        if ((forced_ && (mesh_.point[way.from] - mesh_.point[way.to]).norm() <= slack) ||
            (mesh_.may_collapse(way.from, way.to) && keeps_fronts(way.from, way.to, slack))) {
            mesh_.collapse(way.from, way.to);
            return true;
        }
    return false;
}

// Projects a point onto the side and the front of a place; nothing where the two are nearly parallel.
std::optional<Vec3> Improver::on_place(const Place& place, const Vec3& p) const {
    if (place.regions.size() == 1) return p;
    const int high = place.regions[1];
    const auto k = static_cast<std::size_t>(high == mesh_.outside ? high - 1 : place.regions[0]);
    Vec3 q = p;
    for (int i = 0; i < 2; ++i) {
        const DistanceSample sample = fronts_[k](q);
        Vec3 rise = sample.rise;
        for (int a = 0; a < 3; ++a)
            if ((place.sides >> (2 * a) & 3) != 0) rise[a] = 0.0;
        const double squared = rise.squaredNorm();
        if (squared < 0.1) return std::nullopt;
        q -= sample.distance / squared * rise;
    }
    return q;
}

// Moves a vertex by pattern search along the axes to increase the smallest dihedral angle around it.
bool Improver::move(std::uint32_t v) {
    const Place place = mesh_.place(v);
    const bool on_line = place.regions.size() > 2;
    if ((on_line && !forced_) || place.freedom() == 0) return false;
    const Vec3 start = mesh_.point[v];
    double shortest = 1e300;
    for (const std::uint32_t t : mesh_.around[v])
        for (const std::uint32_t w : mesh_.tet[t])
            if (w != v) shortest = std::min(shortest, (mesh_.point[w] - start).norm());
    double best = mesh_.cosine_around(v);
    const double before = best;
    Vec3 here = start;
    double step = 0.3 * shortest;
    for (int round = 0; round < 8 && step > 0.01 * shortest; ++round) {
        bool better = false;
        for (int d = 0; d < 6; ++d) {
            const int axis = d / 2;
            if ((place.sides >> (2 * axis) & 3) != 0) continue;
            Vec3 p = here;
            p[axis] += d % 2 == 0 ? step : -step;
            if (on_line && (p - start).norm() > options_.tolerance) continue;
            const std::optional<Vec3> q = on_line ? p : on_place(place, p);
            if (!q || !options_.box.min.cwiseMax(*q).isApprox(*q, 0.0) ||
                !options_.box.max.cwiseMin(*q).isApprox(*q, 0.0))
                continue;
            mesh_.point[v] = *q;
            const double cosine = mesh_.cosine_around(v);
            if (cosine >= best - kLeastGain) continue;
            best = cosine;
            here = *q;
            better = true;
        }
        if (!better) step *= 0.5;
    }
    mesh_.point[v] = here;
    return best < before - kLeastGain;
}

bool Improver::flip(std::uint32_t t) {
    const Tetrahedron c = mesh_.tet[t];
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j)
            if (remove_edge(mesh_, c[i], c[j])) return true;
    for (std::size_t i = 0; i < 4; ++i)
        if (remove_face(mesh_, t, c[i])) return true;
    return false;
}

// Assigns a flat tetrahedron at an interface to the region beyond, if a flip removes it there. Deletes it if
// nothing is meshed beyond.
bool Improver::reassign_region(std::uint32_t t, double slack) {
    const Tetrahedron c = mesh_.tet[t];
    double largest = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3 &a = mesh_.point[c[(k + 1) % 4]], &b = mesh_.point[c[(k + 2) % 4]],
                   &d = mesh_.point[c[(k + 3) % 4]];
        largest = std::max(largest, 0.5 * (b - a).cross(d - a).norm());
    }
    if (!(3.0 * std::abs(mesh_.volume(c)) <= 2.0 * slack * largest)) return false;
    // Per face, opposite to corner k: the region beyond; -1 on a side of the box.
    std::array<int, 4> beyond{};
    for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t a = c[(k + 1) % 4], b = c[(k + 2) % 4], d = c[(k + 3) % 4];
        beyond[k] = (mesh_.side[a] & mesh_.side[b] & mesh_.side[d]) != 0 ? -1 : mesh_.outside;
        for (const std::uint32_t other : mesh_.at_edge(a, b))
            if (other != t && mesh_.has(other, d)) beyond[k] = mesh_.region[other];
    }
    const int own = mesh_.region[t];
    for (const int to : beyond) {
        if (to < 0 || to == own || std::count(beyond.begin(), beyond.end(), to) < (forced_ ? 1 : 2)) continue;
        if (to == mesh_.outside && !options_.outside) {
            mesh_.remove_tet(t);
            return true;
        }
        mesh_.region[t] = to;
        if (flip(t)) return true;
        mesh_.region[t] = own;
    }
    return false;
}

// Splits an edge and moves the new vertex, if that increases the smallest dihedral angle.
bool Improver::insert(std::uint32_t t) {
    const Tetrahedron c = mesh_.tet[t];
    const double before = mesh_.cosine(t);
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j) {
            const std::uint32_t m = mesh_.split(c[i], c[j], 0.5 * (mesh_.point[c[i]] + mesh_.point[c[j]]));
            move(m);
            if (mesh_.cosine_around(m) < before - kLeastGain) return true;
            mesh_.collapse(m, c[i]);
        }
    return false;
}

bool Improver::repair(std::uint32_t t, double slack) {
    if (merge(t, slack)) return true;
    bool moved = false;
    const double before = mesh_.cosine(t);
    for (const std::uint32_t v : mesh_.tet[t]) moved = move(v) || moved;
    if (moved && mesh_.cosine(t) < before - 0.01) return true;
    return flip(t) || reassign_region(t, slack) || moved || (forced_ && insert(t));
}

std::size_t Improver::pass(double target, double slack) {
    std::vector<std::pair<double, std::uint32_t>> bad;
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t)
        if (mesh_.alive(t))
            if (const double cosine = mesh_.cosine(t); cosine > target) bad.emplace_back(-cosine, t);
    std::sort(bad.begin(), bad.end());
    std::size_t repaired = 0;
    for (const auto& [cosine, t] : bad)
        if (mesh_.alive(t) && mesh_.cosine(t) > target) repaired += repair(t, slack);
    return repaired;
}

void Improver::run() {
    const double target = cosine_of_deg(options_.target_deg);
    for (int i = 0; i < 8; ++i) {
        if (pass(target, options_.tolerance) == 0) break;
    }
    // Small angles remain where fronts meet at such or nearly touch: forced passes with growing slack.
    const double required = cosine_of_deg(kRequired * options_.target_deg);
    forced_ = true;
    for (const double slack : {1.0, 1.0, 2.0, 2.0, 4.0, 4.0}) pass(required, slack * options_.tolerance);
}

}  // namespace

void improve(TetComplex& mesh, std::span<const Front> fronts, const TetOptions& options) {
    Improver(mesh, fronts, options).run();
}

}  // namespace sidewall::surface
