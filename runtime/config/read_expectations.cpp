#include <algorithm>

#include <hil/quantity.hpp>

#include "runtime/config/run_end.hpp"
#include "runtime/config/section_readers.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::config {
namespace {

std::optional<WindowSection> read_window(const Value& entry, const ClaimContext& context) {
  if (!entry.has("between") && !entry.has("after") && !entry.has("until")) return std::nullopt;
  Diagnostics& diagnostics = context.diagnostics;
  WindowSection window{.place = entry.place(), .from_ns = {}, .to_ns = {}, .after = {}, .until = {}};
  if (entry.has("between")) {
    const std::vector<Value>& limits = entry["between"].items();
    window.from_ns = limits[0].duration_ns();
    window.to_ns = limits[1].duration_ns();
    if (*window.to_ns < *window.from_ns) {
      diagnostics.add(limits[1].place(), "'between': " + format_duration(*window.to_ns) +
                                             " is before the begin of the window, " +
                                             format_duration(*window.from_ns));
    } else {
      const std::string reason = reason_without_tick(*window.from_ns, context.period_ns, context.duration_ns);
      if (!reason.empty())
        diagnostics.add(limits[0].place(), "'between': " + format_duration(*window.from_ns) + reason);
      else if (context.duration_ns > 0 && *window.to_ns > context.duration_ns)
        diagnostics.add(limits[1].place(), "'between': " + format_duration(*window.to_ns) +
                                               " is after the end of the run, which takes " +
                                               format_duration(context.duration_ns) +
                                               "; give an earlier time or a longer duration");
    }
  }
  if (entry.has("after")) window.after = Expression::parse(entry["after"], diagnostics);
  if (entry.has("until")) window.until = Expression::parse(entry["until"], diagnostics);
  return window;
}

void check_by(const Value& entry, const std::optional<WindowSection>& window, const ClaimContext& context) {
  if (!entry.has("by")) return;
  const Value& by = entry["by"];
  if (entry.chosen() != "eventually") {
    context.diagnostics.add(by.place(), "'by' belongs to 'eventually', not to " + in_quotes(entry.chosen()));
  } else if (window && window->from_ns && by.duration_ns() < *window->from_ns) {
    context.diagnostics.add(by.place(), "'by': " + format_duration(by.duration_ns()) +
                                            " is before the begin of the window, " +
                                            format_duration(*window->from_ns));
  }
}

}  // namespace

Schema expectations_schema(const ScenarioTypes& types) {
  std::vector<Field> kinds;
  for (const ExpectationKind& kind : types.expectations)
    kinds.push_back(Field::optional(kind.key, kind.schema(types.buses), kind.about));
  const std::vector<Field> common{
      Field::needed("name", Schema::text(), "The expectation's name in the report."),
      Field::optional("by", duration_schema(0.0),
                      "With eventually: the run time by which the condition has to be true. Left out: "
                      "the end of the run."),
      Field::optional("between", Schema::list(duration_schema(0.0), 2, 2),
                      "The first and the last run time at which the expectation is judged."),
      Field::optional("after", Schema::text(),
                      "A condition: the expectation is judged from the first tick on which it is true."),
      Field::optional("until", Schema::text(),
                      "A condition: the expectation is judged before the first tick on which it is true."),
      Field::with_default(
          "coverage", Schema::quantity(Quantity::share, 0.0, 1.0), "95 %",
          "The least share of its ticks on which the expectation has to be evaluated, and at least one "
          "tick. Below it the expectation is not checked, and the run does not pass."),
  };
  return Schema::list(kinds.empty() ? Schema::record(common) : Schema::exactly_one(kinds, common));
}

void read_expectations(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "expectations");
  if (list == nullptr) return;
  UniqueNames names("expectation", reading.diagnostics);
  const ClaimContext context{.duration_ns = scenario.duration_ns,
                             .period_ns = scenario.base_period_ns,
                             .diagnostics = reading.diagnostics};
  for (const Value& entry : list->items()) {
    if (const std::optional<Word> name = word_in(entry, "name")) names.add(*name);
    if (!is_whole(entry)) continue;
    const std::size_t before = reading.diagnostics.count();
    std::optional<WindowSection> window = read_window(entry, context);
    check_by(entry, window, context);
    const auto kind = std::ranges::find(reading.types.expectations, entry.chosen(), &ExpectationKind::key);
    std::shared_ptr<const Claim> claim = kind->read(entry, context);
    if (reading.diagnostics.count() != before || claim == nullptr) continue;
    scenario.expectations.push_back({.name = entry["name"].text(),
                                     .place = entry.place(),
                                     .coverage = entry["coverage"].number(),
                                     .window = std::move(window),
                                     .claim = std::move(claim)});
  }
}

}  // namespace hil::config
