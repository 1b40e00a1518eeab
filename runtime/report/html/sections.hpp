#pragma once
// The sections of report.html, each a function of the record. A section without content writes nothing, or
// a sentence where the absence is a result (no deadline miss).

#include "runtime/report/markup.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

// section_outcome.cpp
void verdict_section(Markup& out, const RunRecord& record);
void expectations_section(Markup& out, const RunRecord& record);
void injections_section(Markup& out, const RunRecord& record);
void degraded_section(Markup& out, const RunRecord& record);
void failures_section(Markup& out, const RunRecord& record);
void events_section(Markup& out, const RunRecord& record);

// section_signals.cpp
void signals_section(Markup& out, const RunRecord& record);

// section_pictures.cpp
void top_view_section(Markup& out, const RunRecord& record);
void views_section(Markup& out, const RunRecord& record);
void contributed_sections(Markup& out, const RunRecord& record);
void response_section(Markup& out, const RunRecord& record);

// section_timing.cpp
void timing_section(Markup& out, const RunRecord& record);
void misses_section(Markup& out, const RunRecord& record);
void stages_section(Markup& out, const RunRecord& record);

// section_tasks.cpp
void task_cards_section(Markup& out, const RunRecord& record);

// section_exchange.cpp
void transactions_section(Markup& out, const RunRecord& record);
void scheduler_section(Markup& out, const RunRecord& record);
void database_log_section(Markup& out, const RunRecord& record);
void buses_section(Markup& out, const RunRecord& record);
void processes_section(Markup& out, const RunRecord& record);
void origin_section(Markup& out, const RunRecord& record);

}  // namespace hil::report
