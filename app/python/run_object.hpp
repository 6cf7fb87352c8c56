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

/// Python's TimeStep: the wafer before a time step, or at the end. Surface and measures stay available once
/// read; everything else is available only until next() is called.
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
    /// Detaches this object from the wafer, before the simulation continues.
    void pass() { moment_ = nullptr; }

  private:
    const app::Moment& moment(const char* asked) const;

    std::shared_ptr<Simulation> simulation_;  // owns the recipe and, at the end, the state
    const app::Moment* moment_;
    std::shared_ptr<TriangleMesh> surface_;
    std::optional<py::dict> measures_;
};

/// Python's Simulation: a run in another thread that waits before every time step until next() is called.
class Simulation : public std::enable_shared_from_this<Simulation> {
  public:
    /// \param law     a callable that gives the speeds, or None.
    /// \param folder  owner of a temporary \p options.output, or None; kept until the run has ended.
    Simulation(std::shared_ptr<app::Recipe> recipe, app::RunOptions options, py::object law,
               py::object folder);
    ~Simulation() { close(); }  // NOLINT(bugprone-exception-escape): only if a mutex fails
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// Continues the run until it waits before the next time step, or at its end.
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

    std::shared_ptr<app::Recipe> recipe_;  // includes all revisions
    std::shared_ptr<const app::Recipe> began_with_;
    app::RunOptions options_;
    py::object law_, folder_;
    std::string summary_;
    std::weak_ptr<StepObject> current_;

    std::atomic<bool> stop_ = false;
    std::mutex mutex_;
    std::condition_variable turn_;
    bool running_ = false, ended_ = false;  // the run's thread works, the caller waits; run() has returned
    const app::Moment* moment_ = nullptr;   // where the run waits; null: it does not
    std::shared_ptr<const app::Recipe> revised_;  // set by revise(), taken by observe()
    std::optional<std::size_t> revised_step_;     // time step that is repeated: not observed again
    std::exception_ptr error_;
    std::thread thread_;
};

/// A speed law that calls a Python function with arrays of all points (Points in sidewall/__init__.pyi) and
/// gets an array of their speeds.
/// \pre law and recipe outlive the returned law.
app::CallerLaw speeds_by(const pybind11::object& law, const app::Recipe& recipe);

}  // namespace sidewall::python
