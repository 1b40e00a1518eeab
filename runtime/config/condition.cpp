#include "runtime/config/condition.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "runtime/config/check.hpp"
#include "runtime/config/numbers.hpp"
#include "runtime/config/require.hpp"

namespace hil::config {
namespace {

bool is_letter(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || letter == '_';
}
bool is_digit(char letter) {
  return letter >= '0' && letter <= '9';
}
bool is_blank(char letter) {
  return letter == ' ' || letter == '\t' || letter == '\n' || letter == '\r';
}

}  // namespace

/// A recursive-descent parser. The first mistake ends it.
class ConditionParser {
 public:
  ConditionParser(const Value& text, Diagnostics& diagnostics)
      : value_(text), text_(text.text()), diagnostics_(diagnostics) {}

  std::optional<Condition> parse() {
    if (text_.size() > Condition::max_text_bytes) {
      fail(0, "a condition has at most " + std::to_string(Condition::max_text_bytes) +
                  " bytes, and this one " + std::to_string(text_.size()));
      return std::nullopt;
    }
    const Index whole = parse_any_of();
    if (whole && at_ < text_.size()) fail(at_, unexpected("'and', 'or' or the end of the condition"));
    if (failed_) return std::nullopt;
    condition_.text_ = text_;
    condition_.place_ = value_.place();
    return std::move(condition_);
  }

 private:
  using Node = Condition::Node;
  using Operand = Condition::Operand;
  using Operation = Condition::Operation;
  using Index = std::optional<std::uint32_t>;

  void fail(std::size_t at, const std::string& message) {
    if (!failed_) diagnostics_.add(value_.place_in_text(at), message);
    failed_ = true;
  }

  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_]))
      ++at_;
  }

  /// The word, number or sign at the cursor, for messages.
  std::string_view peek() const {
    std::size_t end = at_;
    while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end]) || text_[end] == '.'))
      ++end;
    if (end == at_ && end < text_.size()) ++end;
    return text_.substr(at_, end - at_);
  }

  std::string unexpected(const std::string& wanted) const {
    const std::string_view next = peek();
    const std::string_view pair = text_.substr(at_, 2);
    if (next.empty()) return "the condition ends where " + wanted + " is expected";
    std::string hint;
    if (pair == "&&" || pair == "&") hint = "; write and";
    if (pair == "||" || pair == "|") hint = "; write or";
    if (next == "!" && pair != "!=") hint = "; write not";
    if (next == "=" && pair != "==") hint = "; write ==";
    return "expected " + wanted + ", found " + in_quotes(next) + hint;
  }

  bool take_word(std::string_view word) {
    skip_blanks();
    if (peek() != word) return false;
    at_ += word.size();
    return true;
  }

  Index add(const Node& node) {
    condition_.nodes_.push_back(node);
    return static_cast<std::uint32_t>(condition_.nodes_.size() - 1);
  }

  Index parse_chain(Operation operation, std::string_view word, Index (ConditionParser::*part)()) {
    Index left = (this->*part)();
    while (left && take_word(word)) {
      const Index right = (this->*part)();
      if (!right) return std::nullopt;
      left = add({operation, *left, *right, {}, {}});
    }
    skip_blanks();
    return left;
  }

  Index parse_any_of() { return parse_chain(Operation::any_of, "or", &ConditionParser::parse_all_of); }
  Index parse_all_of() { return parse_chain(Operation::all_of, "and", &ConditionParser::parse_negation); }

  Index parse_negation() {
    skip_blanks();
    const std::size_t begin = at_;
    if (peek() == "not" || peek() == "(") {
      if (++nesting_ > Condition::max_nesting) {
        fail(begin, "nested deeper than " + std::to_string(Condition::max_nesting) + " levels");
        return std::nullopt;
      }
      const Index inner = take_word("not") ? parse_negated() : parse_parentheses();
      --nesting_;
      return inner;
    }
    return parse_comparison();
  }

  Index parse_negated() {
    const Index inner = parse_negation();
    if (!inner) return std::nullopt;
    return add({Operation::negation, *inner, *inner, {}, {}});
  }

  Index parse_parentheses() {
    take_word("(");
    const Index inner = parse_any_of();
    if (!inner) return std::nullopt;
    if (take_word(")")) return inner;
    fail(at_, unexpected("'and', 'or' or ')'"));
    return std::nullopt;
  }

  Index parse_comparison() {
    const std::size_t begin = at_;
    Node node;
    if (!parse_operand(node.left)) return std::nullopt;
    const std::optional<Operation> operation = take_operation(node.left);
    if (!operation || !parse_operand(node.right)) return std::nullopt;
    node.operation = *operation;
    name_values(node);
    skip_blanks();
    if (at_ < text_.size() && std::string_view("<>=!").find(text_[at_]) != std::string_view::npos) {
      fail(at_, "comparisons can not be chained; join them with and");
      return std::nullopt;
    }
    if (node.left.kind != Operand::Kind::signal && node.right.kind != Operand::Kind::signal) {
      fail(begin, "two constants are compared; at least one side has to be a signal");
      return std::nullopt;
    }
    if (++comparisons_ > Condition::max_comparisons) {
      fail(begin, "more than " + std::to_string(Condition::max_comparisons) + " comparisons");
      return std::nullopt;
    }
    return add(node);
  }

  /// Makes a word without a dot that is compared with a signal, whose name has a dot, the name of a value of
  /// that signal.
  void name_values(Node& node) {
    const auto has_dot = [&](const Operand& operand) {
      return condition_.mentions_[operand.index].text.find('.') != std::string::npos;
    };
    std::vector<Word>& mentions = condition_.mentions_;
    if (node.left.kind == Operand::Kind::signal && node.right.kind == Operand::Kind::signal &&
        has_dot(node.left) != has_dot(node.right)) {
      Operand& name = has_dot(node.left) ? node.right : node.left;
      Operand& signal = has_dot(node.left) ? node.left : node.right;
      const Word word = mentions[name.index];
      mentions.erase(mentions.begin() + static_cast<std::ptrdiff_t>(name.index));  // one of the last two
      signal.index = static_cast<std::uint32_t>(mentions.size() - 1);
      set_named_value(name, word);
    }
    for (const auto& [name, signal] : {std::pair(node.left, node.right), std::pair(node.right, node.left)}) {
      if (name.kind == Operand::Kind::named_value && signal.kind == Operand::Kind::signal)
        condition_.named_values_[name.index].mention = signal.index;
    }
  }

  void set_named_value(Operand& operand, Word name) {
    operand.kind = Operand::Kind::named_value;
    operand.index = static_cast<std::uint32_t>(condition_.named_values_.size());
    condition_.named_values_.push_back({std::move(name), 0});
  }

  std::optional<Operation> take_operation(const Operand& left) {
    constexpr std::pair<std::string_view, Operation> operations[] = {
        {"==", Operation::equal},         {"!=", Operation::not_equal},
        {"<=", Operation::less_or_equal}, {">=", Operation::greater_or_equal},
        {"<", Operation::less},           {">", Operation::greater},
    };
    skip_blanks();
    for (const auto& [sign, operation] : operations) {
      if (!text_.substr(at_).starts_with(sign)) continue;
      at_ += sign.size();
      return operation;
    }
    const bool has_unit = left.kind == Operand::Kind::number && at_ < text_.size() && is_letter(text_[at_]);
    fail(at_, unexpected("a comparison (== != < <= > >=)") +
                  (has_unit ? "; numbers have no unit here, signals are in SI units" : ""));
    return std::nullopt;
  }

  bool parse_operand(Operand& operand) {
    skip_blanks();
    const char next = at_ < text_.size() ? text_[at_] : '\0';
    if (is_letter(next)) return parse_signal(operand);
    if (next == '"' || next == '\'') return parse_quoted(operand, next);
    if (!is_digit(next) && next != '+' && next != '-' && next != '.') {
      fail(at_, unexpected("a signal or a number"));
      return false;
    }
    const ParsedNumber reading = read_number(text_.substr(at_));
    if (!reading.fault.empty()) {
      fail(at_, in_quotes(text_.substr(at_, std::max<std::size_t>(reading.length, 1))) + " " + reading.fault);
      return false;
    }
    at_ += reading.length;
    if (at_ < text_.size() && is_letter(text_[at_])) {
      fail(at_, in_quotes(peek()) + " after a number; numbers have no unit here, signals are in SI units");
      return false;
    }
    operand.number = reading.value;
    return true;
  }

  bool parse_quoted(Operand& operand, char quote) {
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos || end == at_ + 1) {
      fail(at_, "a value's name in quotes is not closed, or empty");
      return false;
    }
    set_named_value(operand, {std::string(text_.substr(at_ + 1, end - at_ - 1)), value_.place_in_text(at_)});
    at_ = end + 1;
    return true;
  }

  bool parse_signal(Operand& operand) {
    const std::string_view word = peek();
    if (word == "and" || word == "or" || word == "not") {
      fail(at_, unexpected("a signal or a number"));
      return false;
    }
    if (!is_signal_name(word)) {
      fail(at_, in_quotes(word) + " is not a signal's name; that is names joined by dots");
      return false;
    }
    operand.kind = Operand::Kind::signal;
    operand.index = static_cast<std::uint32_t>(condition_.mentions_.size());
    condition_.mentions_.push_back({std::string(word), value_.place_in_text(at_)});
    at_ += word.size();
    return true;
  }

  const Value& value_;
  const std::string_view text_;
  Diagnostics& diagnostics_;
  Condition condition_;
  std::size_t at_ = 0;
  std::size_t nesting_ = 0;
  std::size_t comparisons_ = 0;
  bool failed_ = false;
};

std::optional<Condition> Condition::parse(const Value& text, Diagnostics& diagnostics) {
  return ConditionParser(text, diagnostics).parse();
}

BoundCondition Condition::bind(std::span<const std::uint32_t> indices,
                               std::span<const double> named_numbers) const {
  require(indices.size() == mentions_.size(), "one index for each mention of a signal");
  require(named_numbers.size() == named_values_.size(), "one number for each named value");
  BoundCondition bound;
  bound.nodes_ = nodes_;
  for (Node& node : bound.nodes_) {
    for (Operand* operand : {&node.left, &node.right}) {
      if (operand->kind == Operand::Kind::signal) operand->index = indices[operand->index];
      if (operand->kind == Operand::Kind::named_value) {
        operand->number = named_numbers[operand->index];
        operand->kind = Operand::Kind::number;
      }
    }
  }
  for (const std::uint32_t index : indices)
    bound.min_size_ = std::max(bound.min_size_, index + 1);
  return bound;
}

bool BoundCondition::holds(std::span<const double> values) const noexcept {
  require(!nodes_.empty(), "a condition made by Condition::bind");
  require(values.size() >= min_size_, "a value for each signal of the condition");
  return evaluate(nodes_.size() - 1, values, {}) == Truth::yes;
}

Truth BoundCondition::truth(std::span<const double> values,
                            std::span<const std::uint8_t> unknown) const noexcept {
  require(!nodes_.empty(), "a condition made by Condition::bind");
  require(values.size() >= min_size_ && unknown.size() == values.size(),
          "a value for each signal of the condition, and whether it is unknown");
  return evaluate(nodes_.size() - 1, values, unknown);
}

Truth BoundCondition::evaluate(std::size_t index, std::span<const double> values,
                               std::span<const std::uint8_t> unknown) const noexcept {
  using Operation = Condition::Operation;
  const Condition::Node& node = nodes_[index];
  const auto part = [&](std::size_t child) { return evaluate(child, values, unknown); };
  const auto either = [&](Truth decisive, Truth other) {
    const Truth first = part(node.first);
    if (first == decisive) return decisive;
    const Truth second = part(node.second);
    if (second == decisive) return decisive;
    return first == Truth::unknown || second == Truth::unknown ? Truth::unknown : other;
  };
  const auto is_unknown = [&](const Condition::Operand& operand) {
    return operand.kind == Condition::Operand::Kind::signal && !unknown.empty() &&
           unknown[operand.index] != 0;
  };
  const auto value_of = [&](const Condition::Operand& operand) {
    return operand.kind == Condition::Operand::Kind::signal ? values[operand.index] : operand.number;
  };
  const auto compare = [&](auto comparison) {
    if (is_unknown(node.left) || is_unknown(node.right)) return Truth::unknown;
    return comparison(value_of(node.left), value_of(node.right)) ? Truth::yes : Truth::no;
  };
  switch (node.operation) {
    case Operation::all_of:
      return either(Truth::no, Truth::yes);
    case Operation::any_of:
      return either(Truth::yes, Truth::no);
    case Operation::negation: {
      const Truth inner = part(node.first);
      return inner == Truth::unknown ? inner : inner == Truth::yes ? Truth::no : Truth::yes;
    }
    case Operation::equal:
      return compare(std::equal_to<>());
    case Operation::not_equal:
      return compare(std::not_equal_to<>());
    case Operation::less:
      return compare(std::less<>());
    case Operation::less_or_equal:
      return compare(std::less_equal<>());
    case Operation::greater:
      return compare(std::greater<>());
    case Operation::greater_or_equal:
      return compare(std::greater_equal<>());
  }
  return Truth::unknown;
}

}  // namespace hil::config
