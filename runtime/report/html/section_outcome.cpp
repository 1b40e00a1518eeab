#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/svg.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"

namespace hil::report {
namespace {

const char* tone(Verdict verdict) {
  switch (verdict) {
    case Verdict::passed:
      return "good";
    case Verdict::completed:
    case Verdict::interrupted:
      return "warn";
    default:
      return "bad";
  }
}

/// Of a sentence that begins with an ASCII letter.
std::string capitalized(std::string sentence) {
  sentence.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(sentence.front())));
  return sentence;
}

void fact(Markup& out, const char* name, const std::string& value) {
  out.open("div").element("dt", name).element("dd", value.empty() ? dash : value).close();
}

std::string length_text(const RunRecord& record) {
  const std::string reached = chosen_time(record.run_time_ns);
  const bool ended_early = record.duration_ns > 0 && record.run_time_ns < record.duration_ns;
  return (ended_early ? reached + " of " + chosen_time(record.duration_ns) : reached) + ", " +
         counted(record.ticks, "tick", "ticks");
}

std::string clock_text(const RunRecord& record) {
  const bool measurable = record.wall_ns > 0 && record.ticks > 0;
  if (!measurable) return record.clock;
  const double speed = static_cast<double>(record.run_time_ns) / static_cast<double>(record.wall_ns);
  return record.clock + ", " + measured_time(record.wall_ns) + " of wall-clock time (" +
         decimal(speed, speed < 10 ? 2 : 0) + "×)";
}

std::string misses_text(const RunRecord& record) {
  std::uint64_t misses = 0;
  std::uint64_t runs = 0;
  for (const Task& task : record.tasks) {
    misses += task.deadline_misses;
    runs += task.runs;
  }
  return counted(misses, "miss", "misses") + " in " + counted(runs, "task run", "task runs");
}

/// The position of an instant in the run, as a dot on a line.
void draw_instant(Markup& out, std::int64_t time_ns, std::int64_t end_ns) {
  const double share =
      end_ns > 0 ? std::clamp(static_cast<double>(time_ns) / static_cast<double>(end_ns), 0.0, 1.0) : 0.0;
  open_svg(out, 180.0, 18.0, "at " + percent(share, 0) + " of the run", PictureUse::inline_in_page);
  svg_line(out, "axis", {6.0, 9.0}, {174.0, 9.0});
  out.leaf("path", {{"class", "moment"}, {"d", svg_dots(std::array{Pixel{6.0 + 168.0 * share, 9.0}})}});
  out.close();
}

}  // namespace

void verdict_section(Markup& out, const RunRecord& record) {
  out.open("header", {{"class", std::string("verdict ") + tone(record.verdict)}});
  out.element("h1", headline(record.verdict));
  out.element("p", {{"class", "reason"}}, reason_sentence(record));
  if (!record.scenario.about.empty()) out.element("p", {{"class", "soft"}}, record.scenario.about);
  out.open("dl", {{"class", "facts"}});
  if (!record.expectations.empty()) fact(out, "Expectations", held_sentence(record));
  fact(out, "Scenario", record.scenario.name);
  fact(out, "Run time", length_text(record));
  fact(out, "Clock", clock_text(record));
  fact(out, "Base rate",
       record.period_ns > 0 ? rate_text(1e9 / static_cast<double>(record.period_ns)) : dash);
  fact(out, "Deadlines", misses_text(record));
  if (const std::string sentence = skipped_ticks_sentence(record); !sentence.empty())
    fact(out, "Ticks", sentence);
  fact(out, "Started", record.started_at);
  if (!record.gpu.device.empty()) fact(out, "GPU", record.gpu.device);
  fact(out, "Exit code", std::to_string(record.exit_code));
  out.close().close();
}

void degraded_section(Markup& out, const RunRecord& record) {
  if (record.realtime.degraded.empty()) return;
  out.open("section", {{"class", "card warn"}});
  out.element("h3", {{"class", "tone"}}, "Degraded: what this machine does not permit");
  out.open("ul");
  for (const std::string& sentence : record.realtime.degraded)
    out.element("li", sentence);
  out.close().close();
}

void not_evaluated_table(Markup& out, const RunRecord& record) {
  const bool is_needed = std::ranges::any_of(
      record.expectations, [](const Expectation& expectation) { return !expectation.not_evaluated.empty(); });
  if (!is_needed) return;
  out.element("h3", "Not evaluated");
  Table table(out, {{"Expectation"}, {"From", true}, {"To", true}, {"Unknown signals"}});
  for (const Expectation& expectation : record.expectations) {
    for (const NotEvaluated& interval : expectation.not_evaluated) {
      std::string signals;
      for (const std::string& signal : interval.signals)
        signals += (signals.empty() ? "" : ", ") + signal;
      table.row({expectation.name, instant(interval.begin_ns), instant(interval.end_ns),
                 signals.empty() ? "none: a function had no known result" : signals});
    }
  }
  table.end();
}

void expectations_section(Markup& out, const RunRecord& record) {
  out.element("h2", "Expectations");
  out.open("div", {{"class", "card"}});
  if (record.expectations.empty()) {
    out.element("p", {{"class", "soft"}}, "The scenario has no expectations.");
  } else {
    Table table(out, {{"Result"},
                      {"Expectation"},
                      {"Detail"},
                      {"Margin", true},
                      {"Worst at", true},
                      {"Evaluated", true},
                      {"First failed", true}});
    for (const Expectation& expectation : record.expectations) {
      const bool held = expectation.result == ExpectationResult::held;
      table.row({{(held ? "✓ " : "✗ ") + std::string(words_of(expectation.result)),
                  held ? "tone good nowrap" : "tone bad nowrap"},
                 expectation.name,
                 expectation.detail,
                 quantity_text(expectation.margin, expectation.margin_unit),
                 expectation.worst_ns ? instant(*expectation.worst_ns) : std::string(dash),
                 count_text(expectation.evaluated_ticks) + " of " +
                     counted(expectation.covered_ticks, "tick", "ticks"),
                 expectation.first_failure_ns ? instant(*expectation.first_failure_ns) : std::string(dash)});
    }
    table.end();
    not_evaluated_table(out, record);
  }
  out.close();
}

Cell effect_cell(const Injection& injection) {
  if (!injection.missing_effect.empty())
    return {(injection.took_effect.value_or(false) ? "in part: " : "no: ") + injection.missing_effect,
            "tone bad"};
  return injection.took_effect ? std::string(*injection.took_effect ? "yes" : "no") : std::string(dash);
}

void injections_section(Markup& out, const RunRecord& record) {
  const auto add = [&](const std::vector<Injection>& injections, const char* title, const char* target) {
    if (injections.empty()) return;
    const bool has_effect =
        std::ranges::any_of(injections, [](const auto& one) { return !one.effect.empty(); });
    out.element("h2", title);
    out.open("div", {{"class", "card"}});
    std::vector<Column> columns{{"Name"}, {target}};
    if (has_effect) columns.push_back({"Effect"});
    for (const char* const number : {"Begins", "First begin", "Active for"})
      columns.push_back({number, true});
    const bool has_frames =
        std::ranges::any_of(injections, [](const auto& one) { return one.frames.has_value(); });
    if (has_frames) columns.push_back({"Frames or requests", true});
    columns.push_back({"Took effect"});
    Table table(out, std::move(columns));
    for (const Injection& one : injections) {
      std::vector<Cell> cells{one.name, one.target};
      if (has_effect) cells.push_back(one.effect);
      cells.push_back({count_text(one.begins), one.begins == 0 ? "tone bad" : ""});
      cells.push_back(one.first_begin_ns ? instant(*one.first_begin_ns) : std::string(dash));
      cells.push_back(chosen_time(one.active_ns));
      if (has_frames) cells.push_back(one.frames ? count_text(*one.frames) : std::string(dash));
      cells.push_back(effect_cell(one));
      table.row(cells);
    }
    table.end();
    out.close();
  };
  add(record.stimuli, "Stimuli", "Drives");
  add(record.faults, "Faults", "Of");
}

void failures_section(Markup& out, const RunRecord& record) {
  if (record.failures.empty() && record.input_failures.empty() && record.losses.empty()) return;
  out.element("h2", "Failures and losses");
  out.open("div", {{"class", "card"}});
  for (const std::vector<std::string>* const failures : {&record.failures, &record.input_failures}) {
    if (failures->empty()) continue;
    out.open("ul");
    for (const std::string& failure : *failures)
      out.element("li", failure);
    out.close();
  }
  if (!record.losses.empty()) {
    Table table(out, {{"Lost"}, {"Since", true}, {"For", true}, {"Until"}, {"Permitted"}, {"Cause"}});
    for (const Loss& loss : record.losses) {
      table.row(
          {loss.what,
           instant(loss.begin_ns),
           chosen_time(loss.duration_ns),
           loss.to_the_end ? std::string("the end of the run") : instant(loss.begin_ns + loss.duration_ns),
           {!loss.fault.empty() ? "yes, by the fault " + loss.fault
            : loss.permitted    ? "yes, by may_be_lost"
                                : "no",
            loss.permitted ? "" : "tone bad"},
           loss.cause.empty() ? std::string(dash) : loss.cause});
    }
    table.end();
    if (record.losses_not_listed > 0)
      out.element("p", {{"class", "small soft"}},
                  counted(record.losses_not_listed, "more loss is", "more losses are") + " not listed.");
  }
  out.close();
}

void events_section(Markup& out, const RunRecord& record) {
  if (record.events.empty() && record.watchdog.empty()) return;
  std::vector<std::pair<Event, bool>> events;  // each with whether it is bad
  for (const Event& event : record.events)
    events.emplace_back(event, false);
  for (const MissingTicks& ticks : record.watchdog)
    events.emplace_back(Event{ticks.time_ns, ticks.text}, ticks.fault.empty());
  std::ranges::stable_sort(events, {}, [](const auto& entry) { return entry.first.time_ns; });
  out.element("h2", "Events");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"Time", true}, {"Event"}, {"In the run"}});
  for (const auto& [event, is_bad] : events) {
    table.open_row({instant(event.time_ns), {event.text, is_bad ? "tone bad" : ""}}, "bar-cell");
    draw_instant(out, event.time_ns, record.run_time_ns);
    table.close_row();
  }
  table.end();
  if (record.watchdog_not_listed > 0) {
    out.element("p", {{"class", "small soft"}},
                "Ticks were skipped " + count_text(record.watchdog_not_listed) +
                    " more times; the recorder kept the first ones.");
  }
  if (const std::string sentence = unlisted_events_sentence(record); !sentence.empty())
    out.element("p", {{"class", "small soft"}}, capitalized(sentence) + ".");
  out.close();
}

}  // namespace hil::report
