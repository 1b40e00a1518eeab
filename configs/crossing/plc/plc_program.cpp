#include "configs/crossing/plc/plc_program.hpp"

#include <poll.h>

#include <cmath>
#include <string_view>
#include <vector>

#include "configs/crossing/plc/plc_registers.hpp"
#include "io/modbus/require.hpp"

namespace hil::crossing::plc {

namespace {

/// All holding registers: those that hil writes, and override_mode, which an operator sets.
std::vector<bool> writable_by_clients(const modbus::RegisterMap& map) {
  std::vector<bool> allowed;
  allowed.reserve(map.entries.size());
  for (const modbus::RegisterEntry& entry : map.entries)
    allowed.push_back(entry.table == modbus::Table::holding);
  return allowed;
}

const modbus::RegisterEntry& entry_named(const modbus::RegisterMap& map, std::string_view name) {
  const modbus::RegisterEntry* entry = map.find(name);
  modbus::require(entry != nullptr, "PlcProgram: the map has no register of that name");
  return *entry;
}

bool can_be_read(int fd) {
  pollfd wanted{fd, POLLIN, 0};
  return ::poll(&wanted, 1, 0) > 0;
}

}  // namespace

PlcProgram::PlcProgram(const Timing& timing, PlcClock clock, modbus::ServerLimits limits)
    : map_(register_map()),
      clock_(clock),
      bank_(map_, writable_by_clients(map_)),
      logic_(timing),
      server_(bank_, limits,
              {nullptr, [this](const modbus::RequestRange& written) { scan_up_to_bench_time(written); },
               nullptr}) {
  write_outputs();
}

void PlcProgram::listen(const modbus::Endpoint& endpoint) {
  server_.listen(endpoint, "the crossing's PLC");
}

void PlcProgram::run_until_readable(int stop_fd) {
  constexpr std::chrono::milliseconds period(scan_period_ms);
  WallClock::time_point next_scan = WallClock::now() + period;
  while (!can_be_read(stop_fd)) {
    if (clock_ == PlcClock::stepped) {
      server_.serve(std::chrono::milliseconds(-1), stop_fd);
      continue;
    }
    const WallClock::time_point now = WallClock::now();
    if (now < next_scan) {
      server_.serve(std::chrono::ceil<std::chrono::milliseconds>(next_scan - now), stop_fd);
      continue;
    }
    // Missed scans are not repeated; the time of the next scan includes theirs.
    const std::int64_t missed = (now - next_scan) / period;
    scan((missed + 1) * scan_period_ms);
    next_scan += (missed + 1) * period;
  }
  server_.close();
}

void PlcProgram::scan_up_to_bench_time(const modbus::RequestRange& written) {
  const modbus::RegisterEntry& bench_time = entry_named(map_, "bench_time_ms");
  const bool is_bench_time = written.table == bench_time.table && written.address < bench_time.address + 2U &&
                             bench_time.address < std::uint32_t{written.address} + written.count;
  if (clock_ != PlcClock::stepped || !is_bench_time) return;
  const auto until_ms = static_cast<std::int64_t>(std::llround(bank_.load(bench_time).value));
  while (plc_time_ms_ + scan_period_ms <= until_ms)
    scan(scan_period_ms);
}

void PlcProgram::scan(std::int64_t elapsed_ms) {
  plc_time_ms_ += elapsed_ms;
  ++scan_count_;
  const Inputs inputs{word(entry_named(map_, "detector_ego")),
                      word(entry_named(map_, "detector_cross_right")),
                      word(entry_named(map_, "detector_cross_left")),
                      word(entry_named(map_, "heartbeat_hil")), word(entry_named(map_, "override_mode"))};
  logic_.step(inputs, elapsed_ms);
  write_outputs();
}

void PlcProgram::write_outputs() {
  const Outputs& outputs = logic_.outputs();
  constexpr double ms_per_s = 1000.0;
  constexpr std::int64_t u32_range = std::int64_t{1} << 32U;
  bank_.store(entry_named(map_, "light_ego"), static_cast<double>(outputs.ego));
  bank_.store(entry_named(map_, "light_cross"), static_cast<double>(outputs.cross));
  bank_.store(entry_named(map_, "fault"), outputs.watchdog_fault ? fault_watchdog : 0);
  bank_.store(entry_named(map_, "green_remaining"),
              static_cast<double>(outputs.green_remaining_ms) / ms_per_s);
  bank_.store(entry_named(map_, "scan_count"), scan_count_);
  bank_.store(entry_named(map_, "plc_time_ms"), static_cast<double>(plc_time_ms_ % u32_range));
  bank_.store(entry_named(map_, "demand_ego"), outputs.demand_ego ? 1.0 : 0.0);
  bank_.store(entry_named(map_, "demand_cross"), outputs.demand_cross ? 1.0 : 0.0);
}

std::uint16_t PlcProgram::word(const modbus::RegisterEntry& entry) const noexcept {
  return bank_.get(entry.table, entry.address);
}

}  // namespace hil::crossing::plc
