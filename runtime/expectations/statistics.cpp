#include "runtime/expectations/statistics.hpp"

#include <hil/unit.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/expectations/signal_constant.hpp"

namespace hil::expectations {
namespace {

using config::Field;
using config::Schema;

constexpr std::array all_figures{Statistics::mean, Statistics::rms, Statistics::standard_deviation,
                                 Statistics::smallest, Statistics::largest};

Schema limits_schema() {
  return Schema::record({
      Field::optional("min", Schema::text(), "The least value, with its unit."),
      Field::optional("max", Schema::text(), "The greatest value, with its unit."),
  });
}

Schema step_schema(std::vector<Field> more) {
  std::vector<Field> fields{
      Field::needed("of", Schema::text(), "The final value of the step, with its unit."),
      Field::optional("from", Schema::text(),
                      "The value before the step. Left out: that at the first judged instant.")};
  fields.insert(fields.end(), more.begin(), more.end());
  return Schema::record(std::move(fields));
}

Schema statistics_schema(std::span<const config::BusSectionType> /*buses*/) {
  const Schema share = Schema::quantity(config::Quantity::share, 0.0, 1e3);
  return Schema::record({
      Field::needed("signal", Schema::signal(), "The signal."),
      Field::optional("mean", limits_schema(), "The mean of its values on all judged ticks."),
      Field::optional("rms", limits_schema(), "The root of the mean of their squares."),
      Field::optional("standard_deviation", limits_schema(), "Their standard deviation."),
      Field::optional("smallest", limits_schema(), "The smallest value."),
      Field::optional("largest", limits_schema(), "The largest value."),
      Field::optional("overshoot", step_schema({Field::needed("at_most", share, "The largest overshoot.")}),
                      "The largest excess over the final value of a step, as a share of the step."),
      Field::optional(
          "settling_time",
          step_schema({Field::needed("within", share, "The share of the step within which it settles."),
                       Field::needed("at_most", config::duration_schema(config::min_duration_s),
                                     "The longest time from the first judged instant.")}),
          "The time from which on the signal stays near the final value of a step."),
  });
}

class StatisticsReader {
 public:
  StatisticsReader(const config::Value& value, const config::ClaimContext& context)
      : value_(value), context_(context) {}

  std::shared_ptr<const config::Claim> read() {
    const std::size_t before = context_.diagnostics.count();
    Statistics claim{
        .signal = config::word_of(value_["signal"]), .limits = {}, .overshoot = {}, .settling = {}};
    bool has_limit = false;
    for (const Statistics::Figure figure : all_figures) {
      const char* const key = key_of(figure);
      if (!value_.has(key)) continue;
      has_limit = true;
      const config::Value& limits = value_[key];
      claim.limits[figure] = {parsed(limits, "min"), parsed(limits, "max")};
      if (!limits.has("min") && !limits.has("max"))
        context_.diagnostics.add(limits.place(), std::string("'") + key + "' needs 'min', 'max' or both");
    }
    if (value_.has("overshoot")) {
      const config::Value& overshoot = value_["overshoot"];
      if (auto step = step_in(overshoot))
        claim.overshoot = Statistics::Overshoot{std::move(*step), overshoot["at_most"].number()};
    }
    if (value_.has("settling_time")) {
      const config::Value& settling = value_["settling_time"];
      if (auto step = step_in(settling))
        claim.settling = Statistics::Settling{std::move(*step), settling["within"].number(),
                                              settling["at_most"].duration_ns()};
    }
    if (!has_limit && !value_.has("overshoot") && !value_.has("settling_time"))
      context_.diagnostics.add(value_.place(), "'statistics' needs a limit of at least one figure");
    if (context_.diagnostics.count() != before) return nullptr;
    return claim_of(std::move(claim));
  }

 private:
  std::optional<config::Expression> parsed(const config::Value& record, const char* key) {
    if (!record.has(key)) return std::nullopt;
    return config::Expression::parse(record[key], context_.diagnostics);
  }
  std::optional<StepResponse> step_in(const config::Value& record) {
    auto of = parsed(record, "of");
    auto from = parsed(record, "from");
    if (!of) return std::nullopt;
    return StepResponse{std::move(*of), std::move(from)};
  }

  const config::Value& value_;
  const config::ClaimContext& context_;
};

std::shared_ptr<const config::Claim> read_statistics(const config::Value& entry,
                                                     const config::ClaimContext& context) {
  return StatisticsReader(entry["statistics"], context).read();
}

void check_step(const StepResponse& step, const signals::SignalInfo& signal, const ClaimCheck& check) {
  const ConstantKind kind = limit_kind(signal);
  const auto of = check_constant(step.of, kind, signal.unit, "'of'", check.diagnostics);
  warn_of_missing_unit(step.of, signal, check.diagnostics);
  if (!step.from) return;
  const auto from = check_constant(*step.from, kind, signal.unit, "'from'", check.diagnostics);
  if (of && from && *of == *from)
    check.diagnostics.add(step.from->place(), "'from': " + config::in_quotes(step.from->text()) +
                                                  " is the final value, so there is no step");
}

}  // namespace

const char* key_of(Statistics::Figure figure) {
  constexpr std::array keys{"mean", "rms", "standard_deviation", "smallest", "largest"};
  return keys[figure];
}

bool has_rms(const signals::SignalInfo& signal) {
  const auto unit = units::parse_unit(signal.unit);
  return !unit || unit->offset == 0.0 || signal.value_kind == units::ValueKind::difference;
}

void check_claim(const Statistics& claim, const ClaimCheck& check) {
  const signals::SignalId signal = check.known.find(claim.signal, check.diagnostics);
  if (!signal.valid()) return;
  const signals::SignalInfo& info = check.known.table().info(signal);
  for (const Statistics::Figure figure : all_figures) {
    const Limits& limits = claim.limits[figure];
    const ConstantKind kind =
        figure == Statistics::standard_deviation ? ConstantKind::difference : limit_kind(info);
    std::optional<double> min, max;
    if (limits.min) min = check_constant(*limits.min, kind, info.unit, "'min'", check.diagnostics);
    if (limits.max) max = check_constant(*limits.max, kind, info.unit, "'max'", check.diagnostics);
    for (const auto* limit : {&limits.min, &limits.max}) {
      if (!*limit) continue;
      warn_of_missing_unit(**limit, info, check.diagnostics);
      if (figure == Statistics::rms && !has_rms(info))
        check.diagnostics.add((*limit)->place(), "'rms' of a temperature in " + info.unit +
                                                     " depends on where its scale begins; limit 'mean' and "
                                                     "'standard_deviation', or give the signal the unit K");
    }
    if (min && max && *max < *min) {
      check.diagnostics.add(limits.max->place(), "'max': " + config::in_quotes(limits.max->text()) +
                                                     " is less than 'min', " +
                                                     config::in_quotes(limits.min->text()));
    }
  }
  if (claim.overshoot) check_step(claim.overshoot->step, info, check);
  if (claim.settling) check_step(claim.settling->step, info, check);
}

config::ExpectationKind statistics_kind() {
  return {.key = "statistics",
          .about = "Limits of the mean, the deviation, the overshoot and other figures of a signal.",
          .schema = statistics_schema,
          .read = read_statistics};
}

}  // namespace hil::expectations
