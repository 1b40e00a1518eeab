#include "runtime/config/section_readers.hpp"
#include "runtime/config/units.hpp"

namespace hil::config {
namespace {

using Claim = decltype(Expectation::claim);

Response read_response(const Value& value, Diagnostics& diagnostics) {
  if (value["request"].text() == value["reply"].text()) {
    diagnostics.add(value["reply"].place(), "'reply': " + in_quotes(value["reply"].text()) +
                                                " is the request itself; the reply is another signal");
  }
  return {word_of(value["request"]), word_of(value["reply"]), value["within"].duration_ns(),
          static_cast<std::uint64_t>(value["at_least"].integer())};
}

std::optional<Claim> read_reaction(const Value& value, Diagnostics& diagnostics) {
  auto when = Expression::parse(value["when"], diagnostics);
  auto then = Expression::parse(value["then"], diagnostics);
  if (!when || !then) return std::nullopt;
  return Reaction{std::move(*when), std::move(*then), value["within"].duration_ns(),
                  static_cast<std::uint64_t>(value["at_least"].integer())};
}

std::optional<Claim> read_count(const Value& value, Diagnostics& diagnostics) {
  auto condition = Expression::parse(value["of"], diagnostics);
  if (!condition) return std::nullopt;
  Count count{std::move(*condition), static_cast<std::uint64_t>(value["min"].integer()), std::nullopt};
  if (value.has("max")) count.max = static_cast<std::uint64_t>(value["max"].integer());
  if (count.max && *count.max < count.min) {
    diagnostics.add(value["max"].place(), "'max': " + std::to_string(*count.max) + " is less than 'min', " +
                                              std::to_string(count.min));
    return std::nullopt;
  }
  if (!count.max && count.min == 0) {
    diagnostics.add(value.place(), "'count' needs 'min', 'max' or both");
    return std::nullopt;
  }
  return count;
}

std::optional<Claim> read_order(const Value& list, Diagnostics& diagnostics) {
  Order order;
  for (const Value& text : list.items()) {
    if (auto condition = Expression::parse(text, diagnostics))
      order.conditions.push_back(std::move(*condition));
  }
  if (order.conditions.size() != list.items().size()) return std::nullopt;
  return order;
}

std::optional<Claim> read_claim(const Value& value, std::int64_t duration_ns, Diagnostics& diagnostics) {
  const std::string& kind = value.chosen();
  if (kind == "response") return read_response(value[kind], diagnostics);
  if (kind == "reaction") return read_reaction(value[kind], diagnostics);
  if (kind == "count") return read_count(value[kind], diagnostics);
  if (kind == "order") return read_order(value[kind], diagnostics);
  std::optional<Expression> condition = Expression::parse(value[kind], diagnostics);
  if (!condition) return std::nullopt;
  if (kind == "never") return Never{std::move(*condition)};
  if (kind == "always") return Always{std::move(*condition)};
  Eventually eventually{std::move(*condition), std::nullopt};
  if (!value.has("by")) return eventually;
  eventually.by_ns = value["by"].duration_ns();
  if (duration_ns > 0 && *eventually.by_ns > duration_ns) {
    diagnostics.add(value["by"].place(), "'by': " + format_duration(*eventually.by_ns) +
                                             " is after the end of the run, which takes " +
                                             format_duration(duration_ns) + "; left out: by its end");
  }
  return eventually;
}

}  // namespace

void read_expectations(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "expectations");
  if (list == nullptr) return;
  UniqueNames names("expectation", reading.diagnostics);
  for (const Value& value : list->items()) {
    if (const std::optional<Word> name = word_in(value, "name")) names.add(*name);
    if (!is_whole(value)) continue;
    if (value.has("by") && value.chosen() != "eventually") {
      reading.diagnostics.add(value["by"].place(),
                              "'by' belongs to 'eventually', not to " + in_quotes(value.chosen()));
    }
    std::optional<Claim> claim = read_claim(value, scenario.duration_ns, reading.diagnostics);
    if (!claim) continue;
    scenario.expectations.push_back(
        {value["name"].text(), value.place(), value["coverage"].number(), std::move(*claim)});
  }
}

}  // namespace hil::config
