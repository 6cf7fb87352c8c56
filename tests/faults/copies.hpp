#pragma once

// A program that sees each of its calls to the system fail, one at a time: it forks at the call, the copy
// sees the failure and runs to its end in a copy of the working folder, and the original goes on as if
// nothing had been.
namespace sidewall::faults {

/// Begins what SIDEWALL_FAULT asks for by "each", if it does.
void begin_survey();

/// Whether the call at hand is to fail: in a copy of the program, made for this call unless one was made before
/// for the same chain of callers.
/// \param what  the call's name, for the report.
bool fails_here(const char* what);

}  // namespace sidewall::faults
