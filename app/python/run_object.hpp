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

/// The wafer before a time step, or at the end. What it has been asked for once it keeps; the rest it can tell only until
/// the simulation goes on.
class TimeStep {
  public:
    TimeStep(std::shared_ptr<Simulation> simulation, const app::Moment& moment);

    double time, dt;
    std::string step;

    std::shared_ptr<TriangleMesh> surface();
    std::shared_ptr<TriangleMesh> traced();
    py::dict measures();
    py::dict fluxes();
    py::list layers();
    py::list profile(const std::string& plane);
    /// The simulation goes on.
    void pass() { moment_ = nullptr; }

  private:
    const app::Moment& moment(const char* asked) const;

    std::shared_ptr<Simulation> simulation_;  // whose recipe and, at the end, state it reads
    const app::Moment* moment_;
    std::shared_ptr<TriangleMesh> surface_;
    std::optional<py::dict> measures_;
};

/// A run in a thread of its own, which waits before every time step until it is asked for the next one.
class Simulation : public std::enable_shared_from_this<Simulation> {
  public:
    /// \param law     a callable that gives the speeds, or None.
    /// \param folder  kept until the run has ended: what \p options.output goes with, if anything.
    Simulation(std::shared_ptr<app::Recipe> recipe, app::RunOptions options, py::object law,
               py::object folder);
    ~Simulation() { close(); }  // NOLINT(bugprone-exception-escape): only if a mutex fails
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// \throws StopIteration after the end, and what the run throws.
    std::shared_ptr<TimeStep> next();
    /// Goes on with another recipe, from the time step that was told last.
    /// \throws RecipeError as require_revision.
    void revise(std::shared_ptr<app::Recipe> recipe);
    /// Ends the run where it is, with a checkpoint.
    void close();
    /// What summary.json holds, as text; empty before the end.
    const std::string& summary() const { return summary_; }
    const app::Recipe& recipe() const { return *recipe_; }

  private:
    void run();
    void observe(const app::Moment& moment);
    void resume_and_wait();

    std::shared_ptr<app::Recipe> recipe_;  // in force
    std::shared_ptr<const app::Recipe> began_with_;
    app::RunOptions options_;
    py::object law_, folder_;
    std::string summary_;
    std::weak_ptr<TimeStep> current_;

    std::atomic<bool> stop_ = false;
    std::mutex mutex_;
    std::condition_variable turn_;
    bool running_ = false, ended_ = false;        // it is the run's turn; it has returned
    const app::Moment* moment_ = nullptr;         // the run waits at
    std::shared_ptr<const app::Recipe> revised_;  // that it is to go on with
    std::optional<std::size_t> told_step_;        // whose time step it will tell of again
    std::exception_ptr error_;
    std::thread thread_;
};

}  // namespace sidewall::python
