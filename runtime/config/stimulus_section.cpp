#include "runtime/config/stimulus_section.hpp"

#include <algorithm>
#include <utility>

#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/run_end.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::config {
namespace {

Schema segment_schema(const Waveforms& waveforms) {
  std::vector<Field> kinds;
  for (const WaveformKind& kind : waveforms.kinds)
    kinds.push_back(Field::optional(kind.key, kind.schema(), kind.about));
  const std::vector<Field> common{
      Field::optional("name", Schema::name(), "The name of the part: its begin is an event of the report."),
      Field::optional("for", duration_schema(min_duration_s),
                      "The duration. Left out, in the last part: to the end of the run."),
  };
  return kinds.empty() ? Schema::record(common) : Schema::exactly_one(kinds, common);
}

Schema stimulus_schema(const Waveforms& waveforms) {
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
          Field::optional("sequence", Schema::list(segment_schema(waveforms), 1, 10'000),
                          "The parts, one after the other."),
          Field::optional("file", file, "A column of a CSV file."),
      },
      std::move(common));
}

std::optional<StimulusSegment> read_segment(const Value& section, bool is_last, ReaderContext& reading) {
  Diagnostics& diagnostics = reading.diagnostics;
  const std::size_t before = diagnostics.count();
  StimulusSegment segment;
  segment.place = section.place();
  if (section.has("name")) segment.name = section["name"].text();
  if (section.has("for")) {
    segment.for_ns = section["for"].duration_ns();
    if (reading.base) need_a_tick(section["for"], "for", reading.base->period_ns, diagnostics);
  }
  const std::string& key = section.chosen();
  const auto kind = std::ranges::find(reading.types.waveforms.kinds, key, &WaveformKind::key);
  segment.waveform = kind->read(
      section[key], {.period_ns = reading.base ? reading.base->period_ns : 0, .diagnostics = diagnostics});
  if (!segment.for_ns && kind->needs_duration)
    diagnostics.add(section.place(), "a " + key + " needs its duration 'for'");
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

/// A mistake where a part with a name, of a sequence whose begin does not depend on a condition, begins after
/// the last tick of the run.
void check_named_parts(const StimulusSection& stimulus, const Scenario& scenario, Diagnostics& diagnostics) {
  const auto* const segments = std::get_if<std::vector<StimulusSegment>>(&stimulus.profile);
  if (segments == nullptr || stimulus.activation.when || stimulus.activation.active_while) return;
  constexpr std::int64_t latest = std::int64_t{1} << 62;
  std::int64_t begin_ns = stimulus.activation.earliest_begin_ns(scenario.base_period_ns);
  for (const StimulusSegment& segment : *segments) {
    const std::string reason = reason_without_tick(begin_ns, scenario.base_period_ns, scenario.duration_ns);
    if (!segment.name.empty() && !reason.empty()) {
      diagnostics.add(segment.place, "the part '" + segment.name + "' begins at " +
                                         format_duration(begin_ns) + ", which" + reason);
    }
    if (!segment.for_ns) return;
    begin_ns = *segment.for_ns > latest - begin_ns ? latest : begin_ns + *segment.for_ns;
  }
}

}  // namespace

Schema stimuli_schema(const Waveforms& waveforms) {
  return Schema::list(stimulus_schema(waveforms));
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
    if (read_activation(section, stimulus.activation, scenario, reading.diagnostics))
      check_named_parts(stimulus, scenario, reading.diagnostics);
    if (reading.diagnostics.count() == before) scenario.stimuli.push_back(std::move(stimulus));
  }
}

}  // namespace hil::config
