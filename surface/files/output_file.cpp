#include "surface/files/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <streambuf>
#include <system_error>
#include <utility>
#include <vector>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/files/locked_folder.hpp"

namespace sidewall::surface {

FileOperationHook file_operation_hook = nullptr;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBlock = std::size_t{1} << 18;

// Signal caught while a file was written, of those that would have ended the program at once; 0 if none.
volatile std::sig_atomic_t ended_by = 0;

extern "C" void on_end(int signal) {
    ended_by = signal;
}

// Defers signals that would end the program at once until the file is complete or its partial file removed:
// Descriptor::write() stops, the destructor raises the signal again. Handled and ignored ones stay as set.
class SignalGuard {
  public:
    SignalGuard() {
        for (std::size_t k = 0; k < kSignals.size(); ++k) {
            struct sigaction noting = {};
            noting.sa_handler = on_end;
            noting.sa_flags = SA_RESTART;
            ours_[k] = ::sigaction(kSignals[k], nullptr, &before_[k]) == 0 &&
                       before_[k].sa_handler == SIG_DFL && ::sigaction(kSignals[k], &noting, nullptr) == 0;
        }
    }
    ~SignalGuard() {
        for (std::size_t k = 0; k < kSignals.size(); ++k)
            if (ours_[k]) ::sigaction(kSignals[k], &before_[k], nullptr);
        if (ended_by != 0) ::raise(ended_by);
    }
    SignalGuard(const SignalGuard&) = delete;
    SignalGuard& operator=(const SignalGuard&) = delete;

  private:
    static constexpr std::array<int, 3> kSignals{SIGINT, SIGTERM, SIGHUP};
    std::array<struct sigaction, 3> before_{};
    std::array<bool, 3> ours_{};
};

// Sets errno to the error that a test injects before an operation; true if there is none.
bool allowed(const char* operation, const fs::path& path) {
    errno = file_operation_hook == nullptr ? 0 : file_operation_hook(operation, path);
    return errno == 0;
}

IoError refused(const fs::path& path, int error) {
    return IoError("{}: cannot write: {}; check space and permissions", path.string(),
                   std::generic_category().message(error));
}

// Owns an open file. Errors name the path that the user knows, not that of the partial file.
class Descriptor {
  public:
    Descriptor(const fs::path& name, int file) : name_(name), file_(file) {
        if (file < 0) throw refused(name, errno);
    }
    ~Descriptor() {
        if (file_ >= 0) ::close(file_);
    }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;

    void write(std::string_view bytes) const {
        while (!bytes.empty()) {
            if (ended_by != 0) throw Interrupted("");
            const auto count = allowed("write", name_) ? ::write(file_, bytes.data(), bytes.size()) : -1;
            if (count < 0 && errno == EINTR) continue;
            if (count < 0) throw refused(name_, errno);
            bytes.remove_prefix(static_cast<std::size_t>(count));
        }
    }
    // Some file systems do not support fsync: EINVAL and ENOTSUP are no errors.
    void sync(const char* operation) const {
        if ((!allowed(operation, name_) || ::fsync(file_) != 0) && errno != EINVAL && errno != ENOTSUP)
            throw refused(name_, errno);
    }
    void close() {
        const bool closed = ::close(std::exchange(file_, -1)) == 0 || errno == EINTR;
        if (!closed || !allowed("close", name_)) throw refused(name_, errno);
    }
    int file() const { return file_; }

  private:
    const fs::path& name_;
    int file_;
};

// Stream buffer that writes to a file and keeps the number and the CRC-32 of the bytes written.
class Buffer : public std::streambuf {
  public:
    explicit Buffer(const Descriptor& file) : file_(file), block_(kBlock) {
        setp(block_.data(), block_.data() + block_.size());
    }
    int sync() override {
        const std::string_view bytes(pbase(), static_cast<std::size_t>(pptr() - pbase()));
        file_.write(bytes);
        checksum_ = crc32_z(checksum_, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
        size_ += bytes.size();
        setp(block_.data(), block_.data() + block_.size());
        return 0;
    }
    std::uint64_t size() const { return size_; }
    std::uint32_t checksum() const { return static_cast<std::uint32_t>(checksum_); }

  protected:
    int_type overflow(int_type character) override {
        sync();
        if (!traits_type::eq_int_type(character, traits_type::eof()))
            sputc(traits_type::to_char_type(character));
        return traits_type::not_eof(character);
    }

  private:
    const Descriptor& file_;
    std::vector<char> block_;
    uLong checksum_ = 0;
    std::uint64_t size_ = 0;
};

// Writes a whole file with its trailer and hands all bytes to the operating system.
void fill(Buffer& buffer, const std::function<void(std::ostream& out)>& write, const Trailer& trailer) {
    std::ostream out(&buffer);
    out.exceptions(std::ios::badbit | std::ios::failbit);
    write(out);
    out.flush();
    if (!trailer) return;
    out << trailer(buffer.size(), buffer.checksum());
    out.flush();
}

// Reads the file back and compares size and CRC-32 with those written.
void verify(const fs::path& name, const Descriptor& file, const Buffer& written) {
    std::vector<Bytef> block(kBlock);
    uLong checksum = 0;
    std::uint64_t size = 0;
    for (;;) {
        const auto count = allowed("verify", name)
                               ? ::pread(file.file(), block.data(), block.size(), static_cast<off_t>(size))
                               : -1;
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) throw refused(name, errno);
        if (count == 0) break;
        checksum = crc32_z(checksum, block.data(), static_cast<std::size_t>(count));
        size += static_cast<std::uint64_t>(count);
    }
    if (size != written.size() || checksum != written.checksum())
        throw IoError("{}: cannot write: the disk holds other bytes than it was given; check the disk",
                      name.string());
}

void sync_folder(const fs::path& path, const FilePlace& place) {
    const fs::path folder = place.name.has_parent_path() ? place.name.parent_path() : fs::path(".");
    const int file = ::openat(place.folder, folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0) return;  // a folder that may be written to but not read
    Descriptor(path, file).sync("sync folder");
}

int open_place(const fs::path& path, const FilePlace& place, int flags) {
    if (!allowed("open", path)) return -1;
    return ::openat(place.folder, place.name.c_str(), flags | O_CLOEXEC | place.no_links(), 0666);
}

// Creates a file beside \p target under a name that no other process or thread uses.
int open_partial(const fs::path& path, const FilePlace& target, fs::path& partial) {
    for (int attempt = 0;; ++attempt) {
        partial = target.name;
        partial += attempt == 0 ? fmt::format(".{}.partial", getpid())
                                : fmt::format(".{}-{}.partial", getpid(), attempt);
        const int file = open_place(path, {target.folder, partial}, O_RDWR | O_CREAT | O_EXCL);
        if (file >= 0 || errno != EEXIST) return file;
    }
}

void write_beside(const fs::path& path, const FilePlace& target,
                  const std::function<void(std::ostream& out)>& write, const Trailer& trailer) {
    const SignalGuard guard;
    fs::path partial;
    Descriptor file(path, open_partial(path, target, partial));
    try {
        Buffer buffer(file);
        fill(buffer, write, trailer);
        file.sync("sync");
        verify(path, file, buffer);
        file.close();
        if (!allowed("rename", path) ||
            ::renameat(target.folder, partial.c_str(), target.folder, target.name.c_str()) != 0)
            throw refused(path, errno);
    } catch (...) {
        if (allowed("remove", path)) ::unlinkat(target.folder, partial.c_str(), 0);
        throw;
    }
    sync_folder(path, target);
}

}  // namespace

void write_file(const fs::path& path, const std::function<void(std::ostream& out)>& write,
                const Trailer& trailer) {
    FilePlace place = place_of(path);
    std::error_code failure;
    if (!place.held() && path.has_parent_path() && !fs::is_directory(path.parent_path(), failure)) {
        if (!allowed("folder", path)) throw refused(path, errno);
        fs::create_directories(path.parent_path(), failure);
        if (failure) throw refused(path, failure.value());
    }
    if (!place.held() && fs::is_symlink(path, failure)) place.name = fs::weakly_canonical(path, failure);
    if (failure) place.name = path;
    const fs::file_status status = fs::status(place.name, failure);
    if (place.held() || !fs::exists(status) || fs::is_regular_file(status) || fs::is_directory(status))
        return write_beside(path, place, write, trailer);
    Descriptor device(path, open_place(path, place, O_WRONLY));
    Buffer buffer(device);
    fill(buffer, write, trailer);
    device.close();
}

void write_whole_file(const fs::path& path, std::string_view bytes) {
    write_file(path, [&](std::ostream& out) {
        out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    });
}

void append_to_file(const fs::path& path, std::string_view bytes) {
    const FilePlace place = place_of(path);
    Descriptor file(path, open_place(path, place, O_WRONLY | O_APPEND | O_CREAT));
    const off_t before = ::lseek(file.file(), 0, SEEK_END);
    try {
        file.write(bytes);
        file.close();
    } catch (...) {
        // If this fails, too, the file ends with half a line; the error is reported in either case.
        const int again = ::openat(place.folder, place.name.c_str(), O_WRONLY | O_CLOEXEC | place.no_links());
        [[maybe_unused]] const int ignored = ::ftruncate(again, before);
        ::close(again);
        throw;
    }
}

void sync_file(const fs::path& path) {
    const FilePlace place = place_of(path);
    Descriptor file(path, open_place(path, place, O_WRONLY));
    file.sync("sync");
    file.close();
    sync_folder(path, place);
}

std::string read_back(const fs::path& path) {
    try {
        return read_whole_file(path);
    } catch (const FileError& error) {
        throw IoError(error.what());
    }
}

}  // namespace sidewall::surface
