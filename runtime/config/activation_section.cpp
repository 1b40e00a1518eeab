#include "runtime/config/activation_section.hpp"

#include <limits>

#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/run_end.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::config {

void add_activation_fields(std::vector<Field>& fields) {
  const std::vector<Field> more{
      Field::optional("at", duration_schema(0.0), "The run time at which it begins."),
      Field::optional("every", duration_schema(min_duration_s),
                      "With 'at': the time from one begin to the next."),
      Field::optional("when", Schema::text(), "A condition: it begins where it becomes true."),
      Field::optional("while", Schema::text(), "A condition: it is active where it is true."),
      Field::optional("for", duration_schema(min_duration_s), "How long it is active. Left out: to the end."),
      Field::optional("until", Schema::text(), "A condition: it ends where it is true."),
      Field::optional("times", Schema::integer(1, 1'000'000'000),
                      "How often it begins at most. Left out: once; with 'every' and 'while' as often as "
                      "they say."),
      Field::with_default("probability", Schema::quantity(Quantity::share, 0.0, 1.0), "100 %",
                          "The probability of each begin, from the run's seed."),
  };
  fields.insert(fields.end(), more.begin(), more.end());
}

namespace {

void read_expression(const Value& section, const char* field, std::optional<Expression>& expression,
                     Diagnostics& diagnostics) {
  if (!section.has(field)) return;
  expression = Expression::parse(section[field], diagnostics);
}

}  // namespace

void need_a_tick(const Value& duration, const std::string& field, std::int64_t period_ns,
                 Diagnostics& diagnostics) {
  if (duration.duration_ns() >= period_ns) return;
  diagnostics.add(duration.place(), "'" + field + "': " + format_duration(duration.duration_ns()) +
                                        " is shorter than the base period of " + format_duration(period_ns));
}

bool read_activation(const Value& section, ActivationSection& activation, const Scenario& scenario,
                     Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.count();
  const char* begin = nullptr;
  for (const char* const field : {"at", "when", "while"}) {
    if (!section.has(field)) continue;
    if (begin != nullptr) {
      diagnostics.add(section[field].place(), std::string("'") + field + "' and '" + begin +
                                                  "' exclude each other: both say when it begins");
    }
    begin = field;
  }
  const bool has_while = section.has("while");
  for (const char* const field : {"for", "until"}) {
    if (has_while && section.has(field))
      diagnostics.add(section[field].place(), std::string("'") + field + "' and 'while' exclude each other");
  }
  if (section.has("at")) activation.at_ns = section["at"].duration_ns();
  if (section.has("for")) activation.for_ns = section["for"].duration_ns();
  if (activation.at_ns) {
    const std::string reason =
        reason_without_tick(*activation.at_ns, scenario.base_period_ns, scenario.duration_ns);
    if (!reason.empty())
      diagnostics.add(section["at"].place(), "'at': " + format_duration(*activation.at_ns) + reason);
  }
  if (section.has("every")) {
    activation.every_ns = section["every"].duration_ns();
    if (!activation.at_ns) diagnostics.add(section["every"].place(), "'every' needs 'at'");
    need_a_tick(section["every"], "every", scenario.base_period_ns, diagnostics);
    if (!activation.for_ns || *activation.for_ns >= *activation.every_ns)
      diagnostics.add(section["every"].place(), "'every' needs a shorter 'for'");
  }
  read_expression(section, "when", activation.when, diagnostics);
  read_expression(section, "while", activation.active_while, diagnostics);
  read_expression(section, "until", activation.until, diagnostics);
  activation.probability = section["probability"].number();
  if (activation.probability == 0.0)
    diagnostics.add(section["probability"].place(),
                    "'probability': with 0 % it never begins; give more than 0 %");
  constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();
  if (section.has("times"))
    activation.times = static_cast<std::uint64_t>(section["times"].integer());
  else if (activation.every_ns || has_while)
    activation.times = unlimited;
  if (activation.times > 1 && activation.at_ns && !activation.every_ns)
    diagnostics.add(section["times"].place(), "'times' with 'at' needs 'every'");
  return diagnostics.count() == before;
}

}  // namespace hil::config
