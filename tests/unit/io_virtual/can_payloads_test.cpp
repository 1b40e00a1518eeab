// A CAN device that receives frames without some signals of their message.

#include <gtest/gtest.h>

#include "io/can/can_device.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/station.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::can {
namespace {

using tests::eventually;

constexpr std::int64_t ms = 1'000'000;
constexpr canid_t status_id = 1;
constexpr canid_t other_id = 2;

/// A device in real time that receives, and another station on its bus that sends.
class Payloads : public ::testing::Test {
 protected:
  void start(const char* database, std::int64_t timeout_ns) {
    CanDeviceConfig config;
    config.name = "car";
    config.database = parse_dbc(database).database;
    for (const DbcMessage& message : config.database.messages)
      config.receive.push_back({message.name, timeout_ns, {}, {}});
    auto hub =
        std::make_unique<virtual_bus::Hub>(virtual_bus::HubConfig{.name = "car", .path = {}, .faults = {}});
    outside_ = std::make_unique<virtual_bus::Station>(virtual_bus::StationConfig{hub->address(), "outside"});
    device_ = std::make_unique<CanDevice>(std::move(config), std::move(hub));
    device_->start(clock_, Pacing::realtime);
    outside_->open(clock_, Pacing::realtime);
    samples_.resize(device_->inputs().size());
  }
  Sample sample(const std::string& name) {
    device_->latch_inputs(samples_);
    for (std::size_t index = 0; index < samples_.size(); ++index) {
      if (device_->inputs()[index].name == name) return samples_[index];
    }
    ADD_FAILURE() << "no input " << name;
    return {};
  }
  void send(canid_t id, std::vector<std::uint8_t> bytes) { outside_->send(make_frame(id, bytes)); }

  RunningClock clock_;
  std::unique_ptr<virtual_bus::Station> outside_;
  std::unique_ptr<CanDevice> device_;
  std::vector<Sample> samples_;
};

TEST_F(Payloads, LongerAndShorterFramesAreAcceptedAndCounted) {
  start(
      "BO_ 1 Status: 4 A\n SG_ First : 0|16@1+ (1,0) [0|0] \"\" B\n SG_ Second : 16|16@1+ (1,0) [0|0] \"\" "
      "B\n"
      "BO_ 2 Other: 4 A\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" B\n",
      0);
  send(status_id, {1, 0, 2, 0, 9, 9, 9, 9});
  send(status_id, {7, 0, 8});
  send(status_id, {7, 0, 8});
  send(other_id, {1, 0, 0, 0});
  ASSERT_TRUE(eventually([&] { return sample("Other.S").fresh; }));
  EXPECT_EQ(sample("Status.First").value, 7.0);
  EXPECT_EQ(sample("Status.Second").value, 2.0) << "incomplete in the shorter frames";
  const std::vector<LengthCounts> lengths = device_->other_lengths();
  ASSERT_EQ(lengths.size(), 1U);
  EXPECT_EQ(lengths[0].message, "Status");
  EXPECT_EQ(lengths[0].longer, 1U);
  EXPECT_EQ(lengths[0].shorter, 2U);
}

TEST_F(Payloads, MultiplexedSignalsTimeOutSeparately) {
  start(
      "BO_ 1 Pages: 2 A\n SG_ Page M : 0|8@1+ (1,0) [0|0] \"\" B\n SG_ Left m0 : 8|8@1+ (1,0) [0|0] \"\" B\n"
      " SG_ Right m1 : 8|8@1+ (1,0) [0|0] \"\" B\n",
      200 * ms);
  send(status_id, {0, 5});
  ASSERT_TRUE(eventually([&] { return sample("Pages.Left").value == 5.0; }));
  ASSERT_TRUE(eventually([&] {
    send(status_id, {1, 6});
    return !sample("Pages.Left").fresh;
  }));
  EXPECT_EQ(sample("Pages.Left").value, 0.0) << "the safe value";
  ASSERT_TRUE(eventually([&] {
    send(status_id, {1, 6});
    return sample("Pages.Right").fresh;
  }));
  EXPECT_TRUE(sample("Pages.Page").fresh);
}

}  // namespace
}  // namespace hil::io::can
