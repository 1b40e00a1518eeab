// hil-aeb-controller: the device under test of the crossing. It uses nothing but CAN.
//
//   hil-aeb-controller --bus unix:/path|socketcan:vcan0 --database crossing.dbc [--name NAME]
//                      [--no-plausibility-check]
//
// Without the plausibility check it takes a frozen object list for a valid one (plausibility_check.hpp).
//
// Exit codes: 0 after a signal, or when the virtual bus was closed; 2 for bad arguments or a bad database;
// 4 when the bus can not be opened.

#include <getopt.h>
#include <poll.h>

#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

#include "configs/crossing/aeb_controller/station.hpp"
#include "io/can/socketcan_bus.hpp"
#include "io/virtual/station.hpp"

namespace {

namespace aeb = hil::crossing::aeb;
namespace can = hil::io::can;

constexpr int bad_usage = 2;
constexpr int bad_io = 4;

volatile std::sig_atomic_t stop_requested = 0;
extern "C" void request_stop(int) {
  stop_requested = 1;
}

class MonotonicTime final : public hil::io::RunClock {
 public:
  hil::io::RunTimeNs now_ns() const noexcept override {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  }
};

struct Arguments {
  std::string bus;
  std::string database;
  std::string name = "aeb-controller";
  aeb::Parameters parameters;
};

bool parse_arguments(int count, char** words, Arguments& arguments) {
  static const option known[] = {{"bus", required_argument, nullptr, 'b'},
                                 {"database", required_argument, nullptr, 'd'},
                                 {"name", required_argument, nullptr, 'n'},
                                 {"no-plausibility-check", no_argument, nullptr, 'p'},
                                 {nullptr, 0, nullptr, 0}};
  int letter = 0;
  while ((letter = ::getopt_long(count, words, "", known, nullptr)) != -1) {
    if (letter == 'b') {
      arguments.bus = optarg;
    } else if (letter == 'd') {
      arguments.database = optarg;
    } else if (letter == 'n') {
      arguments.name = optarg;
    } else if (letter == 'p') {
      arguments.parameters.checks_plausibility = false;
    } else {
      return false;
    }
  }
  return optind == count && !arguments.bus.empty() && !arguments.database.empty();
}

std::unique_ptr<can::CanTransport> make_bus(const Arguments& arguments) {
  constexpr std::string_view kernel_scheme = "socketcan:";
  if (arguments.bus.starts_with(kernel_scheme)) {
    return std::make_unique<can::SocketCanBus>(
        can::SocketCanConfig{arguments.bus.substr(kernel_scheme.size())});
  }
  return std::make_unique<hil::io::virtual_bus::Station>(
      hil::io::virtual_bus::StationConfig{arguments.bus, arguments.name});
}

void answer_frames(can::CanTransport& bus, aeb::Station& station, bool can_reconnect) {
  while (stop_requested == 0) {
    can::Frame frame;
    switch (bus.receive(frame)) {
      case can::ReceiveResult::frame:
        if (const auto reply = station.handle(frame); reply && bus.send(*reply) == can::SendResult::sent) {
          station.confirm_sent();
        }
        continue;
      case can::ReceiveResult::lost:
        if (!can_reconnect) return;
        break;
      case can::ReceiveResult::empty:
        break;
    }
    constexpr int poll_ms = 20;
    pollfd watched{bus.fd(), POLLIN, 0};
    static_cast<void>(::poll(&watched, 1, poll_ms));
  }
}

int run(const Arguments& arguments) {
  const can::DbcResult database = can::load_dbc(arguments.database);
  std::fputs(can::describe_problems(database, arguments.database).c_str(), stderr);
  if (!database.ok()) return bad_usage;
  const auto problems = aeb::Station::database_problems(database.database);
  for (const std::string& problem : problems) {
    std::fprintf(stderr, "%s: %s\n", arguments.database.c_str(), problem.c_str());
  }
  if (!problems.empty()) return bad_usage;

  const MonotonicTime clock;
  const auto bus = make_bus(arguments);
  try {
    bus->open(clock, hil::io::Pacing::realtime);
  } catch (const hil::io::DeviceError& error) {
    std::fprintf(stderr, "hil-aeb-controller: %s\n", error.what());
    return bad_io;
  }
  aeb::Station station(database.database, arguments.parameters);
  answer_frames(*bus, station, arguments.bus.starts_with("socketcan:"));
  const aeb::StationCounters& counters = station.counters();
  std::printf("answers %llu, incomplete lists %llu, refused frames %llu\n",
              static_cast<unsigned long long>(counters.answers),
              static_cast<unsigned long long>(counters.incomplete_lists),
              static_cast<unsigned long long>(counters.refused_frames));
  return 0;
}

}  // namespace

int main(int count, char** words) {
  Arguments arguments;
  if (!parse_arguments(count, words, arguments)) {
    std::fputs(
        "usage: hil-aeb-controller --bus unix:/path|socketcan:INTERFACE --database FILE.dbc [--name NAME]\n"
        "                          [--no-plausibility-check]\n",
        stderr);
    return bad_usage;
  }
  struct sigaction action {};
  action.sa_handler = request_stop;
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
  return run(arguments);
}
