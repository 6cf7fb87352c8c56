#include "app/process/manifest.hpp"

#include <charconv>

#include "app/common/files.hpp"
#include "surface/file.hpp"

namespace sidewall::app {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader =
    "# Files that sidewall wrote here. A new run removes these, and no others.\n";
constexpr std::string_view kPartial = ".partial", kDigits = "0123456789";

bool is_plain(std::string_view name) {
    return !name.empty() && name.find('/') == std::string_view::npos && name != "." && name != "..";
}

// The text less `start` and the digits that follow it, of which there must be at least \p digits.
std::optional<std::string_view> after_number(std::string_view text, std::string_view start,
                                             std::size_t digits) {
    if (!text.starts_with(start)) return std::nullopt;
    text.remove_prefix(start.size());
    const std::size_t count = std::min(text.size(), text.find_first_not_of(kDigits));
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
    if (!text.empty()) append_to_file(folder / kManifest, text);
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

}  // namespace sidewall::app
