#include "app/recipe/layout/oasis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <optional>

#include "app/recipe/layout/oasis_stream.hpp"
#include "surface/error.hpp"

namespace sidewall::app {
namespace {

// Corners of CTRAPEZOIDs by type, x and y in turn: width w, height h, W = 2 w, H = 2 h, d = w - h, e = h - w.
constexpr std::array<std::string_view, 26> kCompact = {
    "000hdhw0", "000hwhd0", "00hhwhw0", "h00hwhw0", "00hhdhw0", "h00hwhd0", "00hhwhd0",
    "h00hdhw0", "000hwew0", "000ewhw0", "000hwhww", "0w0hwhw0", "000hweww", "0w0ewhw0",
    "000ewhww", "0w0hwew0", "000ww0",   "000www",   "00www0",   "0wwww0",   "00hhH0",
    "0hHhh0",   "000Www",   "0wwWw0",   "000hwhw0", "000wwww0"};

// Modal variables: a record that omits a field uses the last value given before.
struct Modal {
    bool relative = false;
    std::array<double, 2> at{}, placement{}, text{};
    std::optional<std::uint64_t> layer, datatype, compact;
    std::optional<double> width, height, half_width, begin, end, radius;
    std::optional<levelset::Polygon> polygon, path;
    std::optional<std::string> cell;
    std::optional<std::uint32_t> repetition;
};

class OasisParser {
  public:
    OasisParser(std::string_view bytes, const std::string& name) : in_(bytes, name, kOasisMagic.size()) {
        layout_.file = name;
    }

    Layout run() {
        if (in_.record() != 1 || in_.text() != "1.0") in_.fail("is not of version 1.0");
        layout_.metres = 1e-6 / in_.real();
        if (!(layout_.metres > 0.0 && layout_.metres < 1.0)) in_.fail("units are out of range");
        if (in_.number() == 0) skip_numbers(12);
        for (std::uint64_t type = in_.record(); type != 2; type = in_.record())
            if (!names(type) && !modes(type)) element(type);
        finish_cell();
        for (auto& [key, cell] : cells_) {
            for (CellReference& reference : cell.references) reference.cell = named(reference.cell);
            add_cell(layout_, named(key), std::move(cell));
        }
        return std::move(layout_);
    }

  private:
    // Key of a cell known by number only, until all names are read. No valid name begins with a line break.
    static std::string key_of(std::uint64_t number) { return fmt::format("\n{}", number); }

    std::string named(const std::string& key) const {
        if (!key.starts_with('\n')) return key;
        const auto found = names_.find(key);
        if (found == names_.end()) in_.fail(fmt::format("cell number {} has no name", key.substr(1)));
        return found->second;
    }

    template <class Value>
    const Value& known(const std::optional<Value>& value) const {
        if (!value) in_.fail("an element omits a value that no element before it has set");
        return *value;
    }

    void skip_numbers(int count) {
        for (; count > 0; --count) in_.number();
    }

    void finish_cell() {
        if (!open_) return;
        cells_.emplace_back(std::move(*open_));
        open_.reset();
    }

    // Reads a record of a table of names; keeps those of cells. Returns whether it was one.
    bool names(std::uint64_t type) {
        if (type < 3 || (type > 12 && type != 30 && type != 31)) return false;
        if (type >= 30) in_.number();
        std::string text = in_.text();
        const bool numbered = type == 31 || (type <= 10 && type % 2 == 0);
        if (type == 11 || type == 12) {  // two intervals: of layers and of datatypes
            for (int k = 0; k < 2; ++k) {
                const std::uint64_t kind = in_.number();
                if (kind > 4) in_.fail("an interval of layers is of an unknown type");
                skip_numbers(kind == 0 ? 0 : kind == 4 ? 2 : 1);
            }
            return true;
        }
        const std::uint64_t number = numbered ? in_.number() : next_name_;
        if (type == 3 || type == 4) {
            if (type == 3) ++next_name_;
            names_[key_of(number)] = std::move(text);
        }
        return true;
    }

    // Handles records that draw nothing. Returns whether it was one.
    bool modes(std::uint64_t type) {
        if (type == 13 || type == 14) {
            finish_cell();
            modal_ = {};
            open_.emplace(type == 13 ? key_of(in_.number()) : in_.text(), LayoutCell{});
        } else if (type == 15 || type == 16) {
            modal_.relative = type == 16;
        } else if (type == 28) {
            property();
        } else if (type == 32) {
            in_.number();
            in_.text();
        } else if (type == 34) {
            in_.open_block();
        } else {
            return type == 0 || type == 29;
        }
        return true;
    }

    void property() {
        const unsigned info = in_.byte();
        if ((info & 0x04) != 0) {
            if ((info & 0x02) != 0)
                in_.number();
            else
                in_.text();
        }
        if ((info & 0x08) != 0) return;
        std::uint64_t count = info >> 4;
        if (count == 15) count = in_.number();
        for (; count > 0; --count) {
            const std::uint64_t type = in_.number();
            if (type < 8)
                in_.real(type);
            else if (type >= 10 && type <= 12)
                in_.text();
            else if (type <= 15)
                in_.number();
            else
                in_.fail("a property is of an unknown type");
        }
    }

    void element(std::uint64_t type) {
        if (!open_) in_.fail("an element lies outside all cells, or a record is of an unknown type");
        if (type == 17 || type == 18) return placement(type == 18);
        if (type == 19) return text();
        if (type == 20) return rectangle();
        if (type == 21) return polygon();
        if (type == 22) return path();
        if (type >= 23 && type <= 25) return trapezoid(type);
        if (type == 26) return compact_trapezoid();
        if (type == 27) return circle();
        in_.fail(type == 33 ? "an XGEOMETRY record, whose meaning OASIS leaves to the program that wrote it"
                            : "a record is of an unknown type");
    }

    // Reads the position and repetition at the end of each element; returns the index of the repetition.
    std::uint32_t end_element(bool x, bool y, bool repeated, std::array<double, 2>& at) {
        for (std::size_t a = 0; a < 2; ++a)
            if (a == 0 ? x : y) at[a] = in_.signed_length() + (modal_.relative ? at[a] : 0.0);
        if (!repeated) return 0;
        const std::uint64_t type = in_.number();
        if (type == 0) return known(modal_.repetition);
        modal_.repetition = static_cast<std::uint32_t>(layout_.repetitions.size());
        layout_.repetitions.push_back(in_.repetition(type));
        return *modal_.repetition;
    }

    void placement(bool scaled) {
        const unsigned info = in_.byte();
        if ((info & 0x80) != 0) modal_.cell = (info & 0x40) != 0 ? key_of(in_.number()) : in_.text();
        CellReference reference{.cell = known(modal_.cell), .mirror = (info & 0x01) != 0};
        if (!scaled) {
            reference.angle = (info >> 1 & 3) * std::numbers::pi / 2.0;
        } else {
            if ((info & 0x04) != 0) reference.magnification = in_.real();
            if ((info & 0x02) != 0) reference.angle = in_.real() * std::numbers::pi / 180.0;
        }
        reference.repetition =
            end_element((info & 0x20) != 0, (info & 0x10) != 0, (info & 0x08) != 0, modal_.placement);
        reference.origin = modal_.placement;
        open_->second.references.push_back(std::move(reference));
    }

    void text() {
        const unsigned info = in_.byte();
        if ((info & 0x40) != 0) {
            if ((info & 0x20) != 0)
                in_.number();
            else
                in_.text();
        }
        skip_numbers((info & 0x01) != 0 ? 1 : 0);
        skip_numbers((info & 0x02) != 0 ? 1 : 0);
        end_element((info & 0x10) != 0, (info & 0x08) != 0, (info & 0x04) != 0, modal_.text);
    }

    // Reads the first byte of a shape, which says which fields follow, and the layer.
    LayoutShape shape() {
        info_ = in_.byte();
        if ((info_ & 0x01) != 0) modal_.layer = in_.number();
        if ((info_ & 0x02) != 0) modal_.datatype = in_.number();
        const auto small = [](std::uint64_t n) {
            return static_cast<int>(std::min<std::uint64_t>(n, 65536));
        };
        return {small(known(modal_.layer)), small(known(modal_.datatype)), {}};
    }

    void size() {
        if ((info_ & 0x40) != 0) modal_.width = in_.length();
        if ((info_ & 0x20) != 0) modal_.height = in_.length();
    }

    // Reads the position of a shape and moves its corners there.
    void end_shape(LayoutShape& shape) {
        shape.repetition =
            end_element((info_ & 0x10) != 0, (info_ & 0x08) != 0, (info_ & 0x04) != 0, modal_.at);
        for (auto& p : shape.polygon)
            for (std::size_t a = 0; a < 2; ++a) p[a] += modal_.at[a];
    }

    void add(LayoutShape shape) {
        end_shape(shape);
        add_polygon(layout_, open_->second, std::move(shape));
    }

    void rectangle() {
        LayoutShape box = shape();
        size();
        if ((info_ & 0x80) != 0) modal_.height = known(modal_.width);
        const double w = known(modal_.width), h = known(modal_.height);
        box.polygon = {{0.0, 0.0}, {w, 0.0}, {w, h}, {0.0, h}};
        add(std::move(box));
    }

    void polygon() {
        LayoutShape polygon = shape();
        if ((info_ & 0x20) != 0) modal_.polygon = in_.points(true);
        polygon.polygon = known(modal_.polygon);
        add(std::move(polygon));
    }

    void path() {
        LayoutShape line = shape();
        if ((info_ & 0x40) != 0) modal_.half_width = in_.length();
        const double half = known(modal_.half_width);
        if ((info_ & 0x80) != 0) {
            const std::uint64_t scheme = in_.number();
            extension(scheme >> 2, half, modal_.begin);
            extension(scheme, half, modal_.end);
        }
        if ((info_ & 0x20) != 0) modal_.path = in_.points(false);
        line.polygon = known(modal_.path);
        end_shape(line);
        add_path(layout_, open_->second, line, {half, known(modal_.begin), known(modal_.end), false});
    }

    void extension(std::uint64_t scheme, double half, std::optional<double>& value) {
        if ((scheme & 3) == 1) value = 0.0;
        if ((scheme & 3) == 2) value = half;
        if ((scheme & 3) == 3) value = in_.signed_length();
    }

    void trapezoid(std::uint64_t type) {
        LayoutShape trapezoid = shape();
        size();
        double w = known(modal_.width), h = known(modal_.height);
        const double a = type != 25 ? in_.signed_length() : 0.0, b = type != 24 ? in_.signed_length() : 0.0;
        const bool upright = (info_ & 0x80) != 0;
        // The file describes the trapezoid with parallel sides along x, the first on top, then turns it.
        if (upright) std::swap(w, h);
        trapezoid.polygon = {{std::max(a, 0.0), h},
                             {w + std::min(b, 0.0), h},
                             {w - std::max(b, 0.0), 0.0},
                             {-std::min(a, 0.0), 0.0}};
        if (upright)  // the first side becomes the left one
            for (auto& [x, y] : trapezoid.polygon) {
                y = h - y;
                std::swap(x, y);
            }
        add(std::move(trapezoid));
    }

    void compact_trapezoid() {
        LayoutShape trapezoid = shape();
        if ((info_ & 0x80) != 0) modal_.compact = in_.number();
        size();
        const std::uint64_t type = known(modal_.compact);
        if (type >= kCompact.size()) in_.fail("a CTRAPEZOID is of an unknown type");
        const auto length = [&](char c) {
            if (c == '0') return 0.0;
            if (c == 'd') return known(modal_.width) - known(modal_.height);
            if (c == 'e') return known(modal_.height) - known(modal_.width);
            const double size = known(c == 'w' || c == 'W' ? modal_.width : modal_.height);
            return c == 'W' || c == 'H' ? 2.0 * size : size;
        };
        const std::string_view corners = kCompact[type];
        for (std::size_t k = 0; k < corners.size(); k += 2)
            trapezoid.polygon.push_back({length(corners[k]), length(corners[k + 1])});
        add(std::move(trapezoid));
    }

    void circle() {
        LayoutShape disc = shape();
        if ((info_ & 0x20) != 0) modal_.radius = in_.length();
        disc.polygon = {{0.0, 0.0}};
        end_shape(disc);
        add_path(layout_, open_->second, disc, {known(modal_.radius), 0.0, 0.0, true});
    }

    OasisStream in_;
    Layout layout_;
    Modal modal_;
    unsigned info_ = 0;
    std::uint64_t next_name_ = 0;
    std::map<std::string, std::string> names_;  // by key_of(number)
    std::optional<std::pair<std::string, LayoutCell>> open_;
    std::vector<std::pair<std::string, LayoutCell>> cells_;
};

}  // namespace

Layout parse_oasis(std::string_view bytes, const std::string& name) {
    if (!bytes.starts_with(kOasisMagic)) throw FileError("{}: is not an OASIS file", name);
    return OasisParser(bytes, name).run();
}

}  // namespace sidewall::app
