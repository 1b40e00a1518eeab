#pragma once
// All kinds of expectation (table.def), and what is done with an expectation of any kind.
//
// Threads: kinds and table_claims on any; the rest on the thread that wires and opens the run.

#include <memory>
#include <vector>

#include "runtime/config/expectation_section.hpp"
#include "runtime/expectations/judge.hpp"

namespace hil::expectations {

const std::vector<config::ExpectationKind>& kinds();
/// The claims of test tables, for config::load_scenario.
config::TableClaims table_claims();

/// Adds the mistakes of an expectation of one of the kinds.
void check_expectation(const config::Expectation& expectation, const ClaimCheck& check);
/// Signals of which it judges every arrival, with those of its window.
std::vector<signals::SignalId> signals_judged_by_arrival(const config::Expectation& expectation,
                                                         const signals::SignalTable& table);
/// What its plot in the report shows, with the signals of its window.
PlotContent plot_content(const config::Expectation& expectation, const signals::SignalTable& table);
/// The signals that the judge of an expectation reads, each once.
std::vector<signals::SignalId> signals_read(const config::Expectation& expectation,
                                            const signals::SignalTable& table);
/// Judges the ticks of its window.
std::unique_ptr<Judge> make_judge(const JudgeContext& context);

}  // namespace hil::expectations
