#pragma once

// Lets each system call of a program fail, one at a time. At the call the program forks: the copy sees the
// failure and runs to its end in a copy of the working folder; the original continues with the call intact.
namespace sidewall::faults {

/// Begins the survey if SIDEWALL_FAULT asks for it by "each DEPTH".
void begin_survey();

/// Whether the current call must fail: true only in the copy that is forked here, once for each chain of
/// callers.
/// \param what  the call's name, for the report.
bool fails_here(const char* what);

}  // namespace sidewall::faults
