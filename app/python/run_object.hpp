#pragma once
#include <pybind11/numpy.h>

#include <atomic>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/process/simulation.hpp"

namespace sidewall::python {

namespace py = pybind11;

class Simulation;

/// Python's TimeStep: the wafer before a time step, or at the end. It keeps what was asked of it; anything else is
/// available only until the simulation goes on.
class StepObject {
  public:
    StepObject(std::shared_ptr<Simulation> simulation, const app::Moment& moment);

    double time, dt;
    std::string step;

    std::shared_ptr<TriangleMesh> surface(std::optional<int> around);
    std::shared_ptr<TriangleMesh> traced();
    py::dict measures();
    py::dict fluxes();
    py::list layers();
    py::list profile(const std::string& plane);
    /// Detaches it from the wafer, as the simulation goes on.
    void pass() { moment_ = nullptr; }

  private:
    const app::Moment& moment(const char* asked) const;

    std::shared_ptr<Simulation> simulation_;  // owns the recipe and, at the end, the state
    const app::Moment* moment_;
    std::shared_ptr<TriangleMesh> surface_;
    std::optional<py::dict> measures_;
};

/// Python's Simulation: a run in a thread of its own that waits before every time step until the next one is asked for.
class Simulation : public std::enable_shared_from_this<Simulation> {
  public:
    /// \param law     a callable that gives the speeds, or None.
    /// \param folder  owner of a temporary \p options.output, or None; kept until the run has ended.
    Simulation(std::shared_ptr<app::Recipe> recipe, app::RunOptions options, py::object law,
               py::object folder);
    ~Simulation() { close(); }  // NOLINT(bugprone-exception-escape): only if a mutex fails
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// Goes on to the next time step.
    /// \throws StopIteration after the end, and what the run throws.
    std::shared_ptr<StepObject> next();
    /// Replaces the recipe from the current time step on.
    /// \throws RecipeError as require_revision.
    void revise(std::shared_ptr<app::Recipe> recipe);
    /// Stops the run with a checkpoint.
    void close();
    /// The text of summary.json; empty before the end.
    const std::string& summary() const { return summary_; }
    const app::Recipe& recipe() const { return *recipe_; }

  private:
    void run();
    void observe(const app::Moment& moment);
    void resume_and_wait();
    std::shared_ptr<app::Recipe> as_run(std::shared_ptr<app::Recipe> recipe) const;

    std::shared_ptr<app::Recipe> recipe_;  // in force
    std::shared_ptr<const app::Recipe> began_with_;
    app::RunOptions options_;
    py::object law_, folder_;
    std::string summary_;
    std::weak_ptr<StepObject> current_;

    std::atomic<bool> stop_ = false;
    std::mutex mutex_;
    std::condition_variable turn_;
    bool running_ = false, ended_ = false;        // the run has its turn; it has returned
    const app::Moment* moment_ = nullptr;         // at which the run waits
    std::shared_ptr<const app::Recipe> revised_;  // the next recipe
    std::optional<std::size_t> revised_step_;     // whose time step is made anew
    std::exception_ptr error_;
    std::thread thread_;
};

/// A speed law that calls a Python function, with arrays of all points at once (Points in sidewall/__init__.pyi), for
/// as many speeds.
/// \pre law and recipe outlive it.
app::CallerLaw speeds_by(const pybind11::object& law, const app::Recipe& recipe);

}  // namespace sidewall::python
