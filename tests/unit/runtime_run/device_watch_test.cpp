#include "runtime/run/device_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/still_device.hpp"

namespace hil::run {
namespace {

class Patient final : public tests::StillDevice {
 public:
  Patient() : StillDevice("plc") {}
  struct State {
    bool connected = true;
    std::string fault{};
  };
  State state;
  bool connected() const noexcept override { return state.connected; }
  std::string fault() const override { return state.fault; }
  std::vector<io::DeviceEvent> events_since(std::size_t first) const override {
    return {happened.begin() + static_cast<std::ptrdiff_t>(first), happened.end()};
  }
  std::vector<io::DeviceEvent> happened;
};

class Watch : public ::testing::Test {
 protected:
  std::vector<std::string> look(std::int64_t time_ns) {
    std::vector<std::string> told;
    watch_.check(time_ns, [&](bool good, const std::string& sentence) {
      told.push_back((good ? "good: " : "bad: ") + sentence);
    });
    return told;
  }
  using Told = std::vector<std::string>;

  Patient plc_;
  DeviceWatch watch_{std::vector<const io::Device*>{&plc_}};
};

TEST_F(Watch, WhatIsWellIsNotTold) {
  EXPECT_EQ(look(0), Told{});
  EXPECT_TRUE(watch_.events().empty());
}

TEST_F(Watch, EachChangeIsToldOnceWithItsTime) {
  plc_.state = {.connected = false, .fault = "no answer"};
  EXPECT_EQ(look(1), Told{"bad: device plc is lost: no answer"});
  plc_.state.fault = "no route";
  EXPECT_EQ(look(2), Told{}) << "another reason for the same loss";
  plc_.state = {.connected = true, .fault = "exception 2"};
  EXPECT_EQ(look(3), Told{"bad: device plc has a fault: exception 2"});
  plc_.state = {.connected = true, .fault = {}};
  EXPECT_EQ(look(4), Told{"good: device plc works again"});
  EXPECT_EQ(look(5), Told{});
  plc_.state = {.connected = false, .fault = {}};
  EXPECT_EQ(look(6), Told{"bad: device plc is not connected"});
  ASSERT_EQ(watch_.events().size(), 4U);
  EXPECT_EQ(watch_.events()[0].time_ns, 1);
  EXPECT_EQ(watch_.events()[3].time_ns, 6);
  EXPECT_EQ(watch_.events()[3].text, "device plc is not connected");
}

TEST_F(Watch, WhatWasNeverThereIsToldAtTheFirstLook) {
  plc_.state = {.connected = false, .fault = {}};
  EXPECT_EQ(look(0), Told{"bad: device plc is not connected"});
}

TEST_F(Watch, EachEventOfADeviceIsTakenOnceWithItsOwnTime) {
  plc_.happened = {{-5, "a value was clamped"}, {7, "a value is stale"}};
  EXPECT_EQ(look(10), (Told{"bad: a value was clamped", "bad: a value is stale"}));
  EXPECT_EQ(look(11), Told{});
  plc_.happened.push_back({12, "another is stale"});
  std::vector<std::string> last;
  watch_.take_last_events([&](const std::string& sentence) { last.push_back(sentence); });
  EXPECT_EQ(last, std::vector<std::string>{"another is stale"});
  ASSERT_EQ(watch_.events().size(), 3U);
  EXPECT_EQ(watch_.events()[0].time_ns, 0) << "what came before the first tick is at its begin";
  EXPECT_EQ(watch_.events()[1].time_ns, 7);
  EXPECT_EQ(watch_.events()[2].text, "another is stale");
}

}  // namespace
}  // namespace hil::run
