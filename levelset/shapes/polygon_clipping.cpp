#include "levelset/shapes/polygon_clipping.hpp"

#include <algorithm>
#include <cmath>
#include <polyclipping/clipper.hpp>

#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

using ClipperLib::IntPoint, ClipperLib::IntRect, ClipperLib::Paths;

constexpr int kLatticeBits = 50;        // less than a double's 53, in which Clipper computes crossings
constexpr std::size_t kFewParts = 16;   // are united at once
constexpr std::size_t kChunk = 64;      // segments of a path that are drawn together
constexpr double kArcTolerance = 1e-3;  // of a round end's radius
constexpr double kTouching = 1e-9;      // of a polygon's size
constexpr double kPathOverlap = 1e-6;   // of half a path's width, of what is drawn by itself
constexpr std::size_t kMostPairs = 500'000'000, kMostCrossings = 1'000'000;  // of edges: some seconds of work

// The integers that Clipper works on.
class Lattice {
  public:
    explicit Lattice(double farthest) {
        if (!std::isfinite(farthest)) throw GeometryError("a polygon's corner is not finite");
        scale_ = farthest > 0.0 ? std::ldexp(1.0, kLatticeBits - 1 - std::ilogb(farthest)) : 1.0;
    }
    explicit Lattice(std::span<const Polygon> polygons) : Lattice(farthest(polygons)) {}

    double scale() const { return scale_; }

    ClipperLib::Path path(const Polygon& polygon) const {
        ClipperLib::Path path;
        path.reserve(polygon.size());
        for (const auto& [x, y] : polygon)
            path.emplace_back(std::llround(x * scale_), std::llround(y * scale_));
        return path;
    }

    Polygon polygon(const ClipperLib::Path& path) const {
        Polygon polygon;
        polygon.reserve(path.size());
        for (const IntPoint& p : path)
            polygon.push_back({static_cast<double>(p.X) / scale_, static_cast<double>(p.Y) / scale_});
        return polygon;
    }

    static double farthest(std::span<const Polygon> polygons) {
        double most = 0.0;
        for (const Polygon& polygon : polygons)
            for (const auto& p : polygon)
                for (const double x : p) most = std::isfinite(x) ? std::max(most, std::abs(x)) : x;
        return most;
    }

  private:
    double scale_ = 1.0;
};

// A connected piece of the plane: its outer outline, then its holes.
struct Part {
    Paths paths;
    IntRect box{};
};

bool meet(const IntRect& a, const IntRect& b) {
    return a.left <= b.right && b.left <= a.right && a.bottom <= b.top && b.bottom <= a.top;
}

IntRect around(const IntRect& a, const IntRect& b) {
    return {std::min(a.left, b.left), std::max(a.top, b.top), std::max(a.right, b.right),
            std::min(a.bottom, b.bottom)};
}

IntRect box_of(std::span<const Part> parts) {
    IntRect box = parts.front().box;
    for (const Part& part : parts) box = around(box, part.box);
    return box;
}

Part make_part(Paths paths) {
    const IntPoint& first = paths[0][0];
    IntRect box{first.X, first.Y, first.X, first.Y};
    for (const IntPoint& p : paths[0]) box = around(box, {p.X, p.Y, p.X, p.Y});
    return {std::move(paths), box};
}

// Counts edges that share heights, and those that cross, which is what Clipper's work grows with.
class Effort {
  public:
    void spend(std::span<const Part> parts) {
        edges_.clear();
        for (const Part& part : parts)
            for (const ClipperLib::Path& path : part.paths)
                for (std::size_t k = 0, j = path.size() - 1; k < path.size(); j = k++)
                    edges_.push_back(path[j].Y < path[k].Y ? Edge{path[j], path[k]} : Edge{path[k], path[j]});
        std::sort(edges_.begin(), edges_.end(),
                  [](const Edge& a, const Edge& b) { return a.low.Y < b.low.Y; });
        for (std::size_t i = 0; i < edges_.size(); ++i)
            for (std::size_t j = i + 1; j < edges_.size() && edges_[j].low.Y <= edges_[i].high.Y; ++j) {
                if (cross(edges_[i], edges_[j])) ++crossings_;
                if (++pairs_ > kMostPairs || crossings_ > kMostCrossings)
                    throw GeometryError(
                        "too many edges of polygons lie across one another; give fewer or simpler ones");
            }
    }

  private:
    struct Edge {
        IntPoint low, high;
    };

    static bool cross(const Edge& a, const Edge& b) {
        if (std::max(a.low.X, a.high.X) < std::min(b.low.X, b.high.X) ||
            std::max(b.low.X, b.high.X) < std::min(a.low.X, a.high.X))
            return false;
        const auto left = [](const Edge& e, const IntPoint& p) {
            return static_cast<double>(e.high.X - e.low.X) * static_cast<double>(p.Y - e.low.Y) >
                   static_cast<double>(e.high.Y - e.low.Y) * static_cast<double>(p.X - e.low.X);
        };
        return left(a, b.low) != left(a, b.high) && left(b, a.low) != left(b, a.high);
    }

    std::vector<Edge> edges_;
    std::size_t pairs_ = 0, crossings_ = 0;
};

std::vector<Part> clip(std::span<const Part> parts, ClipperLib::PolyFillType fill, Effort& effort) {
    effort.spend(parts);
    ClipperLib::Clipper clipper;
    bool any = false;  // that is more than a line
    for (const Part& part : parts) any |= clipper.AddPaths(part.paths, ClipperLib::ptSubject, true);
    if (!any) return {};
    ClipperLib::PolyTree tree;
    if (!clipper.Execute(ClipperLib::ctUnion, tree, fill)) throw GeometryError("polygons cannot be united");
    std::vector<Part> result;
    for (const ClipperLib::PolyNode* node = tree.GetFirst(); node != nullptr; node = node->GetNext()) {
        if (node->IsHole()) continue;
        Paths paths{node->Contour};
        for (const ClipperLib::PolyNode* hole : node->Childs) paths.push_back(hole->Contour);
        result.push_back(make_part(std::move(paths)));
    }
    return result;
}

// Halves are united by themselves; then only what lies along the cut is, for Clipper's time grows with what
// it has before it.
std::vector<Part> unite(std::span<Part> parts, Effort& effort) {
    if (parts.size() <= kFewParts) return clip(parts, ClipperLib::pftNonZero, effort);
    const auto centre = [](const Part& part) {  // twice as far
        return IntPoint(part.box.left + part.box.right, part.box.bottom + part.box.top);
    };
    IntPoint low = centre(parts[0]), high = low;
    for (const Part& part : parts) {
        const IntPoint c = centre(part);
        low = {std::min(low.X, c.X), std::min(low.Y, c.Y)};
        high = {std::max(high.X, c.X), std::max(high.Y, c.Y)};
    }
    const bool along_x = high.X - low.X > high.Y - low.Y;
    const std::size_t half = parts.size() / 2;
    std::nth_element(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(half), parts.end(),
                     [&](const Part& a, const Part& b) {
                         return along_x ? centre(a).X < centre(b).X : centre(a).Y < centre(b).Y;
                     });
    std::array<std::vector<Part>, 2> sides{unite(parts.first(half), effort),
                                           unite(parts.subspan(half), effort)};
    if (sides[0].empty() || sides[1].empty()) return std::move(sides[sides[0].empty() ? 1 : 0]);
    const std::array<IntRect, 2> boxes{box_of(sides[0]), box_of(sides[1])};
    std::vector<Part> result, near;
    for (std::size_t s = 0; s < 2; ++s)
        for (Part& part : sides[s]) (meet(part.box, boxes[1 - s]) ? near : result).push_back(std::move(part));
    for (Part& part : clip(near, ClipperLib::pftNonZero, effort)) result.push_back(std::move(part));
    return result;
}

std::vector<Part> unite(std::span<const Polygon> polygons, const Lattice& lattice) {
    Effort effort;
    std::vector<Part> parts;
    for (const Polygon& polygon : polygons) {
        if (polygon.size() < 3) continue;
        const Part part = make_part({lattice.path(polygon)});
        for (Part& simple : clip({&part, 1}, ClipperLib::pftEvenOdd, effort))
            parts.push_back(std::move(simple));
    }
    return unite(parts, effort);
}

std::vector<Polygon> outlines_of(const std::vector<Part>& parts, const Lattice& lattice) {
    std::vector<Polygon> outlines;
    for (const Part& part : parts)
        for (const ClipperLib::Path& path : part.paths) outlines.push_back(lattice.polygon(path));
    return outlines;
}

// Moves the first point outward, along the first segment; inward, points that it passes go.
void extend_start(Polygon& points, double by) {
    while (points.size() > 1) {
        auto& [x, y] = points[0];
        const double dx = x - points[1][0], dy = y - points[1][1], length = std::hypot(dx, dy);
        if (by + length > 0.0) {
            x += by * dx / length;
            y += by * dy / length;
            return;
        }
        by += length;
        points.erase(points.begin());
    }
    points.clear();
}

// The outline of a path whose bends are mitred on both sides, without loops inside of them. Empty if a bend
// is over 120 degrees, or if the outline crosses where the path begins.
Polygon mitred_outline(const Polygon& line, double half_width) {
    Polygon outline, left;
    double nx = 0.0, ny = 0.0;  // to the left of the segment before
    for (std::size_t k = 0; k < line.size(); ++k) {
        double mx = nx, my = ny, along = 1.0;  // the mitre is m / along
        if (k + 1 < line.size()) {
            const double dx = line[k + 1][0] - line[k][0], dy = line[k + 1][1] - line[k][1],
                         length = std::hypot(dx, dy), lx = -dy / length, ly = dx / length;
            if (k > 0) along += nx * lx + ny * ly;
            mx += lx, my += ly, nx = lx, ny = ly;
        }
        if (along < 0.5) return {};
        const double x = half_width * mx / along, y = half_width * my / along;
        outline.push_back({line[k][0] - x, line[k][1] - y});
        left.push_back({line[k][0] + x, line[k][1] + y});
    }
    outline.insert(outline.end(), left.rbegin(), left.rend());
    const Lattice lattice({&outline, 1});
    const Part part = make_part({lattice.path(outline)});
    Effort effort;
    const std::vector<Part> pieces = clip({&part, 1}, ClipperLib::pftPositive, effort);
    if (pieces.size() != 1 || pieces[0].paths.size() != 1) return {};
    ClipperLib::Path path = pieces[0].paths[0];
    const auto start = std::find(path.begin(), path.end(), part.paths[0].front());
    std::rotate(path.begin(), start, path.end());
    return path.front() == part.paths[0].front() && path.back() == part.paths[0].back()
               ? lattice.polygon(path)
               : Polygon{};
}

// Takes the end off a path that bends within its width of it, and outlines that by itself: Clipper, which
// draws segments, would leave a corner of a long one beyond a short last one.
void take_bent_end(Polygon& line, double half_width, std::vector<Polygon>& polygons) {
    double length = 0.0, enough = 2.0 * half_width;
    for (std::size_t i = line.size() - 1; i-- > 0 && line.size() - i < kChunk;) {
        const auto &a = line[i], &b = line[i + 1];
        const double piece = std::hypot(b[0] - a[0], b[1] - a[1]), share = i > 0 ? 0.5 : 0.0;
        length += piece;
        if (i > 0 && length - share * piece < enough) continue;
        if (i + 2 == line.size()) return;
        Polygon tail(line.begin() + static_cast<std::ptrdiff_t>(i), line.end());
        for (std::size_t x = 0; x < 2; ++x) tail[0][x] += share * (b[x] - a[x]);
        const Polygon outline = mitred_outline(tail, half_width);
        enough = 2.0 * length;
        if (outline.empty()) continue;
        polygons.push_back(outline);
        for (std::size_t x = 0; x < 2; ++x)  // overlaps, so that rounding leaves no gap
            tail[0][x] += kPathOverlap * half_width * (b[x] - a[x]) / piece;
        line.resize(i + 1);
        line.push_back(tail[0]);
        if (i == 0) line.clear();
        return;
    }
}

}  // namespace

std::vector<Polygon> united(std::span<const Polygon> polygons) {
    const Lattice lattice(polygons);
    return outlines_of(unite(polygons, lattice), lattice);
}

std::optional<std::array<double, 2>> self_crossing(const Polygon& polygon) {
    const Lattice lattice({&polygon, 1});
    const Part part = make_part({lattice.path(polygon)});
    const double size = std::max(static_cast<double>(part.box.right - part.box.left),
                                 static_cast<double>(part.box.top - part.box.bottom));
    const double once = std::abs(ClipperLib::Area(part.paths[0]));
    const auto before = [](const IntPoint& a, const IntPoint& b) {
        return a.X != b.X ? a.X < b.X : a.Y < b.Y;
    };
    ClipperLib::Path corners = part.paths[0];
    std::sort(corners.begin(), corners.end(), before);
    Effort effort;
    for (const auto fill : {ClipperLib::pftEvenOdd, ClipperLib::pftNonZero}) {
        double area = 0.0;
        const IntPoint* crossing = &part.paths[0][0];
        const std::vector<Part> pieces = clip({&part, 1}, fill, effort);
        for (const Part& piece : pieces)
            for (const ClipperLib::Path& path : piece.paths) {
                area += ClipperLib::Area(path);
                for (const IntPoint& p : path)
                    if (!std::binary_search(corners.begin(), corners.end(), p, before)) crossing = &p;
            }
        if (std::abs(area - once) > kTouching * size * size) return lattice.polygon({*crossing})[0];
    }
    return std::nullopt;
}

double signed_area(const Polygon& polygon) {
    double twice = 0.0;
    for (std::size_t k = 0, j = polygon.size() - 1; k < polygon.size(); j = k++) {
        const auto &o = polygon[0], &a = polygon[j], &b = polygon[k];  // o is near, for small ones far from 0
        twice += (a[0] - o[0]) * (b[1] - o[1]) - (b[0] - o[0]) * (a[1] - o[1]);
    }
    return 0.5 * twice;
}

double area_of(std::span<const Polygon> outlines) {
    double area = 0.0;
    for (const Polygon& outline : outlines) area += signed_area(outline);
    return area;
}

std::vector<Polygon> path_polygons(const Polygon& points, const PathStyle& style) {
    Polygon line = points;
    line.erase(std::unique(line.begin(), line.end()), line.end());
    std::vector<Polygon> polygons;
    if (line.empty() || !(style.half_width > 0.0)) return polygons;
    if (!style.round) {
        if (line.size() == 1) {
            line = {{line[0][0] - style.begin, line[0][1]}, {line[0][0] + style.end, line[0][1]}};
            if (!(style.begin + style.end > 0.0)) return polygons;
        } else {
            extend_start(line, style.begin);
            std::reverse(line.begin(), line.end());
            extend_start(line, style.end);
            for (int end = 0; end < 2 && !line.empty(); ++end) {
                take_bent_end(line, style.half_width, polygons);
                std::reverse(line.begin(), line.end());
            }
        }
    }
    if (line.empty()) return polygons;
    const Lattice lattice(Lattice::farthest({&line, 1}) + style.half_width);
    ClipperLib::ClipperOffset offset(2.0, kArcTolerance * style.half_width * lattice.scale());
    // Pieces share a segment, so that each bend lies within one.
    for (std::size_t first = 0; first == 0 || first + 2 < line.size(); first += kChunk - 1) {
        const auto begin = line.begin() + static_cast<std::ptrdiff_t>(first);
        const auto count = std::min(kChunk + 1, line.size() - first);
        offset.Clear();
        offset.AddPath(lattice.path({begin, begin + static_cast<std::ptrdiff_t>(count)}),
                       line.size() == 1 ? ClipperLib::jtRound : ClipperLib::jtMiter,
                       style.round ? ClipperLib::etOpenRound : ClipperLib::etOpenButt);
        Paths outlines;
        offset.Execute(outlines, style.half_width * lattice.scale());
        // Holes are joined to the first outline by a slit, which does not count in an even-odd polygon.
        Polygon polygon;
        for (const ClipperLib::Path& outline : outlines) {
            const Polygon corners = lattice.polygon(outline);
            polygon.insert(polygon.end(), corners.begin(), corners.end());
            polygon.push_back(corners[0]);
            if (outlines.size() > 1) polygon.push_back(polygon[0]);
        }
        if (polygon.size() > 1) polygon.pop_back();
        if (!polygon.empty()) polygons.push_back(std::move(polygon));
    }
    return polygons;
}

}  // namespace sidewall::levelset
