#include "app/workbench/opened_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <optional>
#include <tuple>
#include <utility>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "surface/files/locked_folder.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kLongestName = 1000, kMostFound = 500, kMostEntries = 20'000;

std::vector<std::string> parts_of(const std::string& name) {
    std::vector<std::string> parts = split(name, '/');
    const auto refused = [](const std::string& part) { return part.empty() || part == "." || part == ".."; };
    const auto control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
    if (name.size() > kLongestName || std::ranges::any_of(parts, refused) ||
        std::ranges::any_of(name, control))
        throw NotInside("there is nothing of that name");
    return parts;
}

constexpr int kFolder = O_RDONLY | O_DIRECTORY;

Descriptor open_part(const Descriptor& folder, const std::string& part, int flags) {
    return Descriptor(
        ::openat(folder.number(), part.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666));
}

int open_root(const fs::path& folder) {
    const int file = ::open(folder.c_str(), kFolder | O_CLOEXEC);
    if (file < 0)
        throw FileError("{}: cannot open the folder: {}", folder.string(), std::string(std::strerror(errno)));
    return file;
}

// Size in bytes of a regular file; nothing for anything else.
std::optional<std::size_t> size_of(const Descriptor& file) {
    struct stat there {};
    if (::fstat(file.number(), &there) != 0 || !S_ISREG(there.st_mode)) return std::nullopt;
    return static_cast<std::size_t>(there.st_size);
}

std::string folder_part(const std::string& name) {
    const std::size_t slash = name.rfind('/');
    return slash == std::string::npos ? "" : name.substr(0, slash);
}

// Whether a folder holds a file of results, and none of the files that lists read is a link or a pipe.
bool holds_results(const Descriptor& folder) {
    bool marked = false;
    for (const char* file : {"summary.json", "timeline.csv", "sweep.json", "fit.json", "compare.json",
                             "study.json", "validation.json", "manifest.txt", "recipe.toml", "sweep.csv"}) {
        struct stat there {};
        if (::fstatat(folder.number(), file, &there, AT_SYMLINK_NOFOLLOW) != 0) continue;
        if (!S_ISREG(there.st_mode)) return false;
        marked |= std::strcmp(file, "recipe.toml") != 0 && std::strcmp(file, "sweep.csv") != 0;
    }
    return marked;
}

void add(const std::string& name, std::vector<std::string>& list, bool& whole) {
    if (list.size() < kMostFound)
        list.push_back(name);
    else
        whole = false;
}

// Lists a folder's own entries before those of its subfolders, as the number of entries is limited.
void find(const Descriptor& folder, const std::string& prefix, int depth, std::size_t& entries,
          OpenedFolder::Contents& found) {
    constexpr int kDeepest = 4;
    std::error_code failure;
    std::vector<std::string> below;
    for (fs::directory_iterator at(folder.path(), failure), end; !failure && at != end;
         at.increment(failure)) {
        if (++entries > kMostEntries) {
            found.whole = false;
            return;
        }
        const std::string name = at->path().filename().string();
        std::error_code gone;
        if (name.starts_with('.') || at->is_symlink(gone)) continue;
        if (at->is_directory(gone)) {
            if (holds_results(open_part(folder, name, kFolder)))
                add(prefix + name, found.results, found.whole);
            else if (depth < kDeepest)
                below.push_back(name);
        } else if ((name.ends_with(".toml") || name.ends_with(".csv")) && at->is_regular_file(gone)) {
            add(prefix + name, name.ends_with(".csv") ? found.tables : found.recipes, found.whole);
        }
    }
    for (const std::string& name : below)
        if (entries <= kMostEntries)
            find(open_part(folder, name, kFolder), prefix + name + "/", depth + 1, entries, found);
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

fs::path Descriptor::path() const {
    return "/proc/self/fd/" + std::to_string(file_);
}

Descriptor open_file(const Descriptor& folder, const char* name, std::size_t most_bytes) {
    Descriptor file = open_part(folder, name, O_RDONLY);
    const auto size = size_of(file);
    return size && *size <= most_bytes ? std::move(file) : Descriptor(-1);
}

std::string text_of(const Descriptor& file, std::size_t most) {
    const std::size_t whole = size_of(file).value_or(0);
    std::string text(std::min(whole, most), '\0');
    const ssize_t size =
        ::pread(file.number(), text.data(), text.size(), static_cast<off_t>(whole - text.size()));
    text.resize(size > 0 ? static_cast<std::size_t>(size) : 0);
    return text;
}

OpenedFolder::OpenedFolder(const fs::path& folder) : path_(fs::absolute(folder)), folder_(open_root(folder)) {
    path_ = fs::canonical(path_);
}

Descriptor OpenedFolder::open(const std::string& name, int flags) const {
    Descriptor at = open_part(folder_, ".", kFolder);
    if (at.number() < 0) throw NotInside("the folder cannot be opened any more");
    if (name.empty()) return at;
    const std::vector<std::string> parts = parts_of(name);
    for (std::size_t k = 0; k < parts.size(); ++k) {
        at = open_part(at, parts[k], k + 1 < parts.size() ? kFolder : flags);
        if (at.number() < 0) throw NotInside(name + ": there is nothing of that name");
    }
    return at;
}

Descriptor OpenedFolder::folder(const std::string& name) const {
    return open(name, kFolder);
}

bool OpenedFolder::holds(const std::string& name) const {
    const std::string own = parts_of(name).back();
    struct stat there {};
    return ::fstatat(folder(folder_part(name)).number(), own.c_str(), &there, AT_SYMLINK_NOFOLLOW) == 0;
}

void OpenedFolder::refuse_links(const std::string& name) const {
    const Descriptor there = folder(name);
    std::error_code failure, gone;
    fs::recursive_directory_iterator at(there.path(), fs::directory_options::skip_permission_denied, failure);
    for (; !failure && at != fs::recursive_directory_iterator(); at.increment(failure))
        if (at->is_symlink(gone))
            throw NotInside(name + ": " + at->path().filename().string() + " is a link");
    if (failure) throw NotInside(name + ": cannot be read: " + failure.message());
}

std::string OpenedFolder::read(const std::string& name) const {
    std::string text = read_end(name, kMostBytes + 1);
    if (text.size() > kMostBytes) throw NotInside(name + ": is no file of at most 4 MB");
    return text;
}

std::string OpenedFolder::read_end(const std::string& name, std::size_t most) const {
    const Descriptor file = open(name, O_RDONLY);
    if (!size_of(file)) throw NotInside(name + ": is no file");
    return text_of(file, most);
}

void OpenedFolder::write(const std::string& name, const std::string& text, const std::string& before) const {
    const std::string own = parts_of(name).back();
    const Descriptor at = folder(folder_part(name));
    const surface::LockedFolder held(at.path());
    static std::mutex one_at_a_time;
    const std::lock_guard guard(one_at_a_time);
    struct stat there {};
    const bool anew = ::fstatat(at.number(), own.c_str(), &there, AT_SYMLINK_NOFOLLOW) != 0;
    if (before != (anew ? "" : digest(read(name))))
        throw ChangedOnDisk(name + ": has changed on the disk since it was opened");
    try {
        surface::write_whole_file(at.path() / own, text);
    } catch (const IoError& error) {
        throw IoError("{}", boost::replace_all_copy(std::string(error.what()), at.path().string(), "."));
    }
    // A failure is ignored: such a file system has no permissions.
    if (!anew) std::ignore = ::fchmod(open_part(at, own, O_RDONLY).number(), there.st_mode & 07777);
}

void OpenedFolder::make_parent_folders(const std::string& name) const {
    parts_of(name);
    const std::string above = folder_part(name);
    if (above.empty()) return;
    make_parent_folders(above);
    const Descriptor at = folder(folder_part(above));
    if (::mkdirat(at.number(), parts_of(above).back().c_str(), 0777) != 0 && errno != EEXIST)
        throw IoError("{}: cannot make the folder: {}", above, std::string(std::strerror(errno)));
    folder(above);
}

Descriptor OpenedFolder::open_log(const std::string& name) const {
    make_parent_folders(name);
    return open(name, O_WRONLY | O_CREAT | O_APPEND);
}

OpenedFolder::Contents OpenedFolder::contents() const {
    Contents found;
    std::size_t entries = 0;
    find(folder(""), "", 0, entries, found);
    std::ranges::sort(found.recipes);
    for (auto* list : {&found.tables, &found.results}) std::ranges::sort(*list);
    return found;
}

}  // namespace sidewall::app
