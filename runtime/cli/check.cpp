#include <algorithm>
#include <cstdio>

#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/load.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/cli/text_table.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

/// "1 task", "2 tasks".
std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return report::to_ascii(report::counted(count, one.c_str(), many.c_str()));
}

/// "1 CAN bus, 2 ..., ": each type with the number of its buses.
std::string bus_counts(const config::Scenario& scenario) {
  std::string text;
  for (const config::BusSectionType& type : buses::section_types()) {
    const auto count = std::ranges::count_if(
        scenario.buses, [&](const auto& section) { return section->type->key == type.key; });
    text += counted(static_cast<std::size_t>(count), type.noun, type.plural) + ", ";
  }
  return text;
}

std::string contents(const Loaded& loaded) {
  const run::Wiring& wiring = loaded.wiring;
  return counted(wiring.modules.size(), "task", "tasks") + ", " + bus_counts(*loaded.scenario) +
         counted(wiring.signals.size(), "signal", "signals") + ", " +
         counted(loaded.scenario->expectations.size(), "expectation", "expectations");
}

/// The readers of all signals, by index of the signal: "traffic.brake", with the unit to which values are
/// converted: "traffic.brake (in m/s2)"; the names of stimuli and faults whose conditions read it, and the
/// number of expectations.
std::vector<std::string> readers_of_signals(const run::Wiring& wiring) {
  std::vector<std::string> readers(wiring.signals.size());
  const auto add = [&](signals::SignalId signal, const std::string& reader, const std::string& unit,
                       const units::Conversion& conversion) {
    if (!signal.valid()) return;
    std::string& list = readers[signal.index];
    list += (list.empty() ? "" : ", ") + reader;
    if (!conversion.is_identity()) list += " (in " + unit + ")";
  };
  for (const run::WiredModule& wired : wiring.modules) {
    const std::vector<modules::Port>& ports = wired.module->ports().inputs;
    for (std::size_t i = 0; i < ports.size(); ++i)
      add(wired.links.inputs[i].signal, wired.section->module.text + "." + ports[i].name, ports[i].unit,
          wired.links.inputs[i].conversion);
  }
  for (const run::RunVariables::Variable& variable : wiring.variables.all()) {
    for (const signals::SignalId signal : variable.expression.signals())
      add(signal, wiring.signals.info(variable.signal).name, "", {});
  }
  for (const run::WiredBus& wired : wiring.buses) {
    const auto& channels = wired.bus->channels().outputs();
    for (std::size_t i = 0; i < channels.size(); ++i)
      add(wired.links.outputs[i].signal, wired.section->full_name() + "." + channels[i].name,
          channels[i].unit, wired.links.outputs[i].conversion);
  }
  const auto add_conditions = [&](const config::ActivationSection& activation, const std::string& reader) {
    for (const auto* condition : {&activation.when, &activation.active_while, &activation.until}) {
      if (!*condition) continue;
      for (const signals::SignalId signal : signals::signals_in(**condition, wiring.signals))
        add(signal, reader, "", {});
    }
  };
  for (const config::StimulusSection& stimulus : wiring.scenario->stimuli)
    add_conditions(stimulus.activation, "stimulus " + stimulus.name.text);
  for (const config::FaultSection& fault : wiring.scenario->faults)
    add_conditions(fault.activation, "fault " + fault.name.text);
  std::vector<std::size_t> expectations(readers.size());
  for (const config::Expectation& expectation : wiring.scenario->expectations)
    for (const signals::SignalId signal : expectations::signals_read(expectation, wiring.signals))
      ++expectations[signal.index];
  for (std::uint32_t i = 0; i < readers.size(); ++i)
    if (expectations[i] > 0) add({i}, counted(expectations[i], "expectation", "expectations"), "", {});
  return readers;
}

std::string signal_list(const run::Wiring& wiring) {
  TextTable table({{.title = "Signal"}, {.title = "Unit"}, {.title = "Written by"}, {.title = "Read by"}});
  const std::vector<std::string> readers = readers_of_signals(wiring);
  for (std::uint32_t i = 0; i < readers.size(); ++i) {
    const signals::SignalInfo& info = wiring.signals.info({i});
    table.add({info.name, info.unit, info.writer, readers[i]});
  }
  return table.text();
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string scenario;
    std::vector<std::string> overrides, additions;
    bool lists_signals = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("check", "report every mistake and warning of a scenario as file:line:column");
  command->add_option("scenario", arguments->scenario, "the scenario's YAML file")->required();
  command
      ->add_option("--set", arguments->overrides,
                   "change a value of the scenario: path=value; may be repeated")
      ->take_all();
  command
      ->add_option("--add", arguments->additions,
                   "add a name that the scenario defines itself, as a variable or an output of a block: "
                   "path=value; may be repeated")
      ->take_all();
  command->add_flag("--signals", arguments->lists_signals,
                    "list all signals with their units, writers and readers");
  command->callback([arguments, &exit_code] {
    const auto loaded = load(arguments->scenario, with_additions(arguments->additions, arguments->overrides));
    exit_code = loaded ? run::exit_passed : run::exit_bad_config;
    if (!loaded) return;
    std::size_t warning_count = loaded->warning_count;
    if (loaded->scenario->expectations.empty()) {
      ++warning_count;
      std::fprintf(stderr, "%s: warning: the scenario has no expectations, so a run checks nothing\n",
                   arguments->scenario.c_str());
    }
    const std::string warnings =
        warning_count == 0 ? "" : ", " + counted(warning_count, "warning", "warnings");
    std::printf("%s: %s; no mistakes%s\n", arguments->scenario.c_str(), contents(*loaded).c_str(),
                warnings.c_str());
    if (arguments->lists_signals && loaded->wiring.signals.size() > 0)
      std::fputs(("\n" + signal_list(loaded->wiring)).c_str(), stdout);
    exit_code = flush_output("check", exit_code);
  });
}

}  // namespace hil::cli
