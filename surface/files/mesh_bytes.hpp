#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "surface/error.hpp"
#include "surface/files/file.hpp"
#include "surface/triangle_mesh.hpp"

// Internal helpers shared by the readers and writers of mesh files.
namespace sidewall::surface {

static_assert(std::endian::native == std::endian::little,
              "mesh files are written from memory, little endian first");

/// The scalar types of VTP and PLY.
enum class FileScalar { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

constexpr std::size_t byte_size(FileScalar type) {
    constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return kSizes[static_cast<std::size_t>(type)];
}

template <class T>
T load(const char* bytes, bool big_endian) {
    char copy[sizeof(T)];
    std::memcpy(copy, bytes, sizeof(T));
    if (big_endian) std::reverse(copy, copy + sizeof(T));
    T value;
    std::memcpy(&value, copy, sizeof(T));
    return value;
}

template <class T>
double load_as(const char* bytes, bool big_endian) {
    return static_cast<double>(load<T>(bytes, big_endian));
}

/// Reads one value as double; integers beyond 2^53 are rounded.
inline double load_scalar(const char* bytes, FileScalar type, bool big_endian) {
    constexpr double (*kLoad[])(const char*, bool) = {
        load_as<std::int8_t>,  load_as<std::uint8_t>,  load_as<std::int16_t>, load_as<std::uint16_t>,
        load_as<std::int32_t>, load_as<std::uint32_t>, load_as<std::int64_t>, load_as<std::uint64_t>,
        load_as<float>,        load_as<double>};
    return kLoad[static_cast<std::size_t>(type)](bytes, big_endian);
}

/// Type that stores values read from a file: integers become int32 if all fit, else float64.
inline Scalar attribute_scalar(FileScalar type, const std::vector<double>& values) {
    if (type == FileScalar::float32) return Scalar::float32;
    if (type == FileScalar::float64) return Scalar::float64;
    const bool fits = std::all_of(values.begin(), values.end(),
                                  [](double v) { return v >= -2147483648.0 && v <= 2147483647.0; });
    return fits ? Scalar::int32 : Scalar::float64;
}

/// Converts to int32 by truncation; values out of range are clamped, NaN becomes 0.
inline std::int32_t to_int32(double value) {
    if (!(value == value)) return 0;
    return static_cast<std::int32_t>(std::clamp(value, -2147483648.0, 2147483647.0));
}

template <class T>
void append_value(std::string& bytes, T value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void append_scalar(std::string& bytes, Scalar type, double value) {
    if (type == Scalar::float32) append_value(bytes, static_cast<float>(value));
    if (type == Scalar::float64) append_value(bytes, value);
    if (type == Scalar::int32) append_value(bytes, to_int32(value));
}

/// The text without a UTF-8 byte order mark.
/// \throws FileError for UTF-16.
std::string_view without_mark(std::string_view text, const std::string& name);

/// The line that starts at \p at, without its end; moves \p at to the next line. Line ends: LF, CR LF, CR.
std::string_view next_line(std::string_view text, std::size_t& at);

void skip_space(std::string_view& text);

/// Reads a number at the start of a text and removes it there; nothing if the characters up to the next white
/// space are not a number.
std::optional<double> next_number(std::string_view& text);

/// The first characters of a text, made printable for messages.
std::string excerpt(std::string_view text);

/// Limit for the memory that decoding a file takes, checked before it is taken. Well-compressed values, or
/// one cell's values repeated for its many triangles, can turn kilobytes into gigabytes.
class MemoryBudget {
  public:
    /// Allows kLeast bytes plus kTimes the file's size; meshes of this program take ten times their file's.
    MemoryBudget(std::string name, std::size_t file_size)
        : name_(std::move(name)), left_(kLeast + kTimes * static_cast<double>(file_size)), all_(left_) {}

    /// \throws FileError naming the file if \p count more doubles exceed the budget.
    void take_doubles(double count) {
        left_ -= 8.0 * count;
        if (left_ < 0.0)
            throw FileError(
                "{}: unfolds to over {:.0f} MB, {:g} MB and {:g} times its size: it is damaged, or "
                "save it uncompressed and without attributes",
                name_, 1e-6 * all_, 1e-6 * kLeast, kTimes);
    }

  private:
    static constexpr double kLeast = 32e6, kTimes = 300.0;
    std::string name_;
    double left_, all_;
};

/// Triangles made of the cells of a file, and the cell that each came from.
struct CellTriangles {
    std::vector<Triangle> triangles;
    std::vector<std::uint32_t> cell;

    template <class Indices>
    void add_polygon(const Indices& v, std::uint32_t cell_index) {
        for (std::size_t k = 2; k < v.size(); ++k) add({v[0], v[k - 1], v[k]}, cell_index);
    }
    template <class Indices>
    void add_strip(const Indices& v, std::uint32_t cell_index) {
        // Every second triangle of a strip lists its corners in reverse. Those with repeated corners only
        // join parts of the strip.
        for (std::size_t k = 2; k < v.size(); ++k)
            if (v[k - 2] != v[k - 1] && v[k - 1] != v[k] && v[k] != v[k - 2])
                add(k % 2 == 0 ? Triangle{v[k - 2], v[k - 1], v[k]} : Triangle{v[k - 1], v[k - 2], v[k]},
                    cell_index);
    }
    void add(const Triangle& triangle, std::uint32_t cell_index) {
        triangles.push_back(triangle);
        cell.push_back(cell_index);
    }
};

/// Checks a mesh that was read: it has triangles, finite coordinates up to 1e15 and valid indices.
/// \throws FileError.
void check_read_mesh(const TriangleMesh& mesh, const std::string& name);

/// Checks before writing that every attribute has one value per element and component.
/// \throws GeometryError.
void check_written_mesh(const TriangleMesh& mesh);

}  // namespace sidewall::surface
