#include <algorithm>
#include <optional>
#include <utility>

#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_text.hpp"

namespace hil::report {
namespace {

std::string scheduling_text(const Realtime& realtime) {
  if (realtime.scheduler.empty()) return dash;
  return realtime.priority > 0 ? realtime.scheduler + ", priority " + std::to_string(realtime.priority)
                               : realtime.scheduler;
}

std::string cpus_text(const Realtime& realtime) {
  std::string text;
  for (const int cpu : realtime.cpus)
    text += (text.empty() ? "" : ", ") + std::to_string(cpu);
  return text.empty() ? "no affinity" : text;
}

void sentence_list(Markup& out, const std::vector<std::string>& all) {
  if (all.empty()) return;
  out.open("ul");
  for (const std::string& sentence : all)
    out.element("li", sentence);
  out.close();
}

void bus_sentences(Markup& out, const BusGroup& group) {
  std::vector<std::string> all;
  for (const BusRecord& bus : group.buses) {
    for (const auto* sentences : {&bus.faults, &bus.remarks}) {
      for (const contribution::BusSentence& sentence : *sentences)
        all.push_back(bus.name + ": " + sentence.text + ".");
    }
  }
  sentence_list(out, all);
}

/// Empty for a list.
Cell bus_cell(const BusGroup& group, const BusRecord& bus, const contribution::BusColumn& column) {
  if (column.key == group.name_key) return bus.name;
  const contribution::BusField* const field = bus.find(column.key);
  if (field == nullptr) return "";
  if (const auto* const count = std::get_if<std::uint64_t>(&field->value))
    return count_cell(*count, column.is_fault);
  if (const auto* const share = std::get_if<double>(&field->value)) return percent(*share);
  const auto* const text = std::get_if<std::string>(&field->value);
  return text != nullptr ? *text : "";
}

/// The messages or registers of the buses that were not fresh on a tick that counts, or had rejected frames.
void input_table(Markup& out, const BusGroup& group) {
  const auto count_of = [](const contribution::BusRow& row, const std::string& key) -> std::uint64_t {
    const auto field = std::ranges::find(row, key, [](const auto& entry) { return entry.first; });
    const auto* const count = field == row.end() ? nullptr : std::get_if<std::uint64_t>(&field->second);
    return count == nullptr ? 0 : *count;
  };
  std::optional<Table> table;
  for (const BusRecord& bus : group.buses) {
    const contribution::BusField* const field = bus.find("inputs");
    const auto* const rows =
        field == nullptr ? nullptr : std::get_if<std::vector<contribution::BusRow>>(&field->value);
    if (rows == nullptr) continue;
    for (const contribution::BusRow& row : *rows) {
      const std::uint64_t not_fresh = count_of(row, "not_fresh");
      const std::uint64_t rejected = count_of(row, "rejected");
      const auto* const name = row.empty() ? nullptr : std::get_if<std::string>(&row.front().second);
      if (name == nullptr || not_fresh + rejected == 0) continue;
      if (!table)
        table.emplace(out, std::vector<Column>{{"Message or register"},
                                               {"Ticks", true},
                                               {"Not fresh", true},
                                               {"Rejected frames", true},
                                               {"Of them by the scenario", true}});
      table->row({bus.name + "." + *name, count_text(count_of(row, "ticks")), count_text(not_fresh),
                  count_text(rejected), count_text(count_of(row, "rejected_by_scenario"))});
    }
  }
  if (table) table->end();
}

void bus_table(Markup& out, const BusGroup& group) {
  if (group.buses.empty()) return;
  out.element("h3", group.title);
  std::vector<Column> columns;
  for (const contribution::BusColumn& column : group.columns) {
    const contribution::BusField* const first = group.buses.front().find(column.key);
    const bool is_text = first == nullptr || std::holds_alternative<std::string>(first->value);
    columns.push_back({column.title, !is_text});
  }
  Table table(out, std::move(columns));
  for (const BusRecord& bus : group.buses) {
    std::vector<Cell> cells;
    for (const contribution::BusColumn& column : group.columns)
      cells.push_back(bus_cell(group, bus, column));
    table.row(cells);
  }
  table.end();
  input_table(out, group);
  bus_sentences(out, group);
}

}  // namespace

void transactions_section(Markup& out, const RunRecord& record) {
  const Transactions& transactions = record.transactions;
  if (transactions.submitted == 0) return;
  out.element("h2", "Database transactions");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"Submitted", true},
                    {"Committed", true},
                    {"Late", true},
                    {"Missed", true},
                    {"Refused", true},
                    {"Conflicts", true},
                    {"Cancelled", true},
                    {"Truncated", true},
                    {"Device lost", true},
                    {"Bad input", true},
                    {"Firm but late", true},
                    {"Hard missed", true}});
  table.row({count_text(transactions.submitted), count_text(transactions.committed),
             count_cell(transactions.late, true), count_cell(transactions.missed, true),
             count_cell(transactions.refused, true), count_cell(transactions.conflicts, true),
             count_cell(transactions.cancelled, true), count_cell(transactions.truncated, true),
             count_cell(transactions.device_lost, true), count_cell(transactions.bad_input, true),
             count_cell(transactions.firm_late_commits, true), count_cell(transactions.hard_misses, true)});
  table.end();
  out.close();
}

void scheduler_section(Markup& out, const RunRecord& record) {
  const Scheduler& scheduler = record.scheduler;
  if (scheduler.predicted_over_actual.empty() && scheduler.reservations.empty() &&
      scheduler.not_reserved.empty())
    return;
  out.element("h2", "Database scheduler");
  out.open("div", {{"class", "card"}});
  if (!scheduler.predicted_over_actual.empty()) {
    Table table(out, {{"Predicted over actual cost"},
                      {"Transactions", true},
                      {"p1", true},
                      {"Median", true},
                      {"p99", true}});
    for (const CostPrediction& one : scheduler.predicted_over_actual)
      table.row({one.cost_class, count_text(one.count), decimal(one.p01, 2), decimal(one.median, 2),
                 decimal(one.p99, 2)});
    table.end();
  }
  if (!scheduler.reservations.empty()) {
    Table table(out, {{"Reserved for"},
                      {"Transactions", true},
                      {"Kept", true},
                      {"Broken", true},
                      {"Too often", true},
                      {"Too long", true}});
    for (const Reservation& one : scheduler.reservations) {
      table.row({one.name, count_text(one.transactions), count_text(one.kept), count_cell(one.broken, true),
                 count_cell(one.too_often, true), count_cell(one.too_long, true)});
    }
    table.end();
  }
  for (const std::string& sentence : scheduler.not_reserved)
    out.element("p", sentence);
  out.close();
}

void database_log_section(Markup& out, const RunRecord& record) {
  const DatabaseLog& log = record.database_log;
  if (log.durability.empty()) return;
  out.element("h2", "Database log");
  out.open("div", {{"class", "card"}});
  if (log.durability == "volatile") {
    out.element("p", "The world's history was not recorded: world.durability is volatile.");
    out.close();
    return;
  }
  Table table(out, {{"Durability"},
                    {"Versions", true},
                    {"On disk", true},
                    {"Written", true},
                    {"Writes", true},
                    {"Longest write", true},
                    {"Ring, max used", true},
                    {"Not recorded", true},
                    {"Refused", true},
                    {"Disk faults", true}});
  table.row({log.durability, count_text(log.latest_version), count_text(log.durable_version),
             bytes_text(log.bytes), count_text(log.groups), measured_time(log.longest_write_ns),
             bytes_text(log.ring_high_water_bytes) + " of " + bytes_text(log.ring_bytes),
             count_cell(log.commits_in_gaps, true), count_cell(log.refused_transactions, true),
             count_cell(log.faults, true)});
  table.end();
  if (!log.last_fault.empty()) out.element("p", "The last fault: " + log.last_fault);
  out.close();
}

void buses_section(Markup& out, const RunRecord& record) {
  if (std::ranges::all_of(record.buses, [](const BusGroup& group) { return group.buses.empty(); })) return;
  out.element("h2", "Buses and devices");
  out.open("div", {{"class", "card"}});
  for (const BusGroup& group : record.buses)
    bus_table(out, group);
  out.close();
}

void processes_section(Markup& out, const RunRecord& record) {
  if (record.processes.empty()) return;
  out.element("h2", "Processes");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"Process"}, {"Command"}, {"Exit"}, {"Ended during the run", true}});
  for (const Process& process : record.processes) {
    const bool ended_early = process.ended_early_at_ns.has_value();
    table.row({process.name,
               process.command,
               {process.exit, ended_early ? "tone bad" : ""},
               ended_early ? instant(*process.ended_early_at_ns) : std::string("no")});
  }
  table.end();
  for (const Process& process : record.processes) {
    if (process.last_lines.empty()) continue;
    out.element("p", {{"class", "small soft"}}, "The last output of " + process.name + ":");
    std::string lines;
    for (const std::string& line : process.last_lines)
      lines += line + '\n';
    out.element("pre", {}, lines);
  }
  out.close();
}

void origin_section(Markup& out, const RunRecord& record) {
  out.element("h2", "How to reproduce the run");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"What"}, {"Value"}});
  table.row({{"Scenario file", "key"}, record.scenario.file});
  table.row({{"Seed", "key"}, std::to_string(record.seed)});
  for (const Override& entry : record.overrides)
    table.row({{"Set on the command line", "key"}, entry.path + "=" + entry.value});
  table.row({{"Scheduling", "key"}, scheduling_text(record.realtime)});
  table.row({{"Memory", "key"}, record.realtime.locked_memory ? "locked" : "not locked"});
  table.row({{"CPUs", "key"}, cpus_text(record.realtime)});
  table.row({{"Kernel", "key"}, record.realtime.kernel});
  if (!record.gpu.device.empty()) {
    table.row({{"GPU", "key"}, record.gpu.device});
    table.row({{"GPU driver", "key"}, record.gpu.driver});
    table.row({{"GPU API", "key"}, record.gpu.api});
  }
  if (record.recording) table.row({{"Recording", "key"}, recording_text(*record.recording)});
  table.row({{"hil", "key"}, record.program_version});
  for (const plugins::PluginIdentity& plugin : record.plugins)
    table.row({{"Plug-in " + plugin.name, "key"}, plugin.version + ", " + plugin.path + ", " + plugin.hash});
  table.end();
  out.close();
}

}  // namespace hil::report
