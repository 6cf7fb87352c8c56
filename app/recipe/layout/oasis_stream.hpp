#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/recipe/layout/layout.hpp"

namespace sidewall::app {

/// Reads the numbers, texts and lists of an OASIS file (SEMI P39) in sequence.
/// \throws FileError, in every function, with the byte where the file is damaged or ends.
class OasisStream {
  public:
    OasisStream(std::string_view bytes, const std::string& name, std::size_t start)
        : bytes_(bytes), name_(name), position_(start) {}

    [[noreturn]] void fail(const std::string& what) const;

    /// Type of the next record. At the end of a compressed block, reading continues after the block.
    std::uint64_t record();

    /// Opens a block of compressed records (CBLOCK).
    void open_block();

    std::uint8_t byte();
    std::uint64_t number();
    double length();         ///< an unsigned integer of at most 2^53, as double
    double signed_length();  ///< an integer between -2^53 and 2^53, as double
    double real() { return real(number()); }
    double real(std::uint64_t type);
    std::string text();
    std::array<double, 2> displacement();  ///< of type g-delta

    /// A list of points that begins at the origin. With \p closed, adds the last point that right-angled
    /// lists omit.
    levelset::Polygon points(bool closed);

    /// A repetition whose \p type has been read and is not 0.
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
