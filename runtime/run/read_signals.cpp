#include "runtime/run/read_signals.hpp"

#include <algorithm>
#include <string_view>

#include "runtime/expectations/kinds.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::run {
namespace {

class ReadSignals {
 public:
  explicit ReadSignals(const signals::SignalTable& table) : table_(table) {}

  /// A fault of a signal reads it for the readers of the faulted one.
  void add(signals::SignalId signal) {
    if (!signal.valid()) return;
    const std::string_view name = table_.info(signal).name;
    if (name.ends_with(signals::faulted_suffix)) {
      if (const auto original = table_.find(name.substr(0, name.size() - signals::faulted_suffix.size())))
        signal = *original;
    }
    if (std::ranges::find(all_, signal) == all_.end()) all_.push_back(signal);
  }
  void add(const config::Expression& expression) {
    for (const signals::SignalId signal : signals::signals_in(expression, table_))
      add(signal);
  }
  void add(const config::ActivationSection& activation) {
    for (const auto* condition : {&activation.when, &activation.active_while, &activation.until})
      if (*condition) add(**condition);
  }
  const std::vector<signals::SignalId>& all() const noexcept { return all_; }

 private:
  const signals::SignalTable& table_;
  std::vector<signals::SignalId> all_;
};

}  // namespace

std::vector<signals::SignalId> signals_read_in(const Wiring& wiring) {
  const config::Scenario& scenario = *wiring.scenario;
  ReadSignals direct(wiring.signals);
  for (const WiredModule& wired : wiring.modules)
    for (const signals::InputSource& input : wired.links.inputs)
      direct.add(input.signal);
  for (const WiredBus& wired : wiring.buses)
    for (const signals::Source& output : wired.links.outputs)
      direct.add(output.signal);
  for (const config::Expectation& expectation : scenario.expectations)
    for (const signals::SignalId signal : expectations::signals_read(expectation, wiring.signals))
      direct.add(signal);
  for (const config::StimulusSection& stimulus : scenario.stimuli) {
    direct.add(stimulus.activation);
    if (const auto* const segments = std::get_if<std::vector<config::StimulusSegment>>(&stimulus.profile)) {
      for (const config::StimulusSegment& segment : *segments)
        for (const config::Expression& value : segment.waveform->expressions())
          direct.add(value);
    }
  }
  for (const config::FaultSection& fault : scenario.faults) {
    direct.add(fault.activation);
    for (const config::Expression& value : fault.effect->expressions())
      direct.add(value);
  }
  ReadSignals with_sources(wiring.signals);
  for (const signals::SignalId signal : wiring.variables.with_sources(direct.all()))
    with_sources.add(signal);
  return with_sources.all();
}

}  // namespace hil::run
