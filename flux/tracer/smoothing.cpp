#include "flux/tracer/smoothing.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "surface/error.hpp"

namespace sidewall::flux {
namespace {

// Arrivals (flux times area) on some triangles, and the triangles' area.
struct Arrivals {
    double arrivals = 0.0, area = 0.0;
    void add(const Arrivals& other) {
        arrivals += other.arrivals;
        area += other.area;
    }
    double mean() const { return area > 0.0 ? arrivals / area : 0.0; }
};

// Arrivals around every vertex: on its own triangles and, while their area is below `enough`, on rings of
// neighbours around them.
std::vector<Arrivals> arrivals_around(const TriangleMesh& mesh, const std::vector<Arrivals>& triangle,
                                      double enough) {
    std::vector<Arrivals> around(mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const std::uint32_t v : mesh.triangles[t]) around[v].add(triangle[t]);
    // Most rings: clusters of tiny triangles are one or two wide, but with few rays every area is too small.
    constexpr int kMostRings = 8;
    for (int ring = 0; ring < kMostRings; ++ring) {
        const std::vector<Arrivals> before = around;
        bool grown = false;
        for (const Triangle& t : mesh.triangles)
            for (std::size_t k = 0; k < 3; ++k) {
                const std::uint32_t v = t[k];
                if (before[v].area >= enough) continue;
                around[v].add(before[t[(k + 1) % 3]]);
                around[v].add(before[t[(k + 2) % 3]]);
                grown = true;
            }
        if (!grown) break;
    }
    return around;
}

// A sample point, which represents a piece of a triangle or its image beyond a side.
struct Sample {
    Vec3 point, normal;
    double area;
    std::uint32_t triangle;
    float u, v;  // barycentric weights in the triangle
};

void add_samples(const TriangleMesh& mesh, std::uint32_t t, double longest, std::vector<Sample>& samples) {
    const Vec3 twice = area_vector(mesh, t);
    if (twice.isZero(0.0)) return;
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 &origin = mesh.vertices[a], ab = mesh.vertices[b] - origin, ac = mesh.vertices[c] - origin;
    const double edge = std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()}));
    const int parts = std::max(1, static_cast<int>(std::ceil(edge / longest)));
    const Vec3 normal = twice.normalized();
    const double area = 0.5 * twice.norm() / (parts * parts);
    const auto add = [&](double i, double j) {
        const double u = i / parts, v = j / parts;
        samples.push_back(
            {origin + u * ab + v * ac, normal, area, t, static_cast<float>(u), static_cast<float>(v)});
    };
    for (int i = 0; i < parts; ++i)
        for (int j = 0; i + j < parts; ++j) {
            add(i + 1.0 / 3.0, j + 1.0 / 3.0);
            if (i + j + 1 < parts) add(i + 2.0 / 3.0, j + 2.0 / 3.0);
        }
}

// Adds images of a sector's samples, turned about the axis, within `radius` of the plane y = 0.
void add_turned(const LateralBox& box, double radius, std::vector<Sample>& samples) {
    const double step = 2.0 * std::atan(0.5 * (box.max[1] - box.min[1]) / box.max[0]);
    const auto images = static_cast<int>(std::numbers::pi / step);
    const std::size_t n = samples.size();
    for (int k = -images; k <= images; ++k) {
        if (k == 0) continue;
        const Eigen::Matrix3d rotation = Eigen::AngleAxisd(k * step, Vec3::UnitZ()).toRotationMatrix();
        for (std::size_t s = 0; s < n; ++s) {
            Sample image = samples[s];
            image.point = rotation * image.point;
            if (std::abs(image.point.y()) > radius || image.point.x() < -radius) continue;
            image.normal = rotation * image.normal;
            samples.push_back(image);
        }
    }
}

// Adds mirrored or shifted images of the samples within `radius` of a side. Along a periodic axis shorter
// than `radius`, as in a profile one cell (dx) wide, there are several.
void add_images(const LateralBox& box, double radius, std::vector<Sample>& samples) {
    if (box.axial) add_turned(box, radius, samples);
    for (int axis = 0; axis < 2; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        if (box.boundary[a] == Boundary::open || (box.axial && axis == 1)) continue;
        const bool mirror = box.boundary[a] == Boundary::reflective;
        const double extent = box.max[a] - box.min[a];
        const int images = mirror ? 1 : static_cast<int>(std::ceil(radius / extent));
        for (std::size_t s = 0, n = samples.size(); s < n; ++s)
            for (const bool upper : {false, true}) {
                if (box.axial && !upper) continue;
                for (int k = 1; k <= images; ++k) {
                    const double side = upper ? box.max[a] : box.min[a], way = (k - 1) * extent;
                    if (std::abs(samples[s].point[axis] - side) + way > radius) continue;
                    Sample image = samples[s];
                    image.point[axis] = mirror ? 2.0 * side - image.point[axis]
                                               : image.point[axis] + (upper ? -k * extent : k * extent);
                    if (mirror) image.normal[axis] = -image.normal[axis];
                    samples.push_back(image);
                }
            }
    }
}

// Samples sorted into cubes as wide as the averaging radius, by the cubes' keys; z runs fastest.
class Cubes {
  public:
    Cubes(std::vector<Sample> samples, double width) : width_(width) {
        // Vertices lie up to a cube below all samples and search one cube farther: no index is negative.
        for (const Sample& sample : samples) origin_ = origin_.cwiseMin(sample.point);
        origin_.array() -= 2.0 * width_;
        std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
        for (std::uint32_t s = 0; s < samples.size(); ++s) order.emplace_back(key(cube(samples[s].point)), s);
        std::sort(order.begin(), order.end());
        for (const auto& [key, s] : order) {
            keys_.push_back(key);
            samples_.push_back(samples[s]);
        }
    }

    /// Calls use(sample) for all samples in the 27 cubes around \p point.
    template <class Use>
    void each_near(const Vec3& point, Use&& use) const {
        const auto [x, y, z] = cube(point);
        for (std::int64_t i = x - 1; i <= x + 1; ++i)
            for (std::int64_t j = y - 1; j <= y + 1; ++j) {
                const auto first = std::lower_bound(keys_.begin(), keys_.end(), key({i, j, z - 1}));
                for (auto k = first; k != keys_.end() && *k <= key({i, j, z + 1}); ++k)
                    use(samples_[static_cast<std::size_t>(k - keys_.begin())]);
            }
    }

  private:
    using Cube = std::array<std::int64_t, 3>;
    Cube cube(const Vec3& point) const {
        Cube cube;
        for (int axis = 0; axis < 3; ++axis)
            cube[static_cast<std::size_t>(axis)] =
                static_cast<std::int64_t>(std::floor((point[axis] - origin_[axis]) / width_));
        return cube;
    }
    static std::uint64_t key(const Cube& cube) {  // 21 bits an axis: no mesh is 2 million radii wide
        return static_cast<std::uint64_t>(cube[0]) << 42 | static_cast<std::uint64_t>(cube[1]) << 21 |
               static_cast<std::uint64_t>(cube[2]);
    }

    double width_;
    Vec3 origin_ = Vec3::Constant(kInfinity);
    std::vector<std::uint64_t> keys_;
    std::vector<Sample> samples_;
};

// Positions, normals and materials of wedges, for averaged().
struct Places {
    std::vector<Vec3> point, normal;
    std::vector<std::int32_t> material;
};

Places places_of(const TriangleMesh& mesh, const Wedges& wedges, std::span<const std::int32_t> materials) {
    Places places{std::vector<Vec3>(wedges.count()), wedge_normals(mesh, wedges),
                  wedge_materials(wedges, materials)};
    for (std::size_t c = 0; c < wedges.corner.size(); ++c)
        places.point[wedges.corner[c]] = mesh.vertices[mesh.triangles[c / 3][c % 3]];
    return places;
}

// Weights of the samples around a wedge summed by triangle, with barycentric moments, so that each flux is
// read once for a triangle and not for every sample.
class TriangleShares {
  public:
    struct Share {
        std::uint32_t triangle;
        double weight = 0.0, u = 0.0, v = 0.0;
    };
    explicit TriangleShares(std::size_t triangles) : place_(triangles, kNone) {}
    void clear() {
        for (const Share& share : shares_) place_[share.triangle] = kNone;
        shares_.clear();
    }
    void add(const Sample& sample, double weight) {
        std::uint32_t& place = place_[sample.triangle];
        if (place == kNone) {
            place = static_cast<std::uint32_t>(shares_.size());
            shares_.push_back({sample.triangle});
        }
        Share& share = shares_[place];
        share.weight += weight;
        share.u += weight * static_cast<double>(sample.u);
        share.v += weight * static_cast<double>(sample.v);
    }
    const std::vector<Share>& all() const { return shares_; }
    double total() const {
        double sum = 0.0;
        for (const Share& share : shares_) sum += share.weight;
        return sum;
    }

  private:
    static constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::vector<std::uint32_t> place_;  // by triangle
    std::vector<Share> shares_;         // in the order of the samples
};

}  // namespace

std::vector<double> smoothed_flux(const TriangleMesh& mesh, const Wedges& wedges, const FluxField& wedge_flux,
                                  std::uint64_t arrivals, double resolution) {
    const std::vector<double>& flux = wedge_flux.flux;
    std::vector<Arrivals> triangle(mesh.triangles.size()), own(wedges.count());
    Arrivals total;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::uint32_t* corner = &wedges.corner[3 * t];
        const double area = triangle_area(mesh, t);
        triangle[t] = {area * (flux[corner[0]] + flux[corner[1]] + flux[corner[2]]) / 3.0, area};
        for (int k = 0; k < 3; ++k) own[corner[k]].add(triangle[t]);
        total.add(triangle[t]);
    }
    constexpr double kArrivals = 10.0;
    const double enough = arrivals > 0 ? kArrivals * total.area / static_cast<double>(arrivals) : 0.0;
    const std::vector<Arrivals> around = arrivals_around(mesh, triangle, enough);

    const double tau = resolution * total.mean();
    // Number of arrivals for a unit of flux times area.
    const double density = total.arrivals > 0.0 ? static_cast<double>(arrivals) / total.arrivals : 0.0;
    std::vector<double> smooth(flux);
    tbb::parallel_for(std::size_t{0}, mesh.vertices.size(), [&](std::size_t v) {
        for (std::uint32_t w = wedges.first[v]; w < wedges.first[v + 1]; ++w) {
            const bool small = own[w].area < enough;
            const double mean = small ? around[v].mean() : own[w].mean();
            const double variance = wedge_flux.error[w] * wedge_flux.error[w];
            const bool few = small || density * own[w].arrivals < kArrivals;
            double share = few && variance > 0.0 ? variance / (variance + tau * tau) : 0.0;
            // A wedge without hits has no error estimate: it is in shadow, or was missed by chance. Bayes:
            // prior odds kOdds for chance, times the Poisson probability of no hit at the mean flux.
            constexpr double kOdds = 100.0;
            if (flux[w] == 0.0) {
                const double chance = kOdds * std::exp(-density * mean * own[w].area / 3.0);
                share = chance / (1.0 + chance);
            }
            smooth[w] += share * (mean - flux[w]);
        }
    });
    return smooth;
}

std::vector<FluxField> averaged(const TriangleMesh& mesh, const LateralBox& box, const Wedges& wedges,
                                std::span<const std::int32_t> materials, std::span<const Unaveraged> fluxes,
                                double radius) {
    if (!(radius > 0.0)) throw RecipeError("averaging radius = {}: must be above 0", radius);
    std::vector<Sample> samples;
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) add_samples(mesh, t, 0.5 * radius, samples);
    add_images(box, radius, samples);
    const Cubes cubes(std::move(samples), radius);
    const Places places = places_of(mesh, wedges, materials);

    std::vector<FluxField> result;
    for (const Unaveraged& flux : fluxes)
        result.push_back({flux.flux.get(), std::vector<double>(wedges.count(), 0.0)});
    tbb::enumerable_thread_specific<TriangleShares> buffers(
        [&] { return TriangleShares(mesh.triangles.size()); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, wedges.count(), 64), [&](const auto& range) {
        TriangleShares& shares = buffers.local();
        for (std::size_t w = range.begin(); w != range.end(); ++w) {
            shares.clear();
            const Vec3 point = places.point[w], normal = places.normal[w];
            cubes.each_near(point, [&](const Sample& sample) {
                if ((sample.point - point).squaredNorm() > radius * radius) return;
                const double weight = sample.area * normal.dot(sample.normal);
                if (weight <= 0.0 || (!materials.empty() && materials[sample.triangle] != places.material[w]))
                    return;
                shares.add(sample, weight);
            });
            const double total = shares.total();
            if (!(total > 0.0)) continue;  // none of its triangles has an area
            for (std::size_t k = 0; k < fluxes.size(); ++k) {
                const std::vector<double>&flux = fluxes[k].flux.get(), &error = fluxes[k].error.get();
                double sum = 0.0, variance = 0.0;
                for (const TriangleShares::Share& share : shares.all()) {
                    const std::uint32_t* corner = &wedges.corner[3 * std::size_t{share.triangle}];
                    sum += (share.weight - share.u - share.v) * flux[corner[0]] + share.u * flux[corner[1]] +
                           share.v * flux[corner[2]];
                    variance += std::pow(share.weight / total * error[share.triangle], 2);
                }
                result[k].flux[w] = sum / total;
                result[k].error[w] = std::sqrt(variance);
            }
        }
    });
    return result;
}

}  // namespace sidewall::flux
