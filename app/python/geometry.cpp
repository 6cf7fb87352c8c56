#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

#include "app/python/arrays.hpp"
#include "app/python/interruptible.hpp"
#include "levelset/meshes/extract.hpp"
#include "simplify/simplify.hpp"
#include "surface/curvature.hpp"
#include "surface/distance.hpp"

// Functions of the Python module on plain arrays: simplify, distance, extract.
namespace sidewall::python {
namespace {

using FeatureParameter = std::variant<double, std::string>;

double value_of(const FeatureParameter& parameter, const surface::Curvature& curvature, double spacing) {
    if (const double* value = std::get_if<double>(&parameter)) {
        if (*value > 0.0 && std::isfinite(*value)) return *value;
        throw RecipeError("feature_parameter = {}: must be a positive number or \"auto\"", *value);
    }
    if (const auto& word = std::get<std::string>(parameter); word != "auto")
        throw RecipeError("feature_parameter = \"{}\": must be a positive number or \"auto\"", word);
    return surface::auto_feature_parameter(curvature.mean, curvature.gaussian, spacing);
}

std::shared_ptr<TriangleMesh> simplified(const py::object& points, const py::object& triangles,
                                         const std::string& method, std::optional<double> l0,
                                         std::optional<double> step, std::optional<double> l_max,
                                         std::optional<std::size_t> target_vertices,
                                         std::optional<std::array<double, 3>> weights,
                                         std::optional<double> max_error,
                                         const FeatureParameter& feature_parameter,
                                         std::optional<double> grid_spacing, const py::object& material) {
    const auto mesh = mesh_of(points, triangles);
    if (const auto ids = material_ids(material, *mesh); !material.is_none())
        mesh->triangle_attributes.push_back({"material", 1, Scalar::int32, {ids.begin(), ids.end()}});
    simplify::Options options{.method = simplify::method_from_string(method),
                              .l0 = l0,
                              .step = step,
                              .l_max = l_max,
                              .target_vertices = target_vertices,
                              .max_error = max_error,
                              .grid_spacing = grid_spacing};
    if (weights) options.weights = {(*weights)[0], (*weights)[1], (*weights)[2]};
    return interruptible([&](const std::function<bool()>& stop) {
        options.progress = [&](std::size_t) {
            if (stop()) throw Interrupted("simplify");
        };
        std::vector<std::uint8_t> features;
        if (simplify::reads_features(options.method)) {
            const double spacing = simplify::base_length(*mesh, {}, options.grid_spacing);
            const surface::Curvature curvature = surface::mesh_curvature(*mesh);
            features =
                surface::feature_flags(curvature, spacing, value_of(feature_parameter, curvature, spacing));
        }
        return std::make_shared<TriangleMesh>(std::move(simplify::simplify(*mesh, features, options).mesh));
    });
}

struct Distances {
    double max = 0.0, mean = 0.0;
    py::array_t<double> forward, backward;
};

Distances distance(const py::object& points, const py::object& triangles, const py::object& other_points,
                   const py::object& other_triangles) {
    const auto first = mesh_of(points, triangles), second = mesh_of(other_points, other_triangles);
    surface::TwoSidedDistance found = interruptible(
        [&](const std::function<bool()>&) { return surface::two_sided_distance(*first, *second); });
    return {found.max, found.mean, owned(std::move(found.forward.per_vertex)),
            owned(std::move(found.backward.per_vertex))};
}

using Samples = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Values on the nodes of a grid. An index beyond its ends takes the value at the end.
struct Field {
    const double* values;
    std::array<py::ssize_t, 3> size;
    double at(py::ssize_t i, py::ssize_t j, py::ssize_t k) const {
        const auto [x, y, z] = size;
        return values[(std::clamp<py::ssize_t>(i, 0, x - 1) * y + std::clamp<py::ssize_t>(j, 0, y - 1)) * z +
                      std::clamp<py::ssize_t>(k, 0, z - 1)];
    }
};

// Refuses values that are no signed distance; extraction reads them within three cells of the front.
void require_distance(const Field& phi, double spacing) {
    const auto [nx, ny, nz] = phi.size;
    constexpr double kSlope = 1.1;  // allowed slope: 1, and room for rounding and smooth functions
    bool inside_above = false, outside_below = false;
    for (py::ssize_t i = 0; i < nx; ++i)
        for (py::ssize_t j = 0; j < ny; ++j) {
            outside_below |= phi.at(i, j, 0) >= 0.0;
            inside_above |= phi.at(i, j, nz - 1) < 0.0;
            for (py::ssize_t k = 0; k < nz; ++k) {
                const double here = phi.at(i, j, k);
                if (!std::isfinite(here))
                    throw GeometryError("phi[{}, {}, {}] = {}: must be finite", i, j, k, here);
                for (const double next : {phi.at(i + 1, j, k), phi.at(i, j + 1, k), phi.at(i, j, k + 1)})
                    if (std::abs(next - here) > kSlope * spacing)
                        throw GeometryError(
                            "phi[{}, {}, {}] = {:.4g} and a neighbour {:.4g} differ by more than spacing = {:.4g}: "
                            "phi must be a signed distance, at least near its zero, and may be clipped elsewhere",
                            i, j, k, here, next, spacing);
            }
        }
    if (inside_above && outside_below)
        throw GeometryError(
            "phi: the surface goes out through the array's ends along z: let all of phi[:, :, 0] be negative or all of "
            "phi[:, :, -1] positive by some cells");
}

std::shared_ptr<TriangleMesh> extracted(const Samples& samples, double spacing,
                                        const std::array<double, 3>& origin) {
    if (!(spacing > 0.0) || !std::isfinite(spacing))
        throw RecipeError("spacing = {}: must be positive", spacing);
    if (samples.ndim() != 3 || samples.shape(0) < 2 || samples.shape(1) < 2 || samples.shape(2) < 2)
        throw GeometryError("phi must have three axes x, y, z of two nodes or more");
    for (const double o : origin)
        if (!std::isfinite(o)) throw RecipeError("origin must be finite");
    const Field phi{samples.data(), {samples.shape(0), samples.shape(1), samples.shape(2)}};
    return interruptible([&](const std::function<bool()>&) {
        require_distance(phi, spacing);
        levelset::Domain domain;
        domain.spacing = spacing;
        for (std::size_t a = 0; a < 2; ++a) {
            domain.cells[a] = static_cast<int>(phi.size[a] - 1);
            domain.max[a] = domain.cells[a] * spacing;
        }
        const auto at = [&](const Vec3& p) {
            const Vec3 node = domain.to_index(p).array().round();
            return phi.at(static_cast<py::ssize_t>(node.x()), static_cast<py::ssize_t>(node.y()),
                          static_cast<py::ssize_t>(node.z()));
        };
        const auto grid =
            levelset::sample_grid(domain, at, 0.0, spacing * static_cast<double>(phi.size[2] - 1));
        auto mesh = std::make_shared<TriangleMesh>(levelset::extract_surface(*grid, domain));
        for (Vec3& vertex : mesh->vertices) vertex += Vec3(origin[0], origin[1], origin[2]);
        return mesh;
    });
}

}  // namespace

void add_geometry(py::module_& module) {
    using namespace py::literals;
    module.def("simplify", &simplified, "points"_a, "triangles"_a, py::kw_only(),
               "method"_a = "region-bounded", "l0"_a = py::none(), "step"_a = py::none(),
               "l_max"_a = py::none(), "target_vertices"_a = py::none(), "weights"_a = py::none(),
               "max_error"_a = py::none(), "feature_parameter"_a = 0.5, "grid_spacing"_a = py::none(),
               "material"_a = py::none(),
               R"(Coarsens a surface mesh, less at features (edges and strong curvature) than elsewhere.

points and triangles have the shapes (n, 3) and (m, 3). Lengths are in the mesh's own unit.

method: none, lindstrom-turk, region, region-bounded or cgal-lindstrom-turk.
l0: edges shorter than this collapse everywhere, at features too (default: grid_spacing, else the mean edge length).
step: increase of that length per ring of vertices away from features. l_max: edges longer than this never collapse.
target_vertices: number at which coarsening stops. weights: of volume, boundary and shape in the Lindstrom-Turk cost.
max_error: upper bound of the distance between both surfaces, in either direction.
feature_parameter: C; a vertex is a feature if its mean curvature |H| > C/dx or its Gaussian curvature |K| > (C/dx)^2,
dx being grid_spacing, else the mean edge length; or "auto". material: integer ids, one a triangle; borders between materials are kept.

Returns a Mesh, with triangle_data["material"] if material is given.
Raises GeometryError for a mesh that is no orientable manifold, RecipeError for an option out of range.)");

    py::class_<Distances>(module, "Distance", "Distances between two surfaces, in the unit of the points.")
        .def_readonly("max", &Distances::max, "largest distance, over both directions")
        .def_readonly("mean", &Distances::mean, "mean distance, of the direction in which it is larger")
        .def_readonly("forward", &Distances::forward,
                      "distance of each point of the first mesh to the second surface")
        .def_readonly("backward", &Distances::backward,
                      "distance of each point of the second mesh to the first surface");
    module.def(
        "distance", &distance, "points"_a, "triangles"_a, "other_points"_a, "other_triangles"_a,
        R"(Distances from the points of each of two meshes to the surface of the other. For Meshes a and b: distance(*a, *b).

Raises GeometryError for a mesh without points or triangles.)");

    module.def(
        "extract", &extracted, "phi"_a, "spacing"_a, "origin"_a = std::array<double, 3>{},
        R"(Extracts the zero level of a signed distance, negative inside the material, by marching cubes.

phi: values, in the unit of spacing, at the nodes of a grid, axes x, y, z; node (i, j, k) lies at origin + spacing * (i, j, k). Values farther than
three spacings from zero may be clipped. The surface may end at the array's sides in x and y, but not in z.

Returns a Mesh; if origin is 0, its open boundary lies exactly in the planes of the sides.
Raises GeometryError if phi is no signed distance.)");
}

}  // namespace sidewall::python
