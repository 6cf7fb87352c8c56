// Linked with the program's main.cpp: the program on a disk that fills up, or killed, at a chosen operation
// on a file that it writes. SIDEWALL_FAULT="full N": from the N-th operation on, all but removing fail for
// want of space; "kill N": the N-th operation does not happen any more. "memory N": the N-th allocation
// fails.
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <sstream>
#include <string>
#include <string_view>

#include "surface/output_file.hpp"

namespace {

struct Fault {
    std::string kind;
    int operation = 0;
};

const Fault& fault() {
    static const Fault asked = [] {
        Fault f;
        if (const char* text = std::getenv("SIDEWALL_FAULT"))
            std::istringstream(text) >> f.kind >> f.operation;
        return f;
    }();
    return asked;
}

int strike(const char* operation, const std::filesystem::path&) {
    static std::atomic<int> count = 0;
    if (++count < fault().operation) return 0;
    if (fault().kind == "kill") std::raise(SIGKILL);
    return fault().kind == "full" && std::string_view(operation) != "remove" ? ENOSPC : 0;
}

// Allocations left until the one that fails; none does at 0 and below.
std::atomic<long long> allocations_left = 0;

bool may_allocate() {
    return allocations_left.load(std::memory_order_relaxed) <= 0 || allocations_left.fetch_sub(1) != 1;
}

[[maybe_unused]] const bool installed = [] {
    sidewall::surface::file_operation_hook = strike;
    if (fault().kind == "memory") allocations_left = fault().operation;
    return true;
}();

}  // namespace

// Those of arrays and the ones that do not throw call these; what they return is freed by free.
void* operator new(std::size_t size) {
    void* memory = may_allocate() ? std::malloc(size > 0 ? size : 1) : nullptr;
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

void* operator new(std::size_t size, std::align_val_t alignment) {
    const auto step = static_cast<std::size_t>(alignment);
    void* memory = may_allocate() ? std::aligned_alloc(step, (size + step - 1) / step * step) : nullptr;
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}
