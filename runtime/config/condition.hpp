#pragma once
// What an expectation claims about signals, as an expression:
//
//   collision.ego > 0
//   ego.speed <= 14 and not (light.state == 2 or ego.brake < ego.demand)
//
//   condition:  comparisons joined by `and`, `or`, `not` and parentheses; `not` binds tighter than `and`,
//               that tighter than `or`. Words, not && || !.
//   comparison: operand (== != < <= > >=) operand; an operand is a signal, a number without a unit (signals
//               carry SI units), or the name of a value of the signal on the other side: a word without a dot
//               beside a signal with one (can.car.Status.Mode == LimpHome), or any text in quotes
//               (can.car.Status.Mode == 'limp home'). At least one of the two is a signal.
//
// Comparisons are those of IEEE doubles: with a NaN, every one but != is false.
//
// A signal may be unknown. A comparison with it is then unknown, and `and`, `or` and `not` follow Kleene's
// three-valued logic: `false and unknown` is false, `true or unknown` is true.
//
// Threads: immutable after parsing; holds() may be called from any thread and neither allocates nor blocks.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/schema.hpp"

namespace hil::config {

enum class Truth : std::uint8_t { no, yes, unknown };

/// A word of a user's file that is looked up later, with its place.
struct Word {
  std::string text;
  Place place;
};

class BoundCondition;

class Condition {
 public:
  /// A longer text, more comparisons or deeper nesting is refused.
  static constexpr std::size_t max_text_bytes = 8192;
  static constexpr std::size_t max_comparisons = 256;
  static constexpr std::size_t max_nesting = 32;

  /// `text` is a Value of Kind::text. Empty with one mistake, whose place is the first wrong character.
  static std::optional<Condition> parse(const Value& text, Diagnostics& diagnostics);

  const std::string& text() const noexcept { return text_; }
  const Place& place() const noexcept { return place_; }
  /// Every mention of a signal, in the order of the text; a signal that is named twice is listed twice.
  const std::vector<Word>& mentions() const noexcept { return mentions_; }

  /// The name of a value, and the index in mentions() of the signal that it is compared with.
  struct NamedValue {
    Word name;
    std::uint32_t mention = 0;
  };
  const std::vector<NamedValue>& named_values() const noexcept { return named_values_; }

  /// `indices[i]` is the index of the signal mentions()[i] in the values of holds(), `named_numbers[i]` the
  /// number of named_values()[i]. Misuse (asserts): another count.
  BoundCondition bind(std::span<const std::uint32_t> indices,
                      std::span<const double> named_numbers = {}) const;

 private:
  friend class BoundCondition;
  friend class ConditionParser;

  enum class Operation : std::uint8_t {
    all_of,
    any_of,
    negation,
    equal,
    not_equal,
    less,
    less_or_equal,
    greater,
    greater_or_equal,
  };
  struct Operand {
    enum class Kind : std::uint8_t { number, signal, named_value };
    double number = 0.0;
    Kind kind = Kind::number;
    std::uint32_t index = 0;  ///< into mentions or named_values; of a signal once bound, into the values
  };
  /// all_of, any_of, negation: of the nodes `first` and `second`; else a comparison of `left` with `right`.
  struct Node {
    Operation operation = Operation::equal;
    std::uint32_t first = 0;
    std::uint32_t second = 0;
    Operand left;
    Operand right;
  };

  std::string text_;
  Place place_;
  std::vector<Word> mentions_;
  std::vector<NamedValue> named_values_;
  std::vector<Node> nodes_;  ///< parts before the whole; the last one is the condition
};

/// A condition whose signals are given by index.
class BoundCondition {
 public:
  /// Whether the condition is true, every signal being known. Misuse (asserts): a bound index outside
  /// `values`.
  bool holds(std::span<const double> values) const noexcept;
  /// The truth where signals may be unknown: `unknown[i]` is not 0 where values[i] must not be used. Misuse
  /// (asserts): as for holds(), and another number of `unknown` than of `values`.
  Truth truth(std::span<const double> values, std::span<const std::uint8_t> unknown) const noexcept;

 private:
  friend class Condition;
  /// An empty `unknown`: every signal is known.
  Truth evaluate(std::size_t node, std::span<const double> values,
                 std::span<const std::uint8_t> unknown) const noexcept;

  std::vector<Condition::Node> nodes_;
  std::uint32_t min_size_ = 0;
};

}  // namespace hil::config
