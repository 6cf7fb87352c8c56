#include "app/python/run_object.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "app/devices/revolved.hpp"
#include "app/process/record/saved_meshes.hpp"
#include "app/process/revision.hpp"
#include "app/python/arrays.hpp"
#include "app/python/interruptible.hpp"
#include "app/recipe/effective_recipe.hpp"
#include "app/recipe/recipe_domain.hpp"
#include "app/results/metrology.hpp"
#include "levelset/meshes/contact_lines.hpp"
#include "surface/cut.hpp"

namespace sidewall::python {
namespace {

using app::SurfacePoint;

// An array with \p value of each point.
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
    std::ranges::transform(points, values.mutable_data(), &SurfacePoint::visible);
    return values;
}

// All that a speed law in Python may use, as arrays.
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

StepObject::StepObject(std::shared_ptr<Simulation> simulation, const app::Moment& moment)
    : time(moment.state.process_time()),
      dt(moment.dt),
      step(moment.step.name),
      simulation_(std::move(simulation)),
      moment_(&moment) {}

const app::Moment& StepObject::moment(const char* asked) const {
    if (moment_ == nullptr)
        throw RecipeError(
            "{} of the time step at {:g} {}: the simulation has gone on; ask before the next time step",
            asked, time, simulation_->recipe().domain.time_unit);
    return *moment_;
}

std::shared_ptr<TriangleMesh> StepObject::surface(std::optional<int> around) {
    if (around) {
        if (*around < 3 || !app::is_axial(simulation_->recipe().domain))
            throw RecipeError(
                "surface(around={}): must be at least 3, and the wafer round: domain.symmetry = \"axial\"",
                *around);
        return std::make_shared<TriangleMesh>(app::revolved(*surface({}), *around));
    }
    if (!surface_) {
        const app::Moment& m = moment("surface()");
        surface_ = std::make_shared<TriangleMesh>(
            app::result_mesh(m.model, m.state.stack, *m.surface,
                             levelset::extract_materials(m.state.stack, m.surface->raw).surface));
        app::widen_to_strip(simulation_->recipe(), *surface_);
    }
    return surface_;
}

std::shared_ptr<TriangleMesh> StepObject::traced() {
    const app::Moment& m = moment("traced()");
    if (!m.surface->arriving || !m.surface->arriving->trace) return nullptr;
    auto mesh = std::make_shared<TriangleMesh>(app::traced_mesh(m.model, *m.surface));
    app::widen_to_strip(simulation_->recipe(), *mesh);
    return mesh;
}

py::dict StepObject::measures() {
    if (!measures_) {
        const app::Moment& m = moment("measures");
        measures_.emplace();
        for (const app::Measure& measure : app::measure(simulation_->recipe(), m.state.stack, m.surface->raw))
            (*measures_)[measure.name.c_str()] = measure.value;
    }
    return *measures_;
}

py::dict StepObject::fluxes() {
    const std::shared_ptr<TriangleMesh> mesh = surface({});
    const py::object owner = py::cast(mesh);
    py::dict fluxes;
    const std::string prefix = "flux_";
    for (const Attribute& attribute : mesh->triangle_attributes)
        if (attribute.name.starts_with(prefix))
            fluxes[attribute.name.substr(prefix.size()).c_str()] =
                view(attribute.values.data(), attribute.values.size(), 1, owner);
    return fluxes;
}

py::list StepObject::layers() {
    const app::Moment& m = moment("layers()");
    levelset::StackMeshes meshes = levelset::extract_materials(m.state.stack, m.surface->raw);
    meshes.interfaces.push_back(std::move(meshes.surface.mesh));  // the top of the last layer
    py::list layers;
    for (std::size_t k = 0; k < m.state.stack.layers.size(); ++k) {
        const int id = m.state.stack.layers[k].material;
        auto mesh = std::make_shared<TriangleMesh>(app::interface_mesh(std::move(meshes.interfaces[k]), id));
        app::widen_to_strip(simulation_->recipe(), *mesh);
        layers.append(py::make_tuple(simulation_->recipe().materials[static_cast<std::size_t>(id)].name,
                                     std::move(mesh)));
    }
    return layers;
}

py::list StepObject::profile(const std::string& plane) {
    py::list lines;
    for (const surface::Polyline& line : surface::cut_by_plane(*surface({}), surface::parse_plane(plane))) {
        std::vector<double> points;
        for (const Vec3& point : line.points) points.insert(points.end(), point.begin(), point.end());
        if (line.closed) points.insert(points.end(), line.points[0].begin(), line.points[0].end());
        lines.append(owned(std::move(points), 3));
    }
    return lines;
}

Simulation::Simulation(std::shared_ptr<app::Recipe> recipe, app::RunOptions options, py::object law,
                       py::object folder)
    : options_(std::move(options)), law_(std::move(law)), folder_(std::move(folder)) {
    began_with_ = recipe_ = as_run(std::move(recipe));
    options_.quiet = true;
    options_.stop = [this] { return stop_.load(); };
    options_.observe = [this](const app::Moment& moment) { observe(moment); };
    if (!law_.is_none()) options_.speeds = speeds_by(law_, *began_with_);
}

// A law in Python may depend on y: a thin strip is then run as a surface in space, not as a profile.
std::shared_ptr<app::Recipe> Simulation::as_run(std::shared_ptr<app::Recipe> recipe) const {
    if (law_.is_none() || recipe->domain.strip != app::Strip::profile) return recipe;
    auto in_space = std::make_shared<app::Recipe>(*recipe);
    in_space->domain.strip = app::Strip::space;
    return in_space;
}

void Simulation::run() {
    std::exception_ptr error;
    try {
        app::run_recipe(*began_with_, options_);
    } catch (...) {
        error = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    error_ = std::move(error);  // moved: its Python objects must be released by the caller's thread
    moment_ = nullptr;
    running_ = false;
    ended_ = true;
    turn_.notify_all();
}

// Called in the run's thread before each time step and at the end: waits for next() or close(). Throws
// Revised after revise().
void Simulation::observe(const app::Moment& moment) {
    std::unique_lock lock(mutex_);
    if (std::exchange(revised_step_, std::nullopt) == moment.state.step && moment.summary == nullptr) return;
    moment_ = &moment;
    running_ = false;
    turn_.notify_all();
    turn_.wait(lock, [&] { return running_; });
    moment_ = nullptr;
    if (stop_ && moment.summary == nullptr) throw Interrupted("");
    if (!revised_) return;
    revised_step_ = moment.state.step;
    throw app::Revised{std::exchange(revised_, nullptr)};
}

void Simulation::revise(std::shared_ptr<app::Recipe> recipe) {
    recipe = as_run(std::move(recipe));
    if (!thread_.joinable()) {  // the run has not begun
        began_with_ = recipe_ = std::move(recipe);
        if (!law_.is_none()) options_.speeds = speeds_by(law_, *began_with_);
        return;
    }
    if (app::effective_recipe(*recipe) == app::effective_recipe(*recipe_)) return;
    if (moment_ == nullptr || moment_->summary != nullptr) {
        const auto duration = [](const app::Recipe& of) {
            return app::total_duration(app::expanded_steps(of));
        };
        if (duration(*recipe) == duration(*recipe_))
            return;  // changed in the loop's body at the end, where no time step is left
        throw RecipeError(
            "the simulation has ended: a longer recipe goes on from its folder with resume=True");
    }
    app::require_revision(*recipe, *recipe_, moment_->state);
    recipe_ = std::move(recipe);
    revised_ = recipe_;
}

void Simulation::resume_and_wait() {
    {
        const std::lock_guard lock(mutex_);
        running_ = true;
        if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
        turn_.notify_all();
    }
    await(
        [&](std::chrono::milliseconds time) {
            std::unique_lock lock(mutex_);
            return turn_.wait_for(lock, time, [&] { return !running_; });
        },
        stop_);
}

std::shared_ptr<StepObject> Simulation::next() {
    if (running_) throw RecipeError("the simulation is being asked for its next time step by another thread");
    if (ended_ || stop_ || !summary_.empty()) throw py::stop_iteration();
    if (const auto current = current_.lock()) current->pass();
    resume_and_wait();
    if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
    if (moment_ == nullptr) throw py::stop_iteration();
    if (moment_->summary != nullptr) summary_ = moment_->summary->dump();
    auto step = std::make_shared<StepObject>(shared_from_this(), *moment_);
    current_ = step;
    return step;
}

void Simulation::close() {
    if (const auto current = current_.lock()) current->pass();
    if (!thread_.joinable()) return;
    const py::gil_scoped_release released;
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
        running_ = true;
        turn_.notify_all();
    }
    thread_.join();
}

void add_simulation(py::module_& module) {
    py::class_<StepObject, std::shared_ptr<StepObject>>(
        module, "TimeStep",
        R"(The wafer before a time step, or at the run's end. Lengths, times and rates are in the recipe's units.

surface() and measures stay available once they were read; everything else only until the next one is requested.)")
        .def_readonly("time", &StepObject::time, "process time, in the recipe's unit")
        .def_readonly("dt", &StepObject::dt, "length of the time step that follows; 0 at the end")
        .def_readonly("step", &StepObject::step, "name of the recipe's step")
        .def_property_readonly(
            "measures", &StepObject::measures,
            "dict of the figures that [metrology] asks for, by name, angles in degree; nan where a figure does "
            "not exist")
        .def_property_readonly(
            "fluxes", &StepObject::fluxes,
            "dict of arrays by species, one value for each triangle of surface(); 1 on an open plane")
        .def(
            "surface", &StepObject::surface, py::arg("around") = py::none(),
            "The surface, a Mesh with triangle_data material, flux_*, coverage_* and rate. For a round wafer (domain.symmetry = "
            "\"axial\") it is a narrow strip along the profile, x being the radius, which flux() cannot trace; with around=64 it is "
            "the full round surface, with 64 sides.")
        .def(
            "traced", &StepObject::traced,
            "The mesh on which particles were traced, with its flux_* and flux_error_*; None if none were traced.")
        .def("layers", &StepObject::layers,
             "List of (material, Mesh) for every layer, bottom up; the mesh is the layer's upper boundary.")
        .def(
            "profile", &StepObject::profile, py::arg("plane") = "y=0",
            "Lines in which a plane such as \"y=0\" cuts the surface: a list of arrays (n, 3); a closed line repeats its first "
            "point.");

    py::class_<Simulation, std::shared_ptr<Simulation>>(module, "Run")
        .def(py::init([](std::shared_ptr<app::Recipe> recipe, const std::filesystem::path& output,
                         bool resume, bool overwrite, py::object law, py::object folder) {
                 return std::make_shared<Simulation>(
                     std::move(recipe),
                     app::RunOptions{.output = output, .resume = resume, .overwrite = overwrite},
                     std::move(law), std::move(folder));
             }),
             py::arg("recipe"), py::arg("output"), py::arg("resume"), py::arg("overwrite"), py::arg("law"),
             py::arg("folder"))
        .def("next", &Simulation::next)
        .def("revise", &Simulation::revise)
        .def("close", &Simulation::close)
        .def_property_readonly("summary", &Simulation::summary);
}

app::CallerLaw speeds_by(const py::object& law, const app::Recipe& recipe) {
    // A plain pointer, because the law is copied without the GIL. The simulation owns the callable and
    // outlives the law.
    return [law = law.ptr(), &recipe](const app::Step& step, const app::Model& model,
                                      std::span<const SurfacePoint> points) {
        constexpr std::size_t kGrain = 2048;  // points; with fewer, waking a thread costs more than it saves
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
                "step {}: the law for the speed must return an array of {} numbers, one a point", step.name,
                points.size());
        }
        return std::vector<double>(speeds.data(), speeds.data() + speeds.size());
    };
}

}  // namespace sidewall::python
