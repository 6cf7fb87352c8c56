#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "app/common/console.hpp"
#include "app/common/json.hpp"
#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// One of many runs.
struct SetRun {
    std::string recipe;   ///< effective, as DIR/runs/NNNN/recipe.toml holds it
    double memory = 0.0;  ///< bytes that it will need, estimated
    bool ended = false;
    std::string status;  ///< of one that ended: "ok", or why it failed
    Json summary;        ///< of one that ended well
};

/// The runs of a sweep or a fit: DIR/runs/NNNN, one for each recipe, made side by side by this program itself.
struct RunSet {
    std::filesystem::path folder;                ///< DIR
    std::size_t jobs = 0;                        ///< at the same time; 0: as many as there are threads
    std::string resume_command;                  ///< what an interrupted user goes on with
    bool needs_all = false;                      ///< a run that cannot write its files ends all, as in a fit
    std::vector<SetRun> runs;                    ///< number 1 first
    std::map<std::string, std::size_t> numbers;  ///< by effective recipe
};

/// The number, from 1, of the run of a recipe: that of an equal one, if there is one. Nothing is written.
std::size_t add_run(RunSet& set, const Recipe& recipe);

/// Adds the runs that DIR/runs holds beyond those of the set, by their numbers there: a search that asks for them in
/// another order finds them again. Before any other run is added.
/// \throws RecipeError, FileError for a recipe there that cannot be read.
void adopt_runs(RunSet& set);

/// DIR/runs/NNNN.
std::filesystem::path folder_of(const RunSet& set, std::size_t number);

/// The arguments of the command that makes a run; goes on from what is in its folder.
std::vector<std::string> run_arguments(const RunSet& set, std::size_t number);

/// Writes DIR/runs/NNNN/recipe.toml, if it is not there.
void write_run_recipe(const RunSet& set, std::size_t number);

/// Makes the runs that have not ended, several at once: no more than jobs, and no more than the free
/// memory holds. A run whose folder holds its result is read; one that was begun goes on from its checkpoint;
/// one that another process still writes is waited for. A run that fails stops no other, but see needs_all. Ranks of mpirun that
/// help_with_runs take runs, too, one at a time for each of their jobs; a run whose rank dies is made by another.
/// \param progress  counts all runs of the set that have ended.
/// \param ended     called in this thread with the number of each that has ended; with 0 first, for those that had before.
/// \throws Interrupted after all runs have stopped at their checkpoints; IoError, then, too, if needs_all asks for it.
void make_runs(RunSet& set, const std::vector<std::size_t>& numbers, ProgressBar& progress,
               const std::function<void(std::size_t number)>& ended);

/// The part of a rank of `mpirun -n N sidewall sweep|fit` other than the first: makes runs that DIR/runs holds and that
/// nobody makes, until the process that gathers them, which holds DIR, has ended. None of it needs MPI; the ranks share
/// a file system with locks.
/// \param jobs  as in RunSet, of this rank.
/// \throws Interrupted, IoError as make_runs.
void help_with_runs(const std::filesystem::path& folder, std::size_t jobs);

/// Reads the runs whose folder holds their result, and counts them.
/// \throws RecipeError if it is another recipe's.
std::size_t read_ended(RunSet& set);

/// Finds that DIR is empty of results, or may be gone on with; removes what a killed program left half written.
/// \pre no other process writes there.
/// \param file    in DIR, e.g. sweep.json, with the digest of what made it.
/// \param what    is made there, e.g. "sweep".
/// \param plan    what \p file is to hold: "version" and "digest" among the rest.
/// \throws RecipeError if DIR holds another sweep or fit, a run, or this one and \p resume does not ask for it.
void open_batch_folder(const std::filesystem::path& folder, const std::string& file, const std::string& what,
                       const Json& plan, bool resume);

}  // namespace sidewall::app
