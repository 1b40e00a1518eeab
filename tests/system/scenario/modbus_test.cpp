// A run that is a Modbus server and its client: the report counts values out of range and refused
// connections.

#include <gtest/gtest.h>

#include <algorithm>
#include <cerrno>

#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"
#include "tests/system/scenario/silent_listener.hpp"

namespace hil::scenario_test {
namespace {

using Json = nlohmann::json;

class Client {
 public:
  explicit Client(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    connected_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
    const timeval limit{5, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  ~Client() { ::close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  bool connected() const noexcept { return connected_; }
  bool is_closed_by_the_server() const {
    char byte = 0;
    const ssize_t got = ::recv(fd_, &byte, 1, 0);
    return got == 0 || (got < 0 && errno == ECONNRESET);
  }

 private:
  int fd_;
  bool connected_ = false;
};

Json unit_of(const Json& report, const std::string& name) {
  for (const Json& unit : report.at("modbus")) {
    if (unit.at("unit") == name) return unit;
  }
  ADD_FAILURE() << "no unit " << name;
  return Json::object();
}

std::ptrdiff_t events(const Json& report, const std::string& text) {
  return std::ranges::count_if(report.at("events"), [&](const Json& one) { return one.at("text") == text; });
}

TEST(ModbusBusDevice, ReportsValuesOutOfRangeAndRefusedConnections) {
  const Folder folder;
  const std::uint16_t number = free_port();
  const std::string port = std::to_string(number);
  write_text(folder / "panel.yaml",
             "registers:\n"
             "  - {name: status, table: holding, address: 0, type: u16, access: write}\n"
             "  - {name: level, table: holding, address: 1, type: u16, access: read, maximum: 100}\n");
  write_text(folder / "peer.yaml",
             "registers:\n"
             "  - {name: status, table: holding, address: 0, type: u16, access: read, maximum: 100}\n"
             "  - {name: level, table: holding, address: 1, type: u16, access: write}\n");
  write_text(
      folder / "fit.yaml",
      "scenario: fit\nbase_rate: 100 Hz\nduration: 3 s\nworld: {durability: volatile}\n"
      "realtime: {scheduler: other, lock_memory: false, watchdog: 60 s}\nmodbus:\n"
      "  - {unit: panel, role: server, device: \"127.0.0.1:" +
          port +
          "\", registers: panel.yaml, rate: 50 Hz, max_clients: 2, write: {status: 30000}, read: [level]}\n"
          "  - {unit: peer, device: \"127.0.0.1:" +
          port +
          "\", registers: peer.yaml, rate: 50 Hz, timeout: 5 s, max_age: 9 s, unit_id: 250, write: {level: "
          "101}, read: [status]}\n");
  Program run(hil({"run", folder / "fit.yaml", "--out", folder / "out"}));
  ASSERT_TRUE(run_begins(run, folder / "out")) << run.wait().errors;
  {
    const Client second(number);
    const Client third(number);
    EXPECT_TRUE(second.connected());
    EXPECT_TRUE(third.is_closed_by_the_server());
  }
  const Ended ended = run.wait();
  const Json report = read_report(folder / "out");

  const Json panel = unit_of(report, "panel");
  EXPECT_EQ(panel.at("role"), "server");
  EXPECT_EQ(panel.at("reconnects"), 0);
  EXPECT_EQ(panel.at("connections"), 2);
  EXPECT_EQ(panel.at("refused_connections"), 1);
  ASSERT_EQ(panel.at("exceptions").size(), 1U);
  EXPECT_EQ(panel.at("exceptions")[0].at("code"), 3);
  EXPECT_GT(panel.at("exceptions")[0].at("count"), 10);
  EXPECT_EQ(panel.at("out_of_range_inputs"), 0) << "a refused value is not clamped";

  const Json peer = unit_of(report, "peer");
  EXPECT_EQ(peer.at("role"), "client");
  EXPECT_EQ(peer.at("reconnects"), 0) << "the first connection does not count";
  ASSERT_EQ(peer.at("exceptions").size(), 1U);
  EXPECT_EQ(peer.at("exceptions")[0].at("code"), 3);
  EXPECT_GT(peer.at("out_of_range_inputs"), 10);
  EXPECT_EQ(peer.at("saturated_outputs"), 0);

  EXPECT_EQ(
      events(report,
             "Modbus unit panel: register level: a client wrote 101, outside 0 to 100; it was answered with "
             "exception 3 and changed nothing"),
      1)
      << report.at("events");
  EXPECT_EQ(
      events(report, "Modbus unit peer: register status: 30000 is outside 0 to 100; it is read as it is"), 1)
      << report.at("events");
  EXPECT_NE(ended.output.find("modbus.panel: 1 connection was refused"), std::string::npos) << ended.output;
  const Signals signals(folder / "out");
  EXPECT_EQ(signals["modbus.peer.status"].back(), 30000.0);
  EXPECT_EQ(signals["modbus.panel.level"].back(), 0.0);
}

}  // namespace
}  // namespace hil::scenario_test
