#pragma once
#include <fcntl.h>

#include <filesystem>

namespace sidewall::surface {

/// Keeps a folder open while the program writes into it.
///
/// The functions of output_file.hpp write files directly in it through its descriptor, and refuse symbolic
/// links, devices and pipes there. They fail once its path is gone or names another folder. Thread-safe.
class LockedFolder {
  public:
    /// \throws IoError if the folder cannot be opened.
    explicit LockedFolder(const std::filesystem::path& folder);
    ~LockedFolder();
    LockedFolder(const LockedFolder&) = delete;
    LockedFolder& operator=(const LockedFolder&) = delete;

    int descriptor() const { return file_; }

  private:
    int file_;
};

/// A file as openat(), renameat() and their like take it.
struct FilePlace {
    int folder = AT_FDCWD;       ///< descriptor of the folder that `name` is relative to
    std::filesystem::path name;  ///< file name in a held folder; else the whole path
    bool held() const { return folder != AT_FDCWD; }
    /// Flag for open(): symbolic links are followed outside held folders only.
    int no_links() const { return held() ? O_NOFOLLOW : 0; }
};

/// The place of a file to be written: in its held folder, if there is one.
/// \throws IoError if its folder is held and was removed, renamed or replaced, or has a symbolic link, a
///         device or a pipe of that name.
FilePlace place_of(const std::filesystem::path& path);

}  // namespace sidewall::surface
