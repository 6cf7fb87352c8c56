#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "surface/error.hpp"
#include "surface/files/held_folder.hpp"

namespace sidewall::app {

/// Another process holds a lock.
struct HeldElsewhere : IoError {
    using IoError::IoError;
};

/// Keeps other processes that ask for it from writing to a folder: an advisory lock on DIR/.sidewall.lock, which
/// names its holder. It also holds the folder open (surface::HeldFolder). The system frees it when the process ends, however it ends; the file is removed at the
/// end and left behind by a process that is killed. File systems without locks are written to without one.
class FolderLock {
  public:
    /// \pre the folder exists.
    /// \param file  of the lock, in the folder; locks on different files do not exclude each other.
    /// \throws HeldElsewhere naming the process that holds the folder; IoError with the system's reason, or if the lock is
    ///         a link, a device or a pipe.
    explicit FolderLock(const std::filesystem::path& folder, const char* file = kFile);
    ~FolderLock();
    FolderLock(const FolderLock&) = delete;
    FolderLock& operator=(const FolderLock&) = delete;

    static constexpr const char* kFile = ".sidewall.lock";

  private:
    surface::HeldFolder folder_;
    const char* name_;
    int file_ = -1;
};

/// The process that holds a folder's lock, e.g. "process 7 on host, since ..."; nothing if nobody does.
std::optional<std::string> lock_holder(const std::filesystem::path& folder);

}  // namespace sidewall::app
