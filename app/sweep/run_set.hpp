#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "app/common/console.hpp"
#include "app/common/json.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// One run of a set.
struct SetRun {
    std::string recipe;   ///< effective, as DIR/runs/NNNN/recipe.toml holds it
    double memory = 0.0;  ///< bytes that it will need, estimated
    bool ended = false;
    std::string status;  ///< of an ended run: "ok", or why it failed
    Json summary;        ///< of a run that ended well
};

/// The runs of a sweep or a fit, one a recipe, in DIR/runs/NNNN. Child processes of this program make them.
struct RunSet {
    std::filesystem::path folder;  ///< DIR
    std::size_t jobs = 0;          ///< runs at the same time; 0: as many as there are threads
    std::string resume_command;    ///< command that resumes the set, for messages
    bool needs_all = false;        ///< a run that cannot write its files ends all runs, as in a fit
    std::vector<SetRun> runs;      ///< number 1 first
    std::map<std::string, std::size_t> numbers;  ///< by effective recipe
};

/// Adds the run of a recipe, unless the set has a run of an equal one. Writes nothing.
/// \returns the number of the run, from 1.
std::size_t add_run(RunSet& set, const Recipe& recipe);

/// Adds the runs that DIR/runs holds beyond those of the set, with their numbers there, so that a search that
/// asks for them in another order finds them. To be called before other runs are added.
/// \throws RecipeError, FileError for a recipe there that cannot be read.
void adopt_runs(RunSet& set);

/// DIR/runs/NNNN.
std::filesystem::path folder_of(const RunSet& set, std::size_t number);

/// The arguments of the command that makes a run, or resumes one that its folder holds.
std::vector<std::string> run_arguments(const RunSet& set, std::size_t number);

/// Writes DIR/runs/NNNN/recipe.toml, if it is not there.
void write_run_recipe(const RunSet& set, std::size_t number);

/// Makes runs that have not ended, several at once: at most `jobs`, and as many as the free memory holds. A
/// run whose folder holds its result is read; a begun one resumes from its checkpoint; one that another
/// process is writing is waited for. A failed run does not stop the others, unless needs_all is set. Ranks of
/// mpirun in help_with_runs() take runs, too, one for each job; if such a rank dies, another makes its run.
/// \param progress  counts all runs of the set that have ended.
/// \param ended     called in this thread with 0 at the start, then with the number of each run that ends.
/// \throws Interrupted, or IoError if needs_all is set, after all runs have stopped at their checkpoints.
void make_runs(RunSet& set, const std::vector<std::size_t>& numbers, ProgressBar& progress,
               const std::function<void(std::size_t number)>& ended);

/// The work of a rank of `mpirun -n N sidewall sweep|fit` other than the first: makes runs of DIR/runs that
/// no other process makes, until the first rank, which locks DIR, has ended. It uses file locks, no MPI.
/// \param jobs  as in RunSet, of this rank.
/// \throws Interrupted, IoError as make_runs.
void help_with_runs(const std::filesystem::path& folder, std::size_t jobs);

/// Reads the runs whose folder holds their result, and counts them.
/// \throws RecipeError if a folder holds another recipe.
std::size_t read_ended(RunSet& set);

/// Digests of the files that a set's recipes read, by path: its plan's entry "files".
/// \throws FileError if one cannot be read.
Json files_of_plan(const std::set<std::string>& paths);

/// Checks that DIR holds no results, or those of the same plan to resume; removes half-written files.
/// \pre no other process writes there.
/// \param file    the plan's file in DIR, e.g. sweep.json.
/// \param what    the plan's name for messages, e.g. "sweep".
/// \param plan    that \p file is to hold, with "version" and a "digest" of what the results depend on.
/// \throws RecipeError if DIR holds another sweep or fit, a run, or this one without \p resume.
void open_batch_folder(const std::filesystem::path& folder, const std::string& file, const std::string& what,
                       const Json& plan, bool resume);

}  // namespace sidewall::app
