#pragma once
#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/models/table.hpp"
#include "surface/error.hpp"

// Arithmetic expressions in recipes. Only expression.cpp includes the parser, muParser.
namespace sidewall::app {

/// Text that is no valid expression; the message gives the reason and the character, counted from 1.
struct ExpressionError : RecipeError {
    using RecipeError::RecipeError;
};

/// Functions that a recipe reads from files, by name.
using Tables = std::map<std::string, std::shared_ptr<const Table>>;

/// An expression of named numbers, e.g. "-0.1*F*(1 - theta)". It knows `a ? b : c`, comparisons, && and ||,
/// + - * / ^ and the functions of expression_functions().
class Expression {
  public:
    /// \param variables  names of the values, in their order; "" for a value that the expression may not use.
    /// \param constants  names with constant values.
    /// \param tables  functions of one or two numbers, by name.
    /// \throws ExpressionError for text that cannot be read, unknown names (with the nearest known one) and
    ///         functions with the wrong number of arguments.
    Expression(const std::string& text, std::vector<std::string> variables,
               std::map<std::string, double> constants, Tables tables = {});

    /// Value for given values of all variables; not finite where undefined. May be called in parallel.
    double operator()(std::span<const double> values) const;

    const std::string& text() const;
    /// Indices of the variables that occur in the expression, ascending.
    const std::vector<std::size_t>& used() const;

  private:
    struct Shared;
    std::shared_ptr<Shared> shared_;
};

/// The functions that expressions may call, by name.
const std::vector<std::string>& expression_functions();

/// Whether \p text uses \p variable as a variable: "cos*F" names cos, "cos(F)" calls a function of that name.
bool names_variable(std::string_view text, std::string_view variable);

/// All names in \p text: variables, constants and functions.
std::set<std::string> names_in(std::string_view text);

/// Whether \p name is an identifier: letters, digits and _, no digit first, at most 64 characters.
bool is_identifier(std::string_view name);

}  // namespace sidewall::app
