#pragma once
#include <filesystem>
#include <string>

namespace sidewall::app {

/// Memory that this process can still take.
struct FreeMemory {
    double bytes = 0.0;  ///< infinity where nothing is known
    std::string limit;   ///< what sets this bound, e.g. "free on this machine"
};

/// The least of the machine's free memory, the address space left (ulimit -v) and what the control groups of
/// the process, versions 1 and 2, and their parents still allow. A group's cached files count as free.
/// \param root  folder in which proc and sys/fs/cgroup are mounted.
FreeMemory free_memory(const std::filesystem::path& root = "/");

/// Checks that \p bytes of address space are left; without them threads and libraries fail in unclear ways.
/// \throws NumericsError if there are fewer.
void require_address_space(double bytes);

}  // namespace sidewall::app
