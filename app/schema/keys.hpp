#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "surface/error.hpp"

// Keys of recipes. A list of keys drives parsing, validation, the effective recipe and `sidewall models`.
namespace sidewall::app {

/// A material that layers are made of.
struct Material {
    std::string name;
    std::string colour = "#b0b0b0";  ///< in pictures; hexadecimal, as "\#rrggbb"
    double density = 5.0;            ///< atoms, or formula units of a compound, in 1e22 /cm^3
    bool operator==(const Material&) const = default;
};

/// Materials; the index of one is its id. The built-in ones come first, always in the same order, so that
/// their ids are the same in every run; those that a recipe adds follow.
using Materials = std::vector<Material>;

/// The built-in materials.
const Materials& default_materials();

/// The id of the material called \p name, if there is one.
std::optional<int> material_id(const Materials& materials, std::string_view name);

/// The id of the material called \p name, else of the built-in one for which \p name is a common word, such
/// as photoresist for Resist or SiN for Si3N4.
std::optional<int> meant_material(const Materials& materials, std::string_view name);

/// A common word for a built-in material.
struct MaterialWord {
    const char* word;  ///< in small letters; compared without regard to case
    const char* name;
};

const std::vector<MaterialWord>& material_words();

std::vector<std::string> material_names(const Materials& materials);

/// A number that depends on the material: `0.1`, or `{ Si = 0.2, Mask = 0.0, default = 0.1 }`.
struct ByMaterial {
    /// The number for materials not named. Without it a recipe must name all that are on the wafer.
    std::optional<double> fallback = 0.0;
    std::map<std::string, double, std::less<>> named = {};
    bool operator==(const ByMaterial&) const = default;
};

/// Expressions by name, as the recipe writes them; a number is kept as its text.
struct Expressions {
    std::map<std::string, std::string, std::less<>> named = {};
    bool operator==(const Expressions&) const = default;
};

/// The number of every material, indexed by id. A material without a number gets 0; such a material is not on
/// the wafer (recipe/step_materials.hpp).
inline std::vector<double> by_material_id(const ByMaterial& value, const Materials& materials) {
    std::vector<double> result;
    for (const Material& material : materials) {
        const auto found = value.named.find(material.name);
        result.push_back(found == value.named.end() ? value.fallback.value_or(0.0) : found->second);
    }
    return result;
}

/// Largest length, time or rate accepted anywhere: a larger one is taken for a typing error.
inline constexpr double kHuge = 1e9;

/// The rule that a key's value must obey. Bounds hold for every number in the value.
struct Rule {
    double min = -kHuge;
    double max = kHuge;
    bool above_min = false;  ///< min itself is refused
    bool required = false;   ///< there is no default
    bool material = false;   ///< strings, or the names of expressions, name materials
    std::size_t size = 0;    ///< numbers in a list, 0 = any; of a span: the shorter list allowed
    bool or_one = false;     ///< one string may stand for a list of strings
    bool whole = false;      ///< only whole numbers
    std::string word = {};   ///< stands for an absent optional number
    std::vector<std::string> choices = {};  ///< the strings allowed, if not all
};

inline const Rule kPositive{.min = 0.0, .above_min = true};
inline const Rule kNotNegative{.min = 0.0};
inline const Rule kProbability{.min = 0.0, .max = 1.0};
inline const Rule kMaterial{.material = true};

Rule within(double min, double max);
Rule positive_to(double max);
Rule one_of(std::vector<std::string> choices);

/// The rule of a list of \p numbers numbers.
Rule sized(std::size_t numbers);

/// The rule of a key that has no default.
Rule required(Rule rule = {});

/// The rule of an optional number; \p word is written where the number is absent.
Rule or_word(std::string word, Rule rule = {});

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

struct Key;

/// A list of tables in a recipe, each of which fills one element of a vector of structs.
struct TableList {
    std::function<std::size_t()> size;
    std::function<void(std::size_t)> resize;            ///< new elements hold the defaults
    std::function<std::vector<Key>(std::size_t)> keys;  ///< of an element; they live until the next resize
};

/// \param keys  lists the keys of an element.
template <class T>
TableList table_list(std::vector<T>& list, std::vector<Key> (*keys)(T&)) {
    return {[&list] { return list.size(); }, [&list](std::size_t size) { list.resize(size); },
            [&list, keys](std::size_t i) { return keys(list[i]); }};
}

/// The member that a key fills, which holds the default until the recipe is read. An absent optional stands
/// for the word that the rule names, e.g. "auto".
using Target = std::variant<bool*, std::int64_t*, double*, std::optional<double>*, std::string*,
                            std::span<double>, std::vector<double>*, std::vector<std::string>*, ByMaterial*,
                            Expressions*, TableList, Choice>;

/// A key of a recipe: its name, the member that it fills, its unit, documentation and rule. The member's type
/// and initial value are the key's type and default.
struct Key {
    std::string name;
    Target target;
    std::string unit;  ///< in terms of the recipe's length and time, empty for a pure number
    std::string doc;
    Rule rule = {};
    std::string former = {};  ///< an older name, which recipes may still use
};

/// The member that the key \p name fills; nullptr if no key of that name fills one of type T.
template <class T>
T* target_of(const std::vector<Key>& keys, std::string_view name) {
    for (const Key& key : keys)
        if (key.name == name)
            if (T* const* target = std::get_if<T*>(&key.target)) return *target;
    return nullptr;
}

/// Whether the value of a key is the path of a file that the recipe reads.
bool names_file(const Key& key);

/// Calls \p visit with every key and its path; the path of a key in a list of tables is `list[0].key`.
void each_key(const std::vector<Key>& keys,
              const std::function<void(const Key&, const std::string& path)>& visit,
              const std::string& before = {});

/// Appends \p more, e.g. the keys that several models share, to \p keys.
void append_keys(std::vector<Key>& keys, std::vector<Key> more);

/// The documentation of a key, as texts.
struct KeyDoc {
    std::string name, type, unit, fallback, doc;
    std::vector<std::string> words = {};  ///< the words that the value may be, if it can be a single word
};

/// Documents keys whose targets hold the defaults. A list of tables is followed by its keys, as `list[].key`.
std::vector<KeyDoc> document(const std::vector<Key>& keys);

/// The type, unit and default of a key in one line, e.g. "number, length, default 0.5".
std::string type_line(const KeyDoc& key);

/// The bounds of a rule as text: "in [0, 1]", "greater than 0" and the like.
std::string range_text(const Rule& rule);

/// The value that a key's target holds, as TOML; nothing if there is none to write.
std::optional<std::string> toml_text(const Key& key);
std::string toml_text(double number);
std::string toml_text(const std::string& text);

/// Whether TOML lets a key without quotes hold \p c.
bool key_character(char c);

/// A key in TOML: in quotes where it needs them.
std::string key_text(const std::string& key);

/// \p before and `did you mean WORD?`, with the candidate of the smallest edit distance to \p name, without
/// regard to case; \p otherwise if that distance is over a third of the letters of the longer word.
std::string did_you_mean(std::string_view before, std::string_view name,
                         std::span<const std::string> candidates, std::string_view otherwise = {});

/// Thrown if a key breaks a rule that is checked after it was read. The parser adds file, line and value.
struct KeyError : RecipeError {
    KeyError(std::string key_path, const std::string& broken_rule)
        : RecipeError(key_path + ": " + broken_rule), key(std::move(key_path)), rule(broken_rule) {}
    std::string key;   ///< relative to the section or step, e.g. "species[1].rate"
    std::string rule;  ///< what must hold and what to do
};

/// Throws a KeyError whose rule fmt formats.
template <class... Args>
[[noreturn]] void raise_key(const std::string& key_path, fmt::format_string<Args...> rule, Args&&... args) {
    throw KeyError(key_path, fmt::format(rule, std::forward<Args>(args)...));
}

}  // namespace sidewall::app
