#include "flux/tracer/cut_corners.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "surface/topology.hpp"

namespace sidewall::flux {
namespace {

// Faces tilted by less than this against the facet (5 degrees) are as good as the facet itself.
constexpr double kLeastTilt = 0.0872;
// In grid spacings: the widest facet that a grid cuts a corner off by is sqrt(2), and a chamfer of two is
// one.
constexpr double kWidth = 1.5;
// In grid spacings: advection rounds corners over so far, and a surface that curves by a larger radius is
// none.
constexpr double kReach = 5.0, kRadius = 5.0;

// The edge in which the faces' planes meet lies at most so many grid spacings below the facet. Rounded over
// farther, as the holes of a few cells are, the corner takes the facets' own yields, which are what sharpens
// it.
constexpr double kDepth = 2.0;

// A face beside a facet, and the vertex where it was met.
struct Face {
    std::uint32_t triangle, met;
};

// A thread's own.
struct Buffers {
    std::vector<std::uint32_t> met_by;      // by triangle: the last that met it
    std::vector<std::uint32_t> reached_by;  // by vertex
    std::vector<std::uint32_t> next;
    std::vector<Face> faces;
};

// Least squares of n = share[0] normal[0] + share[1] normal[1]; none if it lies not between the two.
std::optional<std::array<double, 2>> shares_of(const Vec3& n, const std::array<Vec3, 2>& normal) {
    const double c = normal[0].dot(normal[1]), a = n.dot(normal[0]), b = n.dot(normal[1]);
    const double squared_sine = 1.0 - c * c;
    if (!(squared_sine > kLeastTilt * kLeastTilt)) return {};
    const std::array<double, 2> share{(a - c * b) / squared_sine, (b - c * a) / squared_sine};
    if (!(share[0] > 0.0 && share[1] > 0.0)) return {};
    return share;
}

// Goes from a triangle over the surface as long as it bends as in a corner, within a reach: from vertex to
// vertex, and on only from triangles that are tilted against the one before. Where it ends are the faces
// beside a corner that is rounded over.
class Bend {
  public:
    Bend(const TriangleMesh& mesh, std::span<const Vec3> normals, double spacing)
        : mesh_(mesh),
          normals_(normals),
          corners_(surface::vertex_corners(mesh)),
          reach_(kReach * spacing),
          radius_(kRadius * spacing) {
        centroids_.resize(mesh.triangles.size());
        tbb::parallel_for(std::size_t{0}, centroids_.size(),
                          [&](std::size_t t) { centroids_[t] = triangle_centroid(mesh, t); });
    }
    const Vec3& centroid(std::uint32_t t) const { return centroids_[t]; }
    double radius() const { return radius_; }

    /// Calls use(other, v) once for every triangle met, at vertex v.
    template <class Use>
    void each(std::uint32_t t, Buffers& buffers, const Use& use) const {
        auto& [met_by, reached_by, next, faces] = buffers;
        met_by.resize(mesh_.triangles.size(), kNone);
        reached_by.resize(mesh_.vertices.size(), kNone);
        met_by[t] = t;
        next.assign(1, t);
        for (std::size_t k = 0; k < next.size(); ++k)
            for (const std::uint32_t v : mesh_.triangles[next[k]]) {
                if (reached_by[v] == t) continue;  // all around it are met
                if (k > 0 && (mesh_.vertices[v] - centroids_[t]).squaredNorm() > reach_ * reach_) continue;
                reached_by[v] = t;
                for (const std::uint32_t corner : corners_[v]) {
                    const std::uint32_t other = corner / 3;
                    if (met_by[other] == t) continue;
                    met_by[other] = t;
                    use(other, v);
                    if (bends(next[k], other)) next.push_back(other);
                }
            }
    }

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};

    // For the small angles that matter the chord of the normals is the turn.
    bool bends(std::uint32_t from, std::uint32_t to) const {
        constexpr double kMargin = 0.7;  // facets are no even steps along the bend
        const double turn2 = (normals_[from] - normals_[to]).squaredNorm();
        return turn2 > kLeastTilt * kLeastTilt &&
               turn2 * radius_ * radius_ >
                   kMargin * kMargin * (centroids_[from] - centroids_[to]).squaredNorm();
    }

    const TriangleMesh& mesh_;
    std::span<const Vec3> normals_;
    surface::Rows corners_;
    std::vector<Vec3> centroids_;
    double reach_, radius_;
};

double extent(const TriangleMesh& mesh, const Triangle& triangle, const Vec3& direction) {
    double from = direction.dot(mesh.vertices[triangle[0]]), to = from;
    for (const std::uint32_t v : triangle) {
        from = std::min(from, direction.dot(mesh.vertices[v]));
        to = std::max(to, direction.dot(mesh.vertices[v]));
    }
    return to - from;
}

// Whether a triangle is wider than a cut corner may be whatever way the corner's edge runs.
bool too_wide(const TriangleMesh& mesh, const Triangle& triangle, double most) {
    const Vec3 &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]],
               &c = mesh.vertices[triangle[2]];
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    return (b - a).cross(c - a).squaredNorm() > most * most * longest;  // its least height
}

// The faces that rise above the plane of triangle t: the steepest, and the one that leans most towards it.
std::optional<CutCorner> corner_of(const TriangleMesh& mesh, std::span<const Vec3> normals, std::uint32_t t,
                                   double spacing, const Bend& bend, Buffers& buffers) {
    std::vector<Face>& faces = buffers.faces;
    faces.clear();
    const Vec3 &n = normals[t], &centre = bend.centroid(t);
    double steepest = 1.0 - kLeastTilt * kLeastTilt;  // squared cosine to the facet
    Face first{};
    bend.each(t, buffers, [&](std::uint32_t other, std::uint32_t v) {
        if (!(n.dot(bend.centroid(other) - centre) > 0.0)) return;
        const double cosine = n.dot(normals[other]);
        if (!(cosine * cosine < 1.0 - kLeastTilt * kLeastTilt)) return;
        faces.push_back({other, v});
        if (!(cosine * cosine < steepest)) return;
        steepest = cosine * cosine;
        first = faces.back();
    });
    if (faces.size() < 2) return {};
    // What of a normal lies in the facet's plane.
    const auto tilt_of = [&](const Face& face) -> Vec3 {
        return normals[face.triangle] - n.dot(normals[face.triangle]) * n;
    };
    const Vec3 tilt = tilt_of(first);
    const Face second =
        *std::ranges::min_element(faces, {}, [&](const Face& f) { return normals[f.triangle].dot(tilt); });
    const Vec3 other_tilt = tilt_of(second);
    if (!(other_tilt.dot(tilt) < 0.0)) return {};
    if (extent(mesh, mesh.triangles[t], (tilt - other_tilt).normalized()) > kWidth * spacing) return {};
    const std::array<Vec3, 2> normal{normals[first.triangle], normals[second.triangle]},
        met{mesh.vertices[first.met], mesh.vertices[second.met]};
    const double turn = std::acos(std::clamp(normal[0].dot(normal[1]), -1.0, 1.0));
    // The faces' middles lie half a cell at least beyond where they were met.
    if (turn * bend.radius() < (met[0] - met[1]).norm() + spacing) return {};
    const std::optional<std::array<double, 2>> share = shares_of(n, normal);
    if (!share) return {};
    const double depth =
        -(*share)[0] * normal[0].dot(met[0] - centre) - (*share)[1] * normal[1].dot(met[1] - centre);
    if (depth > kDepth * spacing) return {};
    return CutCorner{normal, *share};
}

}  // namespace

CutCorner facing(const CutCorner& corner, const Vec3& n, const Vec3& towards) {
    // Along the corner's edge a face can have no slope.
    const Vec3 edge = corner.normal[0].cross(corner.normal[1]).normalized();
    const Vec3 across = towards - edge.dot(towards) * edge;
    if (!shares_of(across, corner.normal)) return corner;
    for (std::size_t k = 0; k < 2; ++k) {
        std::array<Vec3, 2> normal = corner.normal;
        normal[k] = across.normalized();
        if (const auto share = shares_of(n, normal)) return {normal, *share};
    }
    return corner;
}

CutCorners find_cut_corners(const TriangleMesh& mesh, double spacing) {
    if (!(spacing > 0.0)) return {};
    const std::vector<Vec3> normals = triangle_normals(mesh);
    const Bend bend(mesh, normals, spacing);
    std::vector<std::optional<CutCorner>> found(mesh.triangles.size());
    tbb::enumerable_thread_specific<Buffers> buffers;
    tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(found.size()), [&](std::uint32_t t) {
        if (!normals[t].isZero(0.0) && !too_wide(mesh, mesh.triangles[t], kWidth * spacing))
            found[t] = corner_of(mesh, normals, t, spacing, bend, buffers.local());
    });
    CutCorners cut;
    cut.of.assign(found.size(), -1);
    for (std::size_t t = 0; t < found.size(); ++t) {
        if (!found[t]) continue;
        cut.of[t] = static_cast<std::int32_t>(cut.corners.size());
        cut.corners.push_back(*found[t]);
    }
    return cut;
}

}  // namespace sidewall::flux
