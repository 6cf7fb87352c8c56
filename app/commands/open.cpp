#include <fmt/format.h>

#include <fcntl.h>
#include <malloc.h>
#include <unistd.h>
#include <cstdlib>
#include <memory>
#include <optional>

#include "app/commands/cli_options.hpp"
#include "app/common/console.hpp"
#include "app/common/files.hpp"
#include "app/common/interrupt.hpp"
#include "app/workbench/runs.hpp"
#include "app/workbench/web_server.hpp"
#include "app/workbench/workbench.hpp"

namespace sidewall::app {
namespace {

struct OpenOptions {
    std::string input = ".";
    int port = 0;
    bool no_browser = false;
};

// A temporary HTML file that redirects a browser to an address. The address holds the secret token, and any
// user can read a process's arguments; only this user can read the file.
class RedirectFile {
  public:
    explicit RedirectFile(const std::string& address) {
        const char* own = std::getenv("XDG_RUNTIME_DIR");
        path_ = (own != nullptr ? fs::path(own) : fs::temp_directory_path()) / "sidewall-XXXXXX.html";
        std::string name = path_.string();
        const int file = ::mkstemps(name.data(), 5);
        if (file < 0) throw IoError("{}: cannot be made", name);
        path_ = name;
        const std::string page = fmt::format("<meta http-equiv=\"refresh\" content=\"0;url={}\">\n", address);
        const bool written = ::write(file, page.data(), page.size()) == static_cast<ssize_t>(page.size());
        ::close(file);
        if (!written) throw IoError("{}: cannot be written", name);
    }
    ~RedirectFile() {
        std::error_code ignored;
        fs::remove(path_, ignored);
    }
    RedirectFile(const RedirectFile&) = delete;
    RedirectFile& operator=(const RedirectFile&) = delete;
    const fs::path& path() const { return path_; }

  private:
    fs::path path_;
};

// Prints the address, and opens it in a browser if there is a display.
void show(const std::string& address, const OpenOptions& options, std::optional<RedirectFile>& signpost) {
    print_plain(
        "{}\nThe workbench is open at this address, on this machine alone; Ctrl-C ends it, and runs go on.\n",
        address);
    std::fflush(stdout);
    if (options.no_browser ||
        (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr))
        return;
    try {
        const Descriptor root(::open("/", O_PATH | O_CLOEXEC));
        start_program({"xdg-open", signpost.emplace(address).path().string()}, root.number(), -1);
    } catch (const IoError&) {  // no browser starts; the address is printed
    }
}

void open(const OpenOptions& options) {
    std::error_code failure;
    const bool file = fs::is_regular_file(options.input, failure);
    const fs::path input = fs::absolute(options.input).lexically_normal();
    const OpenedFolder folder(file ? input.parent_path() : input);
    const std::string recipe = file ? input.filename().string() : "";
    install_interrupt_handler();
    // Two arenas: threads reuse memory that others freed. Freed blocks over 128 KiB go back to the system.
    ::mallopt(M_ARENA_MAX, 2);
    ::mallopt(M_MMAP_THRESHOLD, 1 << 17);
    std::optional<RedirectFile> signpost;
    serve({.port = static_cast<std::uint16_t>(options.port),
           .token = random_token(),
           .on_listening = [&](const std::string& address) { show(address, options, signpost); },
           .stop = interrupted},
          [&](const WebRequest& request) { return workbench_reply(request, folder, recipe); });
}

}  // namespace

void add_open_command(CLI::App& program) {
    CLI::App& command = *program.add_subcommand(
        "open",
        "Open the workbench, a page in the browser that edits, shows, runs and compares the recipes of a folder; it is served on "
        "this machine alone, until Ctrl-C");
    const auto options = std::make_shared<OpenOptions>();
    add_option(command, "INPUT", options->input, "DIR|FILE",
               "Folder of recipes, or a recipe in it (default: the working folder)");
    add_option(
        command, "--port", options->port, "N",
        "Port on 127.0.0.1 (default: a free one); the same at both ends where it is forwarded over SSH",
        {.range = {{0, 65535}}});
    command.add_flag("--no-browser", options->no_browser, "Only print the address");
    command.callback([options] { open(*options); });
}

}  // namespace sidewall::app
