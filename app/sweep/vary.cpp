#include "app/sweep/vary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>

#include "app/common/text.hpp"
#include "app/recipe/node_path.hpp"
#include "app/recipe/sections.hpp"
#include "app/recipe/steps.hpp"

namespace sidewall::app {
namespace {

constexpr const char* kForms = "write KEY=LOW:HIGH[:COUNT][:log] or KEY=VALUE,VALUE,...";

// Splits a list at commas outside of brackets and quotes.
std::vector<std::string> list_of(const std::string& text) {
    std::vector<std::string> values(1);
    int depth = 0;
    char quote = '\0';
    for (const char c : text) {
        if (quote != '\0')
            quote = c == quote ? '\0' : quote;
        else if (c == '"' || c == '\'')
            quote = c;
        else if (c == '[' || c == '{')
            ++depth;
        else if (c == ']' || c == '}')
            --depth;
        if (c == ',' && depth == 0 && quote == '\0')
            values.emplace_back();
        else
            values.back() += c;
    }
    return values;
}

void read_range(const std::vector<std::string>& parts, const std::string& option, Vary& vary) {
    const auto low = finite_number(parts[0]), high = finite_number(parts[1]);
    if (!low || !high) throw RecipeError("{}: bounds must be numbers: {}", option, kForms);
    vary.low = *low;
    vary.high = *high;
    for (std::size_t i = 2; i < parts.size(); ++i) {
        const auto count = finite_number(parts[i]);
        if (parts[i] == "log" && i + 1 == parts.size()) {
            vary.log = true;
        } else if (i == 2 && count) {
            if (*count < 2.0 || *count > kMostRuns || *count != std::floor(*count))
                throw RecipeError("{}: the count must be a whole number from 2 to {}", option, kMostRuns);
            vary.count = static_cast<std::size_t>(*count);
        } else {
            throw RecipeError("{}: {} is neither a count nor log: {}", option, parts[i], kForms);
        }
    }
    if (!(*low < *high))
        throw RecipeError("{}: the lower bound {:g} must be below the upper one {:g}{}", option, *low, *high,
                          *low > *high ? ": swap them" : "");
    if (vary.log && *low * *high <= 0.0)  // etch rates are negative
        throw RecipeError("{}: on a logarithmic scale both bounds must be above 0, or both below", option);
}

}  // namespace

Vary parse_vary(const std::string& text) {
    const std::string option = "--vary " + text;
    const std::size_t equals = end_of_key(text);
    if (equals == std::string::npos || equals == 0) throw RecipeError("{}: names no key: {}", option, kForms);
    Vary vary{.key = text.substr(0, equals)};
    std::vector<std::string> values = list_of(text.substr(equals + 1));
    const std::vector<std::string> parts = split(values[0], ':');
    if (values.size() == 1 && parts.size() > 1 && (finite_number(parts[0]) || finite_number(parts[1]))) {
        read_range(parts, option, vary);
        return vary;
    }
    for (const std::string& value : values)
        if (value.empty()) throw RecipeError("{}: lacks a value: {}", option, kForms);
    vary.list = std::move(values);
    return vary;
}

std::vector<Vary> parse_vary(const std::vector<std::string>& texts, const Recipe& recipe) {
    std::vector<Vary> varied;
    const std::vector<KeyDoc> keys = settable_keys(recipe);
    const std::vector<NamedStep> steps = named_steps(recipe.steps);
    std::vector<std::string> places;  // of the keys: a step may be named in several forms
    for (const std::string& text : texts) {
        Vary vary = parse_vary(text);
        try {
            places.push_back(with_place_of_step(vary.key, steps));
        } catch (const RecipeError& error) {
            throw RecipeError("--vary {}: {}", text, error.what());
        }
        if (std::find(places.begin(), places.end() - 1, places.back()) != places.end() - 1)
            throw RecipeError("--vary {}: {} is varied twice", text, vary.key);
        const auto key = std::ranges::find(keys, vary.key, &KeyDoc::name);
        if (key != keys.end()) {
            vary.whole = key->type.starts_with("whole number");
            vary.words = !key->words.empty() && key->type.find("number") == std::string::npos;
        }
        varied.push_back(std::move(vary));
    }
    return varied;
}

std::string value_at(const Vary& vary, double place) {
    if (!vary.is_range()) {
        const auto part =
            static_cast<std::size_t>(std::max(0.0, place) * static_cast<double>(vary.list.size()));
        return vary.list[std::min(part, vary.list.size() - 1)];
    }
    double value = vary.log ? vary.low * std::pow(vary.high / vary.low, place)
                            : vary.low + (vary.high - vary.low) * place;
    value = std::clamp(value, vary.low, vary.high);
    if (vary.whole) return fmt::format("{:.0f}", std::round(value));
    return fmt::format("{:.12g}", value);  // 12 digits, so that a tenth is 0.1
}

double place_of(const Vary& vary, double value) {
    return vary.log ? std::log(value / vary.low) / std::log(vary.high / vary.low)
                    : (value - vary.low) / (vary.high - vary.low);
}

std::vector<RunValues> grid_points(const std::vector<Vary>& varied) {
    std::vector<RunValues> points(1);
    for (const Vary& vary : varied) {
        RunValues values = vary.list;
        if (vary.is_range()) {
            if (!vary.count)
                throw RecipeError(
                    "--vary {0}={1:g}:{2:g}: a grid needs a count of points: {0}={1:g}:{2:g}:5, "
                    "or --design sobol --runs N",
                    vary.key, vary.low, vary.high);
            for (std::size_t i = 0; i < *vary.count; ++i)
                values.push_back(
                    value_at(vary, static_cast<double>(i) / static_cast<double>(*vary.count - 1)));
        }
        if (points.size() * values.size() > kMostRuns)
            throw RecipeError("--vary {}: makes over {} runs: use fewer points, or --design sobol", vary.key,
                              kMostRuns);
        std::vector<RunValues> product;
        for (const RunValues& point : points)
            for (const std::string& value : values) {
                product.push_back(point);
                product.back().push_back(value);
            }
        points = std::move(product);
    }
    return points;
}

std::vector<RunValues> sobol_points(const std::vector<Vary>& varied, std::size_t count) {
    if (varied.size() > kSobolDimensions)
        throw RecipeError("--design sobol: varies at most {} keys", kSobolDimensions);
    if (count < 1 || count > kMostRuns)
        throw RecipeError("--runs {}: must be from 1 to {}", count, kMostRuns);
    for (const Vary& vary : varied)
        if (vary.count)
            throw RecipeError(
                "--vary {}={:g}:{:g}:{}: Sobol points have no count of their own: leave it to "
                "--runs",
                vary.key, vary.low, vary.high, *vary.count);
    std::vector<RunValues> points;
    for (std::size_t i = 1; i <= count; ++i) {
        RunValues point;
        point.reserve(varied.size());
        for (std::size_t d = 0; d < varied.size(); ++d)
            point.push_back(value_at(varied[d], sobol(static_cast<std::uint32_t>(i), d)));
        points.push_back(std::move(point));
    }
    return points;
}

double sobol(std::uint32_t index, std::size_t dimension) {
    if (index == 0) return 0.0;
    boost::random::sobol sequence(kSobolDimensions);
    sequence.seed(index - 1);  // Boost's sequence lacks the origin
    sequence.discard(dimension);
    return static_cast<double>(sequence()) * 0x1p-64;
}

}  // namespace sidewall::app
