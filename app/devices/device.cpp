#include "app/devices/device.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "app/common/free_memory.hpp"
#include "app/pictures/render_scene.hpp"
#include "surface/tetrahedra/tetrahedralize.hpp"

namespace sidewall::app {
namespace {

// Lengths of TetOptions in grid spacings.
constexpr double kSize = 2.0;
constexpr double kLeast = 0.6;       // shorter edges are not divided
constexpr double kTolerance = 0.06;  // largest distance of a front from an edge
constexpr double kThin = 0.005;      // thinner films are rounding
constexpr double kShift = 0.06;      // largest offset of fronts to match volumes

// The mesh is refined by kFiner while a region of over kSmall cells is off its volume by over kVolume.
constexpr double kVolume = 0.0048, kSmall = 1.0, kFiner = 0.7;
constexpr double kScrap = 20.0;  // cells: smaller regions have few vertices off contact lines
constexpr int kAttempts = 3;
constexpr double kLonger = 1.2;  // growth of edges, repeated until there are few enough

/// Volume of material between z = \p bottom and a surface that ends on the sides of the box.
double volume_below(const TriangleMesh& mesh, double bottom) {
    double volume = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        volume += 0.5 * area_vector(mesh, t).z() * (triangle_centroid(mesh, t).z() - bottom);
    return volume;
}

/// Layers as nested bodies, with their regions: one per material, not per layer.
struct Regions {
    std::vector<const RenderLayer*> layers;
    std::vector<std::string> names;
    std::vector<int> of_layer;
};

Regions regions_of(const RenderScene& scene, const Result& result) {
    const Materials materials = materials_of(result.metadata);
    Regions regions;
    for (const RenderLayer& layer : scene.layers()) {
        if (!layer.body) continue;  // a layer without thickness so far
        const std::string name = material_of(*layer.body, materials).name;
        const auto found = std::find(regions.names.begin(), regions.names.end(), name);
        regions.layers.push_back(&layer);
        regions.of_layer.push_back(static_cast<int>(found - regions.names.begin()));
        if (found == regions.names.end()) regions.names.push_back(name);
    }
    if (regions.layers.empty())
        throw GeometryError("{}: does not say which material lies below the surface: run it again",
                            result.source.string());
    return regions;
}

/// The box to be meshed: the sides of the surface, and room below and above.
Box3 box_of(const Result& result, double spacing, const DeviceOptions& options) {
    Box3 box = bounding_box(result.surface);
    double lowest = box.min.z();
    for (const TriangleMesh& mesh : result.interfaces) lowest = std::min(lowest, bounding_box(mesh).min.z());
    const double room = std::max(4.0 * spacing, 0.25 * std::max(box.size().x(), box.size().y()));
    box.min.z() = options.bottom.value_or(lowest - room);
    if (!(box.min.z() <= lowest - spacing))
        throw RecipeError(
            "--bottom {:.6g}: must be at least a grid spacing below the lowest front: {:.6g} or less",
            box.min.z(), lowest - spacing);
    box.max.z() += options.gas ? room : 2.0 * spacing;
    return box;
}

double width_of(const Result& result) {
    return bounding_box(result.surface).size().y();
}

// A profile stretched along y to four edges; nothing if it is that wide or the wafer is no profile.
std::optional<Result> drawn_out(const Result& result, double spacing, const DeviceOptions& options) {
    constexpr double kEdges = 4.0;
    const double wide = width_of(result), width = kEdges * options.size.value_or(kSize * spacing);
    if (!is_profile(result, spacing) || !(width > wide) || !std::isfinite(width)) return std::nullopt;
    Result drawn = result;
    const auto draw = [&](TriangleMesh& mesh) {
        for (Vec3& vertex : mesh.vertices) vertex.y() *= width / wide;
    };
    draw(drawn.surface);
    for (TriangleMesh& mesh : drawn.interfaces) draw(mesh);
    return drawn;
}

// Bytes of memory per tetrahedron while meshing.
constexpr double kBytes = 400.0;

double expected_count(const Result& result, const Box3& box, double size) {
    constexpr double kAtFronts = 45.0;  // tetrahedra per size^2 of front (measured: flat, patterned wafers)
    double area = total_area(result.surface);
    for (const TriangleMesh& mesh : result.interfaces) area += total_area(mesh);
    const Vec3 extent = box.size();
    const double cube = std::min({16.0 * size, extent.x(), extent.y(), extent.z()});  // edge far from fronts
    return kAtFronts * (area + extent.x() * extent.y()) / (size * size) +
           6.0 * extent.prod() / (cube * cube * cube);
}

surface::TetOptions tet_options(const Result& result, double spacing, const DeviceOptions& options) {
    surface::TetOptions tets;
    tets.size = options.size.value_or(kSize * spacing);
    if (!(tets.size > 0.0) || !std::isfinite(tets.size))
        throw RecipeError("--size {}: must be a length above 0", tets.size);
    if (options.most == 0) throw RecipeError("--most 0: must be at least 1");
    tets.box = box_of(result, spacing, options);
    const double longest = tets.box.size().maxCoeff();
    while (!options.size && tets.size < longest &&
           expected_count(result, tets.box, tets.size) > static_cast<double>(options.most))
        tets.size *= kLonger;
    // A size that the user gave does not coarsen curves and films.
    const double ratio = tets.size / (kSize * spacing), fine = options.size ? std::min(1.0, ratio) : ratio;
    tets.least = fine * kLeast * spacing;
    tets.tolerance = fine * kTolerance * spacing;
    tets.thin = kThin * spacing;
    tets.shift = fine * kShift * spacing;
    tets.scrap = kScrap * spacing * spacing * spacing;
    tets.outside = options.gas;
    tets.progress = options.progress;
    const Vec3 extent = tets.box.size();
    constexpr double kDeepest = 100.0;  // in widths of the wafer: far below what any device reaches
    if (options.bottom && !(extent.z() < kDeepest * std::max(extent.x(), extent.y())))
        throw RecipeError("--bottom {:.6g}: must lie less than {} times the domain's width below the surface",
                          *options.bottom, kDeepest);
    const FreeMemory free = free_memory();
    const double count = expected_count(result, tets.box, tets.size);
    if (count * kBytes > free.bytes || count > 1e9)
        throw RecipeError(
            "--size {:.4g}: would make about {:.2g} tetrahedra and need about {:.3g} GB, and {:.3g} GB are {}: choose a "
            "larger one",
            tets.size, count, 1e-9 * count * kBytes, 1e-9 * free.bytes, free.limit);
    tets.most = static_cast<std::size_t>(std::min(1e9, free.bytes / kBytes));
    constexpr double kCut = 0.7;  // share of tetrahedra that exists before the fronts are cut
    if (!options.size)
        tets.most =
            std::min(tets.most, static_cast<std::size_t>(kCut * static_cast<double>(options.most)) + 1);
    return tets;
}

// Meshes with at most tets.most tetrahedra, by longer edges where the user gave no size.
TetMesh mesh_within(const std::vector<surface::Front>& fronts, surface::TetOptions& tets,
                    const DeviceOptions& options) {
    for (;;) try {
            return surface::tetrahedralize(fronts, tets);
        } catch (const surface::TooManyTetrahedra&) {
            if (options.size || tets.size > tets.box.size().maxCoeff()) throw;
            for (double* length : {&tets.size, &tets.least, &tets.tolerance, &tets.shift}) *length *= kLonger;
        }
}

std::vector<TetFace> faces_of(const TetMesh& mesh) {
    return sorted_faces(mesh.tetrahedra, [&](std::uint32_t t) { return mesh.region[t]; });
}

/// Name of the side of the box that a face lies on, or "surface".
std::string outer_name(const TetMesh& mesh, const TetFace& face, const Box3& box) {
    constexpr const char* kSides[] = {"x-min", "x-max", "y-min", "y-max", "bottom", "top"};
    for (int axis = 0; axis < 3; ++axis)
        for (const bool high : {false, true}) {
            const double plane = high ? box.max[axis] : box.min[axis];
            if (std::ranges::all_of(face.corners,
                                    [&](std::uint32_t v) { return mesh.vertices[v][axis] == plane; }))
                return kSides[2 * axis + (high ? 1 : 0)];
        }
    return "surface";
}

/// Adds the faces between regions and on the outside.
/// \param gas  region of the gas; negative if it is not meshed.
void add_boundaries(TetMesh& mesh, const Box3& box, int gas) {
    const std::vector<TetFace> faces = faces_of(mesh);
    std::map<std::string, std::vector<Triangle>> named;
    for (std::size_t i = 0, j = 0; i < faces.size(); i = j) {
        j = i + 1 < faces.size() && faces[i + 1].sorted == faces[i].sorted ? i + 2 : i + 1;
        if (j - i == 1) {
            named[outer_name(mesh, faces[i], box)].push_back(faces[i].corners);
        } else if (faces[i].region != faces[i + 1].region) {
            const auto &low = mesh.regions[static_cast<std::size_t>(faces[i].region)],
                       &high = mesh.regions[static_cast<std::size_t>(faces[i + 1].region)];
            named[faces[i + 1].region == gas ? "surface" : fmt::format("{}/{}", low, high)].push_back(
                faces[i].corners);
        }
    }
    for (const auto& [name, triangles] : named) {
        mesh.triangles.insert(mesh.triangles.end(), triangles.begin(), triangles.end());
        mesh.boundary.insert(mesh.boundary.end(), triangles.size(), static_cast<int>(mesh.boundaries.size()));
        mesh.boundaries.push_back(name);
    }
}

/// Volume by region, as enclosed by the surfaces.
std::vector<double> enclosed_volumes(const Regions& regions, const surface::TetOptions& tets) {
    std::vector<double> volumes(regions.names.size(), 0.0);
    double below = 0.0;
    for (std::size_t k = 0; k < regions.layers.size(); ++k) {
        const double here = volume_below(*regions.layers[k]->mesh, tets.box.min.z());
        volumes[static_cast<std::size_t>(regions.of_layer[k])] += here - below;
        below = here;
    }
    if (tets.outside) volumes.back() = tets.box.size().prod() - below;
    return volumes;
}

bool volumes_hold(const Device& device, double small) {
    const std::vector<double> meshed = measure_tets(device.mesh).volume;
    for (std::size_t r = 0; r < meshed.size(); ++r)
        if (device.volume[r] > small && std::abs(meshed[r] - device.volume[r]) > kVolume * device.volume[r])
            return false;
    return true;
}

using Edge = std::array<std::uint32_t, 2>;

// Boundary numbers of the edges of all boundaries but `y-min` and `y-max`.
std::map<Edge, int> named_edges(const TetMesh& mesh) {
    std::map<Edge, int> edges;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const std::string& name = mesh.boundaries[static_cast<std::size_t>(mesh.boundary[t])];
        if (name == "y-min" || name == "y-max") continue;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
            edges[{a, b}] = mesh.boundary[t];
        }
    }
    return edges;
}

}  // namespace

bool is_profile(const Result& result, double spacing) {
    constexpr double kCell = 1.5;  // in grid spacings; wider wafers are no profiles
    return width_of(result) <= kCell * spacing;
}

Device make_device(const Result& wafer, double spacing, const DeviceOptions& options) {
    const std::optional<Result> drawn = drawn_out(wafer, spacing, options);
    const Result& result = drawn ? *drawn : wafer;
    const RenderScene scene(result, {});
    if (!scene.solid())
        throw GeometryError("{}: encloses no material: its edges do not lie on the sides of a rectangle",
                            result.source.string());
    Regions regions = regions_of(scene, result);
    surface::TetOptions tets = tet_options(result, spacing, options);
    std::vector<surface::Front> fronts;
    for (const RenderLayer* layer : regions.layers)
        fronts.emplace_back([layer](const Vec3& p) { return layer->distance.at(p); });

    if (options.gas) {
        if (std::ranges::find(regions.names, "gas") != regions.names.end())
            throw RecipeError(
                "{}: --gas: a material has the name gas, which the gas's region has: leave --gas out, or give the material "
                "another name and run it again",
                result.source.string());
        regions.of_layer.push_back(static_cast<int>(regions.names.size()));
        regions.names.emplace_back("gas");
    }
    Device device;
    device.bottom = tets.box.min.z();
    device.volume = enclosed_volumes(regions, tets);
    tets.material = regions.of_layer;
    tets.volume = device.volume;
    const double small = kSmall * spacing * spacing * spacing;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        device.mesh = mesh_within(fronts, tets, options);
        for (int& region : device.mesh.region) region = regions.of_layer[static_cast<std::size_t>(region)];
        device.mesh.regions = regions.names;
        constexpr double kGrowth = 4.0;  // largest growth of the mesh by the next attempt
        if (volumes_hold(device, small) ||
            kGrowth * static_cast<double>(device.mesh.tetrahedra.size()) > static_cast<double>(tets.most))
            break;
        tets.least *= kFiner;
        tets.tolerance *= kFiner * kFiner;
    }
    device.size = tets.size;
    if (drawn) device.drawn_out = width_of(result);
    add_boundaries(device.mesh, tets.box, options.gas ? static_cast<int>(regions.names.size()) - 1 : -1);
    return device;
}

PlaneMesh plane_of(const TetMesh& mesh) {
    PlaneMesh plane;
    plane.regions = mesh.regions;
    const auto is_side = [&](std::size_t t) {
        return mesh.boundaries[static_cast<std::size_t>(mesh.boundary[t])] == "y-min";
    };
    const std::vector<TetFace> faces = faces_of(mesh);
    const std::map<Edge, int> named = named_edges(mesh);
    std::map<std::uint32_t, std::uint32_t> numbers;
    std::map<Edge, int> used;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!is_side(t)) continue;
        Triangle sorted = mesh.triangles[t], corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t v = sorted[k];
            const auto [place, is_new] =
                numbers.try_emplace(v, static_cast<std::uint32_t>(plane.vertices.size()));
            if (is_new) plane.vertices.emplace_back(mesh.vertices[v].x(), mesh.vertices[v].z(), 0.0);
            corners[k] = place->second;
            const auto [a, b] = std::minmax(v, mesh.triangles[t][(k + 1) % 3]);
            if (const auto edge = named.find({a, b}); edge != named.end()) used.insert(*edge);
        }
        std::sort(sorted.begin(), sorted.end());
        plane.triangles.push_back(corners);
        plane.region.push_back(std::ranges::lower_bound(faces, sorted, {}, &TetFace::sorted)->region);
    }
    std::map<int, int> kept;  // new numbers of boundaries by old ones
    for (const auto& [edge, boundary] : used) {
        const auto [place, is_new] = kept.try_emplace(boundary, static_cast<int>(plane.boundaries.size()));
        if (is_new) plane.boundaries.push_back(mesh.boundaries[static_cast<std::size_t>(boundary)]);
        plane.edges.push_back({numbers.at(edge[0]), numbers.at(edge[1])});
        plane.boundary.push_back(place->second);
    }
    return plane;
}

}  // namespace sidewall::app
