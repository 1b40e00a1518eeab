#pragma once
// The expression language of scenarios, as a tree. Conditions of expectations, blocks, stimuli and faults are
// written in it:
//
//   ego.speed <= 50 km/h and not (light.state == red or ego.brake < ego.demand)
//   (pump.flow - drain) / area
//   if level > 2 m then 0 else gain * (2 m - level)
//
//   precedence, weakest first: if-then-else, or, and, not, comparisons (== != < <= > >=), + and -, * and /,
//   the sign, ^. Words, not && || !. Comparisons can not be chained.
//   operands: a number with or without a unit; a name, which may contain dots; a value name of a
//   signal, as a word or in quotes ('limp home'); true and false; a function with arguments in parentheses.
//
// The unit of a number follows it. Its symbols are separated by blanks, or by / * . without blanks around
// them: in `10 m/s` and `3 N m` all is the unit; in `10 m / t` the stroke divides by the signal t.
//
// What names and functions mean, and the units of the result, are found when an expression is compiled
// (runtime/expression/program.hpp).
//
// Threads: immutable after parsing.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>
#include <hil/unit.hpp>

namespace hil::config {

class Expression {
 public:
  /// A longer text, more operands and operations, or deeper nesting is refused.
  static constexpr std::size_t max_text_bytes = 8192;
  static constexpr std::size_t max_nodes = 1024;
  static constexpr std::size_t max_nesting = 32;

  enum class Operation : std::uint8_t {
    number,
    truth,   ///< number: 0 or 1
    name,    ///< of a signal or a variable, or of a value of a signal
    quoted,  ///< a value name of a signal
    call,    ///< of the function `word`
    conditional,
    any_of,
    all_of,
    negation,
    equal,
    not_equal,
    less,
    less_or_equal,
    greater,
    greater_or_equal,
    add,
    subtract,
    multiply,
    divide,
    minus,
    power,
  };
  struct Node {
    Operation operation = Operation::number;
    Word word{};  ///< the name; of other operations empty, with the place of the sign or the number
    double number = 0.0;
    std::optional<units::Unit> unit{};  ///< that follows the number
    std::vector<std::uint32_t> parts{};
    /// subtract: in place of a comparison, whose sides take their units from each other.
    bool is_margin = false;
  };

  /// `text` is a Value of Kind::text. Empty with one mistake, whose place is the first wrong character.
  static std::optional<Expression> parse(const Value& text, Diagnostics& diagnostics);
  /// A text in one line, as a cell of a table; its place is that of the first character.
  static std::optional<Expression> parse(const Word& text, Diagnostics& diagnostics);
  /// The same text at the same place with another tree, of at least one node.
  Expression with_nodes(std::vector<Node> nodes) const;

  const std::string& text() const noexcept { return text_; }
  const Place& place() const noexcept { return place_; }
  /// Parts before the whole; the last one is the expression.
  std::span<const Node> nodes() const noexcept { return nodes_; }

 private:
  friend class ExpressionParser;
  std::string text_;
  Place place_;
  std::vector<Node> nodes_;
};

/// Whether an expression does not read the word as a name: "and", "if", "time".
bool is_reserved_word(std::string_view word);

/// As it is written: "==", "and".
const char* to_string(Expression::Operation operation) noexcept;

}  // namespace hil::config
