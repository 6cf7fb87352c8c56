#include "levelset/shapes/polygon_clipping.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <polyclipping/clipper.hpp>

#include "surface/error.hpp"

namespace sidewall::levelset {
namespace {

using ClipperLib::IntPoint, ClipperLib::IntRect, ClipperLib::Paths;

constexpr int kLatticeBits = 50;        // fewer than a double's 53: Clipper computes crossings in doubles
constexpr std::size_t kFewParts = 16;   // up to so many are united in one call
constexpr std::size_t kChunk = 64;      // points of a path that are outlined together
constexpr double kArcTolerance = 1e-3;  // chord error over a round end's radius
constexpr double kTouching = 1e-9;      // relative to a polygon's size
constexpr double kPathOverlap = 1e-6;   // overlap of a path's pieces over half its width
constexpr double kReversal = 1e-12;     // least 1 + cosine of a bend that does not reverse a path
constexpr std::size_t kMostPairs = 500'000'000, kMostCrossings = 1'000'000;  // of edges: some seconds of work

// The lattice of integers on which Clipper works.
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

// Counts pairs of edges that share heights, and pairs that cross: Clipper's work grows with both numbers.
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
    bool any = false;  // whether any path is more than a line
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

// Unites each half of the parts by itself, then only parts near the other half: Clipper's time grows with the
// number of edges that it is given.
std::vector<Part> unite(std::span<Part> parts, Effort& effort) {
    if (parts.size() <= kFewParts) return clip(parts, ClipperLib::pftNonZero, effort);
    const auto centre = [](const Part& part) {  // times two
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

// Shortens a path by a length at its first point.
void draw_back(Polygon& points, double by) {
    while (by > 0.0 && points.size() > 1) {
        auto& [x, y] = points[0];
        const double dx = points[1][0] - x, dy = points[1][1] - y, length = std::hypot(dx, dy);
        if (by < length) {
            x += by * dx / length;
            y += by * dy / length;
            return;
        }
        by -= length;
        points.erase(points.begin());
    }
    if (points.size() == 1) points.clear();
}

using Eigen::Vector2d;

// Adds corners on a circle, from the end of \p radius on, clockwise by the angle \p turn.
void add_arc(const Vector2d& centre, const Vector2d& radius, double turn, Polygon& outline) {
    const double most = 2.0 * std::acos(1.0 - kArcTolerance);
    const int pieces = static_cast<int>(std::ceil(turn / most));
    for (int k = 0; k < pieces; ++k) {
        const Vector2d p = centre + Eigen::Rotation2Dd(-turn * k / pieces) * radius;
        outline.push_back({p.x(), p.y()});
    }
}

// Adds the corners to the left of a path, as KLayout draws it: where the sides of two segments meet, but on
// the outside of a bend at most half a width ahead of it. On the inside, three points if a segment is short.
void add_left_side(const Polygon& line, const PathStyle& style, Polygon& outline) {
    const double half_width = style.half_width;
    const auto add = [&](const Vector2d& p) { outline.push_back({p.x(), p.y()}); };
    const auto point = [&](std::size_t k) { return Vector2d(line[k][0], line[k][1]); };
    const auto to_left = [&](const Vector2d& way) {
        return Vector2d(-half_width * way.y(), half_width * way.x());
    };
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
        const Vector2d at = point(k + 1), way = (at - point(k)).normalized(), side = to_left(way);
        if (k == 0) add(point(0) + side - style.begin * way);
        if (k + 2 == line.size()) {
            if (style.round)
                add_arc(at, side, std::numbers::pi, outline);
            else
                add(at + side + style.end * way);
            return;
        }
        const Vector2d next = (point(k + 2) - at).normalized(), next_side = to_left(next);
        const double cosine = way.dot(next), sine = way.x() * next.y() - way.y() * next.x();
        const double shorter = std::min((at - point(k)).norm(), (point(k + 2) - at).norm());
        // Distance from the segment's end to where the sides meet.
        const double ahead = 1.0 + cosine > kReversal ? -half_width * sine / (1.0 + cosine) : kInfinity;
        if (ahead < -half_width - shorter) {
            add(at + side);
            add(at);
            add(at + next_side);
        } else if (ahead <= half_width * (1.0 + kTouching)) {
            add(at + side + ahead * way);
        } else {
            add(at + side + half_width * way);
            add(at + next_side - half_width * next);
        }
    }
}

// Cuts a path into pieces of up to kChunk points, in the middle of long segments: Clipper's time grows with
// the square of the number of edges that share heights.
std::vector<Polygon> pieces_of(const Polygon& line, double half_width) {
    std::vector<Polygon> pieces(1);
    for (std::size_t last = 0; last < line.size(); ++last) {
        Polygon& piece = pieces.back();
        piece.push_back(line[last]);
        if (piece.size() < kChunk || last + 1 == line.size()) continue;
        const auto length = [&](std::size_t k) {
            return std::hypot(piece[k + 1][0] - piece[k][0], piece[k + 1][1] - piece[k][1]);
        };
        std::size_t longest = kChunk / 2;
        for (std::size_t k = longest; k + 1 < kChunk; ++k)
            if (length(k) > length(longest)) longest = k;
        const double overlap = std::min(0.1, kPathOverlap * half_width / length(longest));
        std::array<double, 2> end{}, begin{};
        for (std::size_t a = 0; a < 2; ++a) {
            const double by = piece[longest + 1][a] - piece[longest][a];
            end[a] = piece[longest][a] + (0.5 + overlap) * by;
            begin[a] = piece[longest][a] + 0.5 * by;
        }
        Polygon rest(piece.begin() + static_cast<std::ptrdiff_t>(longest), piece.end());
        rest[0] = begin;
        piece.resize(longest + 1);
        piece.push_back(end);
        pieces.push_back(std::move(rest));
    }
    return pieces;
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
        const auto &o = polygon[0], &a = polygon[j], &b = polygon[k];  // about o: precise far from 0, too
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
    if (line.size() == 1) {
        const auto [x, y] = line[0];
        const double left = x - style.begin, right = x + style.end, half = style.half_width;
        if (style.round)
            add_arc({x, y}, {0.0, half}, 2.0 * std::numbers::pi, polygons.emplace_back());
        else if (left < right)
            polygons.push_back({{left, y - half}, {right, y - half}, {right, y + half}, {left, y + half}});
        return polygons;
    }
    const double begin = style.round ? 0.0 : style.begin, end = style.round ? 0.0 : style.end;
    draw_back(line, -begin);
    std::reverse(line.begin(), line.end());
    draw_back(line, -end);
    std::reverse(line.begin(), line.end());
    if (line.empty()) return polygons;
    const std::vector<Polygon> pieces = pieces_of(line, style.half_width);
    for (const Polygon& piece : pieces) {
        Polygon outline;
        PathStyle left = style;
        left.begin = &piece == &pieces.front() ? std::max(0.0, begin) : 0.0;
        left.end = &piece == &pieces.back() ? std::max(0.0, end) : 0.0;
        left.round = style.round && &piece == &pieces.back();
        PathStyle right = left;
        std::swap(right.begin, right.end);
        right.round = style.round && &piece == &pieces.front();
        add_left_side(piece, left, outline);
        add_left_side({piece.rbegin(), piece.rend()}, right, outline);
        const Lattice lattice({&outline, 1});
        const Part whole = make_part({lattice.path(outline)});
        Effort effort;
        // A slit joins each hole to its outline; by the even-odd rule it has no area.
        for (const Part& part : clip({&whole, 1}, ClipperLib::pftNonZero, effort)) {
            Polygon& polygon = polygons.emplace_back();
            for (const ClipperLib::Path& path : part.paths) {
                const Polygon corners = lattice.polygon(path);
                polygon.insert(polygon.end(), corners.begin(), corners.end());
                polygon.push_back(corners[0]);
                if (part.paths.size() > 1) polygon.push_back(polygon[0]);
            }
            polygon.pop_back();
        }
    }
    return polygons;
}

}  // namespace sidewall::levelset
