#include "app/recipe/gds.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <set>

#include "surface/error.hpp"
#include "surface/files/file.hpp"

namespace sidewall::app {
namespace {

constexpr std::uintmax_t kMostGdsBytes = 1'000'000'000;
constexpr std::size_t kMostCorners = 50'000'000;  // of what the cells hold

// Record types of the stream format, release 6.
enum Record : std::uint8_t {
    kHeader = 0x00,
    kEndLibrary = 0x04,
    kUnits = 0x03,
    kBeginCell = 0x05,
    kCellName = 0x06,
    kEndCell = 0x07,
    kBoundary = 0x08,
    kPath = 0x09,
    kReference = 0x0a,
    kArray = 0x0b,
    kLayer = 0x0d,
    kDatatype = 0x0e,
    kWidth = 0x0f,
    kPoints = 0x10,
    kEndElement = 0x11,
    kReferenceName = 0x12,
    kColumnsRows = 0x13,
    kTransform = 0x1a,
    kMagnification = 0x1b,
    kAngle = 0x1c,
    kPathType = 0x21,
    kBox = 0x2d,
    kBoxType = 0x2e
};

struct Entry {
    std::uint8_t type = 0;
    std::string_view data;
    std::size_t at = 0;  // its first byte in the file
};

// What one element gathers until its end.
struct Element {
    std::uint8_t kind = 0;
    int layer = 0, datatype = 0, path_type = 0;
    double width = 0.0;
    std::vector<std::array<double, 2>> points;
    GdsReference reference;
};

class Parser {
  public:
    Parser(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    GdsLibrary run() {
        library_.file = name_;
        if (next().type != kHeader) fail("is not a GDSII file: its first record is no header");
        while (true) {
            const Entry field = next();
            if (field.type == kEndLibrary) return std::move(library_);
            if (field.type == kUnits) {
                if (field.data.size() != 16) fail("units must be two numbers");
                library_.metres = real(field.data.substr(8));
                if (!(library_.metres > 0.0 && library_.metres < 1.0)) fail("units are out of range");
            } else if (field.type == kBeginCell) {
                cell();
            }
        }
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw FileError(fmt::format("{}: byte {}: {}; export it again", name_, at_, what));
    }

    Entry next() {
        at_ = position_;
        if (bytes_.size() - position_ < 4) fail("the file is cut off");
        const auto byte = [&](std::size_t k) { return static_cast<std::uint8_t>(bytes_[position_ + k]); };
        const std::size_t length = static_cast<std::size_t>(byte(0) << 8 | byte(1));
        if (length < 4 || length % 2 != 0) fail("a record's length is damaged");
        if (length > bytes_.size() - position_) fail("the file is cut off");
        const Entry field{byte(2), bytes_.substr(position_ + 4, length - 4), position_};
        position_ += length;
        return field;
    }

    int short_at(std::string_view data, std::size_t k) const {
        if (data.size() < 2 * k + 2) fail("a record is too short");
        const auto high = static_cast<std::uint8_t>(data[2 * k]),
                   low = static_cast<std::uint8_t>(data[2 * k + 1]);
        return static_cast<std::int16_t>(high << 8 | low);
    }

    double long_at(std::string_view data, std::size_t k) const {
        if (data.size() < 4 * k + 4) fail("a record is too short");
        std::uint32_t value = 0;
        for (std::size_t b = 0; b < 4; ++b) value = value << 8 | static_cast<std::uint8_t>(data[4 * k + b]);
        return static_cast<std::int32_t>(value);
    }

    // Sign, exponent of 16 plus 64, 56 bits of fraction.
    double real(std::string_view data) const {
        if (data.size() < 8) fail("a record is too short");
        std::uint64_t fraction = 0;
        for (std::size_t b = 1; b < 8; ++b) fraction = fraction << 8 | static_cast<std::uint8_t>(data[b]);
        const auto first = static_cast<std::uint8_t>(data[0]);
        const double size = std::ldexp(static_cast<double>(fraction), 4 * ((first & 0x7f) - 64) - 56);
        return first & 0x80 ? -size : size;
    }

    std::string text(std::string_view data) const {
        while (!data.empty() && data.back() == '\0') data.remove_suffix(1);
        return std::string(data);
    }

    void cell() {
        std::string cell_name;
        GdsCell cell;
        while (true) {
            const Entry field = next();
            if (field.type == kEndCell) break;
            if (field.type == kEndLibrary || field.type == kBeginCell) fail("a cell has no end");
            if (field.type == kCellName) cell_name = text(field.data);
            if (field.type == kBoundary || field.type == kPath || field.type == kReference ||
                field.type == kArray || field.type == kBox)
                finish(element(field.type), cell);
        }
        if (cell_name.empty()) fail("a cell has no name");
        if (!library_.cells.emplace(cell_name, std::move(cell)).second)
            fail(fmt::format("cell {} is defined twice", cell_name));
    }

    Element element(std::uint8_t kind) {
        Element e;
        e.kind = kind;
        while (true) {
            const Entry field = next();
            switch (field.type) {
                case kEndElement:
                    return e;
                case kEndCell:
                case kEndLibrary:
                case kBeginCell:
                    fail("an element has no end");
                case kLayer:
                    e.layer = short_at(field.data, 0) & 0xffff;
                    break;
                case kDatatype:
                case kBoxType:
                    e.datatype = short_at(field.data, 0) & 0xffff;
                    break;
                case kPathType:
                    e.path_type = short_at(field.data, 0);
                    break;
                case kWidth:
                    e.width = std::abs(long_at(field.data, 0));
                    break;
                case kPoints:
                    if (field.data.size() % 8 != 0) fail("a record of points is damaged");
                    for (std::size_t k = 0; k < field.data.size() / 8; ++k)
                        e.points.push_back({long_at(field.data, 2 * k), long_at(field.data, 2 * k + 1)});
                    break;
                case kReferenceName:
                    e.reference.cell = text(field.data);
                    break;
                case kColumnsRows:
                    e.reference.columns = short_at(field.data, 0);
                    e.reference.rows = short_at(field.data, 1);
                    if (e.reference.columns < 1 || e.reference.rows < 1)
                        fail("an array has no columns or rows");
                    break;
                case kTransform:
                    e.reference.mirror = (short_at(field.data, 0) & 0x8000) != 0;
                    break;
                case kMagnification:
                    e.reference.magnification = real(field.data);
                    break;
                case kAngle:
                    e.reference.angle = real(field.data) * std::numbers::pi / 180.0;
                    break;
                default:
                    break;
            }
        }
    }

    void finish(Element e, GdsCell& cell) {
        if (e.kind == kReference || e.kind == kArray) {
            GdsReference& r = e.reference;
            if (r.cell.empty() || e.points.size() != (e.kind == kArray ? 3u : 1u))
                fail("a reference lacks its cell or place");
            r.origin = e.points[0];
            if (e.kind == kArray)
                for (std::size_t a = 0; a < 2; ++a) {
                    r.column_step[a] = (e.points[1][a] - r.origin[a]) / r.columns;
                    r.row_step[a] = (e.points[2][a] - r.origin[a]) / r.rows;
                }
            cell.references.push_back(std::move(r));
            return;
        }
        if (e.kind == kPath) {
            if (e.points.size() < 2) fail("a path has fewer than two points");
            count_corners(4 * e.points.size());
            segments(e, cell);
            return;
        }
        if (e.points.size() > 1 && e.points.front() == e.points.back()) e.points.pop_back();
        if (e.points.size() < 3) fail("a polygon has fewer than three corners");
        count_corners(e.points.size());
        cell.shapes.push_back({e.layer, e.datatype, std::move(e.points)});
    }

    void count_corners(std::size_t more) {
        if ((corners_ += more) > kMostCorners)
            throw FileError(
                fmt::format("{}: its cells hold over {} corners of polygons; export less of the chip", name_,
                            kMostCorners));
    }

    // A rectangle a segment; at bends they reach half a width farther and so meet.
    static void segments(const Element& e, GdsCell& cell) {
        const double half = 0.5 * e.width;
        for (std::size_t k = 0; k + 1 < e.points.size(); ++k) {
            auto [ax, ay] = e.points[k];
            auto [bx, by] = e.points[k + 1];
            const double length = std::hypot(bx - ax, by - ay);
            if (!(length > 0.0 && half > 0.0)) continue;
            const double ux = (bx - ax) / length * half, uy = (by - ay) / length * half;
            const bool flush = e.path_type == 0;
            if (k > 0 || !flush) ax -= ux, ay -= uy;
            if (k + 2 < e.points.size() || !flush) bx += ux, by += uy;
            cell.shapes.push_back(
                {e.layer,
                 e.datatype,
                 {{ax + uy, ay - ux}, {bx + uy, by - ux}, {bx - uy, by + ux}, {ax - uy, ay + ux}}});
        }
    }

    std::string_view bytes_;
    const std::string& name_;
    std::size_t position_ = 0, at_ = 0, corners_ = 0;
    GdsLibrary library_;
};

}  // namespace

GdsLibrary parse_gds(std::string_view bytes, const std::string& name) {
    return Parser(bytes, name).run();
}

GdsLibrary read_gds(const std::filesystem::path& path) {
    std::error_code failure;
    const std::uintmax_t size = std::filesystem::file_size(path, failure);
    if (failure) throw FileError(fmt::format("{}: cannot be read: {}", path.string(), failure.message()));
    if (size > kMostGdsBytes)
        throw FileError(fmt::format("{}: larger than {} bytes", path.string(), kMostGdsBytes));
    return parse_gds(surface::read_whole_file(path), path.string());
}

std::vector<std::string> top_cells(const GdsLibrary& library) {
    std::set<std::string> placed;
    for (const auto& [name, cell] : library.cells)
        for (const GdsReference& reference : cell.references) placed.insert(reference.cell);
    std::vector<std::string> tops;
    for (const auto& [name, cell] : library.cells)
        if (!placed.contains(name)) tops.push_back(name);
    return tops;
}

}  // namespace sidewall::app
