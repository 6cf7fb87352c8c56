#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "surface/error.hpp"
#include "surface/files/locked_folder.hpp"

namespace sidewall::app {

namespace fs = std::filesystem;

/// Writes \p text to \p path through a temporary file that is synced, verified and renamed: a reader never
/// sees half a file, and the old one stays if anything fails. Missing folders are made.
/// \throws IoError naming the path and the system's reason.
void write_file(const fs::path& path, std::string_view text);

/// Makes a folder and those above it, where they are missing.
/// \throws IoError naming it and the system's reason; the message ends with \p advice.
void make_folder(const fs::path& folder, std::string_view advice);

/// \throws IoError if \p folder, which only the program writes to, is a link: files would land elsewhere.
void refuse_link(const fs::path& folder);

/// Whether a file or folder exists; false, too, where that cannot be known.
bool is_there(const fs::path& path);

/// The folder \p name, such as configs/chemistry, that came with the program: NAME or share/sidewall/NAME in
/// a folder above the library that holds this code or above the program. Empty if there is none.
fs::path shipped_folder(const std::string& name);

/// Thrown where another process holds a lock.
struct HeldElsewhere : IoError {
    using IoError::IoError;
};

/// An advisory lock that keeps other processes that ask for it from writing to a folder. The locked file,
/// DIR/.sidewall.lock, names its holder; the folder is held open, too (surface::LockedFolder). The file is
/// removed at the end. A killed process leaves it, but the system frees the lock. File systems without locks
/// are written to without one.
class FolderLock {
  public:
    /// \pre the folder exists.
    /// \param file  name of the locked file; locks on different files do not exclude each other.
    /// \throws HeldElsewhere naming the process that holds the folder; IoError with the system's reason, or
    ///         if the lock is a link, a device or a pipe.
    explicit FolderLock(const fs::path& folder, const char* file = kFile);
    ~FolderLock();
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

    static constexpr const char* kFile = ".sidewall.lock";

  private:
    surface::LockedFolder folder_;
    const char* name_;
    int file_ = -1;
};

/// The process that holds a folder's lock, e.g. "process 7 on host, since ..."; nothing if nobody does.
std::optional<std::string> lock_holder(const fs::path& folder);

}  // namespace sidewall::app
