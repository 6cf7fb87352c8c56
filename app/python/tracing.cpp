#include <fmt/ranges.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <variant>

#include "app/python/arrays.hpp"
#include "app/python/interruptible.hpp"
#include "flux/radiosity/method_choice.hpp"
#include "surface/repair.hpp"

// Functions of the Python module that trace particles: flux, mend.
namespace sidewall::python {
namespace {

using flux::Boundary;
using Words = std::variant<std::string, std::array<std::string, 2>>;
using Sticking = std::variant<double, std::map<std::int32_t, double>>;

struct Traced : flux::FluxResult {
    std::vector<double> area;
};

std::array<Boundary, 2> boundary_of(const Words& words) {
    const auto one = [](const std::string& word) {
        if (word == "reflective") return Boundary::reflective;
        if (word == "periodic") return Boundary::periodic;
        if (word == "open") return Boundary::open;
        throw RecipeError(
            "boundary = \"{}\": must be reflective, periodic or open, or a pair of these for x and y", word);
    };
    if (const auto* word = std::get_if<std::string>(&words)) return {one(*word), one(*word)};
    const auto& [x, y] = std::get<std::array<std::string, 2>>(words);
    return {one(x), one(y)};
}

void warn(const std::string& text) {
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
}

// Sides of the domain; by default reflective where the surface ends on a rectangle, else open with a warning.
flux::LateralBox box_of(const TriangleMesh& mesh, const std::optional<Words>& boundary) {
    if (boundary) return flux::lateral_box(mesh, boundary_of(*boundary));
    try {
        return flux::lateral_box(mesh, {Boundary::reflective, Boundary::reflective});
    } catch (const GeometryError& reason) {
        const auto box = flux::lateral_box(mesh, {Boundary::open, Boundary::open});
        warn(fmt::format("the sides are taken as open, particles leave there and none come in: {}",
                         reason.what()));
        return box;
    }
}

// Renumbers \p materials from 0, ascending by id; returns one sticking probability for all or one for each.
std::vector<double> sticking_of(const Sticking& sticking, std::vector<std::int32_t>& materials) {
    const auto checked = [](double value, const std::string& where) {
        if (value >= 0.0 && value <= 1.0) return value;
        throw RecipeError("{} = {}: must be in [0, 1]", where, value);
    };
    std::vector<std::int32_t> ids = materials;
    if (ids.empty()) ids.push_back(0);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    const auto place = [&](std::int32_t id) {
        return std::lower_bound(ids.begin(), ids.end(), id) - ids.begin();
    };
    for (std::int32_t& id : materials) id = static_cast<std::int32_t>(place(id));
    if (const double* value = std::get_if<double>(&sticking)) return {checked(*value, "sticking")};
    const auto& by_id = std::get<std::map<std::int32_t, double>>(sticking);
    std::vector<double> values;
    for (const auto& [id, value] : by_id)
        if (!std::binary_search(ids.begin(), ids.end(), id))
            throw RecipeError("sticking[{}]: no triangle has material {}; there are {}", id, id,
                              fmt::join(ids, ", "));
    for (const std::int32_t id : ids) {
        if (!by_id.contains(id)) throw RecipeError("sticking: material {} is missing", id);
        values.push_back(checked(by_id.at(id), fmt::format("sticking[{}]", id)));
    }
    return values;
}

std::uint64_t rays_of(std::optional<double> rays, bool to_error) {
    constexpr double kDefault = 1e6,
                     kMost = 1e10;  // limit with relative_error and without rays
    const double value = rays.value_or(to_error ? kMost : kDefault);
    if (!(value >= 1.0 && value <= 1e12) || value != std::floor(value))
        throw RecipeError("rays = {}: must be a whole number from 1 to 1e12", value);
    return static_cast<std::uint64_t>(value);
}

Traced trace(const py::object& points, const py::object& triangles, const Sticking& sticking,
             const py::object& material, double source_exponent, std::optional<double> rays,
             std::optional<double> relative_error, const std::optional<Words>& boundary, std::uint64_t seed,
             const std::string& method) {
    if (method != "monte-carlo" && method != "radiosity" && method != "auto")
        throw RecipeError("method = \"{}\": must be monte-carlo, radiosity or auto", method);
    const auto mesh = mesh_of(points, triangles);
    std::vector<std::int32_t> materials = material_ids(material, *mesh);
    const flux::Species species{"flux", source_exponent, sticking_of(sticking, materials)};
    const flux::LateralBox box = box_of(*mesh, boundary);
    flux::TraceOptions options{
        .rays = rays_of(rays, relative_error.has_value()), .relative_error = relative_error, .seed = seed};
    Traced traced = interruptible([&](const std::function<bool()>& stop) {
        options.stop = stop;
        const surface::RayScene scene(*mesh);
        const flux::Wedges wedges = flux::make_wedges(*mesh, materials);
        const flux::SingleFlux asked{*mesh, materials, box,     wedges,
                                     scene, species,   options, rays.has_value()};
        Traced done{flux::find_flux(method, asked), {}};
        for (std::size_t t = 0; t < mesh->triangles.size(); ++t) done.area.push_back(triangle_area(*mesh, t));
        return done;
    });
    if (flux::leaks_too_much(traced.leaked, traced.emitted))
        throw NumericsError(
            "{} of {} particles went through the surface: it has holes, overlaps, pieces turned inside out that are "
            "hidden from above or, with periodic sides, opposite ends that do not match; mend() repairs what it can",
            traced.leaked, traced.emitted);
    if (relative_error && !(traced.relative_error <= *relative_error))
        warn(fmt::format("relative error {:.3g} after {} rays, above the {:.3g} asked for: allow more rays",
                         traced.relative_error, traced.emitted, *relative_error));
    return traced;
}

std::shared_ptr<TriangleMesh> repaired(const py::object& points, const py::object& triangles) {
    auto mesh = mesh_of(points, triangles);
    flux::require_traceable(*mesh);
    interruptible([&](const std::function<bool()>&) { return surface::repair(*mesh); });
    return mesh;
}

// The getter of a property: a read-only view of the numbers that \p member names in the result.
template <class Member>
auto numbers(Member member) {
    return [member](const py::object& self) {
        const std::vector<double>& values = std::invoke(member, self.cast<const Traced&>());
        return view(values.data(), values.size(), 1, self);
    };
}

}  // namespace

void add_tracing(py::module_& module) {
    using namespace py::literals;
    py::class_<Traced>(module, "Flux",
                       R"(The flux on a mesh, relative to an open flat plane, where it is 1.

Its arrays are read-only views of its memory, not copies, and keep it alive.)")
        .def_property_readonly("flux", numbers([](const Traced& t) -> auto& { return t.triangle.flux; }),
                               "flux of each triangle")
        .def_property_readonly("flux_error",
                               numbers([](const Traced& t) -> auto& { return t.triangle.error; }),
                               "its standard error")
        .def_property_readonly("point_flux", numbers([](const Traced& t) -> auto& { return t.vertex.flux; }),
                               "flux at each point; the flux is linear between points")
        .def_property_readonly("point_flux_error",
                               numbers([](const Traced& t) -> auto& { return t.vertex.error; }),
                               "its standard error")
        .def_property_readonly("area", numbers(&Traced::area),
                               "area of each triangle, in the points' unit squared")
        .def_readonly("relative_error", &Traced::relative_error,
                      "sum(area * standard error) / sum(area * flux) over the points")
        .def_readonly("rays", &Traced::emitted, "number of particles that left the source")
        .def_readonly("absorbed", &Traced::absorbed, "number of particles that stuck to the surface")
        .def_readonly("escaped", &Traced::escaped, "number of particles that flew off")
        .def_readonly(
            "leaked", &Traced::leaked,
            "number of particles that passed through the surface, by rounding errors; 0 in practice")
        .def_readonly("segments", &Traced::segments, "number of straight paths between hits")
        .def_readonly("seconds", &Traced::seconds, "time of tracing, in s");

    module.def("flux", &trace, "points"_a, "triangles"_a, py::kw_only(), "sticking"_a = 1.0,
               "material"_a = py::none(), "source_exponent"_a = 1.0, "rays"_a = py::none(),
               "relative_error"_a = py::none(), "boundary"_a = py::none(), "seed"_a = 1, "method"_a = "auto",
               R"(Traces particles from a plane above the mesh until each of them sticks or is gone.

points and triangles have the shapes (n, 3) and (m, 3). z is up, and triangles are counter-clockwise seen from the gas;
mend() repairs meshes of other programs.

sticking: probability in [0, 1], or {material: probability}; particles that do not stick are re-emitted diffusely.
material: integer ids, one a triangle. source_exponent: n of the source's cos^n; 1 is a thermal gas.
rays: number of source rays (default: 1e6). relative_error: traces until it is reached, with rays as limit.
boundary: "reflective", "periodic", "open" or a pair for x and y; by default reflective if the surface ends on a
rectangle, else open, with a warning.
method: "monte-carlo" follows particles from the source; "radiosity" traces rays between points of the surface (default: 64
an unknown) and solves the balance of what they re-emit, which takes a fraction of the time in deep places at low
sticking; "auto" takes the method that costs less. With radiosity,
absorbed and escaped divide rays in the ratio of all particles.

Returns a Flux, the same bits for the same seed on any number of threads.
Raises GeometryError for a surface that cannot be traced, NumericsError if particles go through it.)");
    module.def("mend", &repaired, "points"_a, "triangles"_a,
               R"(Repairs a mesh of another program for flux(), where only one repair is possible.

Merges points of the same position, at open edges also within rounding errors; removes points without triangles,
repeated triangles and triangles with two corners in one point; turns triangles to face the source or outwards.
Triangles keep their order.

Returns a Mesh. Raises GeometryError for a one-sided surface.)");
}

}  // namespace sidewall::python
