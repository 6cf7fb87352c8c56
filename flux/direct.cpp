#include "flux/direct.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include "flux/random.hpp"
#include "flux/sampling.hpp"
#include "flux/tracer/flight.hpp"
#include "flux/yield.hpp"

namespace sidewall::flux {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLeastExponent = 10.0, kWidestBin = 45.0 * kPi / 180.0;
constexpr std::size_t kAngles = 181;      // table entries at equal steps of sin(polar angle / 2)
constexpr std::size_t kAzimuths = 13;     // table entries from 0 to pi, for tilted beams
constexpr std::size_t kBeams = 16;        // for a tilted source over a rotating wafer
constexpr std::size_t kDirections = 256;  // samples of a beam for the table
// Samples of a beam for open shares, of equal weight, powers of two. A profile has few wedges and takes more
// than a surface in space. A surface of revolution takes most: its shares come from few points, and on its
// axis all directions of one polar angle give the same answer.
constexpr std::size_t kInProfile = 256, kInSpace = 32, kInSpaceRotating = 256, kRound = 1024,
                      kRoundRotating = 256;
// Lower bound of -d . z in the weight 1 / (-d . z), which diverges at grazing directions.
constexpr double kMinRise = 1e-2;

// A direction towards the source, with the mean energy factor of each yield.
struct SourceSample {
    Vec3 towards;
    double weight;
    std::vector<double> energetic;
};

// Turns a vector about the vertical.
Vec3 turned(const Vec3& v, double angle) {
    const double c = std::cos(angle), s = std::sin(angle);
    return {c * v.x() - s * v.y(), s * v.x() + c * v.y(), v.z()};
}

// Sample directions of one beam whose axis has azimuth 0, without upward flights. Each is followed by its
// mirror images, so that symmetric surfaces get symmetric fluxes.
class BeamSamples {
  public:
    // \param spread  range of azimuths (radian) that the beam represents.
    BeamSamples(double spread, std::size_t images) : spread_(spread), images_(images) {}

    // \param draw  gives the direction for an azimuth about the axis, as a number from 0 to 1.
    template <class Draw>
    void add(double weight, const std::vector<double>& energetic, Draw&& draw) {
        constexpr double kGolden = 0.6180339887498949;
        const double around = std::fmod(kGolden * static_cast<double>(++drawn_), 1.0);
        const Vec3 towards = -turned(draw(around), spread_ * (std::fmod(16.0 * around, 1.0) - 0.5));
        if (!(towards.z() > 1e-6)) return;
        for (std::size_t image = 0; image < images_; ++image)
            samples_.push_back(
                {{images_ == 4 && image % 2 == 1 ? -towards.x() : towards.x(),
                  image == images_ - 1 || image == 2 ? -towards.y() : towards.y(), towards.z()},
                 weight,
                 energetic});
    }
    std::vector<SourceSample> of_weight_one() && {
        double sum = 0.0;
        for (const SourceSample& sample : samples_) sum += sample.weight;
        for (SourceSample& sample : samples_) sample.weight /= sum;
        return std::move(samples_);
    }

  private:
    double spread_;
    std::size_t images_, drawn_ = 0;
    std::vector<SourceSample> samples_;
};

// Middle of part i of so many equal ones of 0 to 1.
double part(std::size_t i, std::size_t of) {
    return (static_cast<double>(i) + 0.5) / static_cast<double>(of);
}

// Samples with the energy factors of the yields, bin by bin; at least four a bin, by its weight.
std::vector<SourceSample> samples_by_bin(const Species& species, const Vec3& axis, BeamSamples samples) {
    if (species.bins.empty()) {
        std::vector<double> energetic;
        for (const Yield& yield : species.yields)
            energetic.push_back(mean_energy_factor(yield, species.energy));
        for (std::size_t i = 0; i < kDirections; ++i)
            samples.add(1.0, energetic, [&](double around) {
                return sample_cosine_power(axis, species.source_exponent, part(i, kDirections), around);
            });
    }
    double before = 0.0;
    for (const SourceBin& bin : species.bins) {
        const std::size_t each = std::max<std::size_t>(4, kDirections / species.bins.size());
        std::vector<double> energetic;
        for (const Yield& yield : species.yields) energetic.push_back(mean_energy_factor(yield, bin));
        for (std::size_t i = 0; i < each; ++i)
            samples.add((bin.until - before) / static_cast<double>(each), energetic, [&](double around) {
                const double angle = bin.angle_from + part(i, each) * (bin.angle_to - bin.angle_from);
                return direction_around(axis, std::cos(angle), std::sin(angle), around);
            });
        before = bin.until;
    }
    return std::move(samples).of_weight_one();
}

// The bins sorted by angle, for samples that are stratified over it.
std::vector<SourceBin> by_angle(std::vector<SourceBin> bins) {
    for (std::size_t k = bins.size(); k-- > 1;) bins[k].until -= bins[k - 1].until;
    std::ranges::stable_sort(bins, {}, [](const SourceBin& bin) { return bin.angle_from + bin.angle_to; });
    double sum = 0.0;
    for (SourceBin& bin : bins) bin.until = sum += bin.until;
    if (!bins.empty()) bins.back().until = 1.0;
    return bins;
}

// Directions of equal weight, in the order of their angles to the axis.
std::vector<DirectFlux::Direction> directions(const Species& species, const Vec3& axis, BeamSamples samples,
                                              std::size_t count) {
    const std::vector<SourceBin> bins = by_angle(species.bins);
    for (std::size_t i = 0; i < count; ++i)
        samples.add(1.0, {}, [&](double around) {
            return bins.empty() ? sample_cosine_power(axis, species.source_exponent, part(i, count), around)
                                : sample_bins(bins, axis, part(i, count), around, 0.5).first;
        });
    std::vector<DirectFlux::Direction> result;
    for (const SourceSample& sample : std::move(samples).of_weight_one())
        result.push_back({sample.towards, sample.weight});
    return result;
}

// A point a skin off the surface from which rays test the visibility of the source, with its triangle's
// normal and the area that it represents.
struct VisibilityProbe {
    Vec3 point = Vec3::Zero(), normal = Vec3::Zero();
    double area = 0.0;
};

// The lookout near corner \p k of triangle \p t, moved from it towards the centroid by the share \p inside.
VisibilityProbe probe_at(const TriangleMesh& mesh, const LateralBox& box, double skin, std::size_t t,
                         std::size_t k, double inside) {
    const Vec3 twice = area_vector(mesh, t), normal = twice.normalized();
    VisibilityProbe out{(1.0 - inside) * mesh.vertices[mesh.triangles[t][k]] +
                            inside * triangle_centroid(mesh, t) + skin * normal,
                        normal, 0.5 * twice.norm()};
    for (std::size_t axis = 0; axis < 2; ++axis)
        if (box.boundary[axis] != Boundary::open) {
            double& x = out.point[static_cast<Eigen::Index>(axis)];
            x = std::clamp(x, box.min[axis], box.max[axis]);
        }
    if (box.axial) out.point.y() = 0.0;
    return out;
}

// Adds the lookout of the wedge at corner \p c, at the centroid of the wedge's hat function: 3/4 of the
// distance to the triangle's centroid, or, on a surface of revolution, 1/3 of the segment's length.
void add_probe(const TriangleMesh& mesh, const Wedges& wedges, const LateralBox& box, double skin,
               std::size_t c, std::vector<VisibilityProbe>& own) {
    constexpr double kMiddle = 0.75, kThird = 0.5;
    const std::size_t t = c / 3, k = c % 3;
    if (!box.axial) {
        own.push_back(probe_at(mesh, box, skin, t, k, kMiddle));
        return;
    }
    // A segment has two triangles: take the one whose other two corners lie on the other ring.
    const std::uint32_t* const ring = &wedges.corner[3 * t];
    if (ring[(k + 1) % 3] == ring[k] || ring[(k + 2) % 3] == ring[k]) return;
    own.push_back(probe_at(mesh, box, skin, t, k, kThird));
    const Vec3& end = mesh.vertices[mesh.triangles[t][k]];
    own.back().area =
        own.back().point.x() * std::hypot(own.back().point.x() - end.x(), own.back().point.z() - end.z());
}

// One lookout for every wedge: near the vertex, in the largest triangle of its fan.
std::vector<std::vector<VisibilityProbe>> probes_near(const TriangleMesh& mesh, const Wedges& wedges,
                                                      const LateralBox& box, double skin) {
    constexpr double kNearVertex = 0.2;
    std::vector<std::vector<VisibilityProbe>> places(wedges.count());
    for (std::size_t c = 0; c < wedges.corner.size(); ++c) {
        std::vector<VisibilityProbe>& own = places[wedges.corner[c]];
        if (own.empty() || triangle_area(mesh, c / 3) > own[0].area)
            own = {probe_at(mesh, box, skin, c / 3, c % 3, kNearVertex)};
    }
    return places;
}

// Flags the wedges in the penumbra: at a corner of a triangle whose corners' shares differ.
std::vector<std::uint8_t> in_half_shadow(const Wedges& wedges, std::span<const double> open) {
    constexpr double kDiffers = 0.01;
    std::vector<std::uint8_t> half(wedges.count(), 0);
    for (std::size_t t = 0; 3 * t < wedges.corner.size(); ++t) {
        const std::uint32_t* const corner = &wedges.corner[3 * t];
        const auto [least, most] = std::minmax({open[corner[0]], open[corner[1]], open[corner[2]]});
        for (std::size_t k = 0; most - least > kDiffers && k < 3; ++k) half[corner[k]] = 1;
    }
    return half;
}

}  // namespace

bool has_direct_flux(const Species& species) {
    if (only_reemits_diffusely(species) || species.desorbs || std::isfinite(species.mean_free_path) ||
        species.source_beta != 0.0)
        return false;
    if (species.bins.empty()) return species.source_exponent >= kLeastExponent;
    return std::ranges::all_of(species.bins, [](const SourceBin& bin) { return bin.angle_to <= kWidestBin; });
}

DirectFlux::DirectFlux(const Species& species) {
    const Vec3 source = -species.beam;
    tilt_sine_ = std::hypot(source.x(), source.y());
    tilt_cosine_ = source.z();
    const bool tilted = tilt_sine_ > 1e-9;
    if (!tilted) tilt_sine_ = 0.0, tilt_cosine_ = 1.0;
    azimuth_ = tilted && !species.rotating ? std::atan2(source.y(), source.x()) : 0.0;
    beams_ = tilted && species.rotating ? kBeams : 1;
    azimuths_ = tilted ? kAzimuths : 1;
    const Vec3 axis(tilt_sine_, 0.0, tilt_cosine_), across(tilt_cosine_, 0.0, -tilt_sine_);
    const double spread = beams_ > 1 ? 2.0 * kPi / static_cast<double>(beams_) : 0.0;
    images_ = tilted ? 2 : 4;
    const std::vector<SourceSample> samples = samples_by_bin(species, -axis, {spread, images_});
    const bool rotates = beams_ > 1;
    in_space_ = directions(species, -axis, {spread, images_}, rotates ? kInSpaceRotating : kInSpace);
    in_profile_ = directions(species, -axis, {spread, images_}, kInProfile);
    round_ = directions(species, -axis, {spread, 1}, rotates ? kRoundRotating : kRound);

    scale_.push_back({1.0});
    for (const Yield& yield : species.yields) scale_.push_back(yield.scale);
    table_.assign(tallies() * azimuths_ * kAngles, 0.0);
    tbb::parallel_for(std::size_t{0}, azimuths_ * kAngles, [&](std::size_t n) {
        const double polar =
            2.0 * std::asin(static_cast<double>(n % kAngles) / static_cast<double>(kAngles - 1));
        const std::size_t row = n / kAngles;
        const double around =
            azimuths_ > 1 ? kPi * static_cast<double>(row) / static_cast<double>(azimuths_ - 1) : 0.25 * kPi;
        const Vec3 normal = std::cos(polar) * axis +
                            std::sin(polar) * (std::cos(around) * across + std::sin(around) * Vec3::UnitY());
        for (const SourceSample& sample : samples) {
            const double cosine = std::min(1.0, normal.dot(sample.towards));
            if (!(cosine > 0.0)) continue;
            const double arrivals = sample.weight * cosine / std::max(kMinRise, sample.towards.z());
            table_[n] += arrivals;
            for (std::size_t k = 1; k < tallies(); ++k)
                table_[k * azimuths_ * kAngles + n] +=
                    arrivals * sample.energetic[k - 1] * angular_factor(species.yields[k - 1], cosine);
        }
    });
    // Scale the table so that a flat wafer gets exactly mean_yield(), by which models scale their rates.
    const double azimuth = azimuths_ > 1 ? std::atan2(0.0, -tilt_sine_) : 0.0;
    for (std::size_t k = 0; k < tallies(); ++k) {
        Yield yield = k > 0 ? species.yields[k - 1] : Yield();
        yield.scale = {1.0};
        const double mean = k > 0 ? mean_yield(species, yield) : 1.0, ours = at(k, tilt_cosine_, azimuth);
        if (!(ours > 0.0)) continue;
        for (std::size_t n = 0; n < azimuths_ * kAngles; ++n)
            table_[k * azimuths_ * kAngles + n] *= mean / ours;
    }
}

double DirectFlux::azimuth_of(std::size_t beam) const {
    return azimuth_ + 2.0 * kPi * static_cast<double>(beam) / static_cast<double>(beams_);
}

std::vector<DirectFlux::Direction> DirectFlux::towards(std::size_t beam, std::size_t alike) const {
    const double turn = azimuth_of(beam);
    const bool round = alike > 2;
    // All samples of a set: every other one would have azimuths that follow from the polar angles.
    const std::vector<Direction>& all = round ? round_ : alike == 2 ? in_profile_ : in_space_;
    const std::size_t each = round ? 1 : images_, images = std::max<std::size_t>(1, each / alike),
                      groups = all.size() / each, count = std::bit_ceil(groups);
    // Order by bisection, so that the first few directions span the beam: both ends of the list (narrowest
    // and widest direction of a cos^n source), then midpoints.
    std::vector<std::size_t> order{count - 1, 0};
    for (std::size_t step = count / 2; step > 0; step /= 2)
        for (std::size_t k = step; k + 1 < count; k += 2 * step) order.push_back(k);
    // If there are four images, take a pair (x, -x) of each group, at y and -y in turn, then the other pairs.
    const std::size_t pair = std::min<std::size_t>(images, 2);
    std::vector<Direction> directions;
    for (std::size_t first = 0; first < images; first += pair)
        for (std::size_t m = 0; m < order.size(); ++m)
            if (const std::size_t n = order[m]; n < groups)
                for (std::size_t k = 0; k < pair; ++k) {
                    const std::size_t image = (first + (m % 2) * pair) % images + k;
                    const Direction& sample = all[n * each + image];
                    directions.push_back({turned(sample.towards, turn), sample.weight});
                }
    return directions;
}

double DirectFlux::at(std::size_t tally, double cosine, double azimuth) const {
    const auto part_of = [](double x, std::size_t values, std::size_t& i) {
        const double at = std::clamp(x, 0.0, 1.0) * static_cast<double>(values - 1);
        i = std::min(static_cast<std::size_t>(at), values - 2);
        return at - static_cast<double>(i);
    };
    std::size_t i = 0, j = 0;
    // The index sin(polar angle / 2) = sqrt((1 - cosine) / 2) needs no arc cosine.
    const double u = part_of(std::sqrt(std::max(0.0, 0.5 - 0.5 * cosine)), kAngles, i);
    const double* row = &table_[tally * azimuths_ * kAngles + i];
    if (azimuths_ == 1) return row[0] + u * (row[1] - row[0]);
    const double v = part_of(azimuth / kPi, azimuths_, j);
    const double *low = row + j * kAngles, *high = low + kAngles;
    return (1.0 - v) * (low[0] + u * (low[1] - low[0])) + v * (high[0] + u * (high[1] - high[0]));
}

void DirectFlux::add(const Vec3& normal, std::size_t material, std::span<const double> open,
                     std::span<double> flux) const {
    for (std::size_t b = 0; b < beams_; ++b) {
        if (!(open[b] > 0.0)) continue;
        double cosine = normal.z(), azimuth = 0.0;
        if (azimuths_ > 1) {
            const Vec3 n = turned(normal, -azimuth_of(b));
            cosine = tilt_sine_ * n.x() + tilt_cosine_ * n.z();
            azimuth = std::atan2(std::abs(n.y()), tilt_cosine_ * n.x() - tilt_sine_ * n.z());
        }
        const double weight = open[b] / static_cast<double>(beams_);
        for (std::size_t k = 0; k < tallies(); ++k)
            flux[k] += weight * scale_[k][scale_[k].size() == 1 ? 0 : material] * at(k, cosine, azimuth);
    }
}

std::vector<std::vector<double>> open_shares(const DirectFlux& direct, const TriangleMesh& mesh,
                                             const surface::RayScene& scene, const LateralBox& box,
                                             const Wedges& wedges, bool coarse) {
    const Geometry geometry = make_geometry(mesh, scene, box);
    const double skin = 2.0 * kOverlap * geometry.skin;
    // A single point misses how the share varies within a triangle: on the floor of a round contact whose
    // penumbra is one cell (dx) wide, it loses 1 % of the source.
    const bool all = coarse || box.axial;
    const auto in_fans = [&](std::span<const std::uint8_t> chosen) {
        std::vector<std::vector<VisibilityProbe>> places(wedges.count());
        for (std::size_t c = 0; c < wedges.corner.size(); ++c)
            if (const std::uint32_t w = wedges.corner[c]; chosen.empty() || chosen[w] != 0)
                add_probe(mesh, wedges, box, skin, c, places[w]);
        return places;
    };
    const std::vector<std::vector<VisibilityProbe>> from =
        all ? in_fans({}) : probes_near(mesh, wedges, box, skin);
    std::vector<std::vector<double>> open(direct.beams(), std::vector<double>(wedges.count(), 0.0));
    for (std::size_t b = 0; b < direct.beams(); ++b) {
        std::vector<DirectFlux::Direction> towards = direct.towards(b, box.axial           ? 4
                                                                       : geometry.straight ? 2
                                                                                           : 1);
        for (DirectFlux::Direction& d : towards)
            if (geometry.straight) d.towards.y() = 0.0;
        // The visible share of the beam at a lookout.
        const auto share_at = [&](const VisibilityProbe& out) {
            std::array<Vec3, surface::RayPacket::kRays> paths;
            std::array<double, surface::RayPacket::kRays> weights;
            constexpr std::size_t kEnough = 16;
            double all = 0.0, arrives = 0.0;
            for (std::size_t next = 0; next < towards.size();) {
                std::size_t count = 0;
                for (; next < towards.size() && count < paths.size(); ++next) {
                    const Vec3& d = towards[next].towards;
                    weights[count] = towards[next].weight * d.dot(out.normal) / std::max(kMinRise, d.z());
                    if (weights[count] > 0.0) paths[count++] = d;
                }
                const std::uint32_t seen = sees_source(geometry, out.point, std::span(paths).first(count));
                for (std::size_t k = 0; k < count; ++k) {
                    all += weights[k];
                    if ((seen >> k & 1u) != 0) arrives += weights[k];
                }
                // Most lookouts see the whole beam or none of it; 16 directions spread over it settle that.
                if (next >= kEnough && (arrives == 0.0 || arrives == all)) break;
            }
            return all > 0.0 ? arrives / all : 0.0;
        };
        const auto look = [&](const std::vector<std::vector<VisibilityProbe>>& places) {
            tbb::parallel_for(tbb::blocked_range<std::size_t>(0, wedges.count(), 64), [&](const auto& range) {
                for (std::size_t w = range.begin(); w != range.end(); ++w) {
                    double sum = 0.0, area = 0.0;
                    for (const VisibilityProbe& out : places[w]) {
                        sum += out.area * share_at(out);
                        area += out.area;
                    }
                    if (area > 0.0) open[b][w] = sum / area;
                }
            });
        };
        look(from);
        if (!all && !geometry.straight) look(in_fans(in_half_shadow(wedges, open[b])));
    }
    return open;
}

}  // namespace sidewall::flux
