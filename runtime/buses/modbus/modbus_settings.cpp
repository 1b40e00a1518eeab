#include "runtime/buses/modbus/modbus_settings.hpp"

#include <chrono>

namespace hil::buses::modbus {

io::modbus::ClientSettings client_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  using std::chrono::ceil;
  using std::chrono::microseconds;
  using std::chrono::milliseconds;
  using std::chrono::nanoseconds;
  io::modbus::ClientSettings settings;
  settings.name = section.name.text;
  settings.endpoint = endpoint;
  settings.unit = section.unit_id;
  settings.max_gap = section.max_gap;
  settings.response_timeout = ceil<microseconds>(nanoseconds(section.timeout_ns));
  settings.start_timeout = ceil<milliseconds>(nanoseconds(section.start_timeout_ns));
  if (section.max_age_ns) settings.max_age = ceil<milliseconds>(nanoseconds(*section.max_age_ns));
  if (section.run_time_entry) settings.run_time_ms_entry = section.run_time_entry->text;
  if (section.heartbeat_entry) settings.heartbeat_entry = section.heartbeat_entry->text;
  return settings;
}

io::modbus::ServerSettings server_settings(const ModbusSection& section,
                                           const io::modbus::Endpoint& endpoint) {
  io::modbus::ServerSettings settings;
  settings.name = section.name.text;
  settings.endpoint = endpoint;
  settings.limits.max_connections = section.max_clients;
  if (section.max_age_ns) {
    settings.max_age =
        std::chrono::ceil<std::chrono::milliseconds>(std::chrono::nanoseconds(*section.max_age_ns));
  }
  return settings;
}

}  // namespace hil::buses::modbus
