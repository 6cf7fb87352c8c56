#include "tests/flux/cylinders.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace sidewall::flux {
namespace {

// Whether a triangle lies in the middle \p part of a tenth of the depth (0 to 9), or on the floor (10). Half
// a cell at the foot belongs to neither.
bool lies_in(const TriangleMesh& mesh, std::size_t t, double depth, int tenth, double part) {
    const Vec3 c = triangle_centroid(mesh, t), normal = area_vector(mesh, t);
    const bool upright = std::abs(normal.z()) > 0.9 * normal.norm();
    if (tenth == 10) return upright && c.z() < -0.5 * depth;
    const double place = -10.0 * c.z() / depth - tenth;
    return !upright && c.z() < -1e-6 && std::abs(place - 0.5) < 0.5 * part;
}

}  // namespace

std::vector<CylinderRow> cylinder_rows() {
    std::ifstream file(SIDEWALL_SOURCE_DIR "/tests/assets/cylinder_radiosity.csv");
    if (!file) throw std::runtime_error("tests/assets/cylinder_radiosity.csv cannot be read");
    std::vector<CylinderRow> rows;
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
        std::istringstream in(line);
        std::string aspect, sticking, depth, flux;
        std::getline(in, aspect, ',');
        std::getline(in, sticking, ',');
        std::getline(in, depth, ',');
        std::getline(in, flux, ',');
        rows.push_back({std::stod(aspect), std::stod(sticking), depth == "floor" ? -1.0 : std::stod(depth),
                        std::stod(flux)});
    }
    return rows;
}

CylinderTruth::CylinderTruth(double depth, double sticking)
    : depth_(depth),
      flux_(cylinder_flux(depth, sticking, std::clamp(static_cast<int>(20.0 * depth), 100, 4000))) {}

double CylinderTruth::wall(double z) const {
    // Exponential interpolation between the middles of rings; beyond them extrapolated from the nearest two.
    const auto& rings = flux_.wall;
    const double place = -z / depth_ * static_cast<double>(rings.size()) - 0.5;
    const double first = std::clamp(std::floor(place), 0.0, static_cast<double>(rings.size() - 2));
    const auto i = static_cast<std::size_t>(first);
    return rings[i] * std::pow(rings[i + 1] / rings[i], place - first);
}

double tenth_ratio(const TriangleMesh& mesh, const std::vector<double>& triangle_flux,
                   const CylinderTruth& truth, double depth, int tenth) {
    double sum = 0.0, exact = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!lies_in(mesh, t, depth, tenth, 1.0)) continue;
        const double a = triangle_area(mesh, t);
        double there = truth.floor();
        if (tenth < 10) {  // mean over the triangle, from the middles of its edges
            there = 0.0;
            for (std::size_t k = 0; k < 3; ++k)
                there += truth.wall(0.5 * (mesh.vertices[mesh.triangles[t][k]].z() +
                                           mesh.vertices[mesh.triangles[t][(k + 1) % 3]].z())) /
                         3.0;
        }
        sum += a * triangle_flux[t];
        exact += a * there;
    }
    return sum / exact;
}

double tenth_rms(const TriangleMesh& mesh, const std::vector<double>& triangle_flux,
                 const std::vector<double>& truth, double depth, int tenth) {
    double sum = 0.0, area = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const double a = triangle_area(mesh, t);
        if (!lies_in(mesh, t, depth, tenth, 1.0) || !(a > 0.0)) continue;
        sum += a * std::pow(triangle_flux[t] / truth[t] - 1.0, 2.0);
        area += a;
    }
    return std::sqrt(sum / area);
}

}  // namespace sidewall::flux
