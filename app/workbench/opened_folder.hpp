#pragma once
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

// The folder that the workbench is opened on, and safe access to files in it.
namespace sidewall::app {

/// The opened folder has nothing of that name, or the name is not allowed.
struct NotInside : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file has changed on the disk since it was read.
struct ChangedOnDisk : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Owner of a file descriptor; closes it when destroyed.
class Descriptor {
  public:
    explicit Descriptor(int file) : file_(file) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept;
    Descriptor& operator=(Descriptor&& other) noexcept;
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number() const { return file_; }
    /// A path under /proc of the open file or folder, valid in this process even if it was renamed.
    std::filesystem::path path() const;

  private:
    int file_;
};

/// Largest file that is read whole, in bytes.
inline constexpr std::size_t kMostBytes = 4'000'000;

/// Opens a regular file directly in a folder; number() < 0 for a link, a pipe, a larger file or none.
Descriptor open_file(const Descriptor& folder, const char* name, std::size_t most_bytes = kMostBytes);

/// The last \p most bytes of a file, or all of a shorter one; empty if there is none.
std::string text_of(const Descriptor& file, std::size_t most = kMostBytes);

/// A folder whose files are named by relative paths such as `etch/deep.toml`, without empty parts, parts of
/// dots alone, control characters or symbolic links. Any other name counts as missing. Each part of a path is
/// opened from the one before, starting at the open folder: it may be renamed, and links are never followed.
/// Thread-safe.
class OpenedFolder {
  public:
    /// \throws FileError if there is no such folder.
    explicit OpenedFolder(const std::filesystem::path& folder);

    /// Its canonical path when it was opened.
    const std::filesystem::path& path() const { return path_; }

    /// A folder in it, or the opened folder itself if the name is empty.
    /// \throws NotInside
    Descriptor folder(const std::string& name) const;

    /// Whether anything of that name exists, even a link.
    /// \throws NotInside if its folder is not there.
    bool holds(const std::string& name) const;

    /// Checks that a folder holds no links, so that another process may read all of it.
    /// \throws NotInside if it or a folder below it holds a link, or cannot be read.
    void refuse_links(const std::string& name) const;

    /// The text of a file of at most 4 MB.
    /// \throws NotInside
    std::string read(const std::string& name) const;

    /// The last \p most bytes of a file of any size.
    /// \throws NotInside
    std::string read_end(const std::string& name, std::size_t most) const;

    /// Writes a file whole or not at all. A replaced file keeps its permissions.
    /// \param before  digest of the text to be replaced; empty: the file must not exist.
    /// \throws NotInside if its folder is not there; ChangedOnDisk; IoError.
    void write(const std::string& name, const std::string& text, const std::string& before) const;

    /// Makes the folders above a file or folder of that name.
    /// \throws NotInside, IoError
    void make_parent_folders(const std::string& name) const;

    /// Opens or creates a log file for appending, with the folders above it.
    /// \throws NotInside, IoError
    Descriptor open_log(const std::string& name) const;

    /// Files that end in .toml or .csv, and folders of results. Hidden names, links and contents of results
    /// are skipped. A folder with a link or pipe among its tables and recipe is not listed as results.
    struct Contents {
        std::vector<std::string> recipes, tables, results;
        /// Whether the lists are complete: at most 20,000 entries are looked at, and 500 of each sort listed.
        bool whole = true;
    };
    Contents contents() const;

  private:
    Descriptor open(const std::string& name, int flags) const;

    std::filesystem::path path_;
    Descriptor folder_;
};

}  // namespace sidewall::app
