#include "runtime/report/html/report_html.hpp"

#include "runtime/report/html/page_style.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/report_text.hpp"

namespace hil::report {

std::string report_html(const RunRecord& record) {
  Markup out;
  out.raw("<!DOCTYPE html>\n").open("html", {{"lang", "en"}}).open("head");
  out.leaf("meta", {{"charset", "utf-8"}});
  out.leaf("meta", {{"name", "viewport"}, {"content", "width=device-width, initial-scale=1"}});
  out.leaf("meta", {{"name", "color-scheme"}, {"content", "light dark"}});
  out.element("title", std::string(headline(record.verdict)) + ": " + record.scenario.name);
  out.open("style").raw(picture_style()).raw(page_style()).close();
  out.close().open("body").open("main");
  verdict_section(out, record);
  degraded_section(out, record);
  failures_section(out, record);
  expectations_section(out, record);
  signals_section(out, record);
  injections_section(out, record);
  events_section(out, record);
  top_view_section(out, record);
  views_section(out, record);
  contributed_sections(out, record);
  response_section(out, record);
  timing_section(out, record);
  misses_section(out, record);
  task_cards_section(out, record);
  stages_section(out, record);
  transactions_section(out, record);
  scheduler_section(out, record);
  database_log_section(out, record);
  buses_section(out, record);
  processes_section(out, record);
  origin_section(out, record);
  out.close().close().close();
  return out.take();
}

}  // namespace hil::report
