#include "app/common/files.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <thread>

#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

std::string this_process() {
    std::array<char, 256> host{};
    if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
    return fmt::format("process {} on {}, since {:%Y-%m-%d %H:%M:%S}", ::getpid(),
                       host[0] != '\0' ? host.data() : "this machine", fmt::localtime(std::time(nullptr)));
}

// The text that the lock's holder wrote about itself, which it may not have written yet.
std::string holder(int file) {
    std::array<char, 512> text{};
    const auto size = ::pread(file, text.data(), text.size(), 0);
    return size > 0 ? std::string(text.data(), static_cast<std::size_t>(size)) : "another process";
}

// Whether the open file is still in the folder: its holder may have removed it before it was locked here.
bool still_there(int file, int folder, const char* name) {
    struct stat opened {
    }, named{};
    return ::fstat(file, &opened) == 0 && ::fstatat(folder, name, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

}  // namespace

void write_file(const fs::path& path, std::string_view text) {
    surface::write_whole_file(path, text);
}

void make_folder(const fs::path& folder, std::string_view advice) {
    std::error_code failure;
    fs::create_directories(folder, failure);
    if (failure)
        throw IoError("{}: cannot make the folder: {}; {}", folder.string(), failure.message(), advice);
}

void refuse_link(const fs::path& folder) {
    std::error_code failure;
    if (fs::is_symlink(folder, failure))
        throw IoError(
            "{}: is a link, where a folder of the program's own belongs: remove it, or choose "
            "another folder with -o",
            folder.string());
}

bool is_there(const fs::path& path) {
    std::error_code failure;
    return fs::exists(path, failure);
}

fs::path shipped_folder(const std::string& name) {
    std::error_code failure;
    Dl_info library{};  // Python module or program; the name of the latter need not be a path
    dladdr(reinterpret_cast<const void*>(&shipped_folder), &library);
    const fs::path code = library.dli_fname == nullptr ? "" : library.dli_fname;
    for (const fs::path& file : {code.is_absolute() ? fs::canonical(code, failure) : fs::path(),
                                 fs::read_symlink("/proc/self/exe", failure)})
        for (fs::path above = file.parent_path(); above.has_relative_path(); above = above.parent_path())
            for (const fs::path& below : {fs::path("share/sidewall") / name, fs::path(name)})
                if (is_there(above / below)) return above / below;
    return {};
}

FolderLock::FolderLock(const fs::path& folder, const char* file) : folder_(folder), name_(file) {
    constexpr int kMostTries = 100;  // some network file systems give a file another inode number each time
    constexpr int kAsked = 12;  // tries while held: lock_holder takes the lock briefly, maybe on many ranks
    for (int tries = 0;; ++tries) {
        surface::place_of(folder / name_);  // throws if it is a link or a pipe
        constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
        const int in = folder_.descriptor();
        file_ = ::openat(in, name_, O_RDWR | O_CREAT | kFlags, 0666);
        // A killed run of another user may have left a file that this user may only read and lock.
        if (file_ < 0 && errno == EACCES) {
            file_ = ::openat(in, name_, O_RDONLY | kFlags);
            errno = EACCES;  // the reason to report if that fails, too
        }
        if (file_ < 0)
            throw IoError("{}: cannot write: {}; check space and permissions", (folder / name_).string(),
                          std::strerror(errno));
        const bool locked = ::flock(file_, LOCK_EX | LOCK_NB) == 0;
        if (!locked && errno == EWOULDBLOCK) {
            const std::string who = holder(file_);
            ::close(file_);
            if (tries < kAsked) {
                std::this_thread::sleep_for(std::chrono::milliseconds(5 * (tries + 1)));
                continue;
            }
            throw HeldElsewhere(
                "{}: {} is writing there: wait for it, stop it, or choose another folder with -o",
                folder.string(), who);
        }
        if (!locked || still_there(file_, in, name_) || tries >= kMostTries) break;
        ::close(file_);
    }
    const std::string text = this_process();
    // If this fails, only messages lack the holder's name.
    if (::ftruncate(file_, 0) != 0 || ::pwrite(file_, text.data(), text.size(), 0) < 0) return;
}

FolderLock::~FolderLock() {
    ::unlinkat(folder_.descriptor(), name_, 0);
    ::close(file_);
}

std::optional<std::string> lock_holder(const fs::path& folder) {
    const int file =
        ::open((folder / FolderLock::kFile).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (file < 0) return std::nullopt;
    std::optional<std::string> who;
    if (::flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK) who = holder(file);
    ::close(file);
    return who;
}

}  // namespace sidewall::app
