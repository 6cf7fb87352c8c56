// Replaces the C library's functions that change files by ones that can fail (tests/faults/copies.hpp), and
// C++ allocation: SIDEWALL_FAULT="memory N" refuses the N-th allocation of the main thread. The replacements
// also serve the shared libraries.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <new>

#include "tests/faults/copies.hpp"

namespace {

// The number of the allocation that fails; 0: none fails.
long allocations_left() {
    const char* fault = std::getenv("SIDEWALL_FAULT");
    long n = 0;
    return fault != nullptr && std::sscanf(fault, "memory %ld", &n) == 1 ? n : 0;
}

bool no_memory() {
    static long left = allocations_left();
    return left > 0 && ::gettid() == ::getpid() && --left == 0;
}

bool no_file(const char* what, int error) {
    if (!sidewall::faults::fails_here(what)) return false;
    errno = error;
    return true;
}

// The library function that a function of this file replaces.
template <class Function>
Function* hidden(Function*, const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

// Not inlined: a compiler that sees malloc behind new, but not free behind delete, warns of a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
    void* memory = no_memory() ? nullptr : std::malloc(size);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

[[gnu::noinline]] void operator delete(void* memory) noexcept {
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}

extern "C" {

ssize_t write(int file, const void* bytes, std::size_t size) {
    static const auto real = hidden(&write, "write");
    return file > 2 && no_file("write", ENOSPC) ? -1 : real(file, bytes, size);
}

ssize_t pwrite(int file, const void* bytes, std::size_t size, off_t place) {
    static const auto real = hidden(&pwrite, "pwrite");
    return no_file("pwrite", ENOSPC) ? -1 : real(file, bytes, size, place);
}

ssize_t pread(int file, void* bytes, std::size_t size, off_t place) {
    static const auto real = hidden(&pread, "pread");
    return no_file("pread", EIO) ? -1 : real(file, bytes, size, place);
}

int open(const char* path, int flags, ...) {
    static const auto real = hidden(&open, "open");
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return no_file("open", flags & O_CREAT ? ENOSPC : EMFILE) ? -1 : real(path, flags, mode);
}

int openat(int folder, const char* path, int flags, ...) {
    static const auto real = hidden(&openat, "openat");
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = flags & O_CREAT ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return no_file("openat", flags & O_CREAT ? ENOSPC : EMFILE) ? -1 : real(folder, path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
    static const auto real = hidden(&fopen, "fopen");
    return no_file("fopen", EMFILE) ? nullptr : real(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
    static const auto real = hidden(&fopen64, "fopen64");
    return no_file("fopen64", EMFILE) ? nullptr : real(path, mode);
}

// Skips the real sync: the test's files need not survive a power loss, and syncing takes disk time.
int fsync(int) {
    return no_file("fsync", EIO) ? -1 : 0;
}

int close(int file) {
    static const auto real = hidden(&close, "close");
    // Like the kernel's close, it closes the file even where it returns an error.
    const int result = real(file);
    return no_file("close", EIO) ? -1 : result;
}

int rename(const char* from, const char* to) noexcept {
    static const auto real = hidden(&rename, "rename");
    return no_file("rename", ENOSPC) ? -1 : real(from, to);
}

int renameat(int from_folder, const char* from, int to_folder, const char* to) noexcept {
    static const auto real = hidden(&renameat, "renameat");
    return no_file("renameat", ENOSPC) ? -1 : real(from_folder, from, to_folder, to);
}

int mkdir(const char* path, mode_t mode) noexcept {
    static const auto real = hidden(&mkdir, "mkdir");
    return no_file("mkdir", ENOSPC) ? -1 : real(path, mode);
}

int ftruncate(int file, off_t size) noexcept {
    static const auto real = hidden(&ftruncate, "ftruncate");
    return no_file("ftruncate", EIO) ? -1 : real(file, size);
}

int unlink(const char* path) noexcept {
    static const auto real = hidden(&unlink, "unlink");
    return no_file("unlink", EACCES) ? -1 : real(path);
}

int unlinkat(int folder, const char* path, int flags) noexcept {
    static const auto real = hidden(&unlinkat, "unlinkat");
    return no_file("unlinkat", EACCES) ? -1 : real(folder, path, flags);
}

int flock(int file, int operation) noexcept {
    static const auto real = hidden(&flock, "flock");
    return no_file("flock", ENOLCK) ? -1 : real(file, operation);
}
}
