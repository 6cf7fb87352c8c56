#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace sidewall::levelset {

inline constexpr std::size_t kSpeedClasses = 256;

/// The first sample of each speed class, by class; the number of samples for a class that has none.
/// \param speed_class  Motion::speed_class.
std::array<std::size_t, kSpeedClasses> first_of_classes(std::span<const std::uint8_t> speed_class);

}  // namespace sidewall::levelset
