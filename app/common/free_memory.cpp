#include "app/common/free_memory.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>

#include "surface/error.hpp"
#include "surface/infinity.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

// The number at the start of a file, or after \p word; none where it says "max".
std::optional<double> number_in(const fs::path& file, const std::string& word = "") {
    std::ifstream in(file);
    double value = 0.0;
    for (std::string read; !word.empty() && read != word && in >> read;) {
    }
    return in >> value ? std::optional(value) : std::nullopt;
}

// Bytes left in a control group; infinity if it sets no limit.
// Cached files count as free: the kernel drops them first.
double left_in_group(const fs::path& group, const char* limit, const char* usage, const std::string& prefix) {
    const auto most = number_in(group / limit);
    if (!most) return kInfinity;
    const double used = number_in(group / usage).value_or(0.0);
    double files = 0.0;
    for (const char* kind : {"inactive_file", "active_file"})
        files += number_in(group / "memory.stat", prefix + kind).value_or(0.0);
    return std::max(0.0, *most - std::max(0.0, used - files));
}

// Bytes left in a group and its parents, the least of them, up to where the hierarchy is mounted. In a
// container the path may be the host's; the group mounted there is then the container's.
double left_in_groups(const fs::path& mount, fs::path group, const char* limit, const char* usage,
                      const std::string& prefix) {
    double left = kInfinity;
    for (group = group.relative_path();; group = group.parent_path()) {
        left = std::min(left, left_in_group(mount / group, limit, usage, prefix));
        if (group.empty()) return left;
    }
}

// /proc/self/cgroup has a line ID:CONTROLLERS:PATH a hierarchy; version 2 has ID 0 and no controllers.
double left_in_all_groups(const fs::path& root) {
    double left = kInfinity;
    std::ifstream in(root / "proc/self/cgroup");
    for (std::string line; std::getline(in, line);) {
        const std::size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = fmt::format(",{},", line.substr(first + 1, second - first - 1));
        const fs::path path = line.substr(second + 1), mount = root / "sys/fs/cgroup";
        if (controllers == ",,")
            left = std::min(left, left_in_groups(mount, path, "memory.max", "memory.current", ""));
        if (controllers.find(",memory,") != std::string::npos)
            left = std::min(left, left_in_groups(mount / "memory", path, "memory.limit_in_bytes",
                                                 "memory.usage_in_bytes", "total_"));
    }
    return left;
}

double left_of_address_space() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kInfinity;
    const double pages = number_in("/proc/self/statm").value_or(0.0);  // virtual memory in use
    return std::max(0.0,
                    static_cast<double>(limit.rlim_cur) - pages * static_cast<double>(sysconf(_SC_PAGESIZE)));
}

}  // namespace

FreeMemory free_memory(const fs::path& root) {
    FreeMemory least{1024.0 * number_in(root / "proc/meminfo", "MemAvailable:").value_or(kInfinity),
                     "free on this machine"};
    const auto consider = [&](double bytes, const char* limit) {
        if (bytes < least.bytes) least = {bytes, limit};
    };
    consider(left_of_address_space(), "left of the address space that ulimit -v allows");
    consider(left_in_all_groups(root), "left of the memory that the process's control group allows");
    return least;
}

void require_address_space(double bytes) {
    if (const double left = left_of_address_space(); left < bytes)
        throw NumericsError(
            "out of memory: {:.0f} MB are left of the address space that ulimit -v "
            "allows, and {:.0f} MB are needed to begin: raise it, or use fewer --threads",
            1e-6 * left, 1e-6 * bytes);
}

}  // namespace sidewall::app
