#include "runtime/cli/load.hpp"

#include <array>
#include <cstdio>

#include "runtime/run/program_check.hpp"

namespace hil::cli {

std::vector<std::string> with_additions(const std::vector<std::string>& additions,
                                        const std::vector<std::string>& overrides) {
  std::vector<std::string> all;
  for (const std::string& addition : additions)
    all.push_back("+" + addition);
  all.insert(all.end(), overrides.begin(), overrides.end());
  return all;
}

std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::optional<Loaded> load(const std::string& file, const std::vector<std::string>& overrides,
                           std::string* mistakes) {
  config::Diagnostics diagnostics;
  auto scenario = config::load_scenario_to_wire(file, overrides, run::scenario_types(), diagnostics);
  std::optional<run::Wiring> wiring;
  Loaded loaded;
  if (scenario) {
    auto wired = std::make_unique<config::Scenario>(std::move(*scenario));
    wiring = run::wire(*wired, diagnostics);
    run::check_programs(*wired, std::array{program_folder()}, diagnostics);
    loaded.scenario = std::move(wired);
  }
  const std::string text = diagnostics.to_text();
  std::fputs(text.c_str(), stderr);
  if (!wiring || !diagnostics.empty()) {
    if (mistakes != nullptr) *mistakes = text;
    return std::nullopt;
  }
  loaded.wiring = std::move(*wiring);
  loaded.warning_count = diagnostics.warning_count();
  return loaded;
}

}  // namespace hil::cli
