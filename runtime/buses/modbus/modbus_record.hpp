#pragma once
// What the report shows of a Modbus unit.
//
// Threads: plain data, filled after the device is stopped.

#include <cstdint>
#include <string>
#include <vector>

#include "io/modbus/client_device.hpp"
#include "io/modbus/server_device.hpp"
#include "runtime/contribution/bus_record.hpp"

namespace hil::buses::modbus {

struct ExceptionCount {
  int code = 0;  ///< of the Modbus protocol
  std::uint64_t count = 0;
  std::string
      first_request;  ///< the first refused one: "reading level (holding 10)"; empty: it has no address
};

/// Outputs are the registers that hil writes, inputs those that it reads.
struct UnitRecord {
  std::string name;
  std::string role;  ///< of hil: "client" or "server"
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;
  std::uint64_t timeouts = 0;    ///< requests of a client without a whole reply in time
  std::uint64_t errors = 0;      ///< exceptions, and invalid replies or requests
  std::uint64_t reconnects = 0;  ///< connections of a client after the first
  std::vector<ExceptionCount> exceptions;
  std::uint64_t saturated_outputs = 0;     ///< values beyond the range of their register
  std::uint64_t out_of_range_inputs = 0;   ///< values beyond the range of their register
  std::uint64_t not_a_number_outputs = 0;  ///< values that were not written
  std::uint64_t not_a_number_inputs = 0;   ///< values that were not read
  std::uint64_t superseded = 0;           ///< sets of outputs that a newer set replaced before they were sent
  std::uint64_t stale = 0;                ///< how often an input became older than max_age
  std::uint64_t connections = 0;          ///< of a server, accepted
  std::uint64_t refused_connections = 0;  ///< of a server: no place, or no descriptor
  std::uint64_t replaced_connections = 0;  ///< of a server: idle ones that it closed for a new client
  std::uint64_t dropped_connections = 0;   ///< of a server: silent, or without reading the replies
};

UnitRecord record_of(const io::modbus::ClientDevice& device);
UnitRecord record_of(const io::modbus::ServerDevice& device);

/// The columns of the table on the page.
std::vector<contribution::BusColumn> unit_columns();

/// Faults: all counters other than requests and replies.
contribution::BusRecord to_record(const UnitRecord& unit);

}  // namespace hil::buses::modbus
