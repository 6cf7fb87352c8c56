#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <string>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// A stack and a text of the caller, e.g. the progress of the run.
struct Checkpoint {
    MaterialStack stack;
    std::string text;
};

/// Writes every layer, bit for bit, to an OpenVDB file with one grid per layer and a seal of length, version
/// and checksum (write_sealed_file), which other programs ignore. The old file stays until the new one is
/// complete.
/// \throws IoError.
void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text);

/// Reads what save_checkpoint wrote. \p domain is the recipe's. The seal is checked first, so that a damaged
/// file takes neither time to parse nor memory.
/// \throws FileError if the file is missing, damaged, of another version, program or domain.
Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain);

/// Writes a file by write_file and seals it: its content is followed by 28 bytes, which are "sidewall", the
/// content's length (64 bits), \p version (32 bits), a CRC-32 of the content and one of the 24 bytes before.
/// Programs that read the content from its start do not notice the seal.
/// \throws IoError.
void write_sealed_file(const std::filesystem::path& path, std::uint32_t version,
                       const std::function<void(std::ostream& out)>& write);

/// Compares a sealed file with its seal and opens it at its first byte: the content is as it was written (by
/// whom, a checksum cannot tell). Needs memory for one block; reads only the end of a truncated file.
/// \throws FileError if the file is missing, damaged or of another version; the text gives the reason alone.
std::ifstream open_sealed_file(const std::filesystem::path& path, std::uint32_t version);

}  // namespace sidewall::levelset
