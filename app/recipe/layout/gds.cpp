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
    std::size_t at = 0;  // position of the record in the file
};

// Fields of an element, collected until its end.
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

    // GDSII real: a sign bit, 7 bits of exponent to base 16, offset by 64, and 56 bits of fraction.
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
                    e.width = long_at(field.data, 0);
                    break;
                case kBeginExtension:
                    e.begin = long_at(field.data, 0);
                    break;
                case kEndExtension:
                    e.end = long_at(field.data, 0);
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
                    for (std::size_t k = 0; k < 2; ++k) {
                        const int count = short_at(field.data, k);
                        if (count < 1) fail("an array has no columns or rows");
                        (k == 0 ? e.repetition.columns : e.repetition.rows) =
                            static_cast<std::uint64_t>(count);
                    }
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
