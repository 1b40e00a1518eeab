// Test tables become stimuli, faults and expectations. Each change is in the first tick that is not before
// its time.

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <hil/quantity.hpp>

#include "runtime/config/run_end.hpp"
#include "runtime/config/section_readers.hpp"
#include "runtime/config/test_table_file.hpp"

namespace hil::config {
namespace {

/// What a table has for a signal.
struct SignalParts {
  Word signal;
  std::optional<StimulusSection> stimulus{};
  std::int64_t last_begin_ns = 0;      ///< of the last part of the stimulus
  std::optional<std::size_t> fault{};  ///< the index of the one that has not ended
  std::vector<InstantCheck> checks{};
  struct Last {
    std::int64_t tick_ns = -1;
    std::uint32_t line = 0;
  };
  Last value{}, fault_state{}, expectation{};
};

class TableParts {
 public:
  TableParts(const Word& table, Scenario& scenario, ReaderContext& reading)
      : table_(table), scenario_(scenario), reading_(reading), period_ns_(reading.base->period_ns) {}

  void add(const std::vector<TestTableRow>& rows) {
    for (const TestTableRow& row : rows)
      add(row);
    finish();
  }

 private:
  void add(const TestTableRow& row) {
    const std::int64_t tick_ns = (row.time_ns + period_ns_ - 1) / period_ns_ * period_ns_;
    if (!reason_without_tick(row.time_ns, period_ns_, scenario_.duration_ns).empty()) {
      if (late_rows_++ == 0) first_late_ = row;
      return;
    }
    SignalParts& parts = parts_of(row.signal);
    if (row.value && claim_tick(row, "a value", row.value->place(), tick_ns, parts.value))
      add_value(row, tick_ns, parts);
    const Place fault_place = row.fault ? row.fault->place : row.fault_ends.value_or(Place{});
    if ((row.fault || row.fault_ends) && claim_tick(row, "a fault", fault_place, tick_ns, parts.fault_state))
      add_fault(row, tick_ns, parts);
    if (row.expectation &&
        claim_tick(row, "an expectation", row.expectation->place(), tick_ns, parts.expectation))
      parts.checks.push_back({tick_ns, *row.expectation, row.tolerance});
  }

  SignalParts& parts_of(const Word& signal) {
    const auto [found, is_first] = index_.try_emplace(signal.text, parts_.size());
    if (is_first) parts_.push_back({.signal = signal});
    return parts_[found->second];
  }

  /// `what` in `row` is that of the tick from now on. False with a mistake: the tick has one already.
  bool claim_tick(const TestTableRow& row, const char* what, const Place& place, std::int64_t tick_ns,
                  SignalParts::Last& last) {
    if (tick_ns == last.tick_ns) {
      reading_.diagnostics.add(place, in_quotes(row.signal.text) + " has " + what + " in line " +
                                          std::to_string(last.line) + ", in the same tick at " +
                                          format_duration(tick_ns));
      return false;
    }
    last = {tick_ns, row.line};
    return true;
  }

  void add_value(const TestTableRow& row, std::int64_t tick_ns, SignalParts& parts) {
    if (!parts.stimulus) {
      parts.stimulus = StimulusSection{.name = {table_.text + "." + row.signal.text, row.signal.place},
                                       .drives = row.signal,
                                       .test_table = table_.text};
      parts.stimulus->profile = std::vector<StimulusSegment>();
      parts.stimulus->activation.at_ns = tick_ns;
    }
    auto& segments = std::get<std::vector<StimulusSegment>>(parts.stimulus->profile);
    if (!segments.empty()) segments.back().for_ns = tick_ns - parts.last_begin_ns;
    parts.last_begin_ns = tick_ns;
    segments.push_back({.name = "",
                        .place = row.value->place(),
                        .waveform = reading_.types.waveforms.held(*row.value),
                        .for_ns = {}});
  }

  void add_fault(const TestTableRow& row, std::int64_t tick_ns, SignalParts& parts) {
    if (parts.fault) {
      FaultSection& ended = faults_[*parts.fault];
      ended.activation.for_ns = tick_ns - *ended.activation.at_ns;
      parts.fault.reset();
    }
    if (!row.fault) return;
    if (faults_.size() == max_test_table_faults) {
      if (!has_too_many_faults_)
        reading_.diagnostics.add(row.fault->place, "the test table has more faults than the limit of " +
                                                       std::to_string(max_test_table_faults) + "; split it");
      has_too_many_faults_ = true;
      return;
    }
    FaultSection fault = *row.fault;
    fault.name = {table_.text + ".line_" + std::to_string(row.line), row.fault->place};
    fault.subject = row.signal;
    fault.test_table = table_.text;
    fault.activation.at_ns = tick_ns;
    if (const std::string problem = fault.effect->period_problem(period_ns_); !problem.empty())
      reading_.diagnostics.add(fault.place, problem);
    parts.fault = faults_.size();
    faults_.push_back(std::move(fault));
  }

  void finish() {
    const TableClaims& claims = reading_.types.table_claims;
    for (SignalParts& parts : parts_) {
      if (parts.stimulus) scenario_.stimuli.push_back(std::move(*parts.stimulus));
      if (parts.checks.empty()) continue;
      const Place place = parts.checks.front().value.place();
      add_expectation(parts.signal.text, place, claims.at_instants(parts.signal, std::move(parts.checks)));
    }
    for (FaultSection& fault : faults_)
      scenario_.faults.push_back(std::move(fault));
    if (late_rows_ == 0) return;
    reading_.diagnostics.add(
        first_late_.signal.place,
        "the time of this row, " + format_duration(first_late_.time_ns) + "," +
            reason_without_tick(first_late_.time_ns, period_ns_, scenario_.duration_ns) +
            (late_rows_ == 1 ? "" : " (the first of " + std::to_string(late_rows_) + " such rows)"));
  }

  void add_expectation(const std::string& name, const Place& place, std::shared_ptr<const Claim> claim) {
    scenario_.expectations.push_back({.name = table_.text + ": " + name,
                                      .place = place,
                                      .coverage = 1.0,
                                      .window = {},
                                      .claim = std::move(claim)});
  }

  const Word table_;
  Scenario& scenario_;
  ReaderContext& reading_;
  const std::int64_t period_ns_;
  std::vector<SignalParts> parts_;  ///< in the order of their first rows
  std::map<std::string, std::size_t> index_;
  std::vector<FaultSection> faults_;
  bool has_too_many_faults_ = false;
  std::size_t late_rows_ = 0;
  TestTableRow first_late_;
};

}  // namespace

void read_test_tables(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "test_tables");
  if (list == nullptr) return;
  UniqueNames names("test table", reading.diagnostics);
  for (const Value& section : list->items()) {
    if (const std::optional<Word> name = word_in(section, "name")) names.add(*name);
    if (!is_whole(section)) continue;
    const auto rows = read_test_table(section["file"], reading.types, reading.diagnostics);
    if (rows && reading.base) TableParts(word_of(section["name"]), scenario, reading).add(*rows);
  }
}

}  // namespace hil::config
