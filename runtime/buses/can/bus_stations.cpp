#include "runtime/buses/can/bus_stations.hpp"

#include <algorithm>
#include <map>

#include "runtime/config/units.hpp"

namespace hil::buses::can {

BusStations::BusStations(const config::Scenario& scenario, const CanSection& bus)
    : bus_(bus), lockstep_(scenario.clock == config::ClockKind::virtual_time) {
  for (const config::ProcessSection& process : scenario.processes) {
    if (!process.enabled) continue;
    Station station{&process, 0};
    for (const config::CommandWord& word : process.command) {
      for (const auto& placeholder : word.placeholders)
        station.connections +=
            placeholder.section == bus.type->key && placeholder.name == bus.name.text ? 1 : 0;
    }
    if (station.connections > 0) stations_.push_back(station);
  }
}

std::size_t BusStations::connection_count() const noexcept {
  std::size_t count = 0;
  for (const Station& station : stations_)
    count += station.connections;
  return count;
}

bool BusStations::all_connected(io::virtual_bus::Hub& hub, const StartedPrograms& programs) const {
  if (lockstep_) hub.accept_waiting_clients();
  std::map<pid_t, std::size_t> connections;  // by process group
  for (const io::virtual_bus::ClientCounters& client : hub.client_counters()) {
    if (client.connected && (client.greeted || !lockstep_)) ++connections[client.process_group];
  }
  std::vector<Station> missing;  // with the number of connections that each lacks
  std::size_t missing_count = 0;
  std::int64_t longest_timeout_ns = 0;
  for (const Station& station : stations_) {
    std::size_t& of_program = connections[programs.process_of(station.program->name.text)];
    longest_timeout_ns = std::max(longest_timeout_ns, station.program->start_timeout_ns);
    if (of_program < station.connections) {
      missing.push_back({station.program, station.connections - of_program});
      missing_count += station.connections - of_program;
    }
    of_program -= std::min(of_program, station.connections);
  }
  std::size_t of_no_program = 0;
  for (const auto& [group, count] : connections)
    of_no_program += count;
  if (missing_count <= of_no_program) return true;
  for (const Station& station : missing) {
    const std::int64_t timeout_ns = station.program->start_timeout_ns;
    const bool may_have_connected =
        station.connections <= of_no_program && programs.waited_ns < longest_timeout_ns;
    if (programs.waited_ns < timeout_ns || may_have_connected) continue;
    throw io::DeviceError("process " + station.program->name.text + " did not connect to bus " +
                          bus_.name.text + " within its start_timeout of " +
                          config::format_duration(timeout_ns));
  }
  return false;
}

}  // namespace hil::buses::can
