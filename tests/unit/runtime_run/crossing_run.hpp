#pragma once
// configs/crossing/crossing.yaml, run in this process under the virtual clock, and its signals.csv.

#include <map>
#include <string>
#include <vector>

#include "runtime/run/session.hpp"

namespace hil::run::test {

/// signals.csv by column.
class Signals {
 public:
  explicit Signals(const std::string& csv);
  /// The signal's value at this time, interpolated between two rows. Throws when the signal does not exist or
  /// has no row before and after.
  double at(const std::string& signal, double time_s) const;

 private:
  std::map<std::string, std::vector<double>> columns_;
};

struct CrossingRun {
  config::Scenario scenario;
  report::RunRecord record;
  Signals signals;
};

/// Runs the repository's crossing with these settings changed. Throws what run_session throws, and
/// runtime_error with all mistakes when the settings are refused.
CrossingRun run_crossing(const std::vector<std::string>& overrides);

}  // namespace hil::run::test
