#include "app/pictures/section.hpp"

#include <algorithm>
#include <cmath>

namespace sidewall::app {
namespace {

// Half an outline's width, in widths of a sample.
constexpr double kOutline = 1.7;

// Share of a film that an outline may cover: its two leave at least half of it.
constexpr double kOfFilm = 0.25;

/// A layer's boundary as the section shows it: straight within a disc.
struct Front {
    double distance = 0.0;  ///< negative inside
    double slope = 1.0;     ///< change of the distance along the section
    double outline = 0.0;   ///< half the width its line may have
    Colour colour = Colour::Zero();

    /// Share of a disc that lies inside.
    double share(double width) const { return std::clamp(0.5 - distance / (slope * width), 0.0, 1.0); }

    /// Share of a disc that lies within \p half of the boundary.
    double line(double width, double half) const {
        const double at = std::abs(distance) / slope;
        const double covered = std::min(at + 0.5 * width, half) - std::max(at - 0.5 * width, -half);
        return std::clamp(covered / width, 0.0, 1.0);
    }
};

Front front_of(const surface::DistanceSample& sample, int axis, double outline, const Colour& colour) {
    // A front parallel to the section has the slope 0, by which at() would divide.
    constexpr double kLeastSlope = 1e-3;
    const double slope = std::sqrt(std::max(0.0, 1.0 - sample.rise[axis] * sample.rise[axis]));
    return {sample.distance, std::max(slope, kLeastSlope), outline, colour};
}

}  // namespace

SectionReader::SectionReader(const RenderScene& scene) : scene_(scene), last_(scene.layers().size()) {}

// Signed distance to a layer, exact where it is at most `exact`. A signed distance changes by no more than
// the way moved: far from a front, the last one found bounds it and gives its sign.
surface::DistanceSample SectionReader::distance(std::size_t layer, const Vec3& point, double exact) {
    const RenderLayer& of = scene_.layers()[layer];
    std::optional<Last>& last = last_[layer];
    double radius = 1e30;
    if (last) {
        const double way = (point - last->point).norm(), known = std::abs(last->found.distance);
        if (of.body && known - way > exact) {
            surface::DistanceSample bound = last->found;
            bound.distance = std::copysign(known - way, last->found.distance);
            return bound;
        }
        radius = 1.000001 * (known + way);
    }
    last = Last{point, of.distance.at(point, radius)};
    surface::DistanceSample found = last->found;
    const double before = std::abs(found.distance);
    if (before > exact || scene_.thin() == 0.0) return found;
    // A sheet or a gap thinner than thin() counts as none: beyond it the distance has the same sign.
    const Vec3 beyond = point - (found.distance + std::copysign(scene_.thin(), found.distance)) * found.rise;
    const double there = of.distance.at(beyond, 1.000001 * (2.0 * before + scene_.thin())).distance;
    if ((there > 0.0) == (found.distance > 0.0)) found.distance = std::copysign(2.0 * exact, found.distance);
    return found;
}

SectionSample SectionReader::at(const Vec3& point, int axis, double width) {
    const double outline = kOutline * width;
    // Distances up to here are needed: for a share, a line, or the thickness of a film.
    const double exact = 0.5 * width + outline + outline / kOfFilm + scene_.thin();
    const std::size_t top = scene_.layers().size() - 1;
    const surface::DistanceSample surface = distance(top, point, exact);
    SectionSample sample;
    if (surface.distance > 0.5 * width) return sample;
    std::optional<Front> lower;
    for (std::size_t k = 0; k <= top; ++k) {
        const surface::DistanceSample found = k == top ? surface : distance(k, point, exact);
        Front front = front_of(found, axis, outline, scene_.layer_colour(k, found.nearest));
        const double thickness = lower ? lower->distance - front.distance : 0.0;
        if (lower && thickness < scene_.thin()) continue;
        const double share = std::max(front.share(width), sample.solid);
        sample.colour += (share - sample.solid) * front.colour;
        sample.solid = share;
        if (lower && lower->colour != front.colour) {
            front.outline = std::min(outline, kOfFilm * thickness / front.slope);
            sample.line = std::max(sample.line, lower->line(width, std::min(lower->outline, front.outline)));
        }
        lower = front;
    }
    sample.line = std::max(sample.line, lower->line(width, lower->outline));
    if (sample.solid > 0.0) sample.colour /= sample.solid;
    if (surface.distance <= 0.0) sample.way_out = (0.01 * width - surface.distance) * surface.rise;
    return sample;
}

}  // namespace sidewall::app
