#include "runtime/buses/can/connected_programs.hpp"

#include <algorithm>
#include <map>

#include <hil/quantity.hpp>

namespace hil::buses::can {

ConnectedPrograms::ConnectedPrograms(const config::Scenario& scenario, const CanSection& bus)
    : bus_(bus), lockstep_(scenario.clock == config::ClockKind::virtual_time) {
  for (const config::ProcessSection& process : scenario.processes) {
    if (!process.enabled) continue;
    Program program{&process, 0};
    for (const config::CommandWord& word : process.command) {
      for (const auto& placeholder : word.placeholders)
        program.connections +=
            placeholder.section == bus.type->key && placeholder.name == bus.name.text ? 1 : 0;
    }
    if (program.connections > 0) programs_.push_back(program);
  }
}

std::size_t ConnectedPrograms::connection_count() const noexcept {
  std::size_t count = 0;
  for (const Program& program : programs_)
    count += program.connections;
  return count;
}

bool ConnectedPrograms::all_connected(io::virtual_bus::Hub& hub, const StartedPrograms& started) const {
  if (lockstep_) hub.accept_waiting_stations();
  std::map<pid_t, std::size_t> connections;  // by process group
  for (const io::virtual_bus::StationCounters& connection : hub.station_counters()) {
    if (connection.connected && (connection.greeted || !lockstep_)) ++connections[connection.process_group];
  }
  std::vector<Program> missing;  // with the number of connections that each lacks
  std::size_t missing_count = 0;
  std::int64_t longest_timeout_ns = 0;
  for (const Program& program : programs_) {
    std::size_t& of_program = connections[started.process_of(program.process->name.text)];
    longest_timeout_ns = std::max(longest_timeout_ns, program.process->start_timeout_ns);
    if (of_program < program.connections) {
      missing.push_back({program.process, program.connections - of_program});
      missing_count += program.connections - of_program;
    }
    of_program -= std::min(of_program, program.connections);
  }
  std::size_t of_no_program = 0;
  for (const auto& [group, count] : connections)
    of_no_program += count;
  if (missing_count <= of_no_program) return true;
  for (const Program& program : missing) {
    const std::int64_t timeout_ns = program.process->start_timeout_ns;
    const bool may_have_connected =
        program.connections <= of_no_program && started.waited_ns < longest_timeout_ns;
    if (started.waited_ns < timeout_ns || may_have_connected) continue;
    throw io::DeviceError("process " + program.process->name.text + " did not connect to bus " +
                          bus_.name.text + " within its start_timeout of " +
                          config::format_duration(timeout_ns));
  }
  return false;
}

}  // namespace hil::buses::can
