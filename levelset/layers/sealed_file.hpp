#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>

namespace sidewall::levelset {

/// Writes a file by write_file and seals it: after its content follow 28 bytes, which are "sidewall", the
/// content's length (64 bits), \p version (32 bits), a CRC-32 of the content and one of the 24 bytes before.
/// Programs that read the content from its start see nothing of the seal.
/// \throws IoError.
void write_sealed_file(const std::filesystem::path& path, std::uint32_t version,
                       const std::function<void(std::ostream& out)>& write);

/// Opens a sealed file at its first byte, all of which have been compared with the seal: what follows can rely
/// on a content as it was written (by whom, a checksum cannot tell). Takes no memory but a block, and of a file
/// that was cut short reads the end only.
/// \throws FileError if the file is missing, damaged or of another version; its text gives the reason alone.
std::ifstream open_sealed_file(const std::filesystem::path& path, std::uint32_t version);

}  // namespace sidewall::levelset
