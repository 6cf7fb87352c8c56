#pragma once
#include <filesystem>
#include <string>

#include "levelset/layers/stack.hpp"

namespace sidewall::levelset {

/// A stack with a text of the caller's (progress of the run, say) beside it.
struct Checkpoint {
    MaterialStack stack;
    std::string text;
};

/// Writes every layer, bit for bit, to an OpenVDB file with a grid a layer, sealed by length, version and
/// checksum (levelset/layers/sealed_file.hpp), of which OpenVDB's own programs see nothing. The old file stays until
/// the new one is whole.
/// \throws IoError.
void save_checkpoint(const std::filesystem::path& path, const MaterialStack& stack, const std::string& text);

/// Reads what save_checkpoint wrote. \p domain is the recipe's. Nothing is read before the seal has been
/// compared, so that a damaged file takes neither time nor memory.
/// \throws FileError if the file is missing, damaged, of another version, not one of ours, or of another domain.
Checkpoint load_checkpoint(const std::filesystem::path& path, const Domain& domain);

}  // namespace sidewall::levelset
