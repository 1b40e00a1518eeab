#include <array>

#include "runtime/report/html/histogram_chart.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

std::string parameters_of(const Task& task) {
  std::string text =
      rate_text(task.rate_hz) + ", " + (task.thread.empty() ? "base thread" : "thread " + task.thread);
  if (task.deadline_ns > 0) text += ", deadline " + chosen_time(task.deadline_ns);
  if (task.budget_ns > 0) text += ", budget " + chosen_time(task.budget_ns);
  if (!task.overrun_policy.empty()) text += ", on overrun " + task.overrun_policy;
  return text;
}

std::string counts_of(const Task& task) {
  std::string text = counted(task.runs, "run", "runs") + " and " + count_text(task.warmup_runs) +
                     " warm-up runs; " + counted(task.deadline_misses, "miss", "misses") + ", " +
                     counted(task.overruns, "overrun", "overruns") + ", " + count_text(task.skipped) +
                     " skipped";
  if (task.aborted > 0) text += ", " + count_text(task.aborted) + " aborted";
  if (task.warmup_problems > 0) text += ", " + count_text(task.warmup_problems) + " of these in the warm-up";
  if (task.without_result > 0)
    text += ", " + count_text(task.without_result) + " runs without a result of the database";
  if (task.discarded > 0)
    text += " (" + count_text(task.discarded) + " because a firm transaction was late or not admitted)";
  if (task.hard_misses > 0)
    text += ", " + count_text(task.hard_misses) +
            " runs with a hard transaction after its deadline, at most " +
            measured_time(task.worst_hard_miss.lateness_ns) + " (" + task.worst_hard_miss.cause + ")";
  return text + "; " + counted(task.page_faults, "page fault", "page faults") + ".";
}

void quantiles_row(Table& table, const char* name, const Quantiles& quantiles) {
  if (quantiles.samples == 0) {
    table.row({name, dash, dash, dash, dash});
    return;
  }
  table.row({name, measured_time(quantiles.p50), measured_time(quantiles.p99), measured_time(quantiles.p999),
             measured_time(quantiles.max)});
}

void chart(Markup& out, const char* title, const char* quantity, const Histogram& histogram,
           const Quantiles& quantiles) {
  out.open("div").element("p", {{"class", "chart-title"}}, title);
  draw_histogram(out, histogram,
                 {quantity,
                  Scale::Kind::logarithmic,
                  {{"max", quantiles.max, "mark-max"},
                   {"p99", quantiles.p99, "mark-p99"},
                   {"p50", quantiles.p50, "mark-p50"}}});
  out.close();
}

void task_card(Markup& out, const Task& task) {
  out.open("section", {{"class", "card"}});
  out.element("h3", task.name);
  out.element("p", {{"class", "small soft"}}, parameters_of(task));
  out.element("p", {{"class", "small"}}, counts_of(task));
  out.open("div", {{"class", "pair"}});
  chart(out, "Wake-up latency: from the release to the first instruction", "wake-up latency",
        task.histograms.wake_latency_ns, task.wake_latency_ns);
  chart(out, "Wall time of a run", "wall time", task.histograms.wall_ns, task.wall_ns);
  out.close();
  Table table(out, {{"Per run"}, {"p50", true}, {"p99", true}, {"p99.9", true}, {"max", true}});
  quantiles_row(table, "Wake-up latency", task.wake_latency_ns);
  quantiles_row(table, "Wall time", task.wall_ns);
  quantiles_row(table, "CPU time", task.cpu_ns);
  if (task.blocked_ns.max > 0 || task.gpu_ns.max > 0) {
    quantiles_row(table, "Waiting for the database", task.blocked_ns);
    quantiles_row(table, "GPU time", task.gpu_ns);
  }
  table.end();
  out.close();
}

}  // namespace

void task_cards_section(Markup& out, const RunRecord& record) {
  if (record.tasks.empty()) return;
  out.element("h2", "Tasks");
  for (const Task& task : record.tasks)
    task_card(out, task);
}

}  // namespace hil::report
