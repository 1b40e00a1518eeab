#pragma once
// The files that a run writes, read back.

#include <nlohmann/json.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "io/can/candump_log.hpp"
#include "io/can/dbc.hpp"

namespace hil::scenario_test {

nlohmann::json read_report(const std::filesystem::path& directory);

/// "3000 fault stuck begins\n" ...: the run time in ms and the text of each event.
std::string events_in_ms(const nlohmann::json& report);

/// signals.csv.
class Signals {
 public:
  explicit Signals(const std::filesystem::path& directory);
  std::size_t rows() const noexcept { return rows_; }
  /// Fails the test and is empty when there is no such signal.
  const std::vector<double>& operator[](const std::string& name) const;

 private:
  std::size_t rows_ = 0;
  std::map<std::string, std::vector<double>> columns_;
};

/// The largest of the values; 0 when there are none.
double greatest(const std::vector<double>& values);

/// can-car.log; the test fails when a line can not be read.
std::vector<io::can::LoggedFrame> read_can_log(const std::filesystem::path& file);

/// Values of one DBC signal in a log, in their order. `name`: "EgoStatus.Speed" of crossing.dbc.
std::vector<double> values_on_bus(const std::vector<io::can::LoggedFrame>& frames, const std::string& name);

}  // namespace hil::scenario_test
