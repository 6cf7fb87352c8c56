#pragma once
#include <filesystem>
#include <string>

namespace sidewall::app {

/// Memory that this process can still take.
struct FreeMemory {
    double bytes = 0.0;  ///< infinity where nothing is known
    std::string limit;   ///< what ends it, with its remedy, e.g. "free on this machine"
};

/// The least of what the machine has free, the address space that is left (ulimit -v) and what the control
/// groups of the process, versions 1 and 2, and those above them still allow, the cached files of a group counting
/// as free.
/// \param root  of the file systems /proc and /sys/fs/cgroup.
FreeMemory free_memory(const std::filesystem::path& root = "/");

/// \throws NumericsError if fewer than \p bytes of address space are left, which threads and libraries would
/// meet in ways of their own.
void require_address_space(double bytes);

}  // namespace sidewall::app
