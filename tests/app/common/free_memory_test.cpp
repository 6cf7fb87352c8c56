#include "app/common/free_memory.hpp"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/folder.hpp"

using namespace sidewall;

namespace {

namespace fs = std::filesystem;

void put(const fs::path& path, const std::string& text) {
    fs::create_directories(path.parent_path());
    std::ofstream(path) << text;
}

}  // namespace

TEST_CASE("free memory is the least of the machine's and of all control groups'") {
    const test::Folder folder;
    const fs::path root = folder.path, groups = root / "sys/fs/cgroup";
    put(root / "proc/meminfo", "MemTotal: 9000 kB\nMemAvailable: 4000 kB\n");
    CHECK(app::free_memory(root).bytes == 4000.0 * 1024.0);
    CHECK(app::free_memory(root).limit.find("machine") != std::string::npos);

    // Cgroup version 2: the group sets no limit, but its parent does; cached files count as free.
    put(root / "proc/self/cgroup", "0::/user/me\n");
    put(groups / "user/me/memory.max", "max\n");
    put(groups / "user/memory.max", "3000000\n");
    put(groups / "user/memory.current", "2000000\n");
    put(groups / "user/memory.stat", "anon 1\ninactive_file 500000\n");
    CHECK(app::free_memory(root).bytes == 1.5e6);
    CHECK(app::free_memory(root).limit.find("control group") != std::string::npos);

    // Cgroup version 1 in a container: the path is that of the host, and the limit lies at the mount point.
    put(root / "proc/self/cgroup", "7:cpu:/\n4:memory:/docker/0123\n0::/\n");
    put(groups / "memory/memory.limit_in_bytes", "1000000\n");
    put(groups / "memory/memory.usage_in_bytes", "900000\n");
    CHECK(app::free_memory(root).bytes == 1e5);
    put(groups / "memory/memory.usage_in_bytes", "1100000\n");
    CHECK(app::free_memory(root).bytes == 0.0);
}
