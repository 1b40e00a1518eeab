#include "runtime/run/device_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/idle_device.hpp"

namespace hil::run {
namespace {

class WatchedDevice final : public tests::IdleDevice {
 public:
  WatchedDevice() : IdleDevice("plc") {}
  struct State {
    bool connected = true;
    std::string fault{};
  };
  State state;
  bool connected() const noexcept override { return state.connected; }
  std::string fault() const override { return state.fault; }
  std::vector<io::DeviceEvent> events_since(std::size_t first) const override {
    return {events.begin() + static_cast<std::ptrdiff_t>(first), events.end()};
  }
  std::vector<io::DeviceEvent> events;
};

class DeviceWatchTest : public ::testing::Test {
 protected:
  std::vector<std::string> check(std::int64_t time_ns) {
    std::vector<std::string> reported;
    watch_.check(time_ns, [&](bool good, const std::string& sentence) {
      reported.push_back((good ? "good: " : "bad: ") + sentence);
    });
    return reported;
  }
  using Reports = std::vector<std::string>;

  WatchedDevice plc_;
  DeviceWatch watch_{{{&plc_, "Modbus unit plc"}}, DeviceWatch::Causes::in_events};
};

TEST_F(DeviceWatchTest, EachChangeIsReportedOnceWithItsTime) {
  EXPECT_EQ(check(0), Reports{});
  plc_.state = {.connected = false, .fault = "no answer"};
  EXPECT_EQ(check(1), Reports{"bad: Modbus unit plc is lost: no answer"});
  plc_.state.fault = "no route";
  EXPECT_EQ(check(2), Reports{}) << "another reason for the same loss";
  plc_.state = {.connected = true, .fault = "exception 2"};
  EXPECT_EQ(check(3), Reports{"bad: Modbus unit plc has a fault: exception 2"});
  plc_.state = {.connected = true, .fault = {}};
  EXPECT_EQ(check(4), Reports{"good: Modbus unit plc works again"});
  EXPECT_EQ(check(5), Reports{});
  plc_.state = {.connected = false, .fault = {}};
  EXPECT_EQ(check(6), Reports{"bad: Modbus unit plc is not connected"});
  ASSERT_EQ(watch_.events().size(), 4U);
  EXPECT_EQ(watch_.events()[0].time_ns, 1);
  EXPECT_EQ(watch_.events()[0].text, "Modbus unit plc is lost: no answer");
  EXPECT_EQ(watch_.events()[3].time_ns, 6);
  EXPECT_EQ(watch_.events()[3].text, "Modbus unit plc is not connected");
}

TEST_F(DeviceWatchTest, EventsMayHaveNoCause) {
  DeviceWatch watch({{&plc_, "Modbus unit plc"}}, DeviceWatch::Causes::only_reported);
  plc_.state = {.connected = false, .fault = "no answer from port 4711"};
  std::string reported;
  watch.check(3, [&](bool, const std::string& sentence) { reported = sentence; });
  EXPECT_EQ(reported, "Modbus unit plc is lost: no answer from port 4711");
  ASSERT_EQ(watch.events().size(), 1U);
  EXPECT_EQ(watch.events()[0].text, "Modbus unit plc is lost");
}

TEST_F(DeviceWatchTest, DeviceThatWasNeverConnectedIsReportedAtTheFirstCheck) {
  plc_.state = {.connected = false, .fault = {}};
  EXPECT_EQ(check(0), Reports{"bad: Modbus unit plc is not connected"});
}

TEST_F(DeviceWatchTest, EachEventOfADeviceIsReportedOnceWithItsTime) {
  plc_.events = {{-5, "a value was clamped"}, {7, "a value is stale"}};
  EXPECT_EQ(check(10), (Reports{"bad: a value was clamped", "bad: a value is stale"}));
  EXPECT_EQ(check(11), Reports{});
  plc_.events.push_back({12, "another is stale"});
  std::vector<std::string> last;
  watch_.collect_last_events([&](bool /*good*/, const std::string& sentence) { last.push_back(sentence); });
  EXPECT_EQ(last, std::vector<std::string>{"another is stale"});
  ASSERT_EQ(watch_.events().size(), 3U);
  EXPECT_EQ(watch_.events()[0].time_ns, 0) << "events before the first tick have its time";
  EXPECT_EQ(watch_.events()[1].time_ns, 7);
  EXPECT_EQ(watch_.events()[2].text, "another is stale");
}

}  // namespace
}  // namespace hil::run
