#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <string>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// A stack with a text of the caller's (progress of the run, say) beside it.
struct Checkpoint {
    MaterialStack stack;
    std::string text;
};

/// Writes every layer, bit for bit, to an OpenVDB file with a grid a layer, sealed by length, version and
/// checksum (write_sealed_file), of which OpenVDB's own programs see nothing. The old file stays until
/// the new one is whole.
/// \throws IoError.
void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text);

/// Reads what save_checkpoint wrote. \p domain is the recipe's. Nothing is read before the seal has been
/// compared, so that a damaged file takes neither time nor memory.
/// \throws FileError if the file is missing, damaged, of another version, not one of ours, or of another domain.
Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain);

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
