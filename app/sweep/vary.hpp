#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/recipe/recipe.hpp"

namespace sidewall::app {

/// A recipe key that a sweep or a fit varies: over the values of a list, or over a range.
struct Vary {
    std::string key;
    std::vector<std::string> list;     ///< TOML, as written; empty for a range
    double low = 0.0, high = 0.0;      ///< of a range, low < high
    std::optional<std::size_t> count;  ///< of a range: grid points, both ends included
    bool log = false;                  ///< of a range: spread evenly in the logarithm
    bool whole = false;                ///< only whole numbers
    bool words = false;                ///< the key takes certain words and no numbers

    bool is_range() const { return list.empty(); }
};

/// Reads `KEY=LO:HI[:N][:log]` or `KEY=V1,V2,...`; commas within brackets and quotes do not separate.
/// \throws RecipeError naming the option: bounds the wrong way round, a logarithm of 0, no values.
Vary parse_vary(const std::string& text);

/// Reads several options. Keys that \p recipe holds as whole numbers take only whole numbers.
/// \throws RecipeError, too, for a key that is varied twice.
std::vector<Vary> parse_vary(const std::vector<std::string>& texts, const Recipe& recipe);

/// The value at \p place in [0, 1]: of a range, or of a list, whose values have equal parts of [0, 1].
std::string value_at(const Vary& vary, double place);

/// The place in [0, 1] of a value in its range. \pre is_range().
double place_of(const Vary& vary, double value);

/// Values of all varied keys for a run.
using RunValues = std::vector<std::string>;

/// All combinations of the keys' values; the last key changes fastest.
/// \throws RecipeError if a range has no count, or there are over kMostRuns.
std::vector<RunValues> grid_points(const std::vector<Vary>& varied);

/// Points 1 to \p count of Sobol's sequence. A longer design begins with the points of a shorter one.
/// \throws RecipeError for more keys than kSobolDimensions, over kMostRuns, or a range with a count.
std::vector<RunValues> sobol_points(const std::vector<Vary>& varied, std::size_t count);

inline constexpr std::size_t kMostRuns = 9999;

inline constexpr std::size_t kSobolDimensions = 10;

/// Coordinate \p dimension of point \p index of Sobol's sequence in the order of Gray codes (I. A. Antonov
/// and V. M. Saleev, USSR Comput. Math. Math. Phys. 19 (1979) 252), in [0, 1); point 0 is the origin. In
/// every coordinate 2^k successive points from a multiple of 2^k on have one point in each of 2^k equal
/// parts. Direction numbers: S. Joe and F. Y. Kuo, SIAM J. Sci. Comput. 30 (2008) 2635, table new-joe-kuo-6.
/// \pre dimension < kSobolDimensions.
double sobol(std::uint32_t index, std::size_t dimension);

}  // namespace sidewall::app
