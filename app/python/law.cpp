#include "app/python/law.hpp"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "app/python/arrays.hpp"
#include "surface/error.hpp"

namespace sidewall::python {
namespace {

using app::SurfacePoint;

// An array of one value a point.
template <class T, class Value>
py::array_t<T> gathered(std::span<const SurfacePoint> points, Value&& value) {
    std::vector<T> values;
    values.reserve(points.size());
    for (const SurfacePoint& point : points) values.push_back(value(point));
    return owned(std::move(values));
}

py::array_t<double> normals_of(std::span<const SurfacePoint> points) {
    std::vector<double> values;
    values.reserve(3 * points.size());
    for (const SurfacePoint& point : points)
        values.insert(values.end(), point.normal.begin(), point.normal.end());
    return owned(std::move(values), 3);
}

py::array_t<bool> visibility(std::span<const SurfacePoint> points) {
    py::array_t<bool> values(static_cast<py::ssize_t>(points.size()));
    std::transform(points.begin(), points.end(), values.mutable_data(),
                   [](const SurfacePoint& point) { return point.visible; });
    return values;
}

// All that a speed law may use, as arrays.
// \param own  the model's own speeds.
py::object as_arrays(const app::Step& step, const app::Model& model, const app::Recipe& recipe,
                     std::span<const SurfacePoint> points, std::vector<double> own) {
    py::dict fluxes, coverages, materials;
    const std::vector<std::string> names = app::flux_names(model.species);
    for (std::size_t k = 0; k < names.size(); ++k)
        fluxes[names[k].c_str()] = gathered<double>(points, [k](const SurfacePoint& p) { return p.flux[k]; });
    for (std::size_t k = 0; k < model.coverages.names.size(); ++k)
        coverages[model.coverages.names[k].c_str()] =
            gathered<double>(points, [k](const SurfacePoint& p) { return p.coverage[k]; });
    for (std::size_t id = 0; id < recipe.materials.size(); ++id)
        materials[recipe.materials[id].name.c_str()] = id;
    using namespace py::literals;
    return py::module_::import("types").attr("SimpleNamespace")(
        "step"_a = step.name, "count"_a = points.size(), "fluxes"_a = fluxes, "coverages"_a = coverages,
        "material"_a = gathered<std::int32_t>(points, [](const SurfacePoint& p) { return p.material; }),
        "materials"_a = materials, "normals"_a = normals_of(points), "visible"_a = visibility(points),
        "speeds"_a = owned(std::move(own)));
}

}  // namespace

app::CallerLaw speeds_by(const py::object& law, const app::Recipe& recipe) {
    // A plain pointer, as the law is copied without the GIL; the simulation owns the callable and outlives
    // it.
    return [law = law.ptr(), &recipe](const app::Step& step, const app::Model& model,
                                      std::span<const SurfacePoint> points) {
        constexpr std::size_t kGrain = 2048;  // fewer points do not pay for waking a thread
        std::vector<double> own(points.size());
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, own.size(), kGrain), [&](const auto& range) {
            for (std::size_t n = range.begin(); n != range.end(); ++n) own[n] = model.speed(points[n]);
        });
        const py::gil_scoped_acquire acquired;
        const py::object answer = py::handle(law)(as_arrays(step, model, recipe, points, std::move(own)));
        const auto speeds = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(answer);
        if (!speeds || speeds.ndim() != 1 || static_cast<std::size_t>(speeds.shape(0)) != points.size()) {
            PyErr_Clear();
            throw RecipeError(
                fmt::format("step {}: the law for the speed must return an array of {} numbers, one a point",
                            step.name, points.size()));
        }
        return std::vector<double>(speeds.data(), speeds.data() + speeds.size());
    };
}

}  // namespace sidewall::python
