#pragma once
// The program of the crossing's PLC: a scan cycle reads the input registers, steps the logic and writes the
// output registers, behind a Modbus TCP server.
//
// Under the wall clock a scan starts every 20 ms. Under the stepped clock the time is what a client writes
// into bench_time_ms: the program executes the scans up to that time before it answers the write, so what
// the client reads next depends only on what it wrote. bench_time_ms starts at 0; a time that is not later
// than the last one causes no scan.
//
// Threads: one.

#include <chrono>
#include <cstdint>

#include "configs/crossing/plc/crossing_logic.hpp"
#include "io/modbus/register_bank.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/tcp_server.hpp"

namespace hil::crossing::plc {

namespace modbus = io::modbus;

enum class PlcClock : std::uint8_t { wall, stepped };

inline constexpr std::int64_t scan_period_ms = 20;

class PlcProgram {
 public:
  PlcProgram(const Timing& timing, PlcClock clock, modbus::ServerLimits limits);

  /// Throws io::DeviceError. Afterwards port() is the port.
  void listen(const modbus::Endpoint& endpoint);
  std::uint16_t port() const noexcept { return server_.port(); }

  /// Serves and scans until `stop_fd` can be read.
  void run_until_readable(int stop_fd);

 private:
  using WallClock = std::chrono::steady_clock;

  void scan(std::int64_t elapsed_ms);
  void scan_up_to_bench_time(const modbus::RequestRange& written);
  void write_outputs();
  std::uint16_t word(const modbus::RegisterEntry& entry) const noexcept;

  const modbus::RegisterMap map_;
  const PlcClock clock_;
  modbus::RegisterBank bank_;
  CrossingLogic logic_;
  modbus::TcpServer server_;
  std::int64_t plc_time_ms_ = 0;
  std::uint16_t scan_count_ = 0;
};

}  // namespace hil::crossing::plc
