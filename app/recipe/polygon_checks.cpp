#include "app/recipe/polygon_checks.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "app/recipe/layer_checks.hpp"
#include "app/recipe/layers.hpp"
#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

using levelset::Polygon;
using Corner = std::array<double, 2>;

using Bounds = Eigen::AlignedBox2d;

Bounds outline_bounds(const Polygon& polygon) {
    Bounds bounds;
    for (const Corner& p : polygon) bounds.extend(Eigen::Map<const Eigen::Vector2d>(p.data()));
    return bounds;
}

// Whether the boxes overlap or, with a \p reach, are as near.
bool meet(const Bounds& a, const Bounds& b, double reach = 0.0) {
    return (a.min().array() < b.max().array() + reach).all() &&
           (b.min().array() - reach < a.max().array()).all();
}

// Positive if it goes round counter-clockwise.
double signed_area(const Polygon& polygon) {
    double twice = 0.0;
    const Corner o = polygon[0];  // near, for small outlines far from 0
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
        twice +=
            (polygon[j][0] - o[0]) * (polygon[k][1] - o[1]) - (polygon[k][0] - o[0]) * (polygon[j][1] - o[1]);
    return 0.5 * twice;
}

double perimeter_of(const Polygon& polygon) {
    double perimeter = 0.0;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
        perimeter += std::hypot(polygon[k][0] - polygon[j][0], polygon[k][1] - polygon[j][1]);
    return perimeter;
}

// Distance of \p p from the line through \p a and \p b, positive on its left.
double side_of(const Corner& a, const Corner& b, const Corner& p) {
    const double ex = b[0] - a[0], ey = b[1] - a[1];
    return (ex * (p[1] - a[1]) - ey * (p[0] - a[0])) / std::hypot(ex, ey);
}

// Edges that cross by more than rounding; those that only touch do not.
bool cross(const Corner& a, const Corner& b, const Corner& c, const Corner& d, double tiny) {
    const auto apart = [&](double one, double other) {
        return std::min(one, other) < -tiny && std::max(one, other) > tiny;
    };
    return apart(side_of(a, b, c), side_of(a, b, d)) && apart(side_of(c, d, a), side_of(c, d, b));
}

bool inside(const Polygon& polygon, const Corner& p) {
    return levelset::signed_distance({polygon}, p[0], p[1]) < 0.0;
}

// Points just within \p polygon, near the ends and the middle of each edge.
std::vector<Corner> points_within(const Polygon& polygon, double tiny) {
    const double left = signed_area(polygon) > 0.0 ? 1.0 : -1.0;
    std::vector<Corner> points;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
        const double ex = polygon[k][0] - polygon[j][0], ey = polygon[k][1] - polygon[j][1];
        const double step = left * tiny / std::hypot(ex, ey);
        for (const double t : {0.01, 0.5, 0.99})
            points.push_back({polygon[j][0] + t * ex - step * ey, polygon[j][1] + t * ey + step * ex});
    }
    return points;
}

// Without corners that repeat the one before.
Polygon distinct(const Polygon& polygon) {
    Polygon corners;
    for (const Corner& p : polygon)
        if (corners.empty() || corners.back() != p) corners.push_back(p);
    while (corners.size() > 1 && corners.back() == corners.front()) corners.pop_back();
    return corners;
}

// How many comparisons of edges may be made: seconds of work.
class Effort {
  public:
    void spend(std::size_t a, std::size_t b) {
        left_ -= static_cast<double>(a) * static_cast<double>(b);
        if (left_ < 0.0)
            throw KeyError(
                "polygons",
                "too many corners lie close together to tell whether outlines cross: give them as a "
                "GDSII file, whose polygons are united");
    }

  private:
    double left_ = 5e8;
};

// 0 to \p count - 1 by ascending values, equal ones in their order.
template <class Value>
std::vector<std::size_t> sorted_by(std::size_t count, Value&& value) {
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return value(a) < value(b); });
    return order;
}

std::string points_key(std::size_t k) {
    return fmt::format("polygons[{}].points", k);
}

// Only edges that overlap along x are compared.
void refuse_self_crossing(const Polygon& polygon, std::size_t key, double tiny, Effort& effort) {
    const std::size_t n = polygon.size();
    const auto end = [&](std::size_t i) -> const Corner& { return polygon[(i + 1) % n]; };
    const auto low = [&](std::size_t i) { return std::min(polygon[i][0], end(i)[0]); };
    const std::vector<std::size_t> order = sorted_by(n, low);
    for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = a + 1; b < n; ++b) {
            const std::size_t i = order[a], j = order[b];
            effort.spend(1, 1);
            if (low(j) > std::max(polygon[i][0], end(i)[0])) break;
            if ((i + 1) % n == j || (j + 1) % n == i) continue;
            if (cross(polygon[i], end(i), polygon[j], end(j), tiny))
                throw KeyError(
                    points_key(key),
                    fmt::format("the outline crosses itself near ({:g}, {:g}): list the corners in "
                                "order around it",
                                polygon[i][0], polygon[i][1]));
        }
}

void refuse_overlap(const std::vector<Polygon>& polygons, std::size_t first, std::size_t second,
                    double tiny) {
    const Polygon &a = polygons[first], &b = polygons[second];
    const std::string rule = fmt::format(
        "polygons[{}], and outlines are united: draw both as one outline, a ring as one with a slit", first);
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t j = 0; j < b.size(); ++j)
            if (cross(a[i], a[(i + 1) % a.size()], b[j], b[(j + 1) % b.size()], tiny))
                throw KeyError(points_key(second), "the outline crosses " + rule);
    const auto within = [&](const Polygon& one, const Polygon& other) {
        const std::vector<Corner> points = points_within(one, tiny);
        return static_cast<std::size_t>(
            std::count_if(points.begin(), points.end(), [&](const Corner& p) { return inside(other, p); }));
    };
    if (const std::size_t points = within(b, a); points > 0)
        throw KeyError(
            points_key(second),
            (points == 3 * b.size() ? "the outline lies inside " : "the outline overlaps ") + rule);
    if (within(a, b) > 0) throw KeyError(points_key(second), "the outline encloses or overlaps " + rule);
}

// Outlines that the recipe lists may touch, but not cross or overlap: the grid would take their union, and a
// ring drawn as two of them would be a disc.
void refuse_crossings(const std::vector<Polygon>& polygons) {
    std::vector<Bounds> bounds;
    Effort effort;
    double size = 0.0;
    for (const Polygon& polygon : polygons) {
        bounds.push_back(outline_bounds(polygon));
        size = std::max(size, bounds.back().sizes().maxCoeff());
    }
    const double tiny = kRounding * size;
    for (std::size_t k = 0; k < polygons.size(); ++k) {
        if (polygons[k].size() < 3)
            throw KeyError(points_key(k), "must be x and y of at least three different corners");
        refuse_self_crossing(polygons[k], k, tiny, effort);
    }
    const auto order = sorted_by(polygons.size(), [&](std::size_t k) { return bounds[k].min().x(); });
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = i + 1; j < order.size(); ++j) {
            const auto [first, second] = std::minmax(order[i], order[j]);
            if (bounds[order[j]].min().x() >= bounds[order[i]].max().x()) break;
            effort.spend(1, 1);
            if (!meet(bounds[first], bounds[second])) continue;
            effort.spend(polygons[first].size(), 8 * polygons[second].size());
            refuse_overlap(polygons, first, second, tiny);
        }
}

// Whether a part of the edge lies within the domain; on a periodic axis all of it does.
bool reaches(const Corner& a, const Corner& b, const levelset::Domain& domain) {
    double from = 0.0, to = 1.0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        if (domain.side[axis] == levelset::Side::periodic) continue;
        const double tiny = kRounding * (domain.max[axis] - domain.min[axis]);
        const double low = domain.min[axis] + tiny - a[axis], high = domain.max[axis] - tiny - a[axis];
        const double along = b[axis] - a[axis];
        if (along == 0.0) {
            if (low > 0.0 || high < 0.0) return false;
            continue;
        }
        from = std::max(from, std::min(low / along, high / along));
        to = std::min(to, std::max(low / along, high / along));
    }
    return from < to;
}

// Outlines that adjoin, as the one that they are together.
struct Piece {
    double area = 0.0, perimeter = 0.0;
    Bounds bounds;
};

// How long a part of the edge from \p a to \p b lies on the one from \p c to \p d.
double shared_length(const Corner& a, const Corner& b, const Corner& c, const Corner& d, double tiny) {
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    if (std::abs(side_of(a, b, c)) > tiny || std::abs(side_of(a, b, d)) > tiny) return 0.0;
    const auto along = [&](const Corner& p) {
        return ((p[0] - a[0]) * (b[0] - a[0]) + (p[1] - a[1]) * (b[1] - a[1])) / length;
    };
    const auto [low, high] = std::minmax({along(c), along(d)});
    return std::max(0.0, std::min(high, length) - std::max(low, 0.0));
}

double shared_length(const Polygon& one, const Polygon& other, double tiny) {
    double length = 0.0;
    for (std::size_t k = 0, j = one.size() - 1; k < one.size(); j = k++)
        for (std::size_t l = 0, i = other.size() - 1; l < other.size(); i = l++)
            length += shared_length(one[j], one[k], other[i], other[l], tiny);
    return length;
}

// A side of the domain that mirrors adds the image of what lies on it.
void mirror(Piece& piece, const std::vector<const Polygon*>& parts, const levelset::Domain& domain,
            double tiny) {
    for (std::size_t a = 0; a < 2; ++a)
        for (const double side : {domain.min[a], domain.max[a]}) {
            if (domain.side[a] != levelset::Side::reflective) continue;
            Corner from{}, to{};
            from[a] = to[a] = side;
            from[1 - a] = domain.min[1 - a];
            to[1 - a] = domain.max[1 - a];
            double on_it = 0.0;
            for (const Polygon* part : parts) on_it += shared_length({from, to}, *part, tiny) / 2.0;
            if (on_it <= tiny) continue;
            piece.area *= 2.0;
            piece.perimeter = 2.0 * (piece.perimeter - on_it);
            const auto i = static_cast<Eigen::Index>(a);
            const double width = piece.bounds.sizes()[i];
            (side == domain.min[a] ? piece.bounds.min() : piece.bounds.max())[i] +=
                side == domain.min[a] ? -width : width;
        }
}

// Width of the rectangle of the same area and perimeter: exact for rectangles, however they are turned, near
// for lines with bends. Across it alone where it reaches from side to side: the domain may be thin.
double width_in(const Piece& piece, const levelset::Domain& domain) {
    const double half = 0.5 * piece.perimeter;
    const double root = std::sqrt(std::max(0.0, half * half - 4.0 * piece.area));
    double width = half > 0.0 ? 2.0 * piece.area / (half + root) : 0.0;
    const Eigen::Vector2d sizes = piece.bounds.sizes();
    for (std::size_t a = 0; a < 2; ++a)
        if (sizes[static_cast<Eigen::Index>(a)] >= (1.0 - kRounding) * (domain.max[a] - domain.min[a]))
            width = std::max(width, sizes[static_cast<Eigen::Index>(1 - a)]);
    return width;
}

// Numbers the outlines so that those that adjoin have one number; \p common gets the length of edge that each
// shares.
std::vector<std::size_t> adjoining(const std::vector<Polygon>& polygons, double tiny,
                                   std::vector<double>& common) {
    surface::DisjointSets sets(polygons.size());
    std::vector<Bounds> bounds;
    bounds.reserve(polygons.size());
    for (const Polygon& polygon : polygons) bounds.push_back(outline_bounds(polygon));
    const auto order = sorted_by(polygons.size(), [&](std::size_t k) { return bounds[k].min().x(); });
    double left = 5e7;  // comparisons of edges: of a large layout the rest is taken as it is
    for (std::size_t i = 0; i < order.size() && left > 0.0; ++i)
        for (std::size_t j = i + 1; j < order.size() && left > 0.0; ++j) {
            const std::size_t a = order[i], b = order[j];
            left -= 1.0;
            if (bounds[b].min().x() > bounds[a].max().x() + tiny) break;
            if (polygons[a].size() < 3 || polygons[b].size() < 3 || !meet(bounds[a], bounds[b], tiny))
                continue;
            left -= static_cast<double>(polygons[a].size()) * static_cast<double>(polygons[b].size());
            const double shared = shared_length(polygons[a], polygons[b], tiny);
            if (shared <= tiny) continue;
            common[a] += shared;
            common[b] += shared;
            sets.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
        }
    std::vector<std::size_t> group;
    for (std::uint32_t k = 0; k < polygons.size(); ++k) group.push_back(sets.root(k));
    return group;
}

// The widths of those with an edge in the domain, with what adjoins them and mirrored; infinite for the
// others.
std::vector<double> widths_in(const std::vector<Polygon>& polygons, const levelset::Domain& domain) {
    const double tiny = kRounding * std::max(domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]);
    std::vector<double> common(polygons.size(), 0.0);
    const std::vector<std::size_t> group = adjoining(polygons, tiny, common);
    std::vector<Piece> pieces(polygons.size());
    std::vector<std::vector<const Polygon*>> parts(polygons.size());
    for (std::size_t k = 0; k < polygons.size(); ++k) {
        if (polygons[k].size() < 3) continue;  // a layout may hold outlines of one or two different corners
        Piece& piece = pieces[group[k]];
        piece.area += std::abs(signed_area(polygons[k]));
        piece.perimeter += perimeter_of(polygons[k]) - common[k];
        piece.bounds.extend(outline_bounds(polygons[k]));
        parts[group[k]].push_back(&polygons[k]);
    }
    for (std::size_t k = 0; k < pieces.size(); ++k) mirror(pieces[k], parts[k], domain, tiny);
    std::vector<double> widths;
    for (std::size_t n = 0; n < polygons.size(); ++n) {
        const Polygon& polygon = polygons[n];
        bool any = false;
        for (std::size_t k = 0, j = polygon.size() - 1; polygon.size() > 2 && k < polygon.size() && !any;
             j = k++)
            any = reaches(polygon[j], polygon[k], domain);
        widths.push_back(any ? width_in(pieces[group[n]], domain) : std::numeric_limits<double>::infinity());
    }
    return widths;
}

}  // namespace

void check_outline(const Polygon& polygon, const std::string& key) {
    const Polygon corners = distinct(polygon);
    if (corners.size() < 3) throw KeyError(key, "must be of at least three different points");
    Effort effort;
    try {
        refuse_self_crossing(corners, 0, kRounding * outline_bounds(corners).sizes().maxCoeff(), effort);
    } catch (const KeyError& error) {
        throw KeyError(key, error.rule);
    }
}

void check_polygons(const Layer& layer, const std::vector<Polygon>& polygons, const levelset::Domain& domain,
                    const std::string& path, std::vector<std::string>& notes) {
    const bool listed = layer.file.empty() && layer.blur.empty();
    std::vector<Polygon> placed;
    for (const Polygon& polygon : polygons) {
        placed.push_back(distinct(polygon));
        for (Corner& p : placed.back())
            for (std::size_t a = 0; a < 2; ++a) p[a] += layer.position[a];
    }
    if (layer.file.empty()) refuse_crossings(placed);
    placed = check_print(layer, placed, domain, path, notes);
    const std::vector<double> widths = widths_in(placed, domain);
    const auto narrowest = std::min_element(widths.begin(), widths.end());
    if (std::isinf(*narrowest))
        throw KeyError(
            layer.file.empty() ? "polygons" : "file",
            fmt::format("no edge of the outlines lies in the domain, {:g} x {:g} and centred on 0: the "
                        "mask would be all open or all closed; check unit and position",
                        domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]));
    const auto k = static_cast<std::size_t>(narrowest - widths.begin());
    const double cells = *narrowest / domain.spacing * (1.0 + kRounding);
    const std::string finer = fmt::format("use a grid_spacing of {:.2g} or less", *narrowest / kGoodCells);
    if (listed && *narrowest <= 0.0)
        throw KeyError(points_key(k), "the outline has no area: its corners lie on a line");
    // Pieces of a layout may adjoin others.
    if (listed && cells < kFewestCells)
        throw KeyError(points_key(k),
                       fmt::format("the outline is only {:.3g} cells wide, and the grid loses what "
                                   "is under {:g}: {}",
                                   cells, kFewestCells, finer));
    if (cells < kGoodCells)
        notes.push_back(fmt::format(
            "{}.{}: the narrowest outline is {:.3g} cells wide: its corners and fluxes are coarse under "
            "{:g}, and under {:g} it is lost unless it adjoins others; {}",
            path,
            listed               ? points_key(k)
            : layer.blur.empty() ? "file"
                                 : "blur",
            cells, kGoodCells, kFewestCells, finer));
}

}  // namespace sidewall::app
