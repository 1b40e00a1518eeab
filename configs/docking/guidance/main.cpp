// hil-docking-guidance: the device under test of the docking. It uses nothing but CAN.
//
//   hil-docking-guidance --bus unix:/path|socketcan:vcan0 --database docking.dbc [--name NAME]
//                        [--scan-period-ms 500] [--beam-deg 0.884]
//
// --scan-period-ms is the time of a sweep of the scanner, --beam-deg the full opening angle of a beam.
//
// Exit codes: 0 after a signal, or when the virtual bus was closed; 2 for bad arguments or a bad database;
// 4 when the bus can not be opened.

#include <getopt.h>
#include <poll.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <numbers>
#include <span>
#include <string>

#include "configs/docking/guidance/guidance_node.hpp"
#include "io/can/socketcan_bus.hpp"
#include "io/virtual/station.hpp"

namespace {

namespace guidance = hil::docking::guidance;
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
  std::string name = "docking-guidance";
  guidance::Parameters parameters;
};

/// A positive number in the whole word, else 0.
double positive_number(const char* word) {
  char* end = nullptr;
  const double value = std::strtod(word, &end);
  return *end == '\0' && std::isfinite(value) && value > 0.0 ? value : 0.0;
}

bool parse_arguments(int count, char** words, Arguments& arguments) {
  static const option known[] = {
      {"bus", required_argument, nullptr, 'b'},      {"database", required_argument, nullptr, 'd'},
      {"name", required_argument, nullptr, 'n'},     {"scan-period-ms", required_argument, nullptr, 's'},
      {"beam-deg", required_argument, nullptr, 'w'}, {nullptr, 0, nullptr, 0}};
  int letter = 0;
  while ((letter = ::getopt_long(count, words, "", known, nullptr)) != -1) {
    if (letter == 'b') {
      arguments.bus = optarg;
    } else if (letter == 'd') {
      arguments.database = optarg;
    } else if (letter == 'n') {
      arguments.name = optarg;
    } else if (letter == 's') {
      arguments.parameters.scan_period_s = 1e-3 * positive_number(optarg);
    } else if (letter == 'w') {
      arguments.parameters.scanner.beam_half_angle_rad =
          0.5 * positive_number(optarg) * std::numbers::pi / 180.0;
    } else {
      return false;
    }
  }
  return optind == count && !arguments.bus.empty() && !arguments.database.empty() &&
         arguments.parameters.scan_period_s > 0.0 && arguments.parameters.scanner.beam_half_angle_rad > 0.0;
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

void send_all(can::CanTransport& bus, guidance::GuidanceNode& node, std::span<const can::Frame> frames) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (bus.send(frames[i]) == can::SendResult::sent) node.confirm_sent(i);
  }
}

void answer_frames(can::CanTransport& bus, guidance::GuidanceNode& node, bool can_reconnect) {
  while (stop_requested == 0) {
    can::Frame frame;
    switch (bus.receive(frame)) {
      case can::ReceiveResult::frame:
        send_all(bus, node, node.handle(frame));
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
  const auto problems = guidance::GuidanceNode::database_problems(database.database);
  for (const std::string& problem : problems) {
    std::fprintf(stderr, "%s: %s\n", arguments.database.c_str(), problem.c_str());
  }
  if (!problems.empty()) return bad_usage;

  const MonotonicTime clock;
  const auto bus = make_bus(arguments);
  try {
    bus->open(clock, hil::io::Pacing::realtime);
  } catch (const hil::io::DeviceError& error) {
    std::fprintf(stderr, "hil-docking-guidance: %s\n", error.what());
    return bad_io;
  }
  guidance::GuidanceNode node(database.database, arguments.parameters);
  answer_frames(*bus, node, arguments.bus.starts_with("socketcan:"));
  const guidance::GuidanceCounters& counters = node.counters();
  std::printf("answers %llu, fixes %llu, incomplete lists %llu, refused frames %llu\n",
              static_cast<unsigned long long>(counters.answers),
              static_cast<unsigned long long>(node.controller().fixes()),
              static_cast<unsigned long long>(counters.incomplete_lists),
              static_cast<unsigned long long>(counters.refused_frames));
  return 0;
}

}  // namespace

int main(int count, char** words) {
  Arguments arguments;
  if (!parse_arguments(count, words, arguments)) {
    std::fputs(
        "usage: hil-docking-guidance --bus unix:/path|socketcan:INTERFACE --database FILE.dbc [--name NAME]\n"
        "                            [--scan-period-ms NUMBER] [--beam-deg NUMBER]\n",
        stderr);
    return bad_usage;
  }
  struct sigaction action {};
  action.sa_handler = request_stop;
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGINT, &action, nullptr);
  return run(arguments);
}
