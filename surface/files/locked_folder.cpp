#include "surface/files/locked_folder.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <mutex>
#include <system_error>
#include <vector>

#include "surface/error.hpp"

namespace sidewall::surface {
namespace {

namespace fs = std::filesystem;

struct Held {
    fs::path folder;  // path as the caller gave it
    int file;
};

std::mutex held_mutex;
std::vector<Held> locked_folders;

// A file's folder in normal form, so that its spellings compare equal; symbolic links are not resolved.
fs::path folder_of(const fs::path& file) {
    return file.lexically_normal().parent_path();
}

bool still_named(const Held& held) {
    struct stat open {
    }, named{};
    return ::fstat(held.file, &open) == 0 && ::stat(held.folder.c_str(), &named) == 0 &&
           open.st_ino == named.st_ino && open.st_dev == named.st_dev;
}

}  // namespace

LockedFolder::LockedFolder(const fs::path& folder)
    : file_(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {
    if (file_ < 0)
        throw IoError("{}: cannot open the folder: {}; check permissions", folder.string(),
                      std::generic_category().message(errno));
    const std::lock_guard lock(held_mutex);
    locked_folders.push_back({folder, file_});
}

LockedFolder::~LockedFolder() {
    const std::lock_guard lock(held_mutex);
    std::erase_if(locked_folders, [&](const Held& held) { return held.file == file_; });
    ::close(file_);
}

FilePlace place_of(const fs::path& path) {
    const std::lock_guard lock(held_mutex);
    if (locked_folders.empty()) return {.name = path};
    const auto held = std::find_if(locked_folders.begin(), locked_folders.end(), [&](const Held& h) {
        return folder_of(h.folder / "x") == folder_of(path);
    });
    if (held == locked_folders.end()) return {.name = path};
    if (!still_named(*held))
        throw IoError(
            "{}: cannot write: its folder was removed, renamed or replaced meanwhile; leave it in place and start again",
            path.string());
    struct stat there {};
    if (::fstatat(held->file, path.filename().c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0 &&
        !S_ISREG(there.st_mode) && !S_ISDIR(there.st_mode))
        throw IoError("{}: cannot write: is a {}: remove it, or choose another folder", path.string(),
                      S_ISLNK(there.st_mode) ? "link, and links in a folder of results are not followed"
                                             : "device, a pipe or a socket, and no file");
    return {held->file, path.filename()};
}

}  // namespace sidewall::surface
