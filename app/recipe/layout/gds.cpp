#include "app/recipe/layout/gds.hpp"

#include <cmath>
#include <numbers>

#include "surface/error.hpp"

namespace sidewall::app {
namespace {

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
    kBoxType = 0x2e,
    kBeginExtension = 0x30,
    kEndExtension = 0x31
};

struct Entry {
    std::uint8_t type = 0;
    std::string_view data;
};

struct Element {
    std::uint8_t kind = 0;
    int layer = 0, datatype = 0, path_type = 0;
    double width = 0.0, begin = 0.0, end = 0.0;  // a negative width is absolute
    levelset::Polygon points;
    CellReference reference;
    Repetition repetition;
};

class GdsParser {
  public:
    GdsParser(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    Layout run() {
        layout_.file = name_;
        if (next().type != kHeader) fail("is not a GDSII file: its first record is no header");
        while (true) {
            const Entry field = next();
            if (field.type == kEndLibrary) return std::move(layout_);
            if (field.type == kUnits) {
                if (field.data.size() != 16) fail("units must be two numbers");
                layout_.metres = real(field.data.substr(8));
                if (!(layout_.metres > 0.0 && layout_.metres < 1.0)) fail("units are out of range");
            } else if (field.type == kBeginCell) {
                cell();
            }
        }
    }

  private:
    [[noreturn]] void fail(const std::string& what) const {
        throw FileError("{}: byte {}: {}; export it again", name_, at_, what);
    }

    Entry next() {
        at_ = position_;
        if (bytes_.size() - position_ < 4) fail("the file is cut off");
        const std::size_t length = integer<std::uint16_t>(bytes_.substr(position_));
        if (length < 4 || length % 2 != 0) fail("a record's length is damaged");
        if (length > bytes_.size() - position_) fail("the file is cut off");
        const Entry field{static_cast<std::uint8_t>(bytes_[position_ + 2]),
                          bytes_.substr(position_ + 4, length - 4)};
        position_ += length;
        return field;
    }

    // Integer number \p k of a record; the highest byte comes first.
    template <class Integer>
    Integer integer(std::string_view data, std::size_t k = 0) const {
        if (data.size() < (k + 1) * sizeof(Integer)) fail("a record is too short");
        std::uint64_t value = 0;
        for (const char byte : data.substr(k * sizeof(Integer), sizeof(Integer)))
            value = value << 8 | static_cast<std::uint8_t>(byte);
        return static_cast<Integer>(value);
    }

    // GDSII real: a sign bit, 7 bits of exponent to base 16, offset by 64, and 56 bits of fraction.
    double real(std::string_view data) const {
        const auto bits = integer<std::uint64_t>(data);
        const int exponent = 4 * (static_cast<int>(bits >> 56 & 0x7f) - 64) - 56;
        const double size = std::ldexp(static_cast<double>(bits & 0xff'ffff'ffff'ffff), exponent);
        return bits >> 63 != 0 ? -size : size;
    }

    std::string text(std::string_view data) const {
        while (!data.empty() && data.back() == '\0') data.remove_suffix(1);
        return std::string(data);
    }

    void cell() {
        std::string cell_name;
        LayoutCell cell;
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
        add_cell(layout_, cell_name, std::move(cell));
    }

    Element element(std::uint8_t kind) {
        Element e;
        e.kind = kind;
        while (true) {
            const auto [type, data] = next();
            if (type == kEndElement) return e;
            if (type == kEndCell || type == kEndLibrary || type == kBeginCell) fail("an element has no end");
            if (type == kLayer) e.layer = integer<std::uint16_t>(data);
            if (type == kDatatype || type == kBoxType) e.datatype = integer<std::uint16_t>(data);
            if (type == kPathType) e.path_type = integer<std::int16_t>(data);
            if (type == kWidth) e.width = integer<std::int32_t>(data);
            if (type == kBeginExtension) e.begin = integer<std::int32_t>(data);
            if (type == kEndExtension) e.end = integer<std::int32_t>(data);
            if (type == kReferenceName) e.reference.cell = text(data);
            if (type == kTransform) e.reference.mirror = (integer<std::uint16_t>(data) & 0x8000) != 0;
            if (type == kMagnification) e.reference.magnification = real(data);
            if (type == kAngle) e.reference.angle = real(data) * std::numbers::pi / 180.0;
            if (type == kPoints) {
                if (data.size() % 8 != 0) fail("a record of points is damaged");
                for (std::size_t k = 0; k < data.size() / 4; k += 2)
                    e.points.push_back({static_cast<double>(integer<std::int32_t>(data, k)),
                                        static_cast<double>(integer<std::int32_t>(data, k + 1))});
            }
            if (type == kColumnsRows) {
                const int columns = integer<std::int16_t>(data), rows = integer<std::int16_t>(data, 1);
                if (columns < 1 || rows < 1) fail("an array has no columns or rows");
                e.repetition.columns = static_cast<std::uint64_t>(columns);
                e.repetition.rows = static_cast<std::uint64_t>(rows);
            }
        }
    }

    void finish(Element e, LayoutCell& cell) {
        if (e.kind == kReference || e.kind == kArray) {
            if (e.reference.cell.empty() || e.points.size() != (e.kind == kArray ? 3u : 1u))
                fail("a reference lacks its cell or place");
            e.reference.origin = e.points[0];
            if (e.kind == kArray) {
                for (std::size_t a = 0; a < 2; ++a) {
                    e.repetition.column_step[a] =
                        (e.points[1][a] - e.points[0][a]) / static_cast<double>(e.repetition.columns);
                    e.repetition.row_step[a] =
                        (e.points[2][a] - e.points[0][a]) / static_cast<double>(e.repetition.rows);
                }
                e.reference.repetition = static_cast<std::uint32_t>(layout_.repetitions.size());
                layout_.repetitions.push_back(std::move(e.repetition));
            }
            cell.references.push_back(std::move(e.reference));
        } else if (e.kind == kPath) {
            if (e.points.empty()) fail("a path has no points");
            levelset::PathStyle style{0.5 * std::abs(e.width), e.begin, e.end, e.path_type == 1};
            if (e.path_type != 4) style.begin = style.end = e.path_type == 2 ? style.half_width : 0.0;
            if (e.width < 0.0)
                cell.paths.push_back({e.layer, e.datatype, std::move(e.points), style, e.path_type == 2});
            else
                add_path(layout_, cell, {e.layer, e.datatype, std::move(e.points)}, style);
        } else {
            if (e.points.size() < 3) fail("a polygon has fewer than three corners");
            add_polygon(layout_, cell, {e.layer, e.datatype, std::move(e.points)});
        }
    }

    std::string_view bytes_;
    const std::string& name_;
    std::size_t position_ = 0, at_ = 0;
    Layout layout_;
};

}  // namespace

Layout parse_gds(std::string_view bytes, const std::string& name) {
    return GdsParser(bytes, name).run();
}

}  // namespace sidewall::app
