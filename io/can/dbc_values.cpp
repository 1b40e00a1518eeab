// The statements of a DBC file that decide how raw values are read: value names, floating point,
// multiplexing.

#include <algorithm>
#include <cmath>

#include "io/can/dbc_parser.hpp"
#include "io/can/dbc_text.hpp"

namespace hil::io::can {

namespace {

/// Sorts the ranges and joins those that overlap.
void merge_ranges(std::vector<MultiplexRange>& ranges) {
  std::sort(ranges.begin(), ranges.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::size_t kept = 0;
  for (const MultiplexRange& range : ranges) {
    if (kept > 0 && range.first <= ranges[kept - 1].last) {
      ranges[kept - 1].last = std::max(ranges[kept - 1].last, range.last);
    } else {
      ranges[kept++] = range;
    }
  }
  ranges.resize(kept);
}

}  // namespace

void DbcParser::parse_value_table() {
  const std::string_view name = word();
  if (name.empty()) return static_cast<void>(fail("the name of a value table"));
  std::map<std::int64_t, std::string> values;
  if (parse_value_list(values))
    result_.database.value_tables.insert_or_assign(std::string(name), std::move(values));
}

void DbcParser::parse_values() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) {  // values of an environment variable
    if (word().empty()) return static_cast<void>(fail("a message's identifier"));
    return skip_statement();
  }
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = word();
  if (name.empty()) return static_cast<void>(fail("a signal's name"));
  std::map<std::int64_t, std::string> values;
  if (!parse_value_list(values)) return;
  if (DbcSignal* signal = signal_of(*id, name, position)) signal->value_names = std::move(values);
}

// value "name" ... ;
bool DbcParser::parse_value_list(std::map<std::int64_t, std::string>& values) {
  while (!scanner_.accept(';')) {
    if (scanner_.at_statement_line()) {  // the names read so far are complete
      fail_unfinished();
      return true;
    }
    const std::size_t position = scanner_.position();
    // Unsigned first: a raw value may use all 64 bits.
    const auto whole = scanner_.number<std::uint64_t>();
    std::int64_t raw = whole ? static_cast<std::int64_t>(*whole) : 0;
    if (!whole || scanner_.peek() != '"') {
      scanner_.move_to(position);
      const auto value = scanner_.number<double>();
      if (!value || !(std::abs(*value) < 9.2e18)) return fail("a value, or ';' at the end of the list");
      raw = static_cast<std::int64_t>(*value);
    }
    const auto text = scanner_.quoted();
    if (!text) return fail("the value's name in double quotes");
    values.insert_or_assign(raw, dbc_text(*text));
  }
  return true;
}

// SIG_VALTYPE_ id signal : 1 ;
void DbcParser::parse_value_type() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = word();
  DbcSignal* const signal = name.empty() ? nullptr : signal_of(*id, name, position);
  scanner_.accept(':');
  const auto kind = scanner_.number<std::uint32_t>();
  if (name.empty() || !kind || *kind > 2) {
    // Without this statement the signals of the message would be decoded wrongly.
    if (DbcMessage* const message = message_of_id(*id))
      message->unusable.emplace_back("a SIG_VALTYPE_ statement of it is not understood");
    return static_cast<void>(fail(name.empty() ? "a signal's name" : "0 (integer), 1 (float) or 2 (double)"));
  }
  expect_semicolon();
  if (signal == nullptr || *kind == 0) return;
  if (signal->length_bits != 32 * *kind) {
    return make_unusable(*message_of_id(*id), position,
                         "signal '" + signal->name + "' has " + std::to_string(signal->length_bits) +
                             " bits, and a " + (*kind == 1 ? "float has 32" : "double has 64"));
  }
  signal->type = *kind == 1 ? ValueType::float32 : ValueType::float64;
}

// SG_MUL_VAL_ id signal switch first-last, first-last ;
void DbcParser::parse_extended_multiplexing() {
  const auto id = scanner_.number<std::uint32_t>();
  if (!id) return static_cast<void>(fail("a message's identifier"));
  scanner_.skip_space();
  const std::size_t position = scanner_.position();
  const std::string_view name = word();
  scanner_.skip_space();
  const std::size_t switch_position = scanner_.position();
  const std::string_view switch_name = name.empty() ? name : word();
  std::vector<MultiplexRange> ranges;
  const auto read_ranges = [&] {
    if (name.empty()) return fail("the name of the multiplexed signal");
    if (switch_name.empty()) return fail("the name of the multiplexer signal");
    do {
      const auto first = scanner_.number<std::uint64_t>();
      if (!first || !scanner_.accept('-')) return fail("a range of multiplexer values such as 3-5");
      const auto last = scanner_.number<std::uint64_t>();
      if (!last || *last < *first) return fail("the last value of the range, not below the first");
      ranges.push_back({*first, *last});
    } while (scanner_.accept(','));
    return true;
  };
  if (!read_ranges()) {
    if (DbcMessage* const message = message_of_id(*id))
      message->unusable.emplace_back("a SG_MUL_VAL_ statement of it is not understood");
    return;
  }
  expect_semicolon();
  DbcSignal* const selected = signal_of(*id, name, position);
  DbcSignal* const selector = signal_of(*id, switch_name, switch_position);
  if (selected == nullptr || selector == nullptr) return;
  DbcMessage& message = *message_of_id(*id);
  if (selected == selector)
    return make_unusable(message, switch_position, "signal '" + selected->name + "' selects itself");
  const auto index_of = [&](const DbcSignal* signal) {
    return static_cast<std::size_t>(signal - message.signals.data());
  };
  bool& has_ranges = note_of(message).signals[index_of(selected)].has_extended_ranges;
  if (has_ranges && selected->multiplexer != static_cast<int>(index_of(selector)))
    return make_unusable(message, switch_position,
                         "signal '" + selected->name + "' is selected by two multiplexers");
  if (!has_ranges) selected->multiplex_ranges.clear();
  selected->multiplex_ranges.insert(selected->multiplex_ranges.end(), ranges.begin(), ranges.end());
  merge_ranges(selected->multiplex_ranges);
  selected->multiplexer = static_cast<int>(index_of(selector));
  selector->is_multiplexer = true;
  has_ranges = true;
}

}  // namespace hil::io::can
