#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <utility>

#include <hil/unit.hpp>

namespace hil::units {
namespace {

constexpr int max_exponent = 100;
constexpr double pi = std::numbers::pi;

struct Symbol {
  std::string_view text;
  std::array<std::int8_t, 7> exponents;  // m, kg, s, A, K, mol, cd
  double numerator = 1.0, denominator = 1.0;
  double offset = 0.0;
  std::int8_t angle = 0, two_pi = 0;  ///< exponents
};

// With prefixes.
constexpr std::array<Symbol, 29> prefixable{{
    {"m", {1}},
    {"g", {0, 1}, 1.0, 1000.0},
    {"s", {0, 0, 1}},
    {"A", {0, 0, 0, 1}},
    {"K", {0, 0, 0, 0, 1}},
    {"mol", {0, 0, 0, 0, 0, 1}},
    {"cd", {0, 0, 0, 0, 0, 0, 1}},
    {"rad", {}, 1.0, 1.0, 0.0, 1},
    {"Hz", {0, 0, -1}},
    {"N", {1, 1, -2}},
    {"Pa", {-1, 1, -2}},
    {"J", {2, 1, -2}},
    {"W", {2, 1, -3}},
    {"C", {0, 0, 1, 1}},
    {"V", {2, 1, -3, -1}},
    {"F", {-2, -1, 4, 2}},
    {"Ohm", {2, 1, -3, -2}},
    {"ohm", {2, 1, -3, -2}},
    {"S", {-2, -1, 3, 2}},
    {"Wb", {2, 1, -2, -1}},
    {"T", {0, 1, -2, -1}},
    {"H", {2, 1, -2, -2}},
    {"lm", {0, 0, 0, 0, 0, 0, 1}},
    {"lx", {-2, 0, 0, 0, 0, 0, 1}},
    {"l", {3}, 1.0, 1000.0},
    {"L", {3}, 1.0, 1000.0},
    {"bar", {-1, 1, -2}, 1e5},
    {"Wh", {2, 1, -2}, 3600.0},
    {"Ah", {0, 0, 1, 1}, 3600.0},
}};

constexpr std::array<Symbol, 27> without_prefix{{
    {"min", {0, 0, 1}, 60.0},
    {"h", {0, 0, 1}, 3600.0},
    {"d", {0, 0, 1}, 86400.0},
    {"sec", {0, 0, 1}},
    {"msec", {0, 0, 1}, 1.0, 1000.0},
    {"deg", {}, pi, 180.0, 0.0, 1},
    {"Grad", {}, pi, 180.0, 0.0, 1},
    {"%", {}, 1.0, 100.0},
    {"ppm", {}, 1.0, 1e6},
    {"rev", {}, 1.0, 1.0, 0.0, 1, 1},
    {"rpm", {0, 0, -1}, 1.0, 60.0, 0.0, 1, 1},
    {"RPM", {0, 0, -1}, 1.0, 60.0, 0.0, 1, 1},
    {"t", {0, 1}, 1000.0},
    {"gn", {1, 0, -2}, 9.80665},
    {"kph", {1, 0, -1}, 5.0, 18.0},
    {"kmh", {1, 0, -1}, 5.0, 18.0},
    {"mph", {1, 0, -1}, 0.44704},
    {"kn", {1, 0, -1}, 1852.0, 3600.0},
    {"in", {1}, 0.0254},
    {"ft", {1}, 0.3048},
    {"mi", {1}, 1609.344},
    {"nmi", {1}, 1852.0},
    {"lb", {0, 1}, 0.45359237},
    {"psi", {-1, 1, -2}, 6894.757293168361},
    {"atm", {-1, 1, -2}, 101325.0},
    {"degC", {0, 0, 0, 0, 1}, 1.0, 1.0, 273.15},
    {"degF", {0, 0, 0, 0, 1}, 5.0, 9.0, 459.67 * 5.0 / 9.0},
}};

/// Two symbols that are written without a sign between them.
struct Product {
  std::string_view text, first, second;
};
constexpr std::array<Product, 7> products{{{"Nm", "N", "m"},
                                           {"kNm", "kN", "m"},
                                           {"MNm", "MN", "m"},
                                           {"mNm", "mN", "m"},
                                           {"Ncm", "N", "cm"},
                                           {"Nmm", "N", "mm"},
                                           {"Ws", "W", "s"}}};

/// Whole units under other names.
constexpr std::array<std::pair<std::string_view, std::string_view>, 11> aliases{{
    {"-", ""},
    {"deg C", "degC"},
    {"Celsius", "degC"},
    {"deg F", "degF"},
    {"Fahrenheit", "degF"},
    {"degree", "deg"},
    {"degrees", "deg"},
    {"percent", "%"},
    {"U/min", "rpm"},
    {"Volt", "V"},
    {"Ampere", "A"},
}};

struct Prefix {
  std::string_view text;
  double numerator = 1.0, denominator = 1.0;
};
constexpr std::array<Prefix, 12> prefixes{{{"T", 1e12},
                                           {"G", 1e9},
                                           {"M", 1e6},
                                           {"k", 1e3},
                                           {"h", 1e2},
                                           {"da", 1e1},
                                           {"d", 1.0, 1e1},
                                           {"c", 1.0, 1e2},
                                           {"m", 1.0, 1e3},
                                           {"u", 1.0, 1e6},
                                           {"n", 1.0, 1e9},
                                           {"p", 1.0, 1e12}}};

const Symbol* find(std::span<const Symbol> symbols, std::string_view text) {
  const auto found = std::ranges::find(symbols, text, &Symbol::text);
  return found == symbols.end() ? nullptr : &*found;
}

std::optional<Symbol> symbol_of(std::string_view text) {
  if (const Symbol* symbol = find(without_prefix, text)) return *symbol;
  if (const Symbol* symbol = find(prefixable, text)) return *symbol;
  for (const Prefix& prefix : prefixes) {
    if (!text.starts_with(prefix.text)) continue;
    const Symbol* symbol = find(prefixable, text.substr(prefix.text.size()));
    const bool is_large_angle = symbol != nullptr && symbol->angle != 0 && prefix.numerator > 1.0;
    if (symbol == nullptr || is_large_angle) continue;
    Symbol scaled = *symbol;
    scaled.numerator *= prefix.numerator;
    scaled.denominator *= prefix.denominator;
    return scaled;
  }
  return std::nullopt;
}

/// In plain characters: the signs of other alphabets, and powers, replaced.
std::string plain(std::string_view text) {
  constexpr std::pair<std::string_view, std::string_view> signs[] = {
      {"\u00b0C", "degC"}, {"\u00b0F", "degF"}, {"\u00b0", "deg"}, {"\u00b5", "u"}, {"\u03bc", "u"},
      {"\u03a9", "Ohm"},   {"\u2126", "Ohm"},   {"\u00b7", " "},   {"*", " "},      {"\u00b9", "1"},
      {"\u00b2", "2"},     {"\u00b3", "3"},     {"\u207b", "-"},
  };
  std::string result;
  while (!text.empty()) {
    const auto sign = std::ranges::find_if(signs, [&](const auto& s) { return text.starts_with(s.first); });
    if (sign != std::end(signs)) {
      result += sign->second;
      text.remove_prefix(sign->first.size());
    } else {
      result += text.front();
      text.remove_prefix(1);
    }
  }
  const std::size_t begin = result.find_first_not_of(' ');
  if (begin == std::string::npos) return {};
  result.erase(result.find_last_not_of(' ') + 1);
  result.erase(0, begin);
  return result;
}

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '%';
}
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}

  std::optional<Unit> parse() {
    bool is_denominator = false;
    skip_blanks();
    while (at_ < text_.size()) {
      if (!parse_factor(is_denominator)) return std::nullopt;
      skip_blanks();
      if (at_ == text_.size()) break;
      after_stroke_ = text_[at_] == '/';
      if (after_stroke_) {
        is_denominator = true;
        ++at_;
      } else if (text_[at_] == '.') {
        ++at_;
      }
      skip_blanks();
      if (at_ == text_.size()) return std::nullopt;  // nothing after the sign
    }
    if (symbols_ != 1) unit_.offset = 0.0;
    if (unit_.angle.exponent == 0) unit_.angle.in_turns = false;
    return unit_;
  }

 private:
  void skip_blanks() {
    while (at_ < text_.size() && text_[at_] == ' ')
      ++at_;
  }

  bool parse_factor(bool is_denominator) {
    if (is_digit(text_[at_])) return parse_number(is_denominator);
    const std::size_t begin = at_;
    while (at_ < text_.size() && is_letter(text_[at_]))
      ++at_;
    std::string_view text = text_.substr(begin, at_ - begin);
    const auto pair = std::ranges::find(products, text, &Product::text);
    if (pair != products.end()) {
      if (!multiply(*symbol_of(pair->first), is_denominator ? -1 : 1)) return false;
      text = pair->second;
    }
    const auto symbol = symbol_of(text);
    const auto exponent = parse_exponent();
    if (!symbol || !exponent) return false;
    return multiply(*symbol, is_denominator ? -*exponent : *exponent);
  }

  /// A factor before a symbol: 10mV, l/100km, l/100 km. 1 needs no symbol.
  bool parse_number(bool is_denominator) {
    const std::size_t begin = at_;
    double value = 0.0;
    for (; at_ < text_.size() && is_digit(text_[at_]); ++at_)
      value = 10.0 * value + (text_[at_] - '0');
    double scale = 1.0;
    if (at_ + 1 < text_.size() && text_[at_] == '.' && is_digit(text_[at_ + 1])) {
      for (++at_; at_ < text_.size() && is_digit(text_[at_]); ++at_) {
        value = 10.0 * value + (text_[at_] - '0');
        scale *= 10.0;
      }
    }
    if (at_ - begin > max_digits) return false;
    if (value == 1.0 && scale == 1.0) return true;
    if (after_stroke_) skip_blanks();
    if (at_ == text_.size() || !is_letter(text_[at_])) return false;
    return scale_by(is_denominator ? scale : value, is_denominator ? value : scale);
  }

  /// 1 without one.
  std::optional<int> parse_exponent() {
    std::size_t at = at_;
    const bool is_marked = at < text_.size() && text_[at] == '^';
    if (is_marked) ++at;
    const bool is_negative = at < text_.size() && text_[at] == '-';
    if (is_negative) ++at;
    if (at == text_.size() || !is_digit(text_[at]))
      return is_marked || is_negative ? std::nullopt : std::optional(1);
    int value = 0;
    for (; at < text_.size() && is_digit(text_[at]); ++at) {
      value = 10 * value + (text_[at] - '0');
      if (value > max_exponent) return std::nullopt;
    }
    at_ = at;
    return is_negative ? -value : value;
  }

  bool multiply(const Symbol& symbol, int exponent) {
    const auto raised = power({symbol.exponents}, exponent);
    const auto dimension = raised ? product(unit_.dimension, *raised) : std::nullopt;
    const int angle = unit_.angle.exponent + exponent * symbol.angle;
    const int two_pi_exponent = unit_.two_pi_exponent + exponent * symbol.two_pi;
    if (!dimension || std::abs(angle) > max_exponent || std::abs(two_pi_exponent) > max_exponent)
      return false;
    unit_.dimension = *dimension;
    unit_.angle.exponent = static_cast<std::int8_t>(angle);
    unit_.angle.in_turns |= symbol.two_pi != 0;
    unit_.two_pi_exponent = static_cast<std::int8_t>(two_pi_exponent);
    const double numerator = std::pow(symbol.numerator, std::abs(exponent));
    const double denominator = std::pow(symbol.denominator, std::abs(exponent));
    unit_.offset = exponent == 1 ? symbol.offset : 0.0;
    ++symbols_;
    return scale_by(exponent >= 0 ? numerator : denominator, exponent >= 0 ? denominator : numerator);
  }

  bool scale_by(double numerator, double denominator) {
    unit_.numerator *= numerator;
    unit_.denominator *= denominator;
    return std::isfinite(unit_.numerator) && std::isfinite(unit_.denominator) && unit_.numerator > 0.0 &&
           unit_.denominator > 0.0;
  }

  static constexpr std::size_t max_digits = 15;
  const std::string_view text_;
  std::size_t at_ = 0;
  bool after_stroke_ = false;
  int symbols_ = 0;
  Unit unit_;
};

Conversion with_two_pi(Conversion scale, int exponent) {
  (exponent > 0 ? scale.numerator : scale.denominator) *= std::pow(2.0 * pi, std::abs(exponent));
  return scale;
}

}  // namespace

std::optional<Dimension> product(const Dimension& a, const Dimension& b) noexcept {
  Dimension result;
  for (std::size_t i = 0; i < result.exponents.size(); ++i) {
    const int sum = a.exponents[i] + b.exponents[i];
    if (std::abs(sum) > max_exponent) return std::nullopt;
    result.exponents[i] = static_cast<std::int8_t>(sum);
  }
  return result;
}

std::optional<Dimension> power(const Dimension& dimension, int exponent) noexcept {
  Dimension result;
  for (std::size_t i = 0; i < result.exponents.size(); ++i) {
    const long raised = static_cast<long>(dimension.exponents[i]) * exponent;
    if (std::abs(raised) > max_exponent) return std::nullopt;
    result.exponents[i] = static_cast<std::int8_t>(raised);
  }
  return result;
}

std::optional<Dimension> square_root(const Dimension& dimension) noexcept {
  Dimension result;
  for (std::size_t i = 0; i < result.exponents.size(); ++i) {
    if (dimension.exponents[i] % 2 != 0) return std::nullopt;
    result.exponents[i] = static_cast<std::int8_t>(dimension.exponents[i] / 2);
  }
  return result;
}

bool is_rate(const Dimension& dimension) noexcept {
  constexpr std::size_t seconds = 2;
  for (std::size_t i = 0; i < dimension.exponents.size(); ++i)
    if (i != seconds && dimension.exponents[i] != 0) return false;
  return dimension.exponents[seconds] < 0;
}

std::string si_symbol(const Dimension& dimension) {
  constexpr std::array<std::string_view, 7> base{"m", "kg", "s", "A", "K", "mol", "cd"};
  // In the order in which units are usually written: kg m2/s2.
  constexpr std::array<std::size_t, 7> order{1, 0, 3, 4, 5, 6, 2};
  const auto side = [&](int sign) {
    std::string text;
    for (const std::size_t i : order) {
      const int exponent = sign * dimension.exponents[i];
      if (exponent <= 0) continue;
      if (!text.empty()) text += ' ';
      text += base[i];
      if (exponent != 1) text += std::to_string(exponent);
    }
    return text;
  };
  std::string text = side(1);
  if (text.empty()) text.push_back('1');
  const std::string below = side(-1);
  if (!below.empty()) text.append("/").append(below);
  return text;
}

std::optional<Unit> parse_unit(std::string_view text) {
  std::string written = plain(text);
  const auto alias =
      std::ranges::find(aliases, written, &std::pair<std::string_view, std::string_view>::first);
  if (alias != aliases.end()) written = alias->second;
  auto unit = UnitParser(written).parse();
  if (unit) unit->symbol = text;
  return unit;
}

Conversion Unit::to_si() const noexcept {
  return with_two_pi({numerator, denominator, offset}, two_pi_exponent);
}
Conversion Unit::difference_to_si() const noexcept {
  return with_two_pi({numerator, denominator}, two_pi_exponent);
}

bool is_si(const Unit& unit) noexcept {
  return unit.numerator == unit.denominator && unit.offset == 0.0 && unit.two_pi_exponent == 0;
}

bool is_same(const Unit& a, const Unit& b) noexcept {
  return a.dimension == b.dimension && a.numerator == b.numerator && a.denominator == b.denominator &&
         a.offset == b.offset && a.two_pi_exponent == b.two_pi_exponent &&
         a.angle.exponent == b.angle.exponent;
}

std::optional<int> two_pi_exponent_between(const Dimension& dimension, const Angle& from,
                                           const Angle& to) noexcept {
  const bool is_refused = (from.is_cycles && to.exponent != 0) || (to.is_cycles && from.exponent != 0);
  if (is_refused) return std::nullopt;
  if (dimension.is_one() || from.exponent == to.exponent) return 0;
  const bool has_turns = from.in_turns || to.in_turns;
  if (!is_rate(dimension) || (from.exponent != 0 && to.exponent != 0))
    return has_turns ? std::nullopt : std::optional(0);
  const bool is_open = (from.exponent == 0 ? from : to).is_open;
  if (has_turns == is_open) return std::nullopt;  // turns beside what is open, radians beside cycles
  return has_turns ? to.exponent - from.exponent : 0;
}

std::optional<Conversion> conversion(const Unit& from, const Unit& to) {
  if (from.dimension != to.dimension) return std::nullopt;
  const auto exponent = two_pi_exponent_between(from.dimension, from.angle, to.angle);
  if (!exponent) return std::nullopt;
  Conversion result{.numerator = from.numerator * to.denominator,
                    .denominator = from.denominator * to.numerator};
  result.offset = (from.offset - to.offset) * to.denominator / to.numerator;
  return with_two_pi(result, from.two_pi_exponent + *exponent - to.two_pi_exponent);
}

Angle angle_of(const Unit& unit, ValueKind value_kind) noexcept {
  Angle angle = unit.angle;
  angle.is_open = value_kind == ValueKind::open;
  angle.is_cycles = angle.is_open && unit.dimension.is_one() && angle.exponent == 0;
  return angle;
}

std::optional<Conversion> signal_conversion(const std::string& from, const std::string& to,
                                            ValueKind value_kind) {
  if (from == to) return Conversion{};
  auto source = parse_unit(from);
  const auto target = parse_unit(to);
  if (source) source->angle = angle_of(*source, value_kind);
  if (target && target->offset != 0.0 && value_kind == ValueKind::difference) return std::nullopt;
  if (from.empty() || to.empty()) {
    if (!source || !target) return Conversion{};
    if (source->angle.in_turns || target->angle.in_turns) return std::nullopt;
    if (source->angle.is_cycles && target->angle.exponent != 0) return std::nullopt;
    const Unit& known = from.empty() ? *target : *source;
    const Unit si{.symbol = {}, .dimension = known.dimension, .angle = known.angle};
    return from.empty() ? conversion(si, known) : conversion(known, si);
  }
  return source && target ? conversion(*source, *target) : std::nullopt;
}

std::string missing_unit_text(const std::string& signal, const Unit& unit) {
  std::array<char, 32> number{};
  const double si_one =
      conversion({.symbol = {}, .dimension = unit.dimension, .angle = unit.angle}, unit)->of(1.0);
  std::snprintf(number.data(), number.size(), "%.6g", si_one);
  return "'" + signal + "' has no unit, so it is in the SI, and 1 is " + number.data() + " " + unit.symbol +
         "; 'units' of a CAN bus or 'unit' of a register or an output gives it one";
}

std::string angle_hint(const Dimension& dimension, const Angle& from, const Angle& to) {
  if (two_pi_exponent_between(dimension, from, to)) return {};
  if (from.is_cycles || to.is_cycles)
    return "; a number of cycles is no angle: multiply it by 1 rev (a cycle is a turn) or by 1 rad";
  if (!is_rate(dimension) || (from.exponent != 0 && to.exponent != 0))
    return "; one of both counts turns: multiply or divide it by 1 rad (a turn is 2 pi) or by 1 rev (a turn "
           "is "
           "1)";
  if (from.in_turns || to.in_turns)
    return "; the computed rate may count radians or turns: multiply it by 1 rad or by 1 rev";
  return "; an angular rate is no frequency: divide it by 1 rev, or multiply the frequency by 1 rev";
}

DifferenceUnit difference_unit(const std::string& symbol) {
  const auto unit = parse_unit(symbol);
  if (!unit || unit->offset == 0.0) return {symbol, 1.0};
  return {"K", unit->denominator / unit->numerator};
}

}  // namespace hil::units
