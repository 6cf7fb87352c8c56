#include "app/workbench/opened_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "surface/files/held_folder.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostBytes = 4'000'000, kLongestName = 1000, kMostFound = 500, kMostEntries = 20'000;

std::vector<std::string> parts_of(const std::string& name) {
    std::vector<std::string> parts = split(name, '/');
    const auto refused = [](const std::string& part) { return part.empty() || part == "." || part == ".."; };
    const auto control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
    if (name.size() > kLongestName || std::ranges::any_of(parts, refused) ||
        std::ranges::any_of(name, control))
        throw NotInside("there is nothing of that name");
    return parts;
}

int open_root(const fs::path& folder) {
    const int file = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0)
        throw FileError("{}: cannot open the folder: {}", folder.string(), std::string(std::strerror(errno)));
    return file;
}

bool same_file(int a, int b) {
    struct stat first {
    }, second{};
    return ::fstat(a, &first) == 0 && ::fstat(b, &second) == 0 && first.st_ino == second.st_ino &&
           first.st_dev == second.st_dev;
}

std::string folder_part(const std::string& name) {
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos ? "" : name.substr(0, slash);
}

// Something that is there and no file: a link, a pipe.
bool is_strange(const fs::path& path) {
    std::error_code gone;
    const fs::file_type type = fs::symlink_status(path, gone).type();
    return type != fs::file_type::regular && type != fs::file_type::not_found;
}

// By a file that says what made it, if all that lists read are files.
bool holds_results(const fs::path& folder) {
    const auto there = [&](const char* file) { return is_there(folder / file); };
    const std::array marks{"summary.json", "timeline.csv", "sweep.json",
                           "fit.json",     "compare.json", "manifest.txt"};
    return std::ranges::any_of(marks, there) &&
           std::ranges::none_of(marks, is_strange, [&](const char* file) { return folder / file; }) &&
           std::ranges::none_of(std::array{"recipe.toml", "sweep.csv"}, is_strange,
                                [&](const char* file) { return folder / file; });
}

void add(const std::string& name, std::vector<std::string>& list, bool& whole) {
    if (list.size() < kMostFound)
        list.push_back(name);
    else
        whole = false;
}

// A folder's own files come before those of folders in it.
void find(const fs::path& folder, const std::string& prefix, int depth, std::size_t& entries,
          OpenedFolder::Contents& found) {
    constexpr int kDeepest = 4;
    std::error_code failure;
    std::vector<std::string> below;
    for (fs::directory_iterator at(folder, failure), end; !failure && at != end; at.increment(failure)) {
        if (++entries > kMostEntries) {
            found.whole = false;
            return;
        }
        const std::string name = at->path().filename().string();
        std::error_code gone;
        if (name.starts_with('.') || at->is_symlink(gone)) continue;
        if (at->is_directory(gone)) {
            if (holds_results(at->path()))
                add(prefix + name, found.results, found.whole);
            else if (depth < kDeepest)
                below.push_back(name);
        } else if (name.ends_with(".toml") && at->is_regular_file(gone)) {
            add(prefix + name, found.recipes, found.whole);
        }
    }
    for (const std::string& name : below)
        if (entries <= kMostEntries) find(folder / name, prefix + name + "/", depth + 1, entries, found);
}

}  // namespace

Descriptor::~Descriptor() {
    if (file_ >= 0) ::close(file_);
}

Descriptor::Descriptor(Descriptor&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
}

OpenedFolder::OpenedFolder(const fs::path& folder) : path_(fs::absolute(folder)), folder_(open_root(folder)) {
    path_ = fs::canonical(path_);
}

Descriptor OpenedFolder::open(const std::string& name, int flags) const {
    Descriptor at(::openat(folder_.number(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (name.empty()) return at;
    const std::vector<std::string> parts = parts_of(name);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        const int how = k + 1 < parts.size() ? O_RDONLY | O_DIRECTORY : flags;
        Descriptor next(
            ::openat(at.number(), parts[k].c_str(), how | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666));
        if (next.number() < 0) throw NotInside(name + ": there is nothing of that name");
        at = std::move(next);
    }
    return at;
}

fs::path OpenedFolder::inside(const std::string& name) const {
    const Descriptor there = open(name, O_RDONLY | O_DIRECTORY);
    return path_ / name;
}

fs::path OpenedFolder::without_links(const std::string& name) const {
    fs::path folder = inside(name);
    std::error_code failure, gone;
    fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, failure);
    for (; !failure && at != fs::recursive_directory_iterator(); at.increment(failure))
        if (at->is_symlink(gone))
            throw NotInside(name + ": " + at->path().filename().string() + " is a link");
    if (failure) throw NotInside(name + ": cannot be read: " + failure.message());
    return folder;
}

std::string OpenedFolder::read(const std::string& name) const {
    std::string text = read_end(name, kMostBytes + 1);
    if (text.size() > kMostBytes) throw NotInside(name + ": is no file of at most 4 MB");
    return text;
}

std::string OpenedFolder::read_end(const std::string& name, std::size_t most) const {
    const Descriptor file = open(name, O_RDONLY);
    struct stat there {};
    if (::fstat(file.number(), &there) != 0 || !S_ISREG(there.st_mode))
        throw NotInside(name + ": is no file");
    std::string text(std::min(static_cast<std::size_t>(there.st_size), most), '\0');
    const off_t from = there.st_size - static_cast<off_t>(text.size());
    const ssize_t size = ::pread(file.number(), text.data(), text.size(), from);
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return text;
}

void OpenedFolder::write(const std::string& name, const std::string& text, const std::string& before) const {
    parts_of(name);
    const std::string folder = folder_part(name);
    const Descriptor checked = open(folder, O_RDONLY | O_DIRECTORY);
    const surface::HeldFolder held(path_ / folder);
    if (!same_file(checked.number(), held.descriptor())) throw NotInside(folder + ": was replaced meanwhile");
    static std::mutex one_at_a_time;
    const std::lock_guard guard(one_at_a_time);
    const std::string own = fs::path(name).filename().string();
    std::string now;  // of a new file
    struct stat there {};
    const bool anew = ::fstatat(checked.number(), own.c_str(), &there, AT_SYMLINK_NOFOLLOW) != 0;
    if (!anew) now = digest(read(name));
    if (now != before) throw ChangedOnDisk(name + ": has changed on the disk since it was opened");
    surface::write_whole_file(path_ / folder / own, text);
    if (anew) return;
    // A file system that refuses has no rights to keep.
    [[maybe_unused]] const int ignored = ::fchmod(open(name, O_RDONLY).number(), there.st_mode & 07777);
}

void OpenedFolder::make_room_for(const std::string& name) const {
    parts_of(name);
    const std::string folder = folder_part(name);
    if (folder.empty()) return;
    make_room_for(folder);
    const Descriptor above = open(folder_part(folder), O_RDONLY | O_DIRECTORY);
    if (::mkdirat(above.number(), fs::path(folder).filename().c_str(), 0777) != 0 && errno != EEXIST)
        throw IoError("{}: cannot make the folder: {}", folder, std::string(std::strerror(errno)));
    open(folder, O_RDONLY | O_DIRECTORY);
}

Descriptor OpenedFolder::open_log(const std::string& name) const {
    make_room_for(name);
    return open(name, O_WRONLY | O_CREAT | O_APPEND);
}

OpenedFolder::Contents OpenedFolder::contents() const {
    Contents found;
    std::size_t entries = 0;
    find(path_, "", 0, entries, found);
    std::ranges::sort(found.recipes);
    std::ranges::sort(found.results);
    return found;
}

}  // namespace sidewall::app
