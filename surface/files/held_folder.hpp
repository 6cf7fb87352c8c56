#pragma once
#include <fcntl.h>

#include <filesystem>

namespace sidewall::surface {

/// A folder that is kept open while the program writes into it.
///
/// What output_file.hpp does to files right in it goes through the open folder: not through links, and not to devices
/// or pipes. It fails once the folder's name is gone or names another folder. For any thread.
class HeldFolder {
  public:
    /// \throws IoError if the folder cannot be opened.
    explicit HeldFolder(const std::filesystem::path& folder);
    ~HeldFolder();
    HeldFolder(const HeldFolder&) = delete;
    HeldFolder& operator=(const HeldFolder&) = delete;

    int descriptor() const { return file_; }

  private:
    int file_;
};

/// A file as the *at functions of the system take it.
struct FilePlace {
    int folder = AT_FDCWD;       ///< that the name starts from
    std::filesystem::path name;  ///< in a folder that is held, the file's own name; else its path
    bool held() const { return folder != AT_FDCWD; }
    /// A flag of open: links are followed outside held folders only.
    int no_links() const { return held() ? O_NOFOLLOW : 0; }
};

/// The place of a file that is to be written.
/// \throws IoError if its folder is held and was removed, renamed or replaced, or holds a link, a device or a pipe of that
///         name.
FilePlace place_of(const std::filesystem::path& path);

}  // namespace sidewall::surface
