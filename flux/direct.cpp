#include "flux/direct.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "flux/random.hpp"
#include "flux/sampling.hpp"
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

using Direction = DirectFlux::Direction;

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
    void add(double weight, std::size_t energy, Draw&& draw) {
        constexpr double kGolden = 0.6180339887498949;
        const double around = std::fmod(kGolden * static_cast<double>(++drawn_), 1.0);
        const Vec3 towards = -turned(draw(around), spread_ * (std::fmod(16.0 * around, 1.0) - 0.5));
        if (!(towards.z() > 1e-6)) return;
        for (std::size_t image = 0; image < images_; ++image)
            samples_.push_back(
                {{images_ == 4 && image % 2 == 1 ? -towards.x() : towards.x(),
                  image == images_ - 1 || image == 2 ? -towards.y() : towards.y(), towards.z()},
                 weight,
                 energy});
    }
    std::vector<Direction> of_weight_one() && {
        double sum = 0.0;
        for (const Direction& sample : samples_) sum += sample.weight;
        for (Direction& sample : samples_) sample.weight /= sum;
        return std::move(samples_);
    }

  private:
    double spread_;
    std::size_t images_, drawn_ = 0;
    std::vector<Direction> samples_;
};

// Middle of part i of so many equal ones of 0 to 1.
double part(std::size_t i, std::size_t of) {
    return (static_cast<double>(i) + 0.5) / static_cast<double>(of);
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

// Samples bin by bin, at least four of each, by its weight.
std::vector<Direction> samples_by_bin(const Species& species, const std::vector<SourceBin>& bins,
                                      const Vec3& axis, BeamSamples samples) {
    for (std::size_t i = 0; bins.empty() && i < kDirections; ++i)
        samples.add(1.0, 0, [&](double around) {
            return sample_cosine_power(axis, species.source_exponent, part(i, kDirections), around);
        });
    double before = 0.0;
    for (std::size_t k = 0; k < bins.size(); ++k) {
        const SourceBin& bin = bins[k];
        const std::size_t each = std::max<std::size_t>(4, kDirections / bins.size());
        for (std::size_t i = 0; i < each; ++i)
            samples.add((bin.until - before) / static_cast<double>(each), k, [&](double around) {
                const double angle = bin.angle_from + part(i, each) * (bin.angle_to - bin.angle_from);
                return direction_around(axis, std::cos(angle), std::sin(angle), around);
            });
        before = bin.until;
    }
    return std::move(samples).of_weight_one();
}

// Mean energy factors, by yield, of the particles that come at \p angle: over all bins that contain it.
std::vector<double> energetic_at(const std::vector<SourceBin>& bins,
                                 const std::vector<std::vector<double>>& by_bin, double angle) {
    constexpr double kThinnest = 1e-7;  // radian
    std::vector<double> mean(by_bin[0].size(), 0.0);
    double sum = 0.0, before = 0.0;
    for (std::size_t k = 0; k < bins.size(); ++k) {
        const SourceBin& bin = bins[k];
        const double share = bin.until - std::exchange(before, bin.until);
        if (angle < bin.angle_from - kThinnest || angle > bin.angle_to + kThinnest) continue;
        const double density = share / std::max(kThinnest, bin.angle_to - bin.angle_from);
        sum += density;
        for (std::size_t j = 0; j < mean.size(); ++j) mean[j] += density * by_bin[k][j];
    }
    for (double& factor : mean) factor /= std::max(sum, 1e-300);
    return mean;
}

}  // namespace

bool has_direct_flux(const Species& species) {
    if (only_reemits_diffusely(species) || species.desorbs || std::isfinite(species.mean_free_path) ||
        species.source_beta != 0.0)
        return false;
    if (species.bins.empty()) return species.source_exponent >= kLeastExponent;
    return std::ranges::all_of(species.bins, [](const SourceBin& bin) { return bin.angle_to <= kWidestBin; });
}

DirectFlux::DirectFlux(const Species& species) : yields_(species.yields) {
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
    const std::vector<SourceBin> bins = by_angle(species.bins);
    for (std::size_t k = 0; k < std::max<std::size_t>(1, bins.size()); ++k) {
        energetic_.emplace_back();
        for (const Yield& yield : yields_)
            energetic_[k].push_back(bins.empty() ? mean_energy_factor(yield, species.energy)
                                                 : mean_energy_factor(yield, bins[k]));
    }
    const std::vector<Direction> samples = samples_by_bin(species, bins, -axis, {spread, images_});
    const std::vector<std::vector<double>> by_bin = energetic_;
    // Directions of equal weight, in the order of their angles to the axis.
    const auto directions = [&](std::size_t count, BeamSamples drawn) {
        for (std::size_t i = 0; i < count; ++i)
            drawn.add(1.0, bins.empty() ? 0 : energetic_.size(), [&](double around) {
                if (bins.empty())
                    return sample_cosine_power(-axis, species.source_exponent, part(i, count), around);
                Vec3 d = sample_bins(bins, -axis, part(i, count), around, 0.5).first;
                energetic_.push_back(energetic_at(bins, by_bin, std::acos(std::min(1.0, -d.dot(axis)))));
                return d;
            });
        return std::move(drawn).of_weight_one();
    };
    const bool rotates = beams_ > 1;
    in_space_ = directions(rotates ? kInSpaceRotating : kInSpace, {spread, images_});
    in_profile_ = directions(kInProfile, {spread, images_});
    round_ = directions(rotates ? kRoundRotating : kRound, {spread, 1});

    table_.assign(tallies() * azimuths_ * kAngles, 0.0);
    tbb::parallel_for(std::size_t{0}, azimuths_ * kAngles, [&](std::size_t n) {
        const double polar =
            2.0 * std::asin(static_cast<double>(n % kAngles) / static_cast<double>(kAngles - 1));
        const std::size_t row = n / kAngles;
        const double around =
            azimuths_ > 1 ? kPi * static_cast<double>(row) / static_cast<double>(azimuths_ - 1) : 0.25 * kPi;
        const Vec3 normal = std::cos(polar) * axis +
                            std::sin(polar) * (std::cos(around) * across + std::sin(around) * Vec3::UnitY());
        for (const Direction& sample : samples) {
            const double cosine = std::min(1.0, normal.dot(sample.towards));
            if (!(cosine > 0.0)) continue;
            const double arrivals = sample.weight * cosine / std::max(kMinRise, sample.towards.z());
            for (std::size_t k = 0; k < tallies(); ++k)
                table_[k * azimuths_ * kAngles + n] += arrivals * brings(k, sample, cosine);
        }
    });
    // Scale the table so that a flat wafer gets exactly mean_yield(), by which models scale their rates.
    const double azimuth = azimuths_ > 1 ? std::atan2(0.0, -tilt_sine_) : 0.0;
    for (std::size_t k = 0; k < tallies(); ++k) {
        Yield yield = k > 0 ? yields_[k - 1] : Yield();
        yield.scale = {1.0};
        const double mean = k > 0 ? mean_yield(species, yield) : 1.0, ours = at(k, tilt_cosine_, azimuth);
        if (!(ours > 0.0)) continue;
        for (std::size_t n = 0; n < azimuths_ * kAngles; ++n)
            table_[k * azimuths_ * kAngles + n] *= mean / ours;
    }
}

double DirectFlux::brings(std::size_t tally, const Direction& direction, double cosine) const {
    if (tally == 0) return 1.0;
    return energetic_[direction.energy][tally - 1] * angular_factor(yields_[tally - 1], cosine);
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
                      groups = all.size() / each;
    if (groups == 0) return {};  // no direction points down
    // Order by bisection, so that the first few directions span the beam: both ends of the list (narrowest
    // and widest direction of a cos^n source), then midpoints.
    std::vector<std::size_t> order{groups - 1, 0};
    for (std::size_t step = std::bit_ceil(groups) / 2; step > 0; step /= 2)
        for (std::size_t k = step; k + 1 < groups; k += 2 * step) order.push_back(k);
    // What a place in a profile sees is an interval of slopes in x: its ends are those of the list.
    std::vector<std::size_t> sorted(groups);
    std::iota(sorted.begin(), sorted.end(), std::size_t{0});
    if (alike == 2)
        std::ranges::stable_sort(sorted, {}, [&](std::size_t n) {
            const Vec3 d = turned(all[n * each].towards, turn);
            return (images_ == 4 ? std::abs(d.x()) : d.x()) / d.z();
        });
    // If there are four images, take a pair (x, -x) of each group, at y and -y in turn, then the other pairs.
    const std::size_t pair = std::min<std::size_t>(images, 2);
    std::vector<Direction> directions;
    for (std::size_t first = 0; first < images; first += pair)
        for (std::size_t m = 0; m < order.size(); ++m)
            for (std::size_t k = 0; k < pair; ++k) {
                const std::size_t image = (first + (m % 2) * pair) % images + k;
                directions.push_back(all[sorted[order[m]] * each + image]);
                directions.back().towards = turned(directions.back().towards, turn);
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
        const std::span<const double> shares = open.subspan(b * tallies(), tallies());
        if (!(shares[0] > 0.0)) continue;
        double cosine = normal.z(), azimuth = 0.0;
        if (azimuths_ > 1) {
            const Vec3 n = turned(normal, -azimuth_of(b));
            cosine = tilt_sine_ * n.x() + tilt_cosine_ * n.z();
            azimuth = std::atan2(std::abs(n.y()), tilt_cosine_ * n.x() - tilt_sine_ * n.z());
        }
        for (std::size_t k = 0; k < tallies(); ++k) {
            double scale = 1.0;
            if (k > 0) scale = yields_[k - 1].scale[yields_[k - 1].scale.size() == 1 ? 0 : material];
            flux[k] += shares[k] / static_cast<double>(beams_) * scale * at(k, cosine, azimuth);
        }
    }
}

}  // namespace sidewall::flux
