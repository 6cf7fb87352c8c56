#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/schema/materials.hpp"
#include "surface/error.hpp"

// One table of keys a recipe section: it drives parsing, validation, the effective recipe and `sidewall
// models`.
namespace sidewall::app {

/// A number that depends on the material: `0.1`, or `{ Si = 0.2, Mask = 0.0, default = 0.1 }`.
struct ByMaterial {
    /// Of materials not named. Absent: the recipe must name those that are on the wafer.
    std::optional<double> fallback = 0.0;
    std::map<std::string, double, std::less<>> named = {};
    bool operator==(const ByMaterial&) const = default;
};

/// Expressions by name, as the recipe writes them; numbers as their text.
struct Expressions {
    std::map<std::string, std::string, std::less<>> named = {};
    bool operator==(const Expressions&) const = default;
};

/// The value of every material, by id; 0 for one without a value, which is not on the wafer
/// (recipe/step_materials.hpp).
std::vector<double> by_material_id(const ByMaterial& value, const Materials& materials);

struct Values;

/// What a key of a model can hold. An absent optional stands for the word that its rule names, e.g. "auto".
using Value =
    std::variant<bool, std::int64_t, double, std::optional<double>, std::string, std::vector<double>,
                 std::vector<std::string>, ByMaterial, Expressions, std::vector<Values>>;

/// The keys a model defines, and what the recipe says about them.
struct Values {
    std::map<std::string, Value, std::less<>> entries;

    /// The value of \p key.
    /// \throws std::logic_error naming the key if the model does not define it with type T.
    template <class T>
    const T& get(std::string_view key) const {
        const auto found = entries.find(key);
        const T* value = found == entries.end() ? nullptr : std::get_if<T>(&found->second);
        if (value == nullptr) refuse(key);
        return *value;
    }
    bool operator==(const Values& other) const;

  private:
    [[noreturn]] void refuse(std::string_view key) const;
};

/// Largest length, time or rate accepted anywhere: more is a typing error.
inline constexpr double kHuge = 1e9;

struct Key;

/// What a value must obey. Bounds hold for every number in it.
struct Rule {
    double min = -kHuge;
    double max = kHuge;
    bool above_min = false;                 ///< min itself is refused
    bool required = false;                  ///< there is no default
    bool material = false;                  ///< strings, or the names of expressions, name materials
    std::size_t size = 0;                   ///< numbers in a list, 0 = any
    bool whole = false;                     ///< a number that is whole
    std::string word = {};                  ///< what an absent optional number is written as
    std::vector<std::string> choices = {};  ///< the strings allowed, if not all
    std::vector<Key> keys;                  ///< of each table in a list of tables
};

/// A key that a model defines; the default's type is the key's type.
struct Key {
    std::string name;
    Value fallback;
    std::string unit;  ///< in terms of the recipe's length and time, empty for a pure number
    std::string doc;
    Rule rule = {};
    std::string former = {};  ///< a name it had, which recipes may still use
};

inline const Rule kPositive{.min = 0.0, .above_min = true};
inline const Rule kNotNegative{.min = 0.0};
inline const Rule kProbability{.min = 0.0, .max = 1.0};

/// The same rule without a default.
Rule required(Rule rule = {});

/// One or more one-byte enumerators, written as words.
struct Choice {
    std::uint8_t* values = nullptr;
    std::size_t count = 1;
    std::vector<std::string> words;  ///< indexed by enumerator
};

template <class E>
Choice choice(E& value, std::vector<std::string> words) {
    static_assert(std::is_enum_v<E> && sizeof(E) == 1);
    return {reinterpret_cast<std::uint8_t*>(&value), 1, std::move(words)};
}

template <class E, std::size_t N>
Choice choice(std::array<E, N>& values, std::vector<std::string> words) {
    static_assert(std::is_enum_v<E> && sizeof(E) == 1);
    return {reinterpret_cast<std::uint8_t*>(values.data()), N, std::move(words)};
}

/// Where a key's value lives. It holds the default until the recipe is read.
using Target = std::variant<bool*, std::int64_t*, double*, std::optional<double>*, std::string*,
                            std::span<double>, std::vector<double>*, std::vector<std::string>*, ByMaterial*,
                            Expressions*, std::vector<Values>*, Choice>;

/// A key bound to the member it fills.
struct Field {
    std::string name;
    Target target;
    std::string unit;
    std::string doc;
    Rule rule = {};
    std::string former = {};  ///< as in Key
};

/// Binds a model's keys to \p values, which gets the defaults of those it lacks. \p values must outlive the
/// fields.
std::vector<Field> bind(const std::vector<Key>& keys, Values& values);

/// A row of the documentation.
struct KeyDoc {
    std::string name, type, unit, fallback, doc;
    std::vector<std::string> words = {};  ///< what the value may be, where it is, or may be, a single word
};

/// The rows of \p fields, whose targets hold the defaults; keys of listed tables follow as `list[].key`.
std::vector<KeyDoc> document(const std::vector<Field>& fields);

/// Type, unit and default of a key in one line, e.g. "number, length, default 0.5".
std::string type_line(const KeyDoc& key);

/// "in [0, 1]", "greater than 0" and the like.
std::string range_text(const Rule& rule);

/// The value as TOML; nothing if there is none to write.
std::optional<std::string> toml_text(const Field& field);
std::string toml_text(double number);
std::string toml_text(const std::string& text);

/// `did you mean WORD?` after \p before, WORD being the candidate with the smallest edit distance to \p name,
/// capitals aside; \p otherwise if none is close: over a third of the letters of the longer one differ.
std::string did_you_mean(std::string_view before, std::string_view name,
                         std::span<const std::string> candidates, std::string_view otherwise = {});

/// A rule that a key breaks, found after it was read. The parser adds file, line and value.
struct KeyError : RecipeError {
    KeyError(std::string key_path, const std::string& broken_rule)
        : RecipeError(key_path + ": " + broken_rule), key(std::move(key_path)), rule(broken_rule) {}
    std::string key;   ///< relative to the section or step, e.g. "species[1].rate"
    std::string rule;  ///< what must hold and what to do
};

}  // namespace sidewall::app
