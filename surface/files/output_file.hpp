#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>

namespace sidewall::surface {

/// What a file ends with, made of the number and the CRC-32 of the bytes before it.
using Trailer = std::function<std::string(std::uint64_t size, std::uint32_t checksum)>;

/// Writes a file so that under its name there is always a whole one: the old one or the new one.
///
/// \p write fills a file beside it, `NAME.PROCESS.partial`, which is then synced to the disk, read back,
/// compared by checksum and renamed; at last the folder is synced. If anything fails, the partial file is
/// removed and the old one stays. Missing folders are made, links are followed, and a device or a pipe is written
/// to directly, except in a HeldFolder, where all three are errors. A signal that would end the program at once (Ctrl-C) ends it when the partial file is removed or whole.
///
/// \param write    gets a stream that throws as soon as the disk refuses; what it throws itself comes through.
/// \param trailer  written after what \p write wrote, if given.
/// \throws IoError naming the path and the system's reason.
void write_file(const std::filesystem::path& path, const std::function<void(std::ostream& out)>& write,
                const Trailer& trailer = {});

/// write_file for bytes that are at hand.
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

/// Adds \p bytes to the end of a file, which is made if it is missing. If that fails, the file is cut back to
/// what it was. The bytes outlast the program at once, and a machine that stops when sync_file has seen them.
/// \throws IoError naming the path and the system's reason.
void append_to_file(const std::filesystem::path& path, std::string_view bytes);

/// Syncs a file and its folder's entry of it to the disk: a millisecond or more.
/// \throws IoError naming the path and the system's reason.
void sync_file(const std::filesystem::path& path);

/// Reads a file that this program wrote and that must be there.
/// \throws IoError naming the path and the reason.
std::string read_back(const std::filesystem::path& path);

/// Called, where it is set, before every operation on a file that is written: "folder", "open", "write",
/// "sync", "verify", "close", "rename", "sync folder", "remove". A number other than 0 becomes the error
/// (errno) with which the operation fails. For tests of full disks and of programs killed at any moment.
using FileOperationHook = int (*)(const char* operation, const std::filesystem::path& path);
extern FileOperationHook file_operation_hook;

}  // namespace sidewall::surface
