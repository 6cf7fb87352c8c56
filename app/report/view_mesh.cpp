#include "app/report/view_mesh.hpp"

#include <algorithm>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "app/common/json.hpp"
#include "app/pictures/render_scene.hpp"
#include "simplify/simplify.hpp"
#include "surface/error.hpp"
#include "surface/ray_scene.hpp"
#include "surface/topology.hpp"

namespace sidewall::app {
namespace {

constexpr double kCrease = 40.0 * std::numbers::pi / 180.0;
constexpr std::uint16_t kNoValue = 65535;
constexpr double kAnyLength = 1e6;  // cells; longer than any edge

// Corners of triangles, grouped: a group holds the corners at one vertex that have the same material and lie
// on the same side of a crease. Each group becomes a vertex of the page's mesh.
struct CornerGroups {
    std::vector<std::uint32_t> of_corner;  // group of corner k of triangle t, at 3 t + k
    std::vector<std::uint32_t> vertex;     // vertex of each group in the mesh
    std::vector<int> material;             // material of each group
};

CornerGroups corner_groups(const TriangleMesh& mesh) {
    struct Group {
        int material;
        Vec3 normal;
        std::uint32_t number;
    };
    const std::vector<Vec3> normals = triangle_normals(mesh);
    std::vector<int> materials = triangle_materials(mesh);
    for (int& id : materials) id = std::clamp(id, 0, 255);  // the page holds a byte each
    const surface::Rows around = surface::vertex_corners(mesh);
    CornerGroups groups;
    groups.of_corner.resize(3 * mesh.triangles.size());
    std::vector<Group> here;
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
        here.clear();
        for (const std::uint32_t corner : around[v]) {
            const std::size_t t = corner / 3;
            const auto same = std::find_if(here.begin(), here.end(), [&](const Group& group) {
                return group.material == materials[t] && group.normal.dot(normals[t]) >= std::cos(kCrease);
            });
            if (same != here.end()) {
                groups.of_corner[corner] = same->number;
                continue;
            }
            const auto number = static_cast<std::uint32_t>(groups.vertex.size());
            here.push_back({materials[t], normals[t], number});
            groups.of_corner[corner] = number;
            groups.vertex.push_back(static_cast<std::uint32_t>(v));
            groups.material.push_back(materials[t]);
        }
    }
    return groups;
}

// Area-weighted mean of an attribute over the triangles of each group; NaN where it has no values.
std::vector<float> group_means(const TriangleMesh& mesh, const CornerGroups& groups,
                               const Attribute* attribute) {
    const std::size_t count = groups.vertex.size();
    if (!attribute || attribute->components != 1)
        return std::vector<float>(count, std::numeric_limits<float>::quiet_NaN());
    std::vector<double> sum(count, 0.0), area(count, 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!std::isfinite(attribute->values[t])) continue;
        const double weight = triangle_area(mesh, t);
        for (std::size_t k = 0; k < 3; ++k) {
            sum[groups.of_corner[3 * t + k]] += weight * attribute->values[t];
            area[groups.of_corner[3 * t + k]] += weight;
        }
    }
    std::vector<float> means(count);
    for (std::size_t g = 0; g < count; ++g) means[g] = static_cast<float>(sum[g] / area[g]);
    return means;
}

TriangleMesh coarsened(const TriangleMesh& mesh, const ViewDetail& detail, double cell) {
    simplify::Options options{.method = simplify::Method::region_bounded, .grid_spacing = cell};
    options.l_max = detail.max_length * cell;
    options.l0 = options.l_max;  // one length everywhere: only the error bound grades the mesh
    options.max_error = detail.max_error * cell;
    try {
        return simplify::simplify(mesh, {}, options).mesh;
    } catch (const GeometryError&) {
        // The mesh is not manifold where films touch each other at a point or along a line.
    }
    try {
        return simplify::simplify(manifold_parts(mesh), {}, options).mesh;
    } catch (const GeometryError&) {
        return mesh;
    }
}

ViewMesh split_corners(const TriangleMesh& mesh, const CornerGroups& groups) {
    ViewMesh view;
    view.material = groups.material;
    for (const std::uint32_t v : groups.vertex) view.vertices.push_back(mesh.vertices[v]);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        view.triangles.push_back(
            {groups.of_corner[3 * t], groups.of_corner[3 * t + 1], groups.of_corner[3 * t + 2]});
    return view;
}

// Points at which vertices sample values: each vertex moved by a tenth towards the centroids of its
// triangles, so that it samples its side of a crease or of a border between materials.
std::vector<Vec3> sampling_points(const ViewMesh& view) {
    constexpr double kInward = 0.1;
    std::vector<Vec3> middle(view.vertices.size(), Vec3::Zero());
    std::vector<double> count(view.vertices.size(), 0.0);
    for (const Triangle& t : view.triangles)
        for (const std::uint32_t v : t) {
            middle[v] += (view.vertices[t[0]] + view.vertices[t[1]] + view.vertices[t[2]]) / 3.0;
            count[v] += 1.0;
        }
    std::vector<Vec3> points = view.vertices;
    for (std::size_t v = 0; v < points.size(); ++v)
        if (count[v] > 0.0) points[v] += kInward * (middle[v] / count[v] - points[v]);
    return points;
}

void append(std::string& bytes, std::uint32_t value, int size) {
    for (int k = 0; k < size; ++k) bytes += static_cast<char>(value >> (8 * k) & 255u);
}

std::uint32_t steps(double value, double low, double high, double count) {
    const double share = high > low ? (value - low) / (high - low) : 0.0;
    return static_cast<std::uint32_t>(std::lround(std::clamp(share, 0.0, 1.0) * count));
}

// Removes pairs of triangles with the same three vertices.
TriangleMesh without_folds(const TriangleMesh& mesh) {
    std::map<Triangle, std::size_t> open;  // unpaired triangles by their sorted vertices
    std::vector<std::uint8_t> kept(mesh.triangles.size(), 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Triangle key = mesh.triangles[t];
        std::sort(key.begin(), key.end());
        const auto [place, fresh] = open.try_emplace(key, t);
        if (fresh) continue;
        kept[t] = kept[place->second] = 0;
        open.erase(place);
    }
    const Attribute* material = mesh.triangle_attribute("material");
    TriangleMesh result{.vertices = mesh.vertices};
    Attribute of_kept{"material", 1, Scalar::int32, {}};
    for (std::size_t t = 0; t < kept.size(); ++t) {
        if (!kept[t]) continue;
        result.triangles.push_back(mesh.triangles[t]);
        if (material) of_kept.values.push_back(material->values[t]);
    }
    if (material) result.triangle_attributes.push_back(std::move(of_kept));
    return result;
}

}  // namespace

ViewMesh view_mesh(const TriangleMesh& mesh, const std::vector<std::string>& attributes,
                   const ViewDetail& detail, double cell) {
    const CornerGroups groups = corner_groups(mesh);
    std::vector<std::vector<float>> means;
    means.reserve(attributes.size());
    for (const std::string& name : attributes)
        means.push_back(group_means(mesh, groups, mesh.triangle_attribute(name)));
    if (detail.max_error == 0.0) {
        ViewMesh view = split_corners(mesh, groups);
        view.values = std::move(means);
        return view;
    }
    const TriangleMesh coarse = coarsened(mesh, detail, cell);
    ViewMesh view = split_corners(coarse, corner_groups(coarse));
    view.values.resize(means.size(), std::vector<float>(view.vertices.size()));
    if (means.empty()) return view;
    const surface::RayScene scene(mesh);
    const std::vector<Vec3> points = sampling_points(view);
    for (std::size_t v = 0; v < points.size(); ++v) {
        const auto hit = scene.closest_point(points[v], std::numeric_limits<double>::max());
        const double weights[3] = {1.0 - hit.u - hit.v, hit.u, hit.v};
        for (std::size_t a = 0; a < means.size(); ++a) {
            double value = 0.0;
            for (std::size_t k = 0; k < 3; ++k)
                value += weights[k] * static_cast<double>(means[a][groups.of_corner[3 * hit.triangle + k]]);
            view.values[a][v] = static_cast<float>(value);
        }
    }
    return view;
}

ViewMesh bare_view_mesh(const TriangleMesh& mesh, const ViewDetail& detail, double cell) {
    ViewMesh view;
    if (detail.max_error > 0.0) {
        // Edges may have any length, as no attribute has to be resolved.
        const TriangleMesh coarse = coarsened(mesh, {detail.max_error, kAnyLength}, cell);
        view.vertices = coarse.vertices;
        view.triangles = coarse.triangles;
    } else {
        view.vertices = mesh.vertices;
        view.triangles = mesh.triangles;
    }
    return view;
}

std::size_t encoded_size(const ViewMesh& mesh) {
    const std::size_t index = mesh.vertices.size() > 65536 ? 4 : 2;
    const std::size_t bytes = mesh.vertices.size() * (6 + 2 * mesh.values.size()) + mesh.material.size() +
                              3 * index * mesh.triangles.size();
    return bytes * 4 / 3 + 100;
}

Json encode(const ViewMesh& mesh, const Box3& box, const std::vector<std::array<double, 2>>& ranges) {
    std::string positions, indices, materials;
    for (const Vec3& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis)
            append(positions, steps(v[axis], box.min[axis], box.max[axis], 65535.0), 2);
    const bool wide = mesh.vertices.size() > 65536;
    for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) append(indices, v, wide ? 4 : 2);
    for (const int id : mesh.material) append(materials, static_cast<std::uint32_t>(id), 1);
    Json json{{"n", mesh.vertices.size()}, {"p", base64(positions)}, {"i", base64(indices)}};
    if (wide) json["wide"] = true;
    if (!mesh.material.empty()) json["m"] = base64(materials);
    for (std::size_t a = 0; a < mesh.values.size(); ++a) {
        std::string values;
        for (const float value : mesh.values[a])
            append(
                values,
                std::isfinite(value) ? steps(double(value), ranges[a][0], ranges[a][1], 65534.0) : kNoValue,
                2);
        json["a"].push_back(base64(values));
    }
    return json;
}

std::string base64(const std::string& bytes) {
    namespace iterators = boost::archive::iterators;
    using Letters = iterators::base64_from_binary<iterators::transform_width<const char*, 6, 8>>;
    std::string text(Letters(bytes.data()), Letters(bytes.data() + bytes.size()));
    return text.append((3 - bytes.size() % 3) % 3, '=');
}

TriangleMesh manifold_parts(const TriangleMesh& mesh) {
    TriangleMesh result = without_folds(mesh);
    // Corners at a vertex stay one vertex where their triangles share an edge that no third triangle has.
    surface::DisjointSets corners(3 * result.triangles.size());
    const auto corner_at = [&](std::uint32_t triangle, std::uint32_t vertex) {
        const Triangle& t = result.triangles[triangle];
        return 3 * triangle + static_cast<std::uint32_t>(std::find(t.begin(), t.end(), vertex) - t.begin());
    };
    const surface::EdgeTable table = surface::edge_table(result);
    for (std::size_t e = 0; e < table.edges.size(); ++e) {
        const auto on_edge = table.corners[e];
        if (on_edge.size() != 2) continue;
        for (const std::uint32_t vertex : table.edges[e])
            corners.join(corner_at(on_edge[0] / 3, vertex), corner_at(on_edge[1] / 3, vertex));
    }
    std::map<std::uint32_t, std::uint32_t> number;  // new vertex of each set, by the root corner
    const std::vector<Vec3> vertices = std::move(result.vertices);
    result.vertices.clear();
    for (std::uint32_t c = 0; c < 3 * result.triangles.size(); ++c) {
        std::uint32_t& vertex = result.triangles[c / 3][c % 3];
        const auto [place, fresh] =
            number.try_emplace(corners.root(c), static_cast<std::uint32_t>(result.vertices.size()));
        if (fresh) result.vertices.push_back(vertices[vertex]);
        vertex = place->second;
    }
    return result;
}

}  // namespace sidewall::app
