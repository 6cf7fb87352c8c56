#include "levelset/shapes/lithography.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "levelset/shapes/outline.hpp"
#include "levelset/shapes/polygon_clipping.hpp"
#include "levelset/shapes/raster.hpp"
#include "surface/error.hpp"
#include "surface/infinity.hpp"
#include "surface/topology.hpp"

namespace sidewall::levelset {
namespace {

constexpr double kPixelsPerCell = 5.0;
constexpr int kSlabs = 4;              // least number of slabs that a row of pixels is cut into
constexpr double kMarginCells = 16.0;  // extent of outlines beyond the domain; wider than a narrow band
constexpr double kMostPixels = 5e7, kMostWork = 3e10;

Raster make_raster(const Blur& blur, const Domain& domain) {
    const double wanted =
        std::max(*std::min_element(blur.sigmas.begin(), blur.sigmas.end()) / kPixelsPerSigma,
                 domain.spacing / kPixelsPerCell);
    Raster raster;
    double pixels = 1.0, work = 0.0;
    for (std::size_t a = 0; a < 2; ++a) {
        const double extent = domain.max[a] - domain.min[a], count = std::ceil(extent / wanted - 1e-9);
        pixels *= count;
        raster.count[a] = static_cast<int>(std::min(count, kMostPixels));
        raster.size[a] = extent / count;
    }
    for (const double sigma : blur.sigmas) work += pixels * blur_work(sigma, wanted);
    if (pixels > kMostPixels || work > kMostWork)
        throw GeometryError("takes {:.2g} pixels and {:.2g} multiplications, over {:g} and {:g}", pixels,
                            work, kMostPixels, kMostWork);
    return raster;
}

struct Edge {
    std::array<double, 2> low, high;  // ends, ordered by y
};

// Adds \p weight times the interval [from, to], in pixels along x, to the pixels of a row that it covers.
void add_interval(float* row, int count, double from, double to, double weight) {
    from = std::max(from, 0.0);
    to = std::min(to, static_cast<double>(count));
    if (from >= to) return;
    const int first = std::min(static_cast<int>(from), count - 1),
              last = std::min(static_cast<int>(to), count - 1);
    for (int i = first; i <= last; ++i)
        row[i] +=
            static_cast<float>(weight * (std::min(to, i + 1.0) - std::max(from, static_cast<double>(i))));
}

// Adds the intervals along x that the outlines enclose at height \p y to a row of pixels.
void add_line(const std::vector<Edge>& edges, double y, double weight, const Raster& raster, double min_x,
              float* row, std::vector<double>& at) {
    at.clear();
    for (const auto& [a, b] : edges)
        if (a[1] <= y && y < b[1])
            at.push_back((a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) - min_x) / raster.size[0]);
    std::sort(at.begin(), at.end());
    for (std::size_t i = 0; i + 1 < at.size(); i += 2)
        add_interval(row, raster.count[0], at[i], at[i + 1], weight);
}

// Sets every pixel to the share of its area within the outlines.
void cover(Raster& raster, const std::vector<Polygon>& outlines, const Domain& domain) {
    std::vector<Edge> edges;
    for (const Polygon& outline : outlines)
        for (std::size_t k = 0, j = outline.size() - 1; k < outline.size(); j = k++) {
            const auto& [a, b] =
                std::minmax(outline[j], outline[k], [](const auto& u, const auto& v) { return u[1] < v[1]; });
            if (a[1] < b[1] && b[1] > domain.min[1] && a[1] < domain.max[1]) edges.push_back({a, b});
        }
    raster.clear();
    tbb::parallel_for(0, raster.count[1], [&](int j) {
        const double low = domain.min[1] + j * raster.size[1], high = low + raster.size[1];
        std::vector<Edge> here;
        std::vector<double> cuts;
        for (int s = 0; s <= kSlabs; ++s) cuts.push_back(low + s * raster.size[1] / kSlabs);
        for (const Edge& edge : edges) {
            if (edge.high[1] <= low || edge.low[1] >= high) continue;
            here.push_back(edge);
            for (const double y : {edge.low[1], edge.high[1]})
                if (y > low && y < high) cuts.push_back(y);
        }
        std::sort(cuts.begin(), cuts.end());
        std::vector<double> at;
        for (std::size_t s = 0; s + 1 < cuts.size() && !here.empty(); ++s)
            if (cuts[s + 1] > cuts[s])
                add_line(here, 0.5 * (cuts[s] + cuts[s + 1]), (cuts[s + 1] - cuts[s]) / raster.size[1],
                         raster, domain.min[0], raster.row(j), at);
    });
}

// The contour of a raster and its continuation beyond the domain, by marching squares between centres of
// pixels i in [-margin, count + margin).
class Contours {
  public:
    Contours(const Raster& raster, const Domain& domain, double threshold)
        : raster_(raster), domain_(domain), threshold_(threshold) {
        for (std::size_t a = 0; a < 2; ++a) {
            const double extent = domain.max[a] - domain.min[a];
            margin_[a] =
                static_cast<int>(std::min(0.5 * extent, kMarginCells * domain.spacing) / raster.size[a]) + 1;
            lattice_[a] = raster.count[a] + 2 * margin_[a] + 2;  // with a rim without resist
        }
    }

    std::vector<Polygon> run() {
        for (int j = 0; j + 1 < lattice_[1]; ++j)
            for (int i = 0; i + 1 < lattice_[0]; ++i) square(i, j);
        std::ranges::sort(pieces_, {}, &surface::Link::from);
        std::vector<Polygon> outlines;
        for (const surface::Chain& chain : surface::join_links(pieces_)) {
            Polygon& outline = outlines.emplace_back();
            for (const std::uint32_t k : chain.links) outline.push_back(crossing(pieces_[k].from));
        }
        return outlines;
    }

  private:
    bool rim(int i, int j) const { return i == 0 || j == 0 || i == lattice_[0] - 1 || j == lattice_[1] - 1; }

    // Positive where resist remains.
    double value(int i, int j) const {
        if (rim(i, j)) return -threshold_;
        return raster_.at(source_pixel(raster_, domain_, 0, i - 1 - margin_[0]),
                          source_pixel(raster_, domain_, 1, j - 1 - margin_[1])) -
               threshold_;
    }
    bool in(int i, int j) const { return value(i, j) > 0.0; }

    // Number of the lattice edge from point (i, j) along \p axis (0 = x, 1 = y).
    std::uint64_t edge(int i, int j, int axis) const {
        return 2 * (static_cast<std::uint64_t>(j) * static_cast<std::uint64_t>(lattice_[0]) +
                    static_cast<std::uint64_t>(i)) +
               static_cast<std::uint64_t>(axis);
    }

    std::array<double, 2> crossing(std::uint64_t edge) const {
        const auto node = edge / 2, width = static_cast<std::uint64_t>(lattice_[0]);
        const std::array<int, 2> a{static_cast<int>(node % width), static_cast<int>(node / width)};
        std::array<int, 2> b = a;
        ++b[edge % 2];
        const double va = value(a[0], a[1]), vb = value(b[0], b[1]);
        std::array<double, 2> p{};
        for (std::size_t axis = 0; axis < 2; ++axis)
            p[axis] =
                domain_.min[axis] +
                (a[axis] - 0.5 - margin_[axis] + (b[axis] - a[axis]) * va / (va - vb)) * raster_.size[axis];
        return p;
    }

    // Adds the pieces of the contour in a square, with the resist on their left. Corners c run
    // counter-clockwise; edge e[k] follows corner c[k].
    void square(int i, int j) {
        const std::array<bool, 4> c{in(i, j), in(i + 1, j), in(i + 1, j + 1), in(i, j + 1)};
        const std::array<std::uint64_t, 4> e{edge(i, j, 0), edge(i + 1, j, 1), edge(i, j + 1, 0),
                                             edge(i, j, 1)};
        const int inside = c[0] + c[1] + c[2] + c[3];
        if (inside == 0 || inside == 4) return;
        const bool saddle = inside == 2 && c[0] == c[2];
        // Two corners on a diagonal are joined if the mean of all four is above the threshold.
        const bool joined =
            saddle && value(i, j) + value(i + 1, j) + value(i + 1, j + 1) + value(i, j + 1) > 0.0;
        for (std::size_t k = 0; k < 4; ++k) {
            const std::size_t next = (k + 1) % 4;
            if (!(c[k] && !c[next]))
                continue;                   // a piece begins where the square's boundary leaves the resist
            std::size_t end = (k + 3) % 4;  // and ends, clockwise, where the boundary entered it,
            if (joined) end = next;         // or on the next edge, as corners are joined
            while (!joined && c[end] == c[(end + 1) % 4]) end = (end + 3) % 4;
            pieces_.push_back({e[k], e[end]});
        }
    }

    const Raster& raster_;
    const Domain& domain_;
    double threshold_;
    std::array<int, 2> margin_{}, lattice_{};
    std::vector<surface::Link> pieces_;
};

// Whether the polygon meets the domain, and whether resist remains on a pixel in it or at one of its corners.
std::pair<bool, bool> meets_and_leaves_resist(const Polygon& polygon, const Raster& raster,
                                              const Domain& domain, double threshold) {
    std::array<int, 2> low{}, high{};
    for (std::size_t a = 0; a < 2; ++a) {
        double from = kInfinity, to = -kInfinity;
        for (const auto& p : polygon) {
            from = std::min(from, (p[a] - domain.min[a]) / raster.size[a]);
            to = std::max(to, (p[a] - domain.min[a]) / raster.size[a]);
        }
        if (!(to > 0.0 && from < raster.count[a])) return {false, false};
        low[a] = static_cast<int>(std::max(from, 0.0));
        high[a] = static_cast<int>(std::min(to, raster.count[a] - 1.0));
    }
    for (const auto& p : polygon) {
        const double i = (p[0] - domain.min[0]) / raster.size[0], j = (p[1] - domain.min[1]) / raster.size[1];
        if (i >= 0.0 && j >= 0.0 && i < raster.count[0] && j < raster.count[1] &&
            raster.at(static_cast<int>(i), static_cast<int>(j)) > threshold)
            return {true, true};
    }
    for (int j = low[1]; j <= high[1]; ++j)
        for (int i = low[0]; i <= high[0]; ++i)
            if (raster.at(i, j) > threshold &&
                signed_distance({&polygon, 1}, domain.min[0] + (i + 0.5) * raster.size[0],
                                domain.min[1] + (j + 0.5) * raster.size[1]) < 0.0)
                return {true, true};
    return {true, false};
}

}  // namespace

ResistContours resist_contours(const std::vector<Polygon>& polygons, const Blur& blur, const Domain& domain,
                               const std::function<bool()>& stop) {
    const auto go_on = [&] {
        if (stop && stop()) throw Interrupted("stopped while outlines were blurred");
    };
    Raster covered = make_raster(blur, domain);
    cover(covered, united(repeated(polygons, domain)), domain);
    Raster blurred = covered;
    blurred.clear();
    std::vector<double> weights = blur.weights;
    if (weights.empty()) weights.assign(blur.sigmas.size(), 1.0);
    const double sum = std::accumulate(weights.begin(), weights.end(), 0.0);
    for (std::size_t k = 0; k < blur.sigmas.size(); ++k) {
        go_on();
        add_blurred(covered, blur.sigmas[k], weights[k] / sum, domain, blurred);
    }
    go_on();
    ResistContours result;
    const auto [least, most] = std::minmax_element(blurred.values.begin(), blurred.values.end());
    result.least = *least;
    result.most = *most;
    result.outlines = Contours(blurred, domain, blur.threshold).run();
    for (std::size_t k = 0; k < polygons.size(); ++k) {
        go_on();
        bool there = false, prints = false;
        for (const Polygon& copy : repeated({polygons[k]}, domain)) {
            const auto [meets, some] = meets_and_leaves_resist(copy, blurred, domain, blur.threshold);
            there |= meets;
            prints |= some;
        }
        if (there && !prints) result.lost.push_back(k);
    }
    return result;
}

}  // namespace sidewall::levelset
