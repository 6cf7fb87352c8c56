#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace sidewall::levelset {

inline constexpr std::size_t kKinds = 256;

/// The first sample of each kind, by kind; as many as there are samples where none is of it. \param kind  Motion::kind.
std::array<std::size_t, kKinds> first_of_kinds(std::span<const std::uint8_t> kind);

}  // namespace sidewall::levelset
