#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace sidewall::app {

/// How bytes are packed by zlib: bare, or in a gzip file.
enum class Packing { deflate, gzip };

/// Unpacks bytes; nothing if they are damaged, cut off or more than \p most when unpacked.
std::optional<std::string> inflated(std::string_view packed, Packing packing, std::size_t most);

}  // namespace sidewall::app
