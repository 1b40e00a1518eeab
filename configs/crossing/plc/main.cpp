// hil-crossing-plc: the PLC of the crossing, a Modbus TCP server. It shares with hil only its registers
// (configs/crossing/crossing_plc.yaml). A real PLC with the same registers can replace it: the scenario
// then has that PLC's address.

#include <CLI/CLI.hpp>
#include <sys/signalfd.h>

#include <csignal>
#include <cstdio>
#include <exception>
#include <map>
#include <string>

#include "configs/crossing/plc/plc_program.hpp"
#include "io/device.hpp"

namespace {

namespace modbus = hil::io::modbus;
namespace plc = hil::crossing::plc;

constexpr int exit_io = 4;

/// Throws CLI::ValidationError.
modbus::Endpoint endpoint_of(const std::string& text) {
  if (const auto endpoint = modbus::parse_endpoint(text)) return *endpoint;
  throw CLI::ValidationError("--listen", "'" + text + "' is not ADDRESS:PORT with a port from 0 to 65535");
}

int run(const modbus::Endpoint& endpoint, plc::PlcClock clock, const plc::Timing& timing) {
  sigset_t end_signals;
  sigemptyset(&end_signals);
  sigaddset(&end_signals, SIGINT);
  sigaddset(&end_signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &end_signals, nullptr);
  const modbus::Descriptor stop(signalfd(-1, &end_signals, SFD_CLOEXEC | SFD_NONBLOCK));

  plc::PlcProgram program(timing, clock, modbus::ServerLimits{});
  program.listen(endpoint);
  modbus::Endpoint bound = endpoint;
  bound.port = program.port();
  std::printf("listening %s\n", bound.to_text().c_str());
  std::fflush(stdout);
  program.run_until_readable(stop.get());
  return 0;
}

int parse_and_run(int argc, char** argv) {
  CLI::App app("The PLC of the crossing: two traffic lights behind a Modbus TCP server", "hil-crossing-plc");
  std::string listen = "127.0.0.1:0";
  plc::PlcClock clock = plc::PlcClock::wall;
  plc::Timing timing;
  app.add_option("--listen", listen,
                 "address and port; port 0: a free one, printed as 'listening ADDRESS:PORT'")
      ->capture_default_str();
  app.add_option("--clock", clock,
                 "wall: scans every 20 ms; stepped: scans up to what bench_time_ms is set to")
      ->transform(CLI::CheckedTransformer(std::map<std::string, plc::PlcClock>{
          {"wall", plc::PlcClock::wall}, {"stepped", plc::PlcClock::stepped}}));
  const auto time_option = [&](const char* name, std::int64_t& milliseconds, const char* about) {
    app.add_option(name, milliseconds, about)
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{3'600'000}))
        ->capture_default_str();
  };
  time_option("--minimum-green-ms", timing.minimum_green_ms, "shortest green");
  time_option("--maximum-green-ms", timing.maximum_green_ms,
              "longest green of an occupied road while the other road has demand");
  time_option("--yellow-ms", timing.yellow_ms, "yellow after green");
  time_option("--all-red-ms", timing.all_red_ms, "time with all lights red between two greens");
  time_option("--red-yellow-ms", timing.red_yellow_ms, "red-yellow before green");
  modbus::Endpoint endpoint;
  try {
    app.parse(argc, argv);
    endpoint = endpoint_of(listen);
    if (timing.maximum_green_ms < timing.minimum_green_ms) {
      throw CLI::ValidationError("--maximum-green-ms", "is below --minimum-green-ms");
    }
  } catch (const CLI::ParseError& mistake) {
    return app.exit(mistake);
  }
  return run(endpoint, clock, timing);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return parse_and_run(argc, argv);
  } catch (const hil::io::DeviceError& error) {
    std::fprintf(stderr, "hil-crossing-plc: %s\n", error.what());
    return exit_io;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hil-crossing-plc: internal error: %s\n", error.what());
    return 70;
  }
}
