#pragma once
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

// Builders of GDSII records, byte by byte.
namespace sidewall::test {

inline std::string gds_record(int type, int kind, const std::string& data = "") {
    const std::size_t size = data.size() + 4;
    return {static_cast<char>(size >> 8), static_cast<char>(size & 0xff), static_cast<char>(type),
            static_cast<char>(kind)};
}

inline std::string gds_put(int type, int kind, const std::string& data = "") {
    return gds_record(type, kind, data) + data;
}

inline std::string gds_short(int type, std::vector<int> values) {
    std::string data;
    for (const int v : values) data += {static_cast<char>(v >> 8), static_cast<char>(v)};
    return gds_put(type, 2, data);
}

inline std::string gds_long(int type, const std::vector<int>& values) {
    std::string data;
    for (const int v : values)
        data += {static_cast<char>(v >> 24), static_cast<char>(v >> 16), static_cast<char>(v >> 8),
                 static_cast<char>(v)};
    return gds_put(type, 3, data);
}

inline std::string gds_real(double value) {
    int exponent = 64;
    while (value >= 1.0) value /= 16.0, ++exponent;
    while (value > 0.0 && value < 1.0 / 16.0) value *= 16.0, --exponent;
    const auto fraction = static_cast<std::uint64_t>(std::ldexp(value, 56));
    std::string data(1, static_cast<char>(exponent));
    for (int b = 6; b >= 0; --b) data += static_cast<char>(fraction >> (8 * b));
    return data;
}

inline std::string gds_text(int type, std::string text) {
    if (text.size() % 2 != 0) text += '\0';
    return gds_put(type, 6, text);
}

inline std::string gds_end() {
    return gds_put(0x11, 0);
}

inline std::string gds_boundary(int layer, int datatype, const std::vector<int>& points) {
    return gds_put(0x08, 0) + gds_short(0x0d, {layer}) + gds_short(0x0e, {datatype}) +
           gds_long(0x10, points) + gds_end();
}

inline std::string gds_path(int layer, int datatype, int width, const std::vector<int>& points) {
    return gds_put(0x09, 0) + gds_short(0x0d, {layer}) + gds_short(0x0e, {datatype}) +
           gds_long(0x0f, {width}) + gds_long(0x10, points) + gds_end();
}

inline std::string gds_reference(const std::string& cell, const std::vector<int>& at, bool mirror = false,
                                 double magnification = 1.0, double angle = 0.0) {
    return gds_put(0x0a, 0) + gds_text(0x12, cell) + gds_short(0x1a, {mirror ? 0x8000 : 0}) +
           gds_put(0x1b, 5, gds_real(magnification)) + gds_put(0x1c, 5, gds_real(angle)) +
           gds_long(0x10, at) + gds_end();
}

inline std::string gds_array(const std::string& cell, int columns, int rows, const std::vector<int>& points) {
    return gds_put(0x0b, 0) + gds_text(0x12, cell) + gds_short(0x13, {columns, rows}) +
           gds_long(0x10, points) + gds_end();
}

inline std::string gds_cell(const std::string& name, const std::string& elements) {
    return gds_short(0x05, std::vector<int>(12, 0)) + gds_text(0x06, name) + elements + gds_put(0x07, 0);
}

inline std::string gds_library(const std::string& cells) {
    return gds_short(0x00, {600}) + gds_short(0x01, std::vector<int>(12, 0)) + gds_text(0x02, "LIB") +
           gds_put(0x03, 5, gds_real(1e-3) + gds_real(1e-9)) + cells + gds_put(0x04, 0);
}

}  // namespace sidewall::test
