#include "app/process/record/manifest.hpp"

#include <charconv>
#include <regex>

#include "app/common/files.hpp"
#include "app/common/text.hpp"
#include "surface/files/file.hpp"
#include "surface/files/output_file.hpp"

namespace sidewall::app {
namespace {

constexpr std::string_view kHeader =
    "# Files that sidewall wrote here. A new run removes these, and no others.\n";

bool is_plain(std::string_view name) {
    return !name.empty() && name.find('/') == std::string_view::npos && name != "." && name != "..";
}

}  // namespace

std::optional<FileNames> read_manifest(const fs::path& folder) {
    std::error_code failure;
    if (!fs::exists(folder / kManifest, failure)) return std::nullopt;
    const std::string text = surface::read_whole_file(folder / kManifest);
    if (!text.starts_with(kHeader)) return std::nullopt;
    std::vector<std::string> lines = split(text, '\n');
    lines.pop_back();  // empty, or an incomplete line
    std::erase_if(lines, [](const std::string& line) { return !is_plain(line) || line[0] == '#'; });
    return FileNames(lines.begin(), lines.end());
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
    static const std::regex saved(
        R"((?:surface|traced)_(\d{4,})\.vtp|interface_(\d{4,})(?:_\d+)?\.vtp|profile_(\d{4,})(?:_\d+)?\.csv)");
    std::cmatch match;
    if (!std::regex_match(name.begin(), name.end(), match, saved)) return std::nullopt;
    std::size_t number = 0;
    for (std::size_t kind = 1; kind < match.size(); ++kind)
        if (match[kind].matched &&
            std::from_chars(match[kind].first, match[kind].second, number).ec != std::errc())
            return std::nullopt;
    return number;
}

void remove_file(const fs::path& path) {
    std::error_code failure;
    fs::remove(path, failure);
    if (failure) throw IoError("{}: cannot remove: {}; check permissions", path.string(), failure.message());
}

void remove_partial_files(const fs::path& folder, const FileNames& names) {
    std::error_code failure;
    for (const auto& entry : fs::directory_iterator(folder, failure)) {
        // The name of the intended file, and the number of the process.
        static const std::regex partial(R"((.+?)(?:\.[\d-]+)?\.partial)");
        const std::string name = entry.path().filename().string();
        std::smatch match;
        if (!std::regex_match(name, match, partial)) continue;
        if (match[1] == kManifest || names.contains(match[1])) fs::remove(entry.path(), failure);
    }
}

std::vector<fs::path> accuracy_records(const fs::path& parent) {
    static const std::regex record(R"(raw|(?:grid|seed|raw)_\d+)");
    std::error_code failure;
    std::vector<fs::path> folders;
    for (const auto& entry : fs::directory_iterator(parent, failure))
        if (!entry.is_symlink() && entry.is_directory() &&
            std::regex_match(entry.path().filename().string(), record) && read_manifest(entry.path()))
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
        fs::remove(folder, failure);  // fails if it is not empty
    }
}

}  // namespace sidewall::app
