#include "app/recipe/polygon_checks.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/recipe/layer_checks.hpp"
#include "app/recipe/layers.hpp"
#include "levelset/shapes/polygon_clipping.hpp"
#include "surface/error.hpp"

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

bool overlap(const Bounds& a, const Bounds& b) {
    return (a.min().array() < b.max().array()).all() && (b.min().array() < a.max().array()).all();
}

double perimeter_of(const Polygon& polygon) {
    double perimeter = 0.0;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++)
        perimeter += std::hypot(polygon[k][0] - polygon[j][0], polygon[k][1] - polygon[j][1]);
    return perimeter;
}

std::string points_key(std::size_t k) {
    return fmt::format("polygons[{}].points", k);
}

// Runs \p work.
// \throws KeyError of \p key for its GeometryError: Clipper would take too long.
template <class Work>
auto with_key(const std::string& key, Work&& work) {
    try {
        return work();
    } catch (const GeometryError& error) {
        throw KeyError(key, error.what());
    }
}

void refuse_self_crossing(const Polygon& polygon, const std::string& key) {
    if (const auto at = with_key(key, [&] { return levelset::self_crossing(polygon); }))
        raise_key(key, "the outline crosses itself near ({:g}, {:g}): list the corners in order around it",
                  (*at)[0], (*at)[1]);
}

double united_area(std::initializer_list<Polygon> polygons) {
    return levelset::area_of(levelset::united(polygons));
}

void refuse_overlap(const std::vector<Polygon>& polygons, std::size_t first, std::size_t second,
                    double tiny) {
    const double a = united_area({polygons[first]}), b = united_area({polygons[second]}),
                 common = a + b - united_area({polygons[first], polygons[second]});
    if (common <= tiny) return;
    raise_key(points_key(second),
              "the outline {} polygons[{}], and the program would unite the two: draw both as one "
              "outline, a ring as one with a slit",
              b - common <= tiny   ? "lies inside"
              : a - common <= tiny ? "encloses"
                                   : "overlaps",
              first);
}

// Listed outlines may touch, but not cross or overlap: the grid would take their union, so that a ring drawn
// as two outlines would become a disc.
void refuse_crossings(const std::vector<Polygon>& polygons) {
    std::vector<Bounds> bounds;
    double size = 0.0, sum = 0.0;
    for (std::size_t k = 0; k < polygons.size(); ++k) {
        if (polygons[k].size() < 3)
            throw KeyError(points_key(k), "must be x and y of at least three different corners");
        refuse_self_crossing(polygons[k], points_key(k));
        bounds.push_back(outline_bounds(polygons[k]));
        const double own = bounds.back().sizes().maxCoeff(),
                     area = std::abs(levelset::signed_area(polygons[k]));
        if (area <= kRounding * own * own)
            throw KeyError(points_key(k), "the outline has no area: its corners lie on a line");
        size = std::max(size, own);
        sum += area;
    }
    const double tiny = kRounding * size * size;
    const double all = with_key("polygons", [&] { return levelset::area_of(levelset::united(polygons)); });
    if (sum - all <= tiny) return;
    std::vector<std::size_t> order(polygons.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t k) { return bounds[k].min().x(); });
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = i + 1; j < order.size(); ++j) {
            const auto [first, second] = std::minmax(order[i], order[j]);
            if (bounds[order[j]].min().x() >= bounds[order[i]].max().x()) break;
            if (overlap(bounds[first], bounds[second])) refuse_overlap(polygons, first, second, tiny);
        }
}

// Whether part of the edge lies in the domain. Along a periodic axis every edge does.
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

// An outline with its holes.
struct Piece {
    double area = 0.0, perimeter = 0.0;
    Bounds bounds;
    bool reaches = false;  // has an edge in the domain
};

// The polygons, and the images beyond a side of those that end there: mirror images, or, on a periodic side,
// shifted ones.
std::vector<Polygon> with_images(std::vector<Polygon> polygons, const levelset::Domain& domain) {
    for (std::size_t a = 0; a < 2; ++a) {
        const double length = domain.max[a] - domain.min[a], tiny = kRounding * length;
        for (std::size_t k = polygons.size(); k-- > 0;) {
            const Bounds bounds = outline_bounds(polygons[k]);
            for (const double side : {domain.min[a], domain.max[a]}) {
                const double end = side == domain.min[a] ? bounds.min()[static_cast<Eigen::Index>(a)]
                                                         : bounds.max()[static_cast<Eigen::Index>(a)];
                if (std::abs(end - side) > tiny) continue;
                Polygon image = polygons[k];
                const double shift = side == domain.min[a] ? length : -length;
                for (Corner& p : image)
                    p[a] = domain.side[a] == levelset::Side::reflective ? 2.0 * side - p[a] : p[a] + shift;
                polygons.push_back(std::move(image));
            }
        }
    }
    return polygons;
}

// Width of the rectangle with the same area and perimeter: exact for rectangles of any direction, close for
// lines with bends. A piece from side to side is measured across only: the domain may be thin.
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

// Width and bounds of the narrowest piece with an edge in the domain; infinite if there is none.
// \param apart  takes each outline as a piece, instead of an outline with the holes that follow it.
std::pair<double, Bounds> narrowest(const std::vector<Polygon>& outlines, bool apart,
                                    const levelset::Domain& domain) {
    std::vector<Piece> pieces;
    for (const Polygon& outline : outlines) {
        const double area = levelset::signed_area(outline);
        if (apart || area > 0.0) pieces.emplace_back();
        Piece& piece = pieces.back();
        piece.area += apart ? std::abs(area) : area;
        piece.perimeter += perimeter_of(outline);
        piece.bounds.extend(outline_bounds(outline));
        for (std::size_t k = 0, j = outline.size() - 1; k < outline.size() && !piece.reaches; j = k++)
            piece.reaches = reaches(outline[j], outline[k], domain);
    }
    std::pair<double, Bounds> least{kInfinity, {}};
    for (const Piece& piece : pieces)
        if (piece.reaches && width_in(piece, domain) < least.first)
            least = {width_in(piece, domain), piece.bounds};
    return least;
}

}  // namespace

void check_outline(const Polygon& polygon, const std::string& key) {
    const Polygon corners = levelset::distinct(polygon);
    if (corners.size() < 3) throw KeyError(key, "must be of at least three different points");
    refuse_self_crossing(corners, key);
}

void check_polygons(const Layer& layer, const std::vector<Polygon>& polygons, const levelset::Domain& domain,
                    const std::string& path, std::vector<std::string>& notes) {
    const bool blurred = !layer.blur.empty();
    const std::string source = layer.file.empty() ? "polygons" : "file";
    std::vector<Polygon> placed;
    placed.reserve(polygons.size());
    for (const Polygon& polygon : polygons) {
        placed.push_back(levelset::distinct(polygon));
        levelset::move_by(placed.back(), layer.position);
    }
    if (layer.file.empty()) refuse_crossings(placed);
    const std::vector<Polygon> printed = check_print(layer, placed, domain, path, notes);
    const auto [width, bounds] = with_key(source, [&] {
        return narrowest(blurred ? printed : levelset::united(with_images(printed, domain)), blurred, domain);
    });
    if (std::isinf(width))
        raise_key(source,
                  "no edge of the outlines lies in the domain, {:g} x {:g} and centred on 0: the "
                  "mask would be all open or all closed; check unit and position",
                  domain.max[0] - domain.min[0], domain.max[1] - domain.min[1]);
    const double cells = width / domain.spacing * (1.0 + kRounding);
    if (cells >= kGoodCells) return;
    std::string key = blurred ? "blur" : source;
    if (layer.file.empty() && !blurred) {
        const Bounds around(bounds.min().array() - kRounding * bounds.sizes().maxCoeff(),
                            bounds.max().array() + kRounding * bounds.sizes().maxCoeff());
        const auto part = std::find_if(placed.begin(), placed.end(),
                                       [&](const Polygon& p) { return around.contains(outline_bounds(p)); });
        key = points_key(static_cast<std::size_t>(part - placed.begin()));
    }
    const std::string finer = fmt::format("use a grid_spacing of {:.2g} or less", width / kGoodCells);
    if (key.starts_with("polygons[") && cells < kFewestCells)
        raise_key(key,
                  "the outline is only {:.3g} cells wide, and the grid loses shapes under {:g} cells: {}",
                  cells, kFewestCells, finer);
    notes.push_back(fmt::format(
        "{}.{}: the narrowest outline is {:.3g} cells wide: its corners and fluxes are coarse under "
        "{:g}, and under {:g} it is lost; {}",
        path, key, cells, kGoodCells, kFewestCells, finer));
}

}  // namespace sidewall::app
