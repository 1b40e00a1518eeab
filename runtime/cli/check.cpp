#include <algorithm>
#include <cstdio>

#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/load.hpp"
#include "runtime/cli/subcommands.hpp"
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

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string scenario;
    std::vector<std::string> overrides;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("check", "report every mistake and warning of a scenario as file:line:column");
  command->add_option("scenario", arguments->scenario, "the scenario's YAML file")->required();
  command
      ->add_option("--set", arguments->overrides,
                   "change a value of the scenario: path=value; may be repeated")
      ->take_all();
  command->callback([arguments, &exit_code] {
    const auto loaded = load(arguments->scenario, arguments->overrides);
    exit_code = loaded ? run::exit_passed : run::exit_bad_config;
    if (!loaded) return;
    const std::string warnings =
        loaded->warning_count == 0 ? "" : ", " + counted(loaded->warning_count, "warning", "warnings");
    std::printf("%s: %s; no mistakes%s\n", arguments->scenario.c_str(), contents(*loaded).c_str(),
                warnings.c_str());
    exit_code = flush_output("check", exit_code);
  });
}

}  // namespace hil::cli
