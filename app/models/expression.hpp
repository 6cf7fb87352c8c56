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

// Arithmetic that recipes write: read by muParser, which only expression.cpp knows.
namespace sidewall::app {

/// Text that is no expression of the names it may use; the message says why and at which character, counted from 1.
struct ExpressionError : RecipeError {
    using RecipeError::RecipeError;
};

/// Functions that a recipe reads from files.
using Tables = std::map<std::string, std::shared_ptr<const Table>>;

/// An expression of named numbers, e.g. "-0.1*F*(1 - theta)": + - * / ^, comparisons, && and ||, `a ? b : c`, and
/// the functions of expression_functions().
class Expression {
  public:
    /// \param variables  names of the values it will be given, in their order; "" for one that it may not use.
    /// \param constants  names that always have the same value.
    /// \param tables  functions of one or two numbers, by name.
    /// \throws ExpressionError for text that cannot be read, unknown names (with the nearest known one) and
    ///         functions with the wrong number of arguments.
    Expression(const std::string& text, std::vector<std::string> variables,
               std::map<std::string, double> constants, Tables tables = {});

    /// The expression's value for these values of all variables. Not finite where it has none. May be called in parallel.
    double operator()(std::span<const double> values) const;

    const std::string& text() const;
    /// Indices of the variables that the expression names, rising.
    const std::vector<std::size_t>& used() const;

  private:
    struct Shared;
    std::shared_ptr<Shared> shared_;
};

/// The functions that expressions may call, by name.
const std::vector<std::string>& expression_functions();

/// Whether \p text names \p variable, which is not a function of that name: "cos*F", not "cos(F)".
bool names_variable(std::string_view text, std::string_view variable);

/// All names in \p text, of functions too.
std::set<std::string> names_in(std::string_view text);

/// Whether \p name can be one: letters, digits and _, no digit first, at most 64.
bool is_identifier(std::string_view name);

}  // namespace sidewall::app
