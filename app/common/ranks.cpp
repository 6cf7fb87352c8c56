#include "app/common/ranks.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <optional>
#include <string>
#include <thread>

#include "app/common/interrupt.hpp"
#include "app/common/text.hpp"
#include "app/common/threads.hpp"
#include "app/common/timing.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kModule = "libsidewall_mpi.so";
constexpr int kInterrupted = 130;

// The functions of mpi/mpi.cpp.
struct Mpi {
    void (*join)(int*, int*) = nullptr;
    void (*sum)(std::uint64_t*, std::size_t) = nullptr;
    void (*abort)(int) = nullptr;
    void (*leave)() = nullptr;
};

std::optional<Mpi> mpi;
std::atomic<bool> stop_agreed = false;
double in_sums = 0.0;
int messages = STDERR_FILENO;  // where this rank's own error goes

std::uint32_t environment_number(const char* name, std::uint32_t otherwise) {
    const char* text = std::getenv(name);
    const auto value = text != nullptr ? finite_number(text) : std::nullopt;
    return value && *value >= 0.0 && *value < 1e9 ? static_cast<std::uint32_t>(*value) : otherwise;
}

Ranks read_ranks() {
    const std::uint32_t count = environment_number("OMPI_COMM_WORLD_SIZE", 1);
    if (count <= 1) return {};
    return {environment_number("OMPI_COMM_WORLD_RANK", 0), count,
            std::max<std::uint32_t>(1, environment_number("OMPI_COMM_WORLD_LOCAL_SIZE", 1))};
}

template <class Function>
void load(void* module, const char* name, Function& function) {
    function = reinterpret_cast<Function>(::dlsym(module, name));
    if (function == nullptr)
        throw RecipeError(fmt::format("{} does not fit this program: install both anew", kModule));
}

Mpi load_mpi() {
    void* module = ::dlopen(kModule, RTLD_NOW | RTLD_GLOBAL);
    if (module == nullptr)
        throw RecipeError(fmt::format(
            "mpirun has started {} processes, and this installation cannot join them ({}): build it where "
            "libopenmpi-dev is installed, or start one process",
            ranks().count, ::dlerror()));
    Mpi loaded;
    load(module, "sidewall_mpi_join", loaded.join);
    load(module, "sidewall_mpi_sum", loaded.sum);
    load(module, "sidewall_mpi_abort", loaded.abort);
    load(module, "sidewall_mpi_leave", loaded.leave);
    return loaded;
}

void sum(std::span<std::uint64_t> values) {
    const double start = now();
    mpi->sum(values.data(), values.size());
    std::uint64_t asked = interrupted() ? 1 : 0;
    mpi->sum(&asked, 1);
    if (asked > 0) stop_agreed = true;
    in_sums += now() - start;
}

}  // namespace

const Ranks& ranks() {
    static const Ranks ranks = read_ranks();
    return ranks;
}

void begin_rank() {
    if (ranks().count == 1) return;
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE"})
        ::unsetenv(name);
    const int cores = static_cast<int>(std::thread::hardware_concurrency() / ranks().on_this_machine);
    limit_threads(std::clamp(cores, 1, thread_count()));
    if (ranks().rank == 0) return;
    messages = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
}

flux::Shares join_ranks() {
    if (ranks().count == 1) return {};
    const Mpi loaded = load_mpi();
    int rank = 0, count = 1;
    loaded.join(&rank, &count);
    mpi = loaded;
    return {static_cast<std::uint32_t>(rank), static_cast<std::uint32_t>(count), sum};
}

bool any_rank_interrupted() {
    return stop_agreed;
}

double seconds_in_sums() {
    return in_sums;
}

void tell_failure(const char* text, int exit_code) {
    if (ranks().rank == 0) {
        std::fputs(text, stderr);
        return;
    }
    const timespec patience{.tv_sec = 2, .tv_nsec = 0};
    if (exit_code == kInterrupted || ::nanosleep(&patience, nullptr) != 0) return;  // mpirun ends this rank
    const std::string whole = fmt::format("rank {}: {}", ranks().rank, text);
    if (::write(messages, whole.data(), whole.size()) < 0) return;
}

int end_rank(int exit_code) {
    if (!mpi) return exit_code;
    std::fflush(stdout);
    if (exit_code != 0 && exit_code != kInterrupted) mpi->abort(exit_code);
    mpi->leave();
    return exit_code;
}

}  // namespace sidewall::app
