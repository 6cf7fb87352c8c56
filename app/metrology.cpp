#include "app/metrology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "surface/cut.hpp"

namespace sidewall::app {
namespace {

struct Profile {
    std::vector<surface::Polyline> lines;
    Vec3 along;  // horizontal axis in the plane

    template <class Use>
    void each_segment(Use&& use) const {
        for (const auto& line : lines) {
            const std::size_t n = line.points.size();
            for (std::size_t k = 0; k + 1 < n + (line.closed ? 1 : 0); ++k)
                use(line.points[k], line.points[(k + 1) % n]);
        }
    }
};

// The widest opening in the cut at a height: gas and material take turns along the line.
double opening(const Profile& profile, double z) {
    std::vector<double> crossings;
    double left = std::numeric_limits<double>::infinity(), left_z = 0.0;
    profile.each_segment([&](const Vec3& p, const Vec3& q) {
        for (const Vec3* end : {&p, &q})
            if (end->dot(profile.along) < left) {
                left = end->dot(profile.along);
                left_z = end->z();
            }
        if ((p.z() > z) == (q.z() > z)) return;
        const double t = (z - p.z()) / (q.z() - p.z());
        crossings.push_back((p + t * (q - p)).dot(profile.along));
    });
    std::sort(crossings.begin(), crossings.end());
    double widest = std::numeric_limits<double>::quiet_NaN();
    // Left of the first crossing lies material if the surface begins above z, else gas.
    for (std::size_t k = left_z > z ? 0 : 1; k + 1 < crossings.size(); k += 2)
        widest = std::fmax(widest, crossings[k + 1] - crossings[k]);
    return widest;
}

}  // namespace

std::vector<Measure> measure(const Recipe& recipe, const TriangleMesh& mesh) {
    const surface::Plane plane = surface::parse_plane(recipe.metrology.cut);
    const Profile profile{surface::cut_by_plane(mesh, plane), surface::plane_axes(plane)[0]};
    std::vector<Measure> measures;
    for (const std::string& what : recipe.metrology.measures) {
        if (what == "depth") {
            double lowest = std::numeric_limits<double>::infinity();
            profile.each_segment([&](const Vec3& p, const Vec3& q) {
                lowest = std::min({lowest, p.z(), q.z()});
            });
            measures.push_back(
                {"depth", std::isfinite(lowest) ? -lowest : std::numeric_limits<double>::quiet_NaN()});
        } else if (what == "cd") {
            for (const double depth : recipe.metrology.cd_depths)
                measures.push_back({fmt::format("cd_at_{:g}", depth), opening(profile, -depth)});
        }
    }
    return measures;
}

}  // namespace sidewall::app
