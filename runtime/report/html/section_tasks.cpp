#include <array>

#include "runtime/report/html/histogram_chart.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

std::string terms_of(const Task& task) {
  std::string terms =
      rate_text(task.rate_hz) + ", " + (task.thread.empty() ? "base thread" : "thread " + task.thread);
  if (task.deadline_ns > 0) terms += ", deadline " + chosen_time(task.deadline_ns);
  if (task.budget_ns > 0) terms += ", budget " + chosen_time(task.budget_ns);
  if (!task.overrun_policy.empty()) terms += ", on overrun " + task.overrun_policy;
  return terms;
}

std::string story_of(const Task& task) {
  std::string story = counted(task.runs, "run", "runs") + " and " + count_text(task.warmup_runs) +
                      " to warm up; " + counted(task.deadline_misses, "miss", "misses") + ", " +
                      counted(task.overruns, "overrun", "overruns") + ", " + count_text(task.skipped) +
                      " skipped";
  if (task.aborted > 0) story += ", " + count_text(task.aborted) + " aborted";
  if (task.warmup_trouble > 0)
    story += ", " + count_text(task.warmup_trouble) + " of such while it warmed up";
  if (task.without_answer > 0)
    story += ", " + count_text(task.without_answer) + " without an answer of the world";
  return story + "; " + counted(task.page_faults, "page fault", "page faults") + ".";
}

void spread_row(Table& table, const char* name, const Quantiles& spread) {
  if (spread.samples == 0) {
    table.row({name, dash, dash, dash, dash});
    return;
  }
  table.row({name, measured_time(spread.p50), measured_time(spread.p99), measured_time(spread.p999),
             measured_time(spread.max)});
}

void chart(Markup& out, const char* title, const char* quantity, const Histogram& histogram,
           const Quantiles& spread) {
  out.open("div").element("p", {{"class", "chart-title"}}, title);
  draw_histogram(
      out, histogram,
      {quantity,
       Scale::Kind::logarithmic,
       {{"max", spread.max, "mark-max"}, {"p99", spread.p99, "mark-p99"}, {"p50", spread.p50, "mark-p50"}}});
  out.close();
}

void task_card(Markup& out, const Task& task) {
  out.open("section", {{"class", "card"}});
  out.element("h3", task.name);
  out.element("p", {{"class", "small soft"}}, terms_of(task));
  out.element("p", {{"class", "small"}}, story_of(task));
  out.open("div", {{"class", "pair"}});
  chart(out, "Wake-up latency: from the release to the first instruction", "wake-up latency",
        task.histograms.wake_latency_ns, task.wake_latency_ns);
  chart(out, "Wall time of a run", "wall time", task.histograms.wall_ns, task.wall_ns);
  out.close();
  Table table(out, {{"Per run"}, {"p50", true}, {"p99", true}, {"p99.9", true}, {"max", true}});
  spread_row(table, "Wake-up latency", task.wake_latency_ns);
  spread_row(table, "Wall time", task.wall_ns);
  spread_row(table, "CPU time", task.cpu_ns);
  spread_row(table, "Blocked on the database", task.blocked_ns);
  spread_row(table, "GPU time", task.gpu_ns);
  table.end();
  out.close();
}

}  // namespace

void task_cards_section(Markup& out, const RunRecord& record) {
  if (record.tasks.empty()) return;
  out.element("h2", "Task by task");
  for (const Task& task : record.tasks)
    task_card(out, task);
}

}  // namespace hil::report
