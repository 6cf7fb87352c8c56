#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// The numbers, texts and lists of an OASIS file (SEMI P39), in turn. Every function reads what stands next.
/// \throws FileError, as every function, where the file is damaged or ends, naming the byte.
class OasisStream {
  public:
    OasisStream(std::string_view bytes, const std::string& name, std::size_t start)
        : bytes_(bytes), name_(name), position_(start) {}

    [[noreturn]] void fail(const std::string& what) const;

    /// The type of the next record. A block of compressed records that is open ends where it has no more.
    std::uint64_t record();

    /// Opens a block of compressed records, CBLOCK.
    void open_block();

    std::uint8_t byte();
    std::uint64_t number();
    double length();         ///< an unsigned integer as a number, at most 2^53
    double signed_length();  ///< between -2^53 and 2^53
    double real() { return real(number()); }
    double real(std::uint64_t type);
    std::string text();
    std::array<double, 2> displacement();  ///< a g-delta

    /// A list of points, the first of which is the origin. With \p closed right-angled ones have a last one that is not
    /// written.
    levelset::Polygon points(bool closed);

    /// A repetition but of type 0, whose type has been read.
    Repetition repetition(std::uint64_t type);

  private:
    double checked(std::uint64_t magnitude, bool negative) const;
    std::array<double, 2> along(std::uint64_t direction, double length) const;
    std::uint64_t count(std::uint64_t less_by);

    std::string_view bytes_, outer_;
    const std::string& name_;
    std::string block_;
    std::size_t position_ = 0, outer_position_ = 0, at_ = 0, unpacked_ = 0;
    bool in_block_ = false;
};

}  // namespace sidewall::app
