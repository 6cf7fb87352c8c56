#include "app/process/record/manifest.hpp"

#include <charconv>

#include <fmt/format.h>

#include "app/common/files.hpp"
#include "app/common/folder_lock.hpp"
#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader =
    "# Files that sidewall wrote here. A new run removes these, and no others.\n";
constexpr std::string_view kPartial = ".partial", kHexDigits = "0123456789";

bool is_plain(std::string_view name) {
    return !name.empty() && name.find('/') == std::string_view::npos && name != "." && name != "..";
}

// The text less `start` and the digits that follow it, of which there must be at least \p digits.
std::optional<std::string_view> after_number(std::string_view text, std::string_view start,
                                             std::size_t digits) {
    if (!text.starts_with(start)) return std::nullopt;
    text.remove_prefix(start.size());
    const std::size_t count = std::min(text.size(), text.find_first_not_of(kHexDigits));
    if (count < digits) return std::nullopt;
    return text.substr(count);
}

// Whether the text is \p end, behind _K if \p part allows that.
bool ends(std::string_view text, std::string_view end, bool part) {
    return text == end || (part && after_number(text, "_", 1) == end);
}

}  // namespace

std::optional<FileNames> read_manifest(const fs::path& folder) {
    std::error_code failure;
    if (!fs::exists(folder / kManifest, failure)) return std::nullopt;
    const std::string text = surface::read_whole_file(folder / kManifest);
    if (!text.starts_with(kHeader)) return std::nullopt;
    FileNames names;
    for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos;
         begin = end + 1) {
        const std::string name = text.substr(begin, end - begin);
        if (is_plain(name) && name[0] != '#') names.insert(name);
    }
    return names;
}

void write_manifest(const fs::path& folder, const FileNames& names) {
    std::string text(kHeader);
    for (const std::string& name : names) text += name + "\n";
    write_file(folder / kManifest, text);
}

void add_to_manifest(const fs::path& folder, const std::vector<std::string>& names) {
    std::string text;
    for (const std::string& name : names) text += name + "\n";
    if (text.empty()) return;
    surface::append_to_file(folder / kManifest, text);
    surface::sync_file(folder / kManifest);
}

const FileNames& run_file_names() {
    static const FileNames names{"recipe.toml", "timeline.csv", "surface.pvd", "checkpoint.vdb",
                                 "summary.json"};
    return names;
}

std::optional<std::size_t> saved_number(std::string_view name) {
    struct Kind {
        std::string_view start, end;
        bool part;
    };
    for (const Kind& kind : {Kind{"surface_", ".vtp", false},
                             {"traced_", ".vtp", false},
                             {"interface_", ".vtp", true},
                             {"profile_", ".csv", true}}) {
        const auto rest = after_number(name, kind.start, 4);
        if (!rest || !ends(*rest, kind.end, kind.part)) continue;
        name.remove_prefix(kind.start.size());
        std::size_t number = 0;
        if (std::from_chars(name.data(), name.data() + name.size(), number).ec != std::errc())
            return std::nullopt;
        return number;
    }
    return std::nullopt;
}

void remove_file(const fs::path& path) {
    std::error_code failure;
    fs::remove(path, failure);
    if (failure)
        throw IoError(
            fmt::format("{}: cannot remove: {}; check permissions", path.string(), failure.message()));
}

void remove_partial_files(const fs::path& folder, const FileNames& names) {
    std::error_code failure;
    for (const auto& entry : fs::directory_iterator(folder, failure)) {
        std::string name = entry.path().filename().string();
        if (!name.ends_with(kPartial)) continue;
        name.resize(name.size() - kPartial.size());
        const auto listed = [&] { return name == kManifest || names.contains(name); };
        if (!listed()) {  // then the process follows the name
            const std::size_t dot = name.find_last_not_of("0123456789-");
            if (dot == std::string::npos || name[dot] != '.') continue;
            name.resize(dot);
            if (!listed()) continue;
        }
        fs::remove(entry.path(), failure);
    }
}

std::vector<fs::path> accuracy_records(const fs::path& parent) {
    const auto is_record = [](const std::string& name) {
        const std::size_t dash = name.find('_');
        const std::string word = name.substr(0, dash);
        if (dash == std::string::npos) return word == "raw";
        const std::string number = name.substr(dash + 1);
        return (word == "grid" || word == "seed" || word == "raw") && !number.empty() &&
               number.find_first_not_of("0123456789") == std::string::npos;
    };
    std::error_code failure;
    std::vector<fs::path> folders;
    for (const auto& entry : fs::directory_iterator(parent, failure))
        if (!entry.is_symlink() && entry.is_directory() && is_record(entry.path().filename().string()) &&
            read_manifest(entry.path()))
            folders.push_back(entry.path());
    return folders;
}

void remove_accuracy_records(const fs::path& parent) {
    std::error_code failure;
    for (const fs::path& folder : accuracy_records(parent)) {
        {
            const FolderLock lock(folder);
            const FileNames names = read_manifest(folder).value_or(FileNames());
            remove_partial_files(folder, names);
            for (const std::string& name : names) remove_file(folder / name);
            remove_file(folder / kManifest);
        }
        fs::remove(folder, failure);  // fails where there is something else
    }
}

}  // namespace sidewall::app
