#include "runtime/config/injection_section.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/config/units.hpp"

namespace hil::config {
namespace {

/// The keys of an activation.
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

Schema pair_schema(const char* first, const char* first_about, const char* second, const char* second_about,
                   std::vector<Field> more) {
  std::vector<Field> fields{Field::needed(first, Schema::text(), first_about),
                            Field::needed(second, Schema::text(), second_about)};
  fields.insert(fields.end(), more.begin(), more.end());
  return Schema::record(std::move(fields));
}

Schema segment_schema() {
  const Field period = Field::needed("period", duration_schema(min_duration_s), "The period.");
  return Schema::exactly_one(
      {
          Field::optional("hold", Schema::text(), "An expression, whose value is held: a step."),
          Field::optional("value", Schema::text(), "An expression, computed in each tick."),
          Field::optional("ramp", Schema::text(),
                          "The last value of a ramp, which begins at the value before it and takes 'for'."),
          Field::optional("sine",
                          pair_schema("mean", "The mean.", "amplitude", "The amplitude.",
                                      {period, Field::with_default(
                                                   "phase", Schema::quantity(Quantity::angle_rad, -1e3, 1e3),
                                                   "0 deg", "The angle at the begin.")}),
                          "A sine."),
          Field::optional("sawtooth",
                          pair_schema("low", "The value at the begin of a period.", "high",
                                      "The value at its end.", {period}),
                          "Rises, or falls, in each period, and goes back at once."),
          Field::optional(
              "pulses",
              pair_schema("low", "The value between pulses.", "high", "The value of a pulse.",
                          {period, Field::with_default("width", Schema::quantity(Quantity::share, 0.0, 1.0),
                                                       "50 %", "The share of a period that is high.")}),
              "Pulses; a period begins with its pulse."),
          Field::optional("noise",
                          pair_schema("mean", "The mean.", "deviation", "The standard deviation.", {}),
                          "Normally distributed random values, one in each tick, from the run's seed."),
      },
      {
          Field::optional("name", Schema::name(),
                          "The name of the part: its begin is an event of the report."),
          Field::optional("for", duration_schema(min_duration_s),
                          "The duration. Left out, in the last part: to the end of the run."),
      });
}

Schema stimulus_schema() {
  const Schema file = Schema::record({
      Field::needed("path", Schema::file(),
                    "A CSV file: a column 'time' in seconds, and one for each value."),
      Field::needed("column", Schema::text(), "The column that drives."),
      Field::with_default("between", Schema::one_of({"linear", "previous"}), "linear",
                          "The value between two rows. linear: on the line between them. previous: that of "
                          "the row before."),
  });
  std::vector<Field> common{
      Field::needed("name", Schema::name(), "The stimulus's name. 'stimulus.NAME' is 1 while it is active."),
      Field::needed("drives", Schema::signal(),
                    "An input of a module, or a signal of a message that a bus sends, which nothing else "
                    "drives."),
      Field::optional("repeat", Schema::integer(0, 1'000'000'000),
                      "How often the sequence runs; 0: to the end of the run. Left out: once."),
  };
  add_activation_fields(common);
  return Schema::exactly_one(
      {
          Field::optional("sequence", Schema::list(segment_schema(), 1, 10'000),
                          "The parts, one after the other."),
          Field::optional("file", file, "A column of a CSV file."),
      },
      std::move(common));
}

Schema fault_schema() {
  std::vector<Field> common{
      Field::needed("name", Schema::name(), "The fault's name. 'fault.NAME' is 1 while it is active."),
      Field::needed("signal", Schema::signal(), "The signal that readers read wrongly."),
      Field::with_default("readers", Schema::list(Schema::signal()), "[]",
                          "Modules, buses ('can.car') or their inputs ('control.level'). Left out: all "
                          "modules and buses that read the signal."),
  };
  add_activation_fields(common);
  return Schema::exactly_one(
      {
          Field::optional("stuck", Schema::text(), "An expression, or 'last': the value before the fault."),
          Field::optional("offset", Schema::text(), "An expression that is added."),
          Field::optional("gain", Schema::text(), "A factor."),
          Field::optional(
              "noise", Schema::text(),
              "The standard deviation of normally distributed noise that is added, from the run's "
              "seed."),
          Field::optional("drift", Schema::text(), "A change per second since the begin, which is added."),
          Field::optional("delay", duration_schema(min_duration_s),
                          "How late the value is, a multiple of the base period."),
          Field::optional("dropout", Schema::quantity(Quantity::share, 0.0, 1.0),
                          "The share of ticks in which there is no value, from the run's seed."),
      },
      std::move(common));
}

/// Empty with a mistake.
bool read_expression(const Value& section, const char* field, std::optional<Expression>& expression,
                     Diagnostics& diagnostics) {
  if (!section.has(field)) return true;
  expression = Expression::parse(section[field], diagnostics);
  return expression.has_value();
}

/// A shorter time would let one tick pass through any number of parts.
void need_a_tick(const Value& duration, const std::string& field, std::int64_t period_ns,
                 Diagnostics& diagnostics) {
  if (duration.duration_ns() >= period_ns) return;
  diagnostics.add(duration.place(), "'" + field + "': " + format_duration(duration.duration_ns()) +
                                        " is shorter than the base period of " + format_duration(period_ns));
}

/// False with mistakes.
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
  if (activation.at_ns && scenario.duration_ns > 0 && *activation.at_ns >= scenario.duration_ns) {
    diagnostics.add(section["at"].place(), "'at': " + format_duration(*activation.at_ns) +
                                               " is not before the end of the run, which takes " +
                                               format_duration(scenario.duration_ns));
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
  constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();
  if (section.has("times"))
    activation.times = static_cast<std::uint64_t>(section["times"].integer());
  else if (activation.every_ns || has_while)
    activation.times = unlimited;
  if (activation.times > 1 && activation.at_ns && !activation.every_ns)
    diagnostics.add(section["times"].place(), "'times' with 'at' needs 'every'");
  return diagnostics.count() == before;
}

std::optional<StimulusSegment> read_segment(const Value& section, bool is_last, ReaderContext& reading) {
  using Kind = StimulusSegment::Kind;
  Diagnostics& diagnostics = reading.diagnostics;
  const std::size_t before = diagnostics.count();
  StimulusSegment segment;
  segment.place = section.place();
  if (section.has("name")) segment.name = section["name"].text();
  if (section.has("for")) {
    segment.for_ns = section["for"].duration_ns();
    if (reading.base) need_a_tick(section["for"], "for", reading.base->period_ns, diagnostics);
  }
  const std::string& kind = section.chosen();
  const auto add = [&](const Value& text) {
    if (auto expression = Expression::parse(text, diagnostics))
      segment.values.push_back(std::move(*expression));
  };
  const Value& value = section[kind];
  if (kind == "hold" || kind == "value" || kind == "ramp") {
    segment.kind = kind == "ramp" ? Kind::ramp : kind == "hold" ? Kind::hold : Kind::value;
    add(value);
  } else {
    segment.kind = kind == "sine"       ? Kind::sine
                   : kind == "sawtooth" ? Kind::sawtooth
                   : kind == "pulses"   ? Kind::pulses
                                        : Kind::noise;
    const bool is_mean = kind == "sine" || kind == "noise";
    add(value[is_mean ? "mean" : "low"]);
    add(value[kind == "sine" ? "amplitude" : is_mean ? "deviation" : "high"]);
    if (kind != "noise") segment.period_ns = value["period"].duration_ns();
    if (kind == "sine") segment.share = value["phase"].number() / (2.0 * std::numbers::pi);
    if (kind == "pulses") segment.share = value["width"].number();
  }
  if (!segment.for_ns && segment.kind == Kind::ramp)
    diagnostics.add(section.place(), "a ramp needs its duration 'for'");
  else if (!segment.for_ns && !is_last)
    diagnostics.add(section.place(), "this part needs its duration 'for', since another one follows");
  if (diagnostics.count() != before) return std::nullopt;
  return segment;
}

std::vector<StimulusSegment> read_segments(const Value& list, ReaderContext& reading) {
  std::vector<StimulusSegment> segments;
  for (std::size_t i = 0; i < list.items().size(); ++i) {
    if (auto segment = read_segment(list.items()[i], i + 1 == list.items().size(), reading))
      segments.push_back(std::move(*segment));
  }
  return segments;
}

}  // namespace

Schema stimuli_schema() {
  return Schema::list(stimulus_schema());
}

Schema faults_schema() {
  return Schema::list(fault_schema());
}

void read_stimuli(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "stimuli");
  if (list == nullptr) return;
  UniqueNames names("stimulus", reading.diagnostics);
  for (const Value& section : list->items()) {
    if (const std::optional<Word> name = word_in(section, "name")) names.add(*name);
    if (!is_whole(section)) continue;
    const std::size_t before = reading.diagnostics.count();
    StimulusSection stimulus{.name = word_of(section["name"]), .drives = word_of(section["drives"])};
    if (section.chosen() == "sequence") {
      stimulus.profile = read_segments(section["sequence"], reading);
    } else {
      const Value& file = section["file"];
      stimulus.profile = StimulusFile{.path = file["path"].text(),
                                      .place = file["path"].place(),
                                      .column = word_of(file["column"]),
                                      .is_linear = file["between"].text() == "linear"};
    }
    if (section.has("repeat")) stimulus.repeat = static_cast<std::uint64_t>(section["repeat"].integer());
    const auto* const segments = std::get_if<std::vector<StimulusSegment>>(&stimulus.profile);
    if (section.has("repeat") && segments == nullptr)
      reading.diagnostics.add(section["repeat"].place(), "'repeat' belongs to 'sequence'");
    if (stimulus.repeat != 1 && segments != nullptr && !segments->empty() && !segments->back().for_ns)
      reading.diagnostics.add(segments->back().place,
                              "this part needs its duration 'for', since the sequence repeats");
    read_activation(section, stimulus.activation, scenario, reading.diagnostics);
    if (reading.diagnostics.count() == before) scenario.stimuli.push_back(std::move(stimulus));
  }
}

void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading) {
  using FaultKind = FaultSection::Kind;
  const Value* const list = part_of(root, "faults");
  if (list == nullptr) return;
  UniqueNames names("fault", reading.diagnostics);
  for (const Value& section : list->items()) {
    if (const std::optional<Word> name = word_in(section, "name")) names.add(*name);
    if (!is_whole(section)) continue;
    const std::size_t before = reading.diagnostics.count();
    FaultSection fault{.name = word_of(section["name"]), .signal = word_of(section["signal"])};
    for (const Value& reader : section["readers"].items())
      fault.readers.push_back(word_of(reader));
    const std::string& kind = section.chosen();
    if (kind == "delay") {
      fault.kind = FaultKind::delay;
      fault.delay_ns = section["delay"].duration_ns();
      if (reading.base)
        multiple_of(section["delay"], reading.base->period_ns, "delay", "the base period",
                    reading.diagnostics);
    } else if (kind == "dropout") {
      fault.kind = FaultKind::dropout;
      fault.dropout = section["dropout"].number();
    } else if (kind != "stuck" || section["stuck"].text() != "last") {
      fault.kind = kind == "stuck"    ? FaultKind::stuck
                   : kind == "offset" ? FaultKind::offset
                   : kind == "gain"   ? FaultKind::gain
                   : kind == "noise"  ? FaultKind::noise
                                      : FaultKind::drift;
      read_expression(section, kind.c_str(), fault.value, reading.diagnostics);
    }
    read_activation(section, fault.activation, scenario, reading.diagnostics);
    if (reading.diagnostics.count() == before) scenario.faults.push_back(std::move(fault));
  }
}

}  // namespace hil::config
