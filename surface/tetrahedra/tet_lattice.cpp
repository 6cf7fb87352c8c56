#include "surface/tetrahedra/tet_lattice.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

/// Bisection of tetrahedra after Maubach, whose vertex order it keeps: the edge to be bisected runs from a
/// tetrahedron's vertex 0 to the one of its tag.
class Bisection {
  public:
    Bisection(std::span<const Front> fronts, const TetOptions& options);
    TetComplex run();

  private:
    void add_cubes();
    void evaluate_new_vertices();
    bool wants_division(std::uint32_t t) const;
    void divide(std::uint32_t t);
    void divide_edge(std::uint32_t a, std::uint32_t b);

    std::span<const Front> fronts_;
    const TetOptions& options_;
    TetComplex mesh_;
    std::vector<int> tag_;                 // Maubach's tag by tetrahedron
    std::vector<std::vector<double>> at_;  // signed distances by front, then vertex
};

Bisection::Bisection(std::span<const Front> fronts, const TetOptions& options)
    : fronts_(fronts), options_(options), at_(fronts.size()) {
    mesh_.outside = static_cast<int>(fronts.size());
}

void Bisection::add_cubes() {
    // Neighbouring cubes are mirror images, so that odd numbers of cubes conform, too.
    const Vec3 extent = options_.box.size();
    const double coarse = std::min({16.0 * options_.size, extent.x(), extent.y(), extent.z()});
    std::array<std::size_t, 3> n{};
    for (std::size_t a = 0; a < 3; ++a)
        n[a] = static_cast<std::size_t>(std::max(1.0, std::round(extent[static_cast<int>(a)] / coarse)));
    const auto index = [&](const std::array<std::size_t, 3>& c) {
        return static_cast<std::uint32_t>((c[2] * (n[1] + 1) + c[1]) * (n[0] + 1) + c[0]);
    };
    std::array<std::size_t, 3> c{};
    for (c[2] = 0; c[2] <= n[2]; ++c[2])
        for (c[1] = 0; c[1] <= n[1]; ++c[1])
            for (c[0] = 0; c[0] <= n[0]; ++c[0]) {
                Vec3 p;
                std::uint8_t sides = 0;
                for (std::size_t a = 0; a < 3; ++a) {
                    const auto axis = static_cast<Eigen::Index>(a);
                    const double share = static_cast<double>(c[a]) / static_cast<double>(n[a]);
                    p[axis] =
                        c[a] == n[a] ? options_.box.max[axis] : options_.box.min[axis] + share * extent[axis];
                    if (c[a] == 0) sides |= static_cast<std::uint8_t>(1u << (2 * a));
                    if (c[a] == n[a]) sides |= static_cast<std::uint8_t>(2u << (2 * a));
                }
                mesh_.add_vertex(p, sides);
            }
    constexpr std::array<std::array<std::size_t, 3>, 6> kOrders{
        {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
    for (c[2] = 0; c[2] < n[2]; ++c[2])
        for (c[1] = 0; c[1] < n[1]; ++c[1])
            for (c[0] = 0; c[0] < n[0]; ++c[0])
                for (const auto& order : kOrders) {
                    // Along edges from the corner of even indices to that of odd ones, one axis at a time.
                    std::array<std::size_t, 3> corner{};
                    for (std::size_t a = 0; a < 3; ++a) corner[a] = c[a] + c[a] % 2;
                    Tetrahedron t{index(corner)};
                    for (std::size_t k = 0; k < 3; ++k) {
                        const std::size_t a = order[k];
                        corner[a] = c[a] + 1 - c[a] % 2;
                        t[k + 1] = index(corner);
                    }
                    mesh_.add_tet(t, mesh_.outside);
                    tag_.push_back(3);
                }
}

void Bisection::evaluate_new_vertices() {
    const std::size_t from = at_[0].size(), to = mesh_.point.size();
    for (auto& values : at_) values.resize(to);
    tbb::parallel_for(from, to, [&](std::size_t v) {
        for (std::size_t k = 0; k < fronts_.size(); ++k) at_[k][v] = fronts_[k](mesh_.point[v]).distance;
    });
}

bool Bisection::wants_division(std::uint32_t t) const {
    const Tetrahedron& tet = mesh_.tet[t];
    double longest = 0.0;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j)
            longest = std::max(longest, (mesh_.point[tet[i]] - mesh_.point[tet[j]]).norm());
    if (longest <= options_.least) return false;
    constexpr double kFilm = 2.0;  // longest edge in thicknesses of a film: longer ones make small angles
    const Vec3 &a = mesh_.point[tet[0]], &b = mesh_.point[tet[static_cast<std::size_t>(tag_[t])]];
    const Vec3 middle = 0.5 * (a + b);
    Vec3 centroid = Vec3::Zero();
    for (const std::uint32_t v : tet) centroid += 0.25 * mesh_.point[v];
    double nearest = 1e300, least_top = 1e300;
    for (const std::uint32_t v : tet) least_top = std::min(least_top, at_.back()[v]);
    // An outside that is not meshed is divided only to conform.
    if (!options_.outside && least_top > 0.5 * longest) return false;
    std::array<double, 6> below{};
    bool had_below = false;
    for (std::size_t k = 0; k < fronts_.size(); ++k) {
        std::array<double, 6> f{};
        double low = 1e300, high = -1e300, mean = 0.0;
        for (std::size_t i = 0; i < 4; ++i) {
            f[i] = at_[k][tet[i]];
            low = std::min(low, f[i]);
            high = std::max(high, f[i]);
            mean += 0.25 * f[i];
        }
        const double gap = low > 0.0 ? low : high < 0.0 ? -high : 0.0;
        nearest = std::min(nearest, gap);
        const bool touches = gap < 0.5 * longest;
        if (!touches) {
            had_below = false;
            continue;
        }
        if (longest > options_.size) return true;
        f[4] = fronts_[k](middle).distance;
        f[5] = fronts_[k](centroid).distance;
        const double bulge =
            std::max(std::abs(f[4] - 0.5 * (at_[k][tet[0]] + at_[k][tet[static_cast<std::size_t>(tag_[t])]])),
                     std::abs(f[5] - mean));
        const bool crosses = gap == 0.0 || (f[4] > 0.0) != (f[5] > 0.0) || gap < bulge;
        if (crosses && bulge > options_.tolerance) return true;
        if (had_below) {
            double film = 0.0;
            for (std::size_t i = 0; i < 6; ++i) film = std::max(film, below[i] - f[i]);
            if (film > options_.thin && longest > kFilm * film) return true;
        }
        below = f;
        had_below = true;
    }
    return longest > options_.size + options_.growth * nearest;
}

// Bisects an edge with all tetrahedra at it. Those that are to be bisected at another edge go first.
void Bisection::divide_edge(std::uint32_t a, std::uint32_t b) {
    for (bool ready = false; !ready;) {
        ready = true;
        for (const std::uint32_t t : mesh_.at_edge(a, b)) {
            const Tetrahedron& tet = mesh_.tet[t];
            const std::uint32_t from = tet[0], to = tet[static_cast<std::size_t>(tag_[t])];
            if ((from == a && to == b) || (from == b && to == a)) continue;
            divide_edge(from, to);
            ready = false;
            break;
        }
    }
    const std::uint32_t m =
        mesh_.add_vertex(0.5 * (mesh_.point[a] + mesh_.point[b]), mesh_.side[a] & mesh_.side[b]);
    for (const std::uint32_t t : mesh_.at_edge(a, b)) {
        const Tetrahedron x = mesh_.tet[t];
        const int tag = tag_[t], next = tag > 1 ? tag - 1 : 3;
        Tetrahedron one = x, two = x;
        std::copy(x.begin() + 1, x.begin() + tag + 1, two.begin());
        one[static_cast<std::size_t>(tag)] = two[static_cast<std::size_t>(tag)] = m;
        mesh_.remove_tet(t);
        for (const Tetrahedron& child : {one, two}) {
            mesh_.add_tet(child, mesh_.outside);
            tag_.push_back(next);
        }
    }
}

TetComplex Bisection::run() {
    add_cubes();
    for (std::uint32_t first = 0; first < mesh_.tet.size();) {
        evaluate_new_vertices();
        const auto end = static_cast<std::uint32_t>(mesh_.tet.size());
        std::vector<std::uint8_t> wanted(end - first, 0);
        tbb::parallel_for(first, end, [&](std::uint32_t t) {
            if (mesh_.alive(t)) wanted[t - first] = wants_division(t);
        });
        for (std::uint32_t t = first; t < end; ++t)
            if (wanted[t - first] && mesh_.alive(t)) {
                const Tetrahedron tet = mesh_.tet[t];
                divide_edge(tet[0], tet[static_cast<std::size_t>(tag_[t])]);
            }
        first = end;
        if (options_.most > 0 && mesh_.count() > options_.most)
            throw TooManyTetrahedra("more than {} tetrahedra are needed: choose a larger size",
                                    options_.most);
    }
    // Maubach's order does not keep orientation: make all volumes positive.
    for (std::uint32_t t = 0; t < mesh_.tet.size(); ++t) {
        if (!mesh_.alive(t)) continue;
        Tetrahedron& x = mesh_.tet[t];
        if (mesh_.volume(x) < 0.0) std::swap(x[2], x[3]);
    }
    return std::move(mesh_);
}

}  // namespace

TetComplex bisected_box(std::span<const Front> fronts, const TetOptions& options) {
    return Bisection(fronts, options).run();
}

}  // namespace sidewall::surface
