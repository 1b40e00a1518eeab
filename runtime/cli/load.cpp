#include "runtime/cli/load.hpp"

#include <cstdio>

namespace hil::cli {

std::vector<std::string> with_additions(const std::vector<std::string>& additions,
                                        const std::vector<std::string>& overrides) {
  std::vector<std::string> all;
  for (const std::string& addition : additions)
    all.push_back("+" + addition);
  all.insert(all.end(), overrides.begin(), overrides.end());
  return all;
}

std::optional<Loaded> load(const std::string& file, const std::vector<std::string>& overrides) {
  config::Diagnostics diagnostics;
  auto scenario = config::load_scenario_to_wire(file, overrides, run::scenario_types(), diagnostics);
  std::optional<run::Wiring> wiring;
  Loaded loaded;
  if (scenario) {
    auto wired = std::make_unique<config::Scenario>(std::move(*scenario));
    wiring = run::wire(*wired, diagnostics);
    loaded.scenario = std::move(wired);
  }
  std::fputs(diagnostics.to_text().c_str(), stderr);
  if (!wiring || !diagnostics.empty()) return std::nullopt;
  loaded.wiring = std::move(*wiring);
  loaded.warning_count = diagnostics.warning_count();
  return loaded;
}

}  // namespace hil::cli
