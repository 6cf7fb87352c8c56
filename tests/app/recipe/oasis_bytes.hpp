#pragma once
#include <zlib.h>

#include <cstdint>
#include <string>
#include <vector>

// Builders of OASIS records, byte by byte.
namespace sidewall::test {

inline std::string oas_number(std::uint64_t value) {
    std::string bytes;
    for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(0x80 | (value & 0x7f));
    return bytes + static_cast<char>(value);
}

inline std::string oas_signed(std::int64_t value) {
    return oas_number(value < 0 ? static_cast<std::uint64_t>(-value) << 1 | 1
                                : static_cast<std::uint64_t>(value) << 1);
}

inline std::string oas_text(const std::string& text) {
    return oas_number(text.size()) + text;
}

/// A displacement, in its form for any direction.
inline std::string oas_delta(std::int64_t x, std::int64_t y) {
    const auto size = static_cast<std::uint64_t>(x < 0 ? -x : x);
    return oas_number(size << 2 | (x < 0 ? 2U : 0U) | 1U) + oas_signed(y);
}

inline std::string oas_numbers(const std::vector<std::uint64_t>& values) {
    std::string bytes;
    for (const std::uint64_t value : values) bytes += oas_number(value);
    return bytes;
}

/// A record: its type, its info byte, the rest.
inline std::string oas_record(int type, int info, const std::string& rest = "") {
    return oas_number(static_cast<std::uint64_t>(type)) + static_cast<char>(info) + rest;
}

/// A rectangle on layer 1/0 with all its fields, and a repetition if there is one.
inline std::string oas_rectangle(std::uint64_t width, std::uint64_t height, std::int64_t x, std::int64_t y,
                                 const std::string& repetition = "") {
    return oas_record(20, repetition.empty() ? 0x7b : 0x7f,
                      oas_numbers({1, 0, width, height}) + oas_signed(x) + oas_signed(y) + repetition);
}

inline std::string oas_cell(const std::string& name, const std::string& elements) {
    return oas_number(14) + oas_text(name) + elements;
}

/// A file with database units of 1 nm and without tables of names.
inline std::string oas_library(const std::string& records) {
    return "%SEMI-OASIS\r\n" + oas_number(1) + oas_text("1.0") + oas_numbers({0, 1000, 0}) +
           std::string(12, '\0') + records + oas_number(2) + oas_text(std::string(252, '\0')) + '\0';
}

/// The bytes compressed by zlib: a bare deflate stream, or a gzip file.
inline std::string packed_by_zlib(std::string bytes, bool gzip) {
    z_stream stream{};
    deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, gzip ? 16 + MAX_WBITS : -MAX_WBITS, 8,
                 Z_DEFAULT_STRATEGY);
    std::string packed(bytes.size() + 100, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(packed.data());
    stream.avail_out = static_cast<uInt>(packed.size());
    deflate(&stream, Z_FINISH);
    packed.resize(stream.total_out);
    deflateEnd(&stream);
    return packed;
}

inline std::string gzip_of(const std::string& bytes) {
    return packed_by_zlib(bytes, true);
}

/// A CBLOCK that holds \p records.
inline std::string oas_block(const std::string& records) {
    const std::string packed = packed_by_zlib(records, false);
    return oas_numbers({34, 0, records.size(), packed.size()}) + packed;
}

}  // namespace sidewall::test
