// hil-tank-plc: the PLC of the water tank, a Modbus TCP server. It shares with hil only its registers
// (configs/tank/tank_plc.yaml). A real PLC with the same registers can replace it: the scenario then has that
// PLC's address.
//
// Each scan of 10 ms: the pump starts below 0.9 m of the level sensor and stops above 1.1 m. The high-level
// trip: when the float switch has been on for 100 ms, the pump stops, and stays off.
//
// Under the stepped clock the time is what a client writes into bench_time_ms: the program executes the scans
// up to that time before it answers the write.

#include <CLI/CLI.hpp>
#include <sys/signalfd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "io/modbus/register_bank.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/tcp_server.hpp"

namespace {

namespace modbus = hil::io::modbus;
using modbus::Table;
using modbus::ValueType;
using Clock = std::chrono::steady_clock;

constexpr int exit_io = 4;
constexpr std::int64_t scan_period_ms = 10;

modbus::RegisterEntry register_at(const char* name, Table table, std::uint16_t address, ValueType type,
                                  double scale = 1.0) {
  modbus::RegisterEntry entry;
  entry.name = name;
  entry.table = table;
  entry.address = address;
  entry.type = type;
  entry.scale = scale;
  return entry;
}

/// When the pump runs.
class TankLogic {
 public:
  explicit TankLogic(bool has_trip) : has_trip_(has_trip) {}

  void scan(double level_m, bool float_switch) noexcept {
    constexpr int trip_scans = 10;
    scans_on_ = float_switch ? scans_on_ + 1 : 0;
    if (has_trip_ && scans_on_ >= trip_scans) tripped_ = true;
    if (level_m < 0.9) filling_ = true;
    if (level_m > 1.1) filling_ = false;
  }
  bool pump() const noexcept { return filling_ && !tripped_; }
  bool tripped() const noexcept { return tripped_; }

 private:
  const bool has_trip_;
  bool filling_ = false, tripped_ = false;
  int scans_on_ = 0;
};

class TankPlc {
 public:
  TankPlc(bool is_stepped, bool has_trip)
      : is_stepped_(is_stepped),
        bank_(map_, {true, true, true, false, false}),
        logic_(has_trip),
        server_(bank_, modbus::ServerLimits{},
                {nullptr, [this](const modbus::RequestRange& written) { take(written); }, nullptr}) {}

  std::uint16_t listen(const modbus::Endpoint& endpoint) {
    server_.listen(endpoint, "the tank's PLC");
    return server_.port();
  }

  /// Until a signal can be read.
  void run(const modbus::Descriptor& stop) {
    constexpr std::chrono::milliseconds period(scan_period_ms);
    Clock::time_point next_scan = Clock::now() + period;
    signalfd_siginfo signal{};
    while (::read(stop.get(), &signal, sizeof signal) < 0) {
      if (is_stepped_) {
        server_.serve(std::chrono::milliseconds(-1), stop.get());
        continue;
      }
      for (; Clock::now() >= next_scan; next_scan += period)
        scan();
      server_.serve(std::chrono::ceil<std::chrono::milliseconds>(next_scan - Clock::now()), stop.get());
    }
    server_.close();
  }

 private:
  /// A client has written registers.
  void take(const modbus::RequestRange& written) {
    const bool is_time = written.table == Table::holding && written.address < bench_time().address + 2U &&
                         bench_time().address < std::uint32_t{written.address} + written.count;
    if (!is_stepped_ || !is_time) return;
    const auto until_ms = static_cast<std::int64_t>(bank_.load(bench_time()).value);
    for (; time_ms_ + scan_period_ms <= until_ms; time_ms_ += scan_period_ms)
      scan();
  }

  void scan() {
    logic_.scan(bank_.load(map_.entries[0]).value, bank_.load(map_.entries[2]).value != 0.0);
    bank_.store(map_.entries[3], logic_.pump() ? 1.0 : 0.0);
    bank_.store(map_.entries[4], logic_.tripped() ? 1.0 : 0.0);
  }

  const modbus::RegisterEntry& bench_time() const { return map_.entries[1]; }

  const bool is_stepped_;
  const modbus::RegisterMap map_{{register_at("level", Table::holding, 0, ValueType::u16, 0.001),
                                  register_at("bench_time_ms", Table::holding, 2, ValueType::u32),
                                  register_at("float_switch", Table::coil, 0, ValueType::boolean),
                                  register_at("pump", Table::discrete_input, 0, ValueType::boolean),
                                  register_at("trip", Table::discrete_input, 1, ValueType::boolean)}};
  modbus::RegisterBank bank_;
  TankLogic logic_;
  modbus::TcpServer server_;
  std::int64_t time_ms_ = 0;
};

/// Throws CLI::ValidationError.
modbus::Endpoint endpoint_of(const std::string& text) {
  if (const auto endpoint = modbus::parse_endpoint(text)) return *endpoint;
  throw CLI::ValidationError("--listen", "'" + text + "' is not ADDRESS:PORT with a port from 0 to 65535");
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("The PLC of the water tank: level control and a high-level trip behind a Modbus TCP server",
               "hil-tank-plc");
  std::string listen = "127.0.0.1:0", clock = "wall";
  bool without_trip = false;
  app.add_option("--listen", listen,
                 "address and port; port 0: a free one, printed as 'listening ADDRESS:PORT'")
      ->capture_default_str();
  app.add_option("--clock", clock,
                 "wall: scans every 10 ms; stepped: scans up to what bench_time_ms is set to")
      ->check(CLI::IsMember({"wall", "stepped"}));
  app.add_flag("--no-trip", without_trip, "the high-level trip does not work");
  modbus::Endpoint endpoint;
  try {
    app.parse(argc, argv);
    endpoint = endpoint_of(listen);
  } catch (const CLI::ParseError& mistake) {
    return app.exit(mistake);
  }
  sigset_t end_signals;
  sigemptyset(&end_signals);
  sigaddset(&end_signals, SIGINT);
  sigaddset(&end_signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &end_signals, nullptr);
  const modbus::Descriptor stop(signalfd(-1, &end_signals, SFD_CLOEXEC | SFD_NONBLOCK));
  TankPlc plc(clock == "stepped", !without_trip);
  endpoint.port = plc.listen(endpoint);
  std::printf("listening %s\n", endpoint.to_text().c_str());
  std::fflush(stdout);
  plc.run(stop);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const hil::io::DeviceError& error) {
    std::fprintf(stderr, "hil-tank-plc: %s\n", error.what());
    return exit_io;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hil-tank-plc: internal error: %s\n", error.what());
    return 70;
  }
}
