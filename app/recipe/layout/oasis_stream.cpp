#include "app/recipe/layout/oasis_stream.hpp"

#include <bit>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

constexpr std::size_t kMostUnpacked = 1'000'000'000;           // bytes of all blocks of a file
constexpr std::uint64_t kMostTimes = std::uint64_t{1} << 31U;  // copies along an axis of a repetition

}  // namespace

void OasisStream::fail(const std::string& what) const {
    throw FileError("{}: byte {}: {}; export it again", name_, at_, what);
}

std::uint64_t OasisStream::record() {
    if (in_block_ && position_ == bytes_.size()) {
        bytes_ = outer_;
        position_ = outer_position_;
        in_block_ = false;
    }
    if (!in_block_) at_ = position_;
    return number();
}

void OasisStream::open_block() {
    if (in_block_) fail("a compressed block lies in another");
    if (number() != 0) fail("a block is compressed by another method than OASIS 1.0 knows");
    const std::uint64_t unpacked = number(), packed = number();
    if (packed > bytes_.size() - position_) fail("the file is cut off");
    if (unpacked > kMostUnpacked - unpacked_) fail("over 1 GB when unpacked");
    auto block = inflated(bytes_.substr(position_, packed), Packing::deflate, unpacked);
    if (!block || block->size() != unpacked) fail("a compressed block is damaged");
    unpacked_ += unpacked;
    outer_ = bytes_;
    outer_position_ = position_ + packed;
    block_ = std::move(*block);
    bytes_ = block_;
    position_ = 0;
    in_block_ = true;
}

std::uint8_t OasisStream::byte() {
    if (position_ == bytes_.size()) fail("the file is cut off");
    return static_cast<std::uint8_t>(bytes_[position_++]);
}

std::uint64_t OasisStream::number() {
    std::uint64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
        const std::uint64_t next = byte();
        if (shift > 63 || (shift == 63 && (next & 0x7e) != 0)) fail("a number is out of range");
        value |= (next & 0x7f) << shift;
        if (next < 0x80) return value;
    }
}

double OasisStream::checked(std::uint64_t magnitude, bool negative) const {
    if (magnitude > std::uint64_t{1} << 53U) fail("a length is out of range");
    const auto value = static_cast<double>(magnitude);
    return negative ? -value : value;
}

double OasisStream::length() {
    return checked(number(), false);
}

double OasisStream::signed_length() {
    const std::uint64_t value = number();
    return checked(value >> 1U, (value & 1) != 0);
}

double OasisStream::real(std::uint64_t type) {
    const double sign = type % 2 == 0 ? 1.0 : -1.0;
    if (type < 2) return sign * static_cast<double>(number());
    if (type < 4) return sign / static_cast<double>(number());
    if (type < 6) {
        const auto numerator = static_cast<double>(number());
        return sign * numerator / static_cast<double>(number());
    }
    if (type > 7) fail("a real number is of an unknown type");
    std::uint64_t bits = 0;
    const unsigned size = type == 6 ? 4 : 8;
    for (unsigned k = 0; k < size; ++k) bits |= std::uint64_t{byte()} << 8 * k;
    return size == 4 ? std::bit_cast<float>(static_cast<std::uint32_t>(bits)) : std::bit_cast<double>(bits);
}

std::string OasisStream::text() {
    const std::uint64_t size = number();
    if (size > bytes_.size() - position_) fail("the file is cut off");
    position_ += size;
    return std::string(bytes_.substr(position_ - size, size));
}

// Directions: east, north, west, south, north-east, north-west, south-west, south-east.
std::array<double, 2> OasisStream::along(std::uint64_t direction, double length) const {
    constexpr int kX[] = {1, 0, -1, 0, 1, -1, -1, 1}, kY[] = {0, 1, 0, -1, 1, 1, -1, -1};
    return {kX[direction] * length, kY[direction] * length};
}

std::array<double, 2> OasisStream::displacement() {
    const std::uint64_t first = number();
    if ((first & 1) == 0) return along(first >> 1U & 7, checked(first >> 4U, false));
    const double x = checked(first >> 2U, (first & 2) != 0);
    return {x, signed_length()};
}

levelset::Polygon OasisStream::points(bool closed) {
    const std::uint64_t type = number(), size = number();
    if (type > 5) fail("a list of points is of an unknown type");
    if (size > bytes_.size() - position_) fail("the file is cut off");
    levelset::Polygon points{{0.0, 0.0}};
    points.reserve(size + 2);
    std::array<double, 2> step{};
    for (std::uint64_t k = 0; k < size; ++k) {
        if (type < 2) {
            step = {};
            step[(k + type) % 2] = signed_length();
        } else if (type < 4) {
            const unsigned bits = type == 2 ? 2 : 3;
            const std::uint64_t value = number();
            step = along(value & ((1U << bits) - 1), checked(value >> bits, false));
        } else {
            const std::array<double, 2> next = displacement();
            if (type == 4) step = {};
            for (std::size_t a = 0; a < 2; ++a) step[a] += next[a];
        }
        points.push_back({points.back()[0] + step[0], points.back()[1] + step[1]});
    }
    if (closed && type < 2) {
        std::array<double, 2> corner = points.back();
        corner[(size + type) % 2] = 0.0;
        points.push_back(corner);
    }
    return points;
}

std::uint64_t OasisStream::count(std::uint64_t less_by) {
    const std::uint64_t value = number();
    if (value > kMostTimes) fail("a repetition is out of range");
    return value + less_by;
}

Repetition OasisStream::repetition(std::uint64_t type) {
    Repetition result;
    if (type >= 1 && type <= 3) {
        if (type != 3) result.columns = count(2);
        if (type != 2) result.rows = count(2);
        if (type != 3) result.column_step[0] = length();
        if (type != 2) result.row_step[1] = length();
    } else if (type == 8 || type == 9) {
        result.columns = count(2);
        if (type == 8) result.rows = count(2);
        result.column_step = displacement();
        if (type == 8) result.row_step = displacement();
    } else if (type >= 4 && type <= 11) {
        const std::uint64_t more = count(1);
        const double grid = type % 2 == 1 ? length() : 1.0;
        if (more > bytes_.size() - position_) fail("the file is cut off");
        result.places.reserve(more + 1);
        result.places.push_back({0.0, 0.0});
        for (std::uint64_t k = 0; k < more; ++k) {
            std::array<double, 2> step{};
            if (type >= 10)
                step = displacement();
            else
                step[type >= 6 ? 1 : 0] = length();
            const auto& last = result.places.back();
            result.places.push_back({last[0] + grid * step[0], last[1] + grid * step[1]});
        }
    } else {
        fail("a repetition is of an unknown type");
    }
    return result;
}

}  // namespace sidewall::app
