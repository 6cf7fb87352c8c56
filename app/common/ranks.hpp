#pragma once
#include <cstdint>

#include "flux/shares.hpp"

// Processes that `mpirun -n N sidewall ...` has started together. Rank 0 speaks and writes for all of them.
namespace sidewall::app {

/// The place of this process among those that mpirun has started.
struct Ranks {
    std::uint32_t rank = 0, count = 1;
    std::uint32_t on_this_machine = 1;
};

/// The rank and the number of processes that mpirun gave in the environment when the program began.
const Ranks& ranks();

/// At the start of the program: ranks but the first fall silent, and each takes its part of the machine's cores as its
/// threads; children of this process will be alone.
void begin_rank();

/// Joins the other ranks by MPI, until end_rank.
/// \returns how they share traces; its sums also agree on what any_rank_interrupted says. One process alone: its own.
/// \throws RecipeError if this installation has no MPI.
flux::Shares join_ranks();

/// Whether a signal had asked any rank to stop by the last sum: the same on all ranks.
bool any_rank_interrupted();

/// Seconds that this rank has spent in sums, waiting for others included.
double seconds_in_sums();

/// Writes the error that ends the program to standard error. A rank other than the first leaves that to the first, which mostly
/// meets the same error, and speaks if it is still alive two seconds later.
/// \param exit_code  that the program will end with; an interruption all ranks agree on.
void tell_failure(const char* text, int exit_code);

/// At the end of the program, which ends with \p exit_code; if that is an error which other ranks may not have met,
/// all of them end here.
/// \returns \p exit_code.
int end_rank(int exit_code);

}  // namespace sidewall::app
