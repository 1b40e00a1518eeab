#include "runtime/config/expression.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/require.hpp>

#include "runtime/config/check.hpp"

namespace hil::config {
namespace {

using Operation = Expression::Operation;

bool is_letter(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || letter == '_';
}
bool is_digit(char letter) {
  return letter >= '0' && letter <= '9';
}
bool is_blank(char letter) {
  return letter == ' ' || letter == '\t' || letter == '\n' || letter == '\r';
}
/// Letters of units: also %, and those of other alphabets.
bool is_unit_letter(char letter) {
  return (is_letter(letter) && letter != '_') || letter == '%' || static_cast<unsigned char>(letter) >= 0x80;
}

constexpr std::array<std::string_view, 8> keywords{"and", "or", "not", "if", "then", "else", "true", "false"};

bool is_keyword(std::string_view word) {
  return std::ranges::find(keywords, word) != keywords.end();
}

}  // namespace

/// A recursive-descent parser. The first mistake ends it.
class ExpressionParser {
 public:
  ExpressionParser(const Value& text, Diagnostics& diagnostics)
      : value_(&text), begin_(text.place()), text_(text.text()), diagnostics_(diagnostics) {}
  ExpressionParser(const Word& text, Diagnostics& diagnostics)
      : begin_(text.place), text_(text.text), diagnostics_(diagnostics) {}

  std::optional<Expression> parse() {
    if (text_.size() > Expression::max_text_bytes) {
      fail(0, "an expression has at most " + std::to_string(Expression::max_text_bytes) +
                  " bytes, and this one " + std::to_string(text_.size()));
      return std::nullopt;
    }
    const Index whole = parse_whole();
    skip_blanks();
    if (whole && at_ < text_.size()) fail(at_, unexpected("an operation or the end of the expression"));
    if (failed_) return std::nullopt;
    expression_.text_ = text_;
    expression_.place_ = begin_;
    return std::move(expression_);
  }

 private:
  using Node = Expression::Node;
  using Index = std::optional<std::uint32_t>;
  using Part = Index (ExpressionParser::*)();
  struct Sign {
    std::string_view text;
    Operation operation;
  };

  void fail(std::size_t at, const std::string& message) {
    if (!failed_) diagnostics_.add(place_of(at), message);
    failed_ = true;
  }

  Place place_of(std::size_t at) const {
    if (value_ != nullptr) return value_->place_in_text(at);
    return {begin_.file, begin_.line, begin_.column + static_cast<std::uint32_t>(at)};
  }

  void skip_blanks() {
    while (at_ < text_.size() && is_blank(text_[at_]))
      ++at_;
  }

  /// The word, number or sign at the cursor.
  std::string_view peek() const {
    std::size_t end = at_;
    while (end < text_.size() && (is_letter(text_[end]) || is_digit(text_[end]) || text_[end] == '.'))
      ++end;
    if (end == at_ && end < text_.size()) ++end;
    return text_.substr(at_, end - at_);
  }

  /// The words before and after the cursor, with the blanks between them; empty unless there is one on each
  /// side.
  std::string_view words_around() const {
    const auto in_word = [&](std::size_t at) {
      return is_letter(text_[at]) || is_digit(text_[at]) || text_[at] == '.';
    };
    std::size_t begin = at_;
    while (begin > 0 && is_blank(text_[begin - 1]))
      --begin;
    if (begin == at_) return {};
    while (begin > 0 && in_word(begin - 1))
      --begin;
    std::size_t end = at_;
    for (std::size_t at = at_; at < text_.size() && (in_word(at) || is_blank(text_[at])); ++at)
      end = is_blank(text_[at]) ? end : at + 1;
    if (!is_letter(text_[begin]) || end == at_ || !is_letter(text_[at_])) return {};
    return text_.substr(begin, end - begin);
  }

  std::string unexpected(const std::string& wanted) const {
    const std::string_view next = peek();
    const std::string_view pair = text_.substr(std::min(at_, text_.size()), 2);
    if (next.empty()) return "the expression ends where " + wanted + " is expected";
    std::string hint;
    if (pair == "&&" || pair == "&") hint = "; write and";
    if (pair == "||" || pair == "|") hint = "; write or";
    if (pair == "**") hint = "; write ^";
    if (next == "!" && pair != "!=") hint = "; write not";
    if (next == "=" && pair != "==") hint = "; write ==";
    if (next == "?") hint = "; write if ... then ... else ...";
    const bool is_part_of_if = next == "then" || next == "else";
    if (const std::string_view name = words_around(); !name.empty() && !is_part_of_if)
      hint = "; write a value name of several words in quotes, as \"'" + std::string(name) + "'\"";
    return "expected " + wanted + ", found " + in_quotes(next) + hint;
  }

  bool take_word(std::string_view word) {
    skip_blanks();
    if (peek() != word) return false;
    at_ += word.size();
    return true;
  }

  Index add(Operation operation, std::size_t at, std::vector<std::uint32_t> parts) {
    Node node{.operation = operation};
    node.word.place = place_of(at);
    node.parts = std::move(parts);
    return add(std::move(node), at);
  }
  Index add(Node node, std::size_t at) {
    if (expression_.nodes_.size() == Expression::max_nodes) {
      fail(at, "more than " + std::to_string(Expression::max_nodes) + " operands and operations");
      return std::nullopt;
    }
    expression_.nodes_.push_back(std::move(node));
    return static_cast<std::uint32_t>(expression_.nodes_.size() - 1);
  }

  /// Parses a part that may contain the same kind of part again.
  Index parse_nested(std::size_t begin, Part part) {
    if (++nesting_ > Expression::max_nesting) {
      fail(begin, "nested deeper than " + std::to_string(Expression::max_nesting) + " levels");
      return std::nullopt;
    }
    const Index inner = (this->*part)();
    --nesting_;
    return inner;
  }

  std::optional<Sign> take_sign(std::span<const Sign> signs) {
    skip_blanks();
    for (const Sign& sign : signs) {
      const bool is_word = is_letter(sign.text.front());
      if (is_word ? peek() != sign.text : !text_.substr(at_).starts_with(sign.text)) continue;
      at_ += sign.text.size();
      return sign;
    }
    return std::nullopt;
  }

  /// Operations of one precedence, from left to right.
  Index parse_chain(std::span<const Sign> signs, Part part) {
    Index left = (this->*part)();
    while (left) {
      skip_blanks();
      const std::size_t at = at_;
      const auto sign = take_sign(signs);
      if (!sign) break;
      const Index right = (this->*part)();
      if (!right) return std::nullopt;
      left = add(sign->operation, at, {*left, *right});
    }
    return left;
  }

  Index parse_whole() {
    skip_blanks();
    if (peek() == "if") return parse_nested(at_, &ExpressionParser::parse_conditional);
    return parse_any_of();
  }

  Index parse_conditional() {
    const std::size_t begin = at_;
    take_word("if");
    const Index condition = parse_whole();
    if (!condition) return std::nullopt;
    if (!take_word("then")) return missing("'then'");
    const Index first = parse_whole();
    if (!first) return std::nullopt;
    if (!take_word("else")) return missing("'else'");
    const Index second = parse_whole();
    if (!second) return std::nullopt;
    return add(Operation::conditional, begin, {*condition, *first, *second});
  }

  Index missing(const std::string& wanted) {
    skip_blanks();
    fail(at_, unexpected("an operation or " + wanted));
    return std::nullopt;
  }

  Index parse_any_of() {
    static constexpr std::array signs{Sign{"or", Operation::any_of}};
    return parse_chain(signs, &ExpressionParser::parse_all_of);
  }
  Index parse_all_of() {
    static constexpr std::array signs{Sign{"and", Operation::all_of}};
    return parse_chain(signs, &ExpressionParser::parse_negation);
  }

  Index parse_negation() {
    skip_blanks();
    const std::size_t begin = at_;
    if (!take_word("not")) return parse_comparison();
    const Index inner = parse_nested(begin, &ExpressionParser::parse_negation);
    return inner ? add(Operation::negation, begin, {*inner}) : std::nullopt;
  }

  Index parse_comparison() {
    static constexpr std::array signs{
        Sign{"==", Operation::equal},         Sign{"!=", Operation::not_equal},
        Sign{"<=", Operation::less_or_equal}, Sign{">=", Operation::greater_or_equal},
        Sign{"<", Operation::less},           Sign{">", Operation::greater}};
    const Index left = parse_sum();
    if (!left) return std::nullopt;
    skip_blanks();
    const std::size_t at = at_;
    const auto sign = take_sign(signs);
    if (!sign) return left;
    const Index right = parse_sum();
    if (!right) return std::nullopt;
    skip_blanks();
    if (at_ < text_.size() && std::string_view("<>=!").find(text_[at_]) != std::string_view::npos) {
      fail(at_, "comparisons can not be chained; join them with and");
      return std::nullopt;
    }
    return add(sign->operation, at, {*left, *right});
  }

  Index parse_sum() {
    static constexpr std::array signs{Sign{"+", Operation::add}, Sign{"-", Operation::subtract}};
    return parse_chain(signs, &ExpressionParser::parse_product);
  }
  Index parse_product() {
    static constexpr std::array signs{Sign{"*", Operation::multiply}, Sign{"/", Operation::divide}};
    return parse_chain(signs, &ExpressionParser::parse_sign);
  }

  Index parse_sign() {
    static constexpr std::array signs{Sign{"-", Operation::minus}, Sign{"+", Operation::add}};
    skip_blanks();
    const std::size_t begin = at_;
    const auto sign = take_sign(signs);
    if (!sign) return parse_power();
    const Index inner = parse_nested(begin, &ExpressionParser::parse_sign);
    return inner && sign->operation == Operation::minus ? add(Operation::minus, begin, {*inner}) : inner;
  }

  Index parse_power() {
    const Index base = parse_operand();
    skip_blanks();
    if (!base || at_ == text_.size() || text_[at_] != '^') return base;
    const std::size_t at = at_++;
    const Index exponent = parse_nested(at, &ExpressionParser::parse_sign);
    return exponent ? add(Operation::power, at, {*base, *exponent}) : std::nullopt;
  }

  Index parse_operand() {
    skip_blanks();
    const char next = at_ < text_.size() ? text_[at_] : '\0';
    if (next == '(') return parse_parentheses();
    if (is_letter(next)) return parse_word();
    if (next == '"' || next == '\'') return parse_quoted(next);
    if (is_digit(next) || next == '.') return parse_number();
    fail(at_, unexpected("a signal or a number"));
    return std::nullopt;
  }

  Index parse_parentheses() {
    const std::size_t begin = at_++;
    const Index inner = parse_nested(begin, &ExpressionParser::parse_whole);
    if (!inner) return std::nullopt;
    return take_word(")") ? inner : missing("')'");
  }

  Index parse_quoted(char quote) {
    const std::size_t begin = at_;
    const std::size_t end = text_.find(quote, at_ + 1);
    if (end == std::string_view::npos || end == at_ + 1) {
      fail(at_, "a value's name in quotes is not closed, or empty");
      return std::nullopt;
    }
    at_ = end + 1;
    return add({.operation = Operation::quoted,
                .word = {std::string(text_.substr(begin + 1, end - begin - 1)), place_of(begin)}},
               begin);
  }

  Index parse_number() {
    const std::size_t begin = at_;
    const ParsedNumber reading = read_number(text_.substr(at_));
    if (!reading.fault.empty()) {
      fail(at_, in_quotes(text_.substr(at_, std::max<std::size_t>(reading.length, 1))) + " " + reading.fault);
      return std::nullopt;
    }
    at_ += reading.length;
    Node node{.operation = Operation::number};
    node.word.place = place_of(begin);
    node.number = reading.value;
    if (!parse_unit(node)) return std::nullopt;
    return add(std::move(node), begin);
  }

  /// Words after a number, with the signs between them, are its unit.
  bool parse_unit(Node& node) {
    const std::size_t after_number = at_;
    skip_blanks();
    const std::size_t begin = at_;
    std::size_t end = begin;  // of the unit
    while (true) {
      std::size_t symbol = end_of_symbol(at_);
      const bool is_inverse = at_ == begin && text_.substr(begin).starts_with("1/");
      if (is_inverse && end_of_symbol(begin + 2) != begin + 2) symbol = begin + 1;
      if (symbol == at_) break;
      at_ = end = symbol;
      const bool continues = at_ + 1 < text_.size() &&
                             std::string_view("/*.").find(text_[at_]) != std::string_view::npos &&
                             end_of_symbol(at_ + 1) != at_ + 1;
      if (continues)
        ++at_;
      else
        skip_blanks();
    }
    at_ = end == begin ? after_number : end;
    if (end == begin) return true;
    const std::string_view written = text_.substr(begin, end - begin);
    node.unit = units::parse_unit(written);
    if (node.unit) return true;
    const bool has_sign = written.find_first_of("/*") != std::string_view::npos;
    fail(begin, in_quotes(written) + " is not a unit" +
                    (has_sign ? "; to divide or multiply the number, write blanks around the sign" : ""));
    return false;
  }

  /// Of a unit's symbol with its exponent ("m", "s2", "s^-1"), and the number before it ("100km"), at `at`;
  /// `at` itself: there is none.
  std::size_t end_of_symbol(std::size_t at) const {
    const std::size_t begin = end_of_factor(at);
    std::size_t end = begin;
    while (end < text_.size() && is_unit_letter(text_[end]))
      ++end;
    if (end == begin || is_keyword(text_.substr(begin, end - begin))) return at;
    std::size_t exponent = end;
    if (exponent < text_.size() && text_[exponent] == '^') ++exponent;
    if (exponent < text_.size() && text_[exponent] == '-') ++exponent;
    if (exponent >= text_.size() || !is_digit(text_[exponent])) return end;
    while (exponent < text_.size() && is_digit(text_[exponent]))
      ++exponent;
    return exponent;
  }

  /// Of a number before a symbol, which is no number of its own ("2e3").
  std::size_t end_of_factor(std::size_t at) const {
    std::size_t end = at;
    while (end < text_.size() && is_digit(text_[end]))
      ++end;
    if (end == at) return at;
    if (end + 1 < text_.size() && text_[end] == '.' && is_digit(text_[end + 1])) {
      for (++end; end < text_.size() && is_digit(text_[end]);)
        ++end;
    }
    return end - at == read_number(text_.substr(at)).length ? end : at;
  }

  Index parse_word() {
    const std::size_t begin = at_;
    const std::string_view word = peek();
    if (word == "true" || word == "false") {
      at_ += word.size();
      Node node{.operation = Operation::truth};
      node.word.place = place_of(begin);
      node.number = word == "true" ? 1.0 : 0.0;
      return add(std::move(node), begin);
    }
    if (word == "if") {
      fail(at_, "'if' inside an operation needs parentheses around it");
      return std::nullopt;
    }
    if (is_keyword(word)) {
      fail(at_, unexpected("a signal or a number"));
      return std::nullopt;
    }
    if (!is_signal_name(word)) {
      fail(at_, in_quotes(word) + " is not a signal's name; that is names joined by dots");
      return std::nullopt;
    }
    at_ += word.size();
    Node node{.operation = Operation::name, .word = {std::string(word), place_of(begin)}};
    skip_blanks();
    if (at_ == text_.size() || text_[at_] != '(') return add(std::move(node), begin);
    node.operation = Operation::call;
    return parse_arguments(std::move(node), begin);
  }

  Index parse_arguments(Node node, std::size_t begin) {
    ++at_;
    if (take_word(")")) return add(std::move(node), begin);
    while (true) {
      const Index argument = parse_nested(begin, &ExpressionParser::parse_whole);
      if (!argument) return std::nullopt;
      node.parts.push_back(*argument);
      if (take_word(")")) return add(std::move(node), begin);
      if (!take_word(",")) return missing("',' or ')'");
    }
  }

  const Value* const value_ = nullptr;  ///< null: a text in one line
  const Place begin_;
  const std::string_view text_;
  Diagnostics& diagnostics_;
  Expression expression_;
  std::size_t at_ = 0;
  std::size_t nesting_ = 0;
  bool failed_ = false;
};

std::optional<Expression> Expression::parse(const Value& text, Diagnostics& diagnostics) {
  return ExpressionParser(text, diagnostics).parse();
}

std::optional<Expression> Expression::parse(const Word& text, Diagnostics& diagnostics) {
  return ExpressionParser(text, diagnostics).parse();
}

Expression Expression::with_nodes(std::vector<Node> nodes) const {
  require(!nodes.empty(), "an expression has a node");
  Expression changed = *this;
  changed.nodes_ = std::move(nodes);
  return changed;
}

bool is_reserved_word(std::string_view word) {
  return is_keyword(word) || word == "time";
}

const char* to_string(Expression::Operation operation) noexcept {
  switch (operation) {
    case Operation::number:
      return "a number";
    case Operation::truth:
      return "true or false";
    case Operation::name:
    case Operation::quoted:
      return "a name";
    case Operation::call:
      return "a function";
    case Operation::conditional:
      return "if";
    case Operation::any_of:
      return "or";
    case Operation::all_of:
      return "and";
    case Operation::negation:
      return "not";
    case Operation::equal:
      return "==";
    case Operation::not_equal:
      return "!=";
    case Operation::less:
      return "<";
    case Operation::less_or_equal:
      return "<=";
    case Operation::greater:
      return ">";
    case Operation::greater_or_equal:
      return ">=";
    case Operation::add:
      return "+";
    case Operation::subtract:
    case Operation::minus:
      return "-";
    case Operation::multiply:
      return "*";
    case Operation::divide:
      return "/";
    case Operation::power:
      return "^";
  }
  return "an operation";
}

}  // namespace hil::config
