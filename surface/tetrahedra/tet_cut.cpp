#include "surface/tetrahedra/tet_cut.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace sidewall::surface {
namespace {

// Where an edge crosses the front: at a + share (b - a).
struct Cut {
    std::uint32_t a = 0, b = 0;
    double share = 0.0;
};

constexpr double kSnap = 0.3;    // share of an edge: a vertex this near to a crossing moves there
constexpr double kTouch = 0.12;  // share of an edge: this near, one that cannot move counts as on it
// Cosine of 8 degrees, the smallest dihedral angle that moving or adding a vertex may leave.
constexpr double kWorst = 0.9902681;

using Edge = std::array<std::uint32_t, 2>;

// Adds those edges of a tetrahedron for which \p takes(a, b) is true, lower vertex first.
template <class Takes>
void add_edges(const Tetrahedron& c, std::vector<Edge>& edges, Takes&& takes) {
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j)
            if (takes(c[i], c[j])) edges.push_back({std::min(c[i], c[j]), std::max(c[i], c[j])});
}

void make_unique(std::vector<Edge>& edges) {
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
}

class Cutter {
  public:
    Cutter(TetComplex& mesh, std::span<const Front> fronts, int k, const TetOptions& options)
        : mesh_(mesh), front_(fronts[static_cast<std::size_t>(k)]), k_(k), options_(options) {}

    void run() {
        collect();
        find_cuts();
        snap();
        split();
        classify();
        sharpen();
    }

  private:
    void collect();
    void find_cuts();
    void snap();
    void split();
    void classify();
    void sharpen();
    bool bulges(std::uint32_t a, std::uint32_t b) const;
    Vec3 crease_point(std::uint32_t a, std::uint32_t b) const;
    bool may_split(std::uint32_t a, std::uint32_t b, const Vec3& p) const;
    bool moves(std::uint32_t v, const std::vector<std::uint32_t>& cuts);
    double root(std::uint32_t a, std::uint32_t b) const;

    TetComplex& mesh_;
    const Front& front_;
    const int k_;
    const TetOptions& options_;
    std::vector<std::uint32_t> active_;  // tetrahedra of region k + 1
    std::vector<double> s_;              // by vertex: signed distance to the front less lift_; 0 on it
    std::vector<double> lift_;           // by vertex: thickness up to which a film counts as none
    std::vector<Cut> cuts_;
};

// Finds the tetrahedra of region k + 1 and the signed distances of their vertices.
void Cutter::collect() {
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t)
        if (mesh_.alive(t) && mesh_.region[t] == k_ + 1) active_.push_back(t);
    s_.assign(mesh_.point.size(), 0.0);
    lift_.assign(mesh_.point.size(), 0.0);
    std::vector<std::uint32_t> vertices;
    std::vector<std::uint8_t> seen(mesh_.point.size(), 0);
    for (const std::uint32_t t : active_)
        for (const std::uint32_t v : mesh_.tet[t]) {
            if (seen[v]) continue;
            seen[v] = 1;
            vertices.push_back(v);
        }
    tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t i) {
        const std::uint32_t v = vertices[i];
        // Where bodies share a boundary, rounding separates the fronts: a film up to `thin` counts as none.
        if (mesh_.place(v).regions.size() > 1) lift_[v] = options_.thin;
        s_[v] = front_(mesh_.point[v]).distance - lift_[v];
    });
}

double Cutter::root(std::uint32_t a, std::uint32_t b) const {
    double low = 0.0, high = 1.0, f_low = s_[a], f_high = s_[b], share = 0.5;
    const double enough = 1e-4 * std::abs(f_low - f_high);
    for (int i = 0; i < 20; ++i) {
        // Regula falsi, and bisection every third time: distances are nearly linear.
        share = i % 3 == 2 ? 0.5 * (low + high) : low + (high - low) * f_low / (f_low - f_high);
        const Vec3 p = mesh_.point[a] + share * (mesh_.point[b] - mesh_.point[a]);
        const double f = front_(p).distance - ((1.0 - share) * lift_[a] + share * lift_[b]);
        if (std::abs(f) <= enough) break;
        if ((f > 0.0) == (f_low > 0.0)) {
            low = share;
            f_low = f;
        } else {
            high = share;
            f_high = f;
        }
        if (high - low < 1e-6) break;
    }
    return std::clamp(share, 1e-3, 1.0 - 1e-3);
}

void Cutter::find_cuts() {
    std::vector<Edge> edges;
    for (const std::uint32_t t : active_)
        add_edges(mesh_.tet[t], edges, [&](std::uint32_t a, std::uint32_t b) { return s_[a] * s_[b] < 0.0; });
    make_unique(edges);
    cuts_.resize(edges.size());
    tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t i) {
        const auto [a, b] = edges[i];
        cuts_[i] = {a, b, root(a, b)};
    });
}

// Moves a vertex to its nearest crossing that angles allow; returns whether it counts as on the front then.
bool Cutter::moves(std::uint32_t v, const std::vector<std::uint32_t>& cuts) {
    const Place here = mesh_.place(v);
    const bool free = here.freedom() == 3;
    std::vector<std::pair<double, std::uint32_t>> near;
    bool touches = false;
    for (const std::uint32_t c : cuts) {
        const Cut& cut = cuts_[c];
        if (s_[cut.a] * s_[cut.b] >= 0.0) continue;  // its other end was moved onto the front
        const std::uint32_t to = cut.a == v ? cut.b : cut.a;
        const double share = cut.a == v ? cut.share : 1.0 - cut.share;
        if (share > kSnap) continue;
        if (share < kTouch) touches = true;
        if (!free && mesh_.place(v, to) != here) continue;
        near.emplace_back(share * (mesh_.point[to] - mesh_.point[v]).norm(), c);
    }
    std::sort(near.begin(), near.end());
    const Vec3 old = mesh_.point[v];
    const double before = mesh_.cosine_around(v);
    for (const auto& [length, c] : near) {
        const Cut& cut = cuts_[c];
        mesh_.point[v] = mesh_.point[cut.a] + cut.share * (mesh_.point[cut.b] - mesh_.point[cut.a]);
        if (mesh_.cosine_around(v) <= std::max(before, kWorst)) {
            s_[v] = 0.0;
            return true;
        }
        mesh_.point[v] = old;
    }
    if (touches) s_[v] = 0.0;
    return touches;
}

void Cutter::snap() {
    std::vector<std::vector<std::uint32_t>> of(mesh_.point.size());
    for (std::uint32_t c = 0; c < cuts_.size(); ++c) {
        of[cuts_[c].a].push_back(c);
        of[cuts_[c].b].push_back(c);
    }
    for (std::uint32_t v = 0; v < of.size(); ++v)
        if (!of[v].empty()) moves(v, of[v]);
}

void Cutter::split() {
    for (const Cut& cut : cuts_) {
        if (s_[cut.a] * s_[cut.b] >= 0.0) continue;
        // An end may have moved along another edge since the crossing was found.
        const double share = root(cut.a, cut.b);
        mesh_.split(cut.a, cut.b, mesh_.point[cut.a] + share * (mesh_.point[cut.b] - mesh_.point[cut.a]));
        s_.push_back(0.0);
        lift_.push_back(0.0);
    }
}

void Cutter::classify() {
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t) {
        if (!mesh_.alive(t) || mesh_.region[t] != k_ + 1) continue;
        double low = 0.0, high = 0.0;
        Vec3 centroid = Vec3::Zero();
        for (const std::uint32_t v : mesh_.tet[t]) {
            low = std::min(low, s_[v]);
            high = std::max(high, s_[v]);
            centroid += 0.25 * mesh_.point[v];
        }
        if (low < 0.0 || (high == 0.0 && front_(centroid).distance < 0.0)) mesh_.region[t] = k_;
    }
}

bool Cutter::bulges(std::uint32_t a, std::uint32_t b) const {
    const Vec3 middle = 0.5 * (mesh_.point[a] + mesh_.point[b]);
    return std::abs(front_(middle).distance) > 0.5 * options_.tolerance;
}

// Crease point of an edge: where the front's tangent planes near both ends meet, nearest to the edge's
// middle. If they are nearly parallel or meet far from edge or front, the middle moved onto the front.
Vec3 Cutter::crease_point(std::uint32_t a, std::uint32_t b) const {
    const Vec3 &pa = mesh_.point[a], &pb = mesh_.point[b], middle = 0.5 * (pa + pb);
    const auto sides = static_cast<unsigned>(mesh_.side[a] & mesh_.side[b]);
    const auto sample = [&](const Vec3& p) {
        DistanceSample found = front_(p);
        for (int axis = 0; axis < 3; ++axis)
            if ((sides >> (2 * axis) & 3u) != 0) found.rise[axis] = 0.0;
        return found;
    };
    constexpr double kNearEnd = 0.25, kParallel = 0.3;
    const Vec3 qa = pa + kNearEnd * (pb - pa), qb = pb + kNearEnd * (pa - pb);
    const DistanceSample sa = sample(qa), sb = sample(qb);
    const double aa = sa.rise.squaredNorm(), bb = sb.rise.squaredNorm(), ab = sa.rise.dot(sb.rise);
    const double fa = sa.distance + sa.rise.dot(middle - qa), fb = sb.distance + sb.rise.dot(middle - qb);
    const double det = aa * bb - ab * ab;
    if (det > kParallel * kParallel * aa * bb) {
        Vec3 p = middle - (fa * bb - fb * ab) / det * sa.rise - (fb * aa - fa * ab) / det * sb.rise;
        if ((p - middle).norm() < (pb - pa).norm() && std::abs(front_(p).distance) < 0.5 * options_.tolerance)
            return p;
    }
    const DistanceSample at = sample(middle);
    return middle - at.distance / std::max(0.1, at.rise.squaredNorm()) * at.rise;
}

bool Cutter::may_split(std::uint32_t a, std::uint32_t b, const Vec3& p) const {
    for (const std::uint32_t t : mesh_.at_edge(a, b))
        for (const std::uint32_t gone : {a, b})
            if (mesh_.cosine_if_moved(t, gone, p) > kWorst) return false;
    return true;
}

// Splits edges that cut off a crease of the front, at the crease.
void Cutter::sharpen() {
    std::vector<Edge> edges;
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t)
        if (mesh_.alive(t) && mesh_.region[t] == k_)
            add_edges(mesh_.tet[t], edges,
                      [&](std::uint32_t a, std::uint32_t b) { return s_[a] == 0.0 && s_[b] == 0.0; });
    make_unique(edges);
    std::vector<std::uint8_t> wanted(edges.size(), 0);
    tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t i) {
        const auto [a, b] = edges[i];
        const std::vector<int> regions = mesh_.place(a, b).regions;
        wanted[i] = regions.size() == 2 && regions[0] == k_ && regions[1] == k_ + 1 && bulges(a, b);
    });
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const auto [a, b] = edges[i];
        if (!wanted[i] || mesh_.at_edge(a, b).empty()) continue;
        if (const Vec3 p = crease_point(a, b); may_split(a, b, p)) mesh_.split(a, b, p);
    }
}

}  // namespace

void cut_front(TetComplex& mesh, std::span<const Front> fronts, int k, const TetOptions& options) {
    Cutter(mesh, fronts, k, options).run();
}

}  // namespace sidewall::surface
