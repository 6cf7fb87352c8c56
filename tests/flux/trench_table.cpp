#include "tests/flux/trench_table.hpp"

#include <cmath>
#include <fstream>
#include <sstream>

namespace sidewall::flux {

std::vector<Row> radiosity_rows() {
    std::ifstream file(SIDEWALL_SOURCE_DIR "/tests/assets/trench_radiosity.csv");
    std::vector<Row> rows;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line[0] == '#' || line[0] == 'a') continue;
        std::istringstream in(line);
        std::string aspect, sticking, where, position, flux;
        std::getline(in, aspect, ',');
        std::getline(in, sticking, ',');
        std::getline(in, where, ',');
        std::getline(in, position, ',');
        std::getline(in, flux, ',');
        rows.push_back({std::stod(aspect), std::stod(sticking), position.empty() ? -1.0 : std::stod(position),
                        std::stod(flux), where});
    }
    return rows;
}

double half_width(double position) {
    return position == 0.1 || position == 0.9 ? 0.05 : 0.1;
}

std::vector<std::size_t> triangles_of(const TriangleMesh& mesh, const Row& row) {
    std::vector<std::size_t> group;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Vec3 c = triangle_centroid(mesh, t);
        const Vec3 normal = area_vector(mesh, t);
        const bool wall = std::abs(normal.z()) < 0.7 * normal.norm(),
                   floor = !wall && c.z() < -0.5 * row.aspect;
        const double position = wall ? -c.z() / row.aspect : 0.5 - std::abs(c.x());
        const bool inside =
            row.position < 0.0 || std::abs(position - row.position) < half_width(row.position);
        if ((row.where.starts_with("wall") ? wall : floor) && inside) group.push_back(t);
    }
    return group;
}

double exact_mean(const TrenchFlux& exact, const Row& row) {
    if (row.where == "wall_mean") return exact.wall_mean;
    if (row.where == "floor_mean") return exact.floor_mean;
    const double half = half_width(row.position);
    return integral(
               row.position - half, row.position + half,
               [&](double p) { return at_position(row.where == "wall" ? exact.wall : exact.floor, p); },
               400) /
           (2.0 * half);
}

}  // namespace sidewall::flux
