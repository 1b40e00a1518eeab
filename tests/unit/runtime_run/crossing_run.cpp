#include "tests/unit/runtime_run/crossing_run.hpp"

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "tests/paths.h"
#include "tests/support/temporary_folder.hpp"

namespace hil::run::test {

Signals::Signals(const std::string& csv) {
  std::istringstream stream(csv);
  std::string line;
  std::getline(stream, line);
  std::vector<std::string> names;
  std::istringstream header(line);
  for (std::string name; std::getline(header, name, ',');)
    names.push_back(name);
  while (std::getline(stream, line)) {
    std::istringstream row(line);
    std::string cell;
    for (const std::string& name : names) {
      if (!std::getline(row, cell, ','))
        throw std::runtime_error("a row of signals.csv is too short: " + line);
      columns_[name].push_back(std::strtod(cell.c_str(), nullptr));
    }
  }
}

double Signals::at(const std::string& signal, double time_s) const {
  const auto column = columns_.find(signal);
  if (column == columns_.end()) throw std::runtime_error("signals.csv has no " + signal);
  const std::vector<double>& times = columns_.at("time_s");
  const auto after = std::upper_bound(times.begin(), times.end(), time_s);
  if (after == times.begin() || after == times.end())
    throw std::runtime_error("signals.csv has no rows around " + std::to_string(time_s) + " s");
  const auto next = static_cast<std::size_t>(after - times.begin());
  const double share = (time_s - times[next - 1]) / (times[next] - times[next - 1]);
  return (1.0 - share) * column->second[next - 1] + share * column->second[next];
}

CrossingRun run_crossing(const std::vector<std::string>& overrides) {
  std::vector<std::string> all = overrides;
  all.emplace_back("clock=virtual");
  config::Diagnostics diagnostics;
  auto scenario = config::load_scenario(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.yaml", all,
                                        scenario_types(), diagnostics);
  if (!scenario) throw std::runtime_error(diagnostics.to_text());
  const auto kept = std::make_unique<config::Scenario>(std::move(*scenario));
  auto wiring = wire(*kept, diagnostics);
  if (!wiring) throw std::runtime_error(diagnostics.to_text());
  const tests::TemporaryFolder folder;
  const std::atomic<bool> never{false};
  SessionResult result = run_session(std::move(*wiring),
                                     {.directory = folder.path(),
                                      .overrides = {},
                                      .fail_on = {},
                                      .program_folders = {std::string(HIL_BINARY_DIR) + "/bin"},
                                      .every_second = {}},
                                     never);
  return {std::move(*kept), std::move(result.record), Signals(folder.read("signals.csv"))};
}

}  // namespace hil::run::test
