#include <cstdio>

#include "runtime/cli/load.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {

void add_check(CLI::App& app, int& exit_code) {
  struct Arguments {
    std::string scenario;
    std::vector<std::string> overrides;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("check", "report every mistake of a scenario as file:line:column");
  command->add_option("scenario", arguments->scenario, "the scenario's YAML file")->required();
  command->add_option("--set", arguments->overrides, "change a value of the scenario: path=value")
      ->take_all();
  command->callback([arguments, &exit_code] {
    const auto loaded = load(arguments->scenario, arguments->overrides);
    exit_code = loaded ? run::exit_passed : run::exit_bad_config;
    if (!loaded) return;
    std::printf(
        "%s: %zu tasks, %zu CAN buses, %zu Modbus units, %zu signals, %zu expectations; no mistakes\n",
        arguments->scenario.c_str(), loaded->wiring.modules.size(), loaded->wiring.can.size(),
        loaded->wiring.modbus.size(), loaded->wiring.signals.size(), loaded->scenario->expectations.size());
  });
}

}  // namespace hil::cli
