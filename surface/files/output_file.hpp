#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>

namespace sidewall::surface {

/// Makes the end of a file from the number and the CRC-32 of the bytes before it.
using Trailer = std::function<std::string(std::uint64_t size, std::uint32_t checksum)>;

/// Writes a file atomically: its name always refers to a complete file, the old one or the new one.
///
/// \p write fills `NAME.PROCESS.partial` in the same folder, which is synced to the disk, read back, compared
/// by checksum and renamed; at last the folder is synced. On failure the partial file is removed and the old
/// file stays. Missing folders are made, symbolic links are followed, and devices and pipes are written to
/// directly; in a LockedFolder links, devices and pipes are errors. A signal that would end the program at once
/// (Ctrl-C) does so when the file is complete or the partial one removed.
///
/// \param write    receives a stream that throws when the disk refuses; its own exceptions pass through.
/// \param trailer  if given, makes the bytes after those of \p write.
/// \throws IoError naming the path and the system's reason.
void write_file(const std::filesystem::path& path, const std::function<void(std::ostream& out)>& write,
                const Trailer& trailer = {});

/// write_file() for bytes in memory.
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

/// Adds \p bytes to the end of a file, which is made if it is missing. On failure the file is cut back to its
/// old length. The bytes survive a crash of the program at once, and one of the machine after sync_file().
/// \throws IoError naming the path and the system's reason.
void append_to_file(const std::filesystem::path& path, std::string_view bytes);

/// Syncs a file and its directory entry to the disk, which takes a millisecond or more.
/// \throws IoError naming the path and the system's reason.
void sync_file(const std::filesystem::path& path);

/// Reads a file that this program wrote before; if it is missing, that is an output error.
/// \throws IoError naming the path and the reason.
std::string read_back(const std::filesystem::path& path);

/// Hook for tests of full disks and of programs killed at any moment. If set, it is called before every
/// operation on a file being written: "folder", "open", "write", "sync", "verify", "close", "rename", "sync
/// folder", "remove". A result other than 0 is the error (errno) with which the operation fails.
using FileOperationHook = int (*)(const char* operation, const std::filesystem::path& path);
extern FileOperationHook file_operation_hook;

}  // namespace sidewall::surface
