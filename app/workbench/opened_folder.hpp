#pragma once
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

// The folder that the workbench is opened on, and what may be reached in it.
namespace sidewall::app {

/// There is nothing of that name in the opened folder, or nothing that may be named.
struct NotInside : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file has changed on the disk since it was read.
struct ChangedOnDisk : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A file of the system, closed at the end.
class Descriptor {
  public:
    explicit Descriptor(int file) : file_(file) {}
    ~Descriptor();
    Descriptor(Descriptor&& other) noexcept;
    Descriptor& operator=(Descriptor&& other) noexcept;
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number() const { return file_; }
    /// A path by which this process reaches what is open, whatever its name has come to mean.
    std::filesystem::path path() const;

  private:
    int file_;
};

/// The most of a file that is read.
inline constexpr std::size_t kMostBytes = 4'000'000;

/// A file right in a folder; its number is negative where there is none, but a link or a pipe, or one that is larger.
Descriptor open_file(const Descriptor& folder, const char* name, std::size_t most_bytes = kMostBytes);

/// The text of a file, of a longer one its end; empty without one.
std::string text_of(const Descriptor& file, std::size_t most = kMostBytes);

/// A folder whose files are named by paths such as `etch/deep.toml`: relative, with no empty part, no part of dots alone, and
/// no control character or link among them. Any other name is as one that is not there. All is reached from the folder as it was
/// opened, a part of a name after the other: it may be renamed meanwhile, and a link that comes up leads nowhere. For any thread.
class OpenedFolder {
  public:
    /// \throws FileError if there is no such folder.
    explicit OpenedFolder(const std::filesystem::path& folder);

    /// The name that it was opened by.
    const std::filesystem::path& path() const { return path_; }

    /// A folder in it; it itself without a name.
    /// \throws NotInside
    Descriptor folder(const std::string& name) const;

    /// Whether something of that name is there, be it a link.
    /// \throws NotInside if its folder is not there.
    bool holds(const std::string& name) const;

    /// Sees to it that another process may read a folder in it whole.
    /// \throws NotInside if there is a link in it, or in a folder of it.
    void refuse_links(const std::string& name) const;

    /// The text of a file of at most 4 MB.
    /// \throws NotInside
    std::string read(const std::string& name) const;

    /// At most so many bytes of the end of a file of any size.
    /// \throws NotInside
    std::string read_end(const std::string& name, std::size_t most) const;

    /// Writes a file whole or not at all; one that is replaced keeps its rights.
    /// \param before  the digest of the text that is to be replaced; empty: there is no such file.
    /// \throws NotInside if its folder is not there; ChangedOnDisk; IoError.
    void write(const std::string& name, const std::string& text, const std::string& before) const;

    /// Makes the folder that a file or folder of that name is to stand in.
    /// \throws NotInside, IoError
    void make_room_for(const std::string& name) const;

    /// Opens or makes a file that takes what a process says.
    /// \throws NotInside, IoError
    Descriptor open_log(const std::string& name) const;

    /// The files that end in .toml and .csv, and the folders of results; neither within results, hidden folders or links. A folder
    /// of results whose tables and recipe are links or pipes is none.
    struct Contents {
        std::vector<std::string> recipes, tables, results;
        /// Else there is more: it looks through 20,000 files and folders, and lists 500 of each, at most.
        bool whole = true;
    };
    Contents contents() const;

  private:
    Descriptor open(const std::string& name, int flags) const;

    std::filesystem::path path_;
    Descriptor folder_;
};

}  // namespace sidewall::app
