#include "runtime/report/report_text.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

std::string whole_seconds(std::int64_t ns) {
  return std::to_string(ns / 1'000'000'000) + " s";
}

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.insert(0, width - text.size(), ' ');
  return text;
}

std::vector<std::string> live_fields(const LiveStatus& status) {
  const std::string end = status.duration_ns > 0 ? " / " + whole_seconds(status.duration_ns) : "";
  const std::string rate = std::isfinite(status.tick_rate_hz) ? decimal(status.tick_rate_hz, 0) : "-";
  std::vector<std::string> fields{
      padded(to_ascii(decimal(static_cast<double>(status.run_time_ns) * 1e-9, 1)) + " s", 8) + end,
      padded(to_ascii(rate), 5) + " ticks/s", "misses " + std::to_string(status.misses)};
  fields.push_back("slack " +
                   (status.min_slack_ns ? ">= " + to_ascii(measured_time(*status.min_slack_ns)) : "-"));
  for (const LiveBus& bus : status.buses)
    fields.push_back(one_line(bus.name) + ' ' + to_ascii(percent(bus.load, 0)));
  return fields;
}

void add_expectations(std::string& out, const RunRecord& record) {
  for (const Expectation& expectation : record.expectations) {
    if (expectation.result == ExpectationResult::held) continue;
    const bool is_in_reason = record.reason.find(expectation.detail) != std::string::npos;
    const bool has_margin = std::isfinite(expectation.margin);
    if (is_in_reason && !expectation.first_failure_ns && !has_margin) continue;
    out += std::string("  ") + words_of(expectation.result) + ": " + one_line(expectation.name);
    if (expectation.first_failure_ns) out += " at " + to_ascii(instant(*expectation.first_failure_ns));
    if (!is_in_reason) out += ": " + one_line(expectation.detail);
    if (has_margin) {
      out += "; margin " + to_ascii(quantity_text(expectation.margin, one_line(expectation.margin_unit)));
      if (expectation.worst_ns) out += " at " + to_ascii(instant(*expectation.worst_ns));
    }
    out += '\n';
  }
}

void add_failures(std::string& out, const RunRecord& record) {
  for (const std::string& failure : record.failures) {
    if (failure != record.reason) out += "  I/O: " + one_line(failure) + '\n';
  }
  for (const std::string& failure : record.input_failures) {
    if (failure != record.reason) out += "  input: " + one_line(failure) + '\n';
  }
  for (const Loss& loss : record.losses) {
    if (loss.permitted) out += "  lost, as the scenario permits: " + one_line(sentence_of(loss)) + '\n';
  }
  if (record.losses_not_listed > 0)
    out += "  " + to_ascii(counted(record.losses_not_listed, "more loss", "more losses")) + '\n';
}

void add_last_lines(std::string& out, const RunRecord& record) {
  for (const Process& process : record.processes) {
    if (process.last_lines.empty()) continue;
    out += "  last output of " + one_line(process.name) + ":\n";
    for (const std::string& line : process.last_lines)
      out += "    | " + one_line(line) + '\n';
  }
}

std::string causes_text(const Task& task) {
  std::string causes;
  std::uint64_t explained = 0;
  const auto add = [&](const std::string& cause, std::uint64_t count) {
    causes += (causes.empty() ? "" : ", ") + one_line(cause) + ' ' + to_ascii(count_text(count));
  };
  for (const auto& [cause, count] : task.misses_by_cause) {
    add(cause, count);
    explained += count;
  }
  if (!causes.empty() && explained < task.deadline_misses)
    add("not recorded", task.deadline_misses - explained);
  return causes;
}

void add_misses(std::string& out, const Task& task) {
  if (task.deadline_misses == 0) return;
  out += "  " + one_line(task.name) + ": " + to_ascii(count_text(task.deadline_misses)) + " of " +
         to_ascii(counted(task.runs, "run", "runs")) + " missed the deadline";
  const std::string causes = causes_text(task);
  if (!causes.empty())
    out += " (" + causes + "; latest by " + to_ascii(measured_time(task.worst_lateness_ns)) + ')';
  out += '\n';
}

void add_bus_faults(std::string& out, const std::string& name, const BusRecord& bus) {
  for (const contribution::BusSentence& fault : bus.faults)
    out += "  " + name + ": " + to_ascii(fault.text) + '\n';
}

/// " from 3 s to 4 s"
std::string times_of(const Injection& injection) {
  if (injection.spans.empty()) return {};
  const ActiveSpan& first = injection.spans.front();
  std::string from = " from " + chosen_time(first.begin_ns) + " to " + chosen_time(first.end_ns);
  if (injection.begins == 1) return from;
  return ' ' + counted(injection.begins, "time", "times") + ", first" + from;
}

}  // namespace

std::string live_line(const LiveStatus& status, std::size_t columns) {
  std::string line;
  for (const std::string& field : live_fields(status)) {
    const std::string addition = (line.empty() ? "" : "  ") + field;
    if (columns_of(line) + columns_of(addition) > columns) break;
    line += addition;
  }
  return line;
}

std::string report_text(const RunRecord& record, const std::string& report_place) {
  std::string out = one_line(headline(record.verdict)) + ": " + one_line(reason_sentence(record)) + '\n';
  if (!record.expectations.empty()) out += "expectations: " + to_ascii(held_sentence(record)) + '\n';
  add_failures(out, record);
  add_last_lines(out, record);
  add_expectations(out, record);
  for (const std::string& sentence : sentences_of_unchecked_injections(record))
    if (sentence != record.reason) out += "  not checked: " + to_ascii(one_line(sentence)) + '\n';
  for (const Task& task : record.tasks)
    add_misses(out, task);
  for (const Task& task : record.tasks) {
    for (const std::string& sentence : {lost_releases_sentence(task), hard_misses_sentence(task)})
      if (!sentence.empty()) out += "  " + to_ascii(one_line(sentence)) + '\n';
  }
  if (const std::string sentence = skipped_ticks_sentence(record); !sentence.empty())
    out += "  " + to_ascii(sentence) + '\n';
  if (const std::string sentence = unlisted_events_sentence(record); !sentence.empty())
    out += "  " + to_ascii(sentence) + '\n';
  for (const BusGroup& group : record.buses) {
    for (const BusRecord& bus : group.buses)
      add_bus_faults(out, group.list_key + "." + one_line(bus.name), bus);
  }
  for (const std::string& sentence : record.realtime.degraded)
    out += "  degraded: " + one_line(sentence) + '\n';
  out += "  " + to_ascii(counted(record.ticks, "tick", "ticks")) + " in " +
         to_ascii(measured_time(record.wall_ns)) +
         (report_place.empty() ? ", no report" : ", report in " + one_line(report_place)) + '\n';
  return out;
}

std::string skipped_ticks_sentence(const RunRecord& record) {
  if (record.skipped_ticks == 0) return {};
  const std::uint64_t due = record.ticks + record.skipped_ticks;
  return count_text(record.skipped_ticks) + " of " + counted(due, "tick", "ticks") + " skipped (" +
         percent(static_cast<double>(record.skipped_ticks) / static_cast<double>(due)) +
         "): they were more than four periods late";
}

std::string unlisted_events_sentence(const RunRecord& record) {
  if (record.events_not_listed == 0) return {};
  return "the first " + count_text(contribution::max_listed_events) +
         " events of modules, stimuli and faults are listed, and " +
         counted(record.events_not_listed, "more is", "more are") + " not";
}

std::vector<std::string> lacks_of(const Recording& recording) {
  std::vector<std::string> lacks;
  if (recording.dropped > 0) {
    lacks.push_back(recording.file + " lacks " + to_ascii(counted(recording.dropped, "message", "messages")) +
                    ": the disk was too slow");
  }
  if (recording.stopped_at_ns) {
    lacks.push_back(
        recording.file + " reached its largest size at " + to_ascii(instant(*recording.stopped_at_ns)) +
        "; " + to_ascii(counted(recording.not_recorded, "message was", "messages were")) + " not recorded");
  }
  return lacks;
}

std::string recording_text(const Recording& recording) {
  std::string text = recording.file + ", " + bytes_text(recording.bytes) + ", " +
                     counted(recording.messages, "message", "messages");
  for (const std::string& lack : lacks_of(recording))
    text += "; " + lack;
  return text;
}

std::string lost_releases_sentence(const Task& task) {
  if (task.skipped + task.aborted == 0) return {};
  const std::uint64_t releases = task.runs + task.skipped;
  std::string sentence = "task " + task.name + ": " + count_text(task.skipped) + " of " +
                         counted(releases, "release", "releases") + " skipped";
  if (task.aborted > 0) sentence += ", " + count_text(task.aborted) + " aborted";
  return sentence + " (" +
         percent(static_cast<double>(task.skipped + task.aborted) / static_cast<double>(releases)) + ")";
}

std::string hard_misses_sentence(const Task& task) {
  if (task.hard_misses == 0) return {};
  return "task " + task.name + ": " + count_text(task.hard_misses) + " of " +
         counted(task.runs + task.warmup_runs, "run", "runs") +
         " had a hard transaction after its deadline, at most " +
         measured_time(task.worst_hard_miss.lateness_ns) + " late, in tick " +
         count_text(task.worst_hard_miss.tick) + ": " + task.worst_hard_miss.cause;
}

std::vector<std::string> sentences_of_unchecked_injections(const RunRecord& record) {
  std::vector<std::string> sentences;
  const auto add = [&](const Injection& injection, const std::string& subject) {
    constexpr const char* consequence =
        ", so the run does not check what it is for; change its time or what it does, or remove it";
    if (injection.begins == 0) {
      const std::string reason = injection.missing_effect.empty() ? "" : ": " + injection.missing_effect;
      sentences.push_back(subject + " never began" + reason + consequence);
    } else if (!injection.missing_effect.empty()) {
      sentences.push_back(subject + " was active" + times_of(injection) + ", but " +
                          injection.missing_effect + consequence);
    }
  };
  for (const Injection& stimulus : record.stimuli) {
    const bool is_log = stimulus.frames.has_value();  // a stimulus of signals has no frames
    add(stimulus, is_log ? "the log of " + stimulus.name : "stimulus '" + stimulus.name + "'");
  }
  for (const Injection& fault : record.faults)
    add(fault, "fault '" + fault.name + "'");
  return sentences;
}

std::string sentence_of(const Loss& loss) {
  constexpr std::int64_t ms = 1'000'000;
  const std::int64_t duration_ns =
      loss.duration_ns >= ms ? (loss.duration_ns + ms / 2) / ms * ms : loss.duration_ns;
  return loss.what + " was lost from " + instant(loss.begin_ns) + " on for " + chosen_time(duration_ns) +
         (loss.to_the_end ? ", to the end of the run" : "") + (loss.cause.empty() ? "" : ": " + loss.cause);
}

const char* headline(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::passed:
      return "Passed";
    case Verdict::completed:
      return "Completed";
    case Verdict::failed:
      return "Failed";
    case Verdict::timing_broken:
      return "Timing broken";
    case Verdict::io_failed:
      return "I/O failed";
    case Verdict::gpu_failed:
      return "GPU failed";
    case Verdict::interrupted:
      return "Interrupted";
    case Verdict::refused:
      return "Refused";
  }
  return "";
}

std::string held_sentence(const RunRecord& record) {
  const auto held = std::ranges::count(record.expectations, ExpectationResult::held, &Expectation::result);
  return count_text(static_cast<std::uint64_t>(held)) + " of " + count_text(record.expectations.size()) +
         " held";
}

std::string reason_sentence(const RunRecord& record) {
  if (!record.reason.empty()) return record.reason;
  const auto failed = static_cast<std::uint64_t>(std::ranges::count_if(
      record.expectations, [](const Expectation& e) { return e.result != ExpectationResult::held; }));
  switch (record.verdict) {
    case Verdict::passed:
      return "Every expectation held.";
    case Verdict::completed:
      return "nothing was checked: the scenario has no expectations";
    case Verdict::failed:
      return counted(failed, "expectation", "expectations") + " of " +
             count_text(record.expectations.size()) + " were not held.";
    case Verdict::timing_broken:
      return "The timing of the run is broken.";
    case Verdict::io_failed:
      return "A device or a process outside the run failed.";
    case Verdict::gpu_failed:
      return "The GPU failed.";
    case Verdict::interrupted:
      return "The run was stopped before its duration was over.";
    case Verdict::refused:
      return "The run could not be set up.";
  }
  return "";
}

}  // namespace hil::report
