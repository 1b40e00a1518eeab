#include <algorithm>
#include <cmath>
#include <map>

#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/svg.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

constexpr std::size_t misses_on_page = 200;

/// The text of a quantile, or a dash without samples.
std::string of(const Quantiles& quantiles, std::int64_t quantile) {
  return quantiles.samples == 0 ? std::string(dash) : measured_time(quantile);
}

void timing_head(Markup& out) {
  out.open("thead").open("tr");
  for (const char* title : {"Task", "Rate", "Runs", "Misses", "Over\u00ADruns", "Skip\u00ADped"}) {
    out.element("th",
                {{"rowspan", "2"}, {"scope", "col"}, {"class", title == std::string("Task") ? "" : "n"}},
                title);
  }
  out.element("th", {{"colspan", "4"}, {"scope", "colgroup"}, {"class", "group"}}, "Wake-up latency");
  out.element("th", {{"colspan", "3"}, {"scope", "colgroup"}, {"class", "group"}}, "Per run, p99");
  out.element("th", {{"colspan", "2"}, {"scope", "colgroup"}, {"class", "group"}}, "Slack");
  out.close().open("tr");
  for (const char* title : {"p50", "p99", "p99.9", "max", "wall", "CPU", "database", "min", "p50"}) {
    out.element("th", {{"scope", "col"}, {"class", "n"}}, title);
  }
  out.close().close();
}

void timing_row(Markup& out, const Task& task) {
  const auto cell = [&](const char* label, const std::string& text, const char* css = "n") {
    out.element("td", {{"class", css}, {"data-label", label}}, text);
  };
  const auto bad_count = [&](const char* label, std::uint64_t count) {
    cell(label, count_text(count), count > 0 ? "n tone bad" : "n");
  };
  const Quantiles& wake = task.wake_latency_ns;
  const Slack& slack = task.slack_ns;
  const bool has_slack = slack.samples > 0;
  out.open("tr");
  cell("Task", task.name, "name");
  cell("Rate", rate_text(task.rate_hz));
  cell("Runs", count_text(task.runs));
  bad_count("Misses", task.deadline_misses);
  bad_count("Overruns", task.overruns);
  bad_count("Skipped", task.skipped);
  cell("Wake-up p50", of(wake, wake.p50), "n first");
  cell("Wake-up p99", of(wake, wake.p99));
  cell("Wake-up p99.9", of(wake, wake.p999));
  cell("Wake-up max", of(wake, wake.max));
  cell("Wall p99", of(task.wall_ns, task.wall_ns.p99), "n first");
  cell("CPU p99", of(task.cpu_ns, task.cpu_ns.p99));
  cell("Database p99", of(task.blocked_ns, task.blocked_ns.p99));
  cell("Slack min", has_slack ? measured_time(slack.min) : dash,
       has_slack && slack.min < 0 ? "n first tone bad" : "n first");
  cell("Slack p50", has_slack ? measured_time(slack.p50) : dash);
  out.close();
}

/// p99 as a bar and the maximum as a line, against the budget. The drawing ends at twice the budget.
void draw_budget_use(Markup& out, const Task& task) {
  constexpr double width = 260.0;
  constexpr double full = 130.0;  // where 100 % lies
  const auto at = [&](std::int64_t ns) {
    return std::min(full * static_cast<double>(ns) / static_cast<double>(task.budget_ns), width);
  };
  open_svg(out, width, 18.0, "CPU time against the budget", PictureUse::inline_in_page);
  out.leaf("rect", {{"class", "use-rest"}, {"x", 0.0}, {"y", 4.0}, {"width", full}, {"height", 10.0}});
  const double p99 = at(task.cpu_ns.p99);
  out.leaf("rect",
           {{"class", "use"}, {"x", 0.0}, {"y", 4.0}, {"width", std::min(p99, full)}, {"height", 10.0}});
  if (p99 > full)
    out.leaf("rect",
             {{"class", "use-over"}, {"x", full}, {"y", 4.0}, {"width", p99 - full}, {"height", 10.0}});
  svg_line(out, "mark mark-limit", {full, 0.0}, {full, 18.0});
  const double maximum = std::clamp(at(task.cpu_ns.max), 0.75, width - 0.75);
  svg_line(out, "rule", {maximum, 2.0}, {maximum, 16.0});
  out.close();
}

void budget_table(Markup& out, const RunRecord& record) {
  if (std::ranges::none_of(record.tasks, [](const Task& task) { return task.budget_ns > 0; })) return;
  out.element("h2", "Budget use");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"Task"},
                    {"Budget", true},
                    {"CPU p99", true},
                    {"CPU max", true},
                    {"Max, of the budget", true},
                    {"Runs over budget", true},
                    {"p99 (bar) and max (line); the budget is the red line"}});
  for (const Task& task : record.tasks) {
    if (task.budget_ns <= 0) continue;
    const Quantiles& cpu = task.cpu_ns;
    const double share =
        cpu.samples > 0 ? static_cast<double>(cpu.max) / static_cast<double>(task.budget_ns) : not_known;
    table.open_row({task.name,
                    chosen_time(task.budget_ns),
                    of(cpu, cpu.p99),
                    of(cpu, cpu.max),
                    {percent(share, 0), share > 1.0 ? "tone bad" : ""},
                    count_cell(task.over_budget, true)},
                   "bar-cell");
    if (cpu.samples > 0) draw_budget_use(out, task);
    table.close_row();
  }
  table.end();
  out.close();
}

struct TaskMiss {
  const Task* task;
  const Miss* miss;
};

std::string causes_text(const RunRecord& record) {
  std::map<std::string, std::uint64_t> by_cause;
  for (const Task& task : record.tasks) {
    for (const auto& [cause, count] : task.misses_by_cause)
      by_cause[cause] += count;
  }
  std::string text;
  for (const auto& [cause, count] : by_cause)
    text += (text.empty() ? "" : ", ") + cause + " " + count_text(count);
  return text;
}

void miss_rows(Markup& out, const std::vector<TaskMiss>& misses, std::int64_t period_ns) {
  Table table(out, {{"Time", true}, {"Tick", true}, {"Task"}, {"Late by", true}, {"Cause"}});
  for (std::size_t index = 0; index < std::min(misses.size(), misses_on_page); ++index) {
    const auto& [task, miss] = misses[index];
    const double time_ns = static_cast<double>(miss->tick) * static_cast<double>(period_ns);
    table.row({decimal(time_ns * 1e-9, 3) + " s", count_text(miss->tick), task->name,
               measured_time(miss->lateness_ns), miss->cause});
  }
  table.end();
}

}  // namespace

void timing_section(Markup& out, const RunRecord& record) {
  out.element("h2", "Timing");
  out.open("div", {{"class", "card"}});
  if (record.tasks.empty()) {
    out.element("p", {{"class", "soft"}}, "No task ran.").close();
    return;
  }
  out.open("div", {{"class", "scroll"}}).open("table");
  timing_head(out);
  out.open("tbody");
  for (const Task& task : record.tasks)
    timing_row(out, task);
  out.close().close().close();
  if (record.clock == "virtual") {
    out.element(
        "p", {{"class", "small soft"}},
        "The clock was virtual: ticks followed one another as fast as they completed, so wake-up latency and "
        "slack do not apply to real time.");
  }
  out.close();
  budget_table(out, record);
}

void misses_section(Markup& out, const RunRecord& record) {
  std::vector<TaskMiss> misses;
  std::uint64_t counted_misses = 0;
  for (const Task& task : record.tasks) {
    counted_misses += task.deadline_misses;
    for (const Miss& miss : task.misses)
      misses.push_back({&task, &miss});
  }
  out.element("h2", "Deadline misses");
  out.open("div", {{"class", "card"}});
  if (counted_misses == 0 && misses.empty()) {
    out.element("p",
                record.tasks.empty() ? "No task ran." : "None: every run of every task met its deadline.")
        .close();
    return;
  }
  std::ranges::stable_sort(misses, {}, [](const TaskMiss& entry) { return entry.miss->tick; });
  std::string summary = counted(counted_misses, "miss", "misses");
  if (const std::string causes = causes_text(record); !causes.empty()) summary += ". By cause: " + causes;
  summary += '.';
  if (misses.size() < counted_misses) {
    summary += " The recorder kept the details of " + count_text(misses.size()) + " of them.";
  }
  if (misses.size() > misses_on_page) {
    summary += " The first " + count_text(misses_on_page) + " are listed here; report.json has " +
               (misses.size() < counted_misses ? "those." : "them all.");
  }
  out.element("p", summary);
  if (!misses.empty()) miss_rows(out, misses, record.period_ns);
  out.close();
}

void stages_section(Markup& out, const RunRecord& record) {
  if (record.base_stages.empty()) return;
  double total_ns = 0.0;
  for (const BaseStage& stage : record.base_stages)
    total_ns += static_cast<double>(std::max<std::int64_t>(stage.total_ns, 0));
  out.element("h2", "Stages of the base thread");
  out.open("div", {{"class", "card"}});
  Table table(out, {{"Stage"},
                    {"Share", true},
                    {"Total", true},
                    {"p50 per tick", true},
                    {"p99", true},
                    {"max", true},
                    {"Share of the run"}});
  for (const BaseStage& stage : record.base_stages) {
    const double share = total_ns > 0.0 ? static_cast<double>(stage.total_ns) / total_ns : not_known;
    const Quantiles& per_tick = stage.per_tick_ns;
    table.open_row({stage.name, percent(share), measured_time(stage.total_ns), of(per_tick, per_tick.p50),
                    of(per_tick, per_tick.p99), of(per_tick, per_tick.max)},
                   "bar-cell");
    open_svg(out, 260.0, 18.0, percent(share), PictureUse::inline_in_page);
    out.leaf("rect", {{"class", "use-rest"}, {"x", 0.0}, {"y", 4.0}, {"width", 260.0}, {"height", 10.0}});
    const double bar = std::isfinite(share) ? 260.0 * std::clamp(share, 0.0, 1.0) : 0.0;
    out.leaf("rect", {{"class", "use"}, {"x", 0.0}, {"y", 4.0}, {"width", bar}, {"height", 10.0}});
    out.close();
    table.close_row();
  }
  table.end();
  out.close();
}

}  // namespace hil::report
