#include "runtime/report/junit_xml.hpp"

#include <algorithm>
#include <cmath>

#include "runtime/report/markup.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"

namespace hil::report {
namespace {

std::string seconds(std::int64_t ns) {
  return to_ascii(decimal(static_cast<double>(ns) * 1e-9, 3));
}

std::string trouble_in_words(const RunRecord& record) {
  std::string words = skipped_ticks_sentence(record);
  if (!words.empty()) words += '\n';
  for (const Task& task : record.tasks) {
    for (const std::string& sentence : {lost_releases_sentence(task), hard_misses_sentence(task)})
      if (!sentence.empty()) words += sentence + '\n';
    if (task.deadline_misses == 0) continue;
    words += task.name + ": " + counted(task.deadline_misses, "deadline miss", "deadline misses") + '\n';
    for (const Miss& miss : task.misses) {
      words += "  tick " + std::to_string(miss.tick) + ", late by " + measured_time(miss.lateness_ns) + ": " +
               miss.cause + '\n';
    }
    if (task.misses.size() < task.deadline_misses)
      words += "  and " + count_text(task.deadline_misses - task.misses.size()) + " more\n";
  }
  return to_ascii(words);
}

bool run_completed(Verdict verdict) {
  return verdict == Verdict::passed || verdict == Verdict::completed || verdict == Verdict::failed ||
         verdict == Verdict::timing_broken;
}

bool has_buses(const RunRecord& record) {
  return std::ranges::any_of(record.buses, [](const BusGroup& group) { return !group.buses.empty(); });
}

class Cases {
 public:
  Cases(Markup& xml, const RunRecord& record)
      : xml_(xml), record_(record), class_name_("hil." + record.scenario.name) {}

  void all() {
    for (const Expectation& expectation : record_.expectations)
      of(expectation);
    open("run completed", record_.run_time_ns);
    if (!run_completed(record_.verdict)) complain("error", record_.reason, failures_text());
    if (record_.verdict == Verdict::completed) xml_.leaf("skipped", {{"message", record_.reason}});
    xml_.close();
    timing();
    if (has_buses(record_)) inputs();
    if (!record_.stimuli.empty() || !record_.faults.empty()) injections();
  }

 private:
  void open(const std::string& name, std::int64_t decided_ns) {
    xml_.open("testcase", {{"classname", class_name_}, {"name", name}, {"time", seconds(decided_ns)}});
  }
  void complain(const char* element, const std::string& message, const std::string& detail) {
    xml_.element(element, {{"message", message}, {"type", to_string(record_.verdict)}}, detail);
  }
  void of(const Expectation& expectation) {
    open(expectation.name,
         expectation.first_failure_ns.value_or(expectation.met_ns.value_or(record_.run_time_ns)));
    if (expectation.result != ExpectationResult::held) {
      const auto& at = expectation.first_failure_ns;
      const std::string result = words_of(expectation.result);
      const std::string share = "evaluated on " + to_ascii(count_text(expectation.evaluated_ticks)) + " of " +
                                to_ascii(counted(expectation.covered_ticks, "tick", "ticks"));
      xml_.element(
          "failure", {{"message", result + ": " + expectation.detail}, {"type", result}},
          (at ? "first at " + to_ascii(instant(*at)) + ": " : "") + expectation.detail + "\n" + share);
    }
    if (std::isfinite(expectation.margin)) {
      std::string margin = "margin " + quantity_text(expectation.margin, expectation.margin_unit);
      if (expectation.worst_ns) margin += " at " + instant(*expectation.worst_ns);
      xml_.element("system-out", {}, to_ascii(margin));
    }
    xml_.close();
  }
  /// The verdict, then everything outside the run that failed, one line each.
  std::string failures_text() const {
    std::string text = to_string(record_.verdict);
    for (const std::string& failure : record_.failures)
      text += '\n' + failure;
    return to_ascii(text);
  }
  void timing() {
    open("timing not broken", record_.run_time_ns);
    const std::string trouble = trouble_in_words(record_);
    if (record_.verdict == Verdict::timing_broken) {
      complain("failure", record_.reason, trouble);
    } else if (!trouble.empty()) {
      xml_.element("system-out", {}, trouble);
    }
    xml_.close();
  }

  void inputs() {
    open("inputs came and were accepted", record_.run_time_ns);
    if (!record_.input_failures.empty()) {
      std::string all;
      for (const std::string& sentence : record_.input_failures)
        all += sentence + '\n';
      xml_.element("failure", {{"message", record_.input_failures.front()}, {"type", "failed"}}, all);
    }
    xml_.close();
  }
  void injections() {
    open("stimuli and faults took effect", record_.run_time_ns);
    const std::vector<std::string> unchecked = sentences_of_unchecked_injections(record_);
    if (!unchecked.empty()) {
      std::string all;
      for (const std::string& sentence : unchecked)
        all += sentence + '\n';
      const std::string result = words_of(ExpectationResult::not_checked);
      xml_.element("failure", {{"message", result + ": " + unchecked.front()}, {"type", result}}, all);
    }
    xml_.close();
  }

  Markup& xml_;
  const RunRecord& record_;
  std::string class_name_;
};

}  // namespace

std::string junit_xml(const RunRecord& record) {
  const auto failed = std::ranges::count_if(record.expectations, [](const Expectation& expectation) {
    return expectation.result != ExpectationResult::held;
  });
  const auto failures =
      static_cast<std::uint64_t>(failed) + (record.verdict == Verdict::timing_broken ? 1 : 0) +
      (record.input_failures.empty() ? 0 : 1) + (sentences_of_unchecked_injections(record).empty() ? 0 : 1);
  const bool has_injections = !record.stimuli.empty() || !record.faults.empty();
  const std::string tests =
      std::to_string(record.expectations.size() + 2 + (has_buses(record) ? 1 : 0) + (has_injections ? 1 : 0));
  const std::string errors = run_completed(record.verdict) ? "0" : "1";
  const std::string time = seconds(record.wall_ns);
  Markup xml;
  xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
  xml.open("testsuites",
           {{"tests", tests}, {"failures", std::to_string(failures)}, {"errors", errors}, {"time", time}});
  xml.open("testsuite", {{"name", record.scenario.name},
                         {"tests", tests},
                         {"failures", std::to_string(failures)},
                         {"errors", errors},
                         {"skipped", record.verdict == Verdict::completed ? "1" : "0"},
                         {"time", time},
                         {"timestamp", record.started_at}});
  Cases(xml, record).all();
  xml.close().close();
  return xml.take();
}

std::string refusal_junit_xml(const std::string& scenario, const std::string& mistakes) {
  const std::string first = mistakes.substr(0, mistakes.find('\n'));
  Markup xml;
  xml.raw("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
  xml.open("testsuites", {{"tests", "1"}, {"failures", "0"}, {"errors", "1"}, {"time", "0"}});
  xml.open("testsuite",
           {{"name", scenario}, {"tests", "1"}, {"failures", "0"}, {"errors", "1"}, {"time", "0"}});
  xml.open("testcase", {{"classname", "hil." + scenario}, {"name", "run completed"}, {"time", "0"}});
  xml.element("error", {{"message", first}, {"type", to_string(Verdict::refused)}}, mistakes);
  xml.close().close().close();
  return xml.take();
}

}  // namespace hil::report
