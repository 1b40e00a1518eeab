// The guidance as a node of a CAN bus, with frames of the scenario's DBC file.

#include "configs/docking/guidance/guidance_node.hpp"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "seen_reflectors.hpp"
#include "tests/paths.h"

namespace hil::docking::guidance {
namespace {

const can::Protection protection{"Counter", "Checksum"};

class GuidanceNodeTest : public ::testing::Test {
 protected:
  GuidanceNodeTest() : dbc_(can::load_dbc(std::string(HIL_SOURCE_DIR) + "/configs/docking/docking.dbc")) {}

  void SetUp() override {
    ASSERT_TRUE(dbc_.ok()) << can::describe_problems(dbc_, "docking.dbc");
    ASSERT_TRUE(GuidanceNode::database_problems(dbc_.database).empty())
        << GuidanceNode::database_problems(dbc_.database).front();
    node_ = std::make_unique<GuidanceNode>(dbc_.database);
  }

  std::span<const can::Frame> send(const std::string& message, const std::map<std::string, double>& signals,
                                   bool is_protected = true) {
    const can::DbcMessage& description = *dbc_.database.find_message(message);
    const auto [encoder, is_new] = encoders_.try_emplace(message);
    if (is_new) {
      encoder->second =
          std::make_unique<can::MessageEncoder>(description, is_protected ? protection : can::Protection{});
    }
    std::vector<double> values(description.signals.size(), 0.0);
    for (const auto& [name, value] : signals)
      values[static_cast<std::size_t>(description.find_signal(name) - description.signals.data())] = value;
    can::MessageEncoder::Tally tally;
    can::Frame frame = encoder->second->build(values, tally);
    encoder->second->confirm_sent();
    EXPECT_EQ(tally.saturated, 0U) << message;
    frame.time_ns = time_ns_;
    frame.direction = can::Direction::rx;
    return node_->handle(frame);
  }

  void send_attitude(const glm::dquat& q) {
    send("Attitude", {{"QW", q.w}, {"QX", q.x}, {"QY", q.y}, {"QZ", q.z}}, false);
    send("Rates", {});
  }

  std::map<std::string, double> values_of(const std::string& message, const can::Frame& frame) {
    const can::DbcMessage& description = *dbc_.database.find_message(message);
    can::MessageDecoder decoder(description, protection);
    EXPECT_EQ(decoder.check(frame), can::MessageDecoder::Verdict::accepted);
    std::map<std::string, double> values;
    decoder.decode(
        frame, [&](std::size_t signal, double value) { values[description.signals[signal].name] = value; });
    return values;
  }

  can::DbcResult dbc_;
  std::unique_ptr<GuidanceNode> node_;
  std::map<std::string, std::unique_ptr<can::MessageEncoder>> encoders_;
  std::int64_t time_ns_ = 1'000'000;
};

TEST_F(GuidanceNodeTest, AnswersAListWithThrustTorqueAndStatus) {
  const glm::dquat attitude = test::facing_the_port();
  send_attitude(attitude);
  const glm::dvec3 port(1.0, 20.0, -0.5);
  const auto detections = test::seen_reflectors(port, attitude, {-1.2, 0.0, 0.0});
  ASSERT_EQ(detections.size(), 8U);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    send("Target" + std::to_string(i),
         {{"Azimuth", detections[i].azimuth_rad},
          {"Elevation", detections[i].elevation_rad},
          {"Range", detections[i].range_m}},
         false);
  }
  const auto answer = send("ScanHeader", {{"ScanIndex", 7}, {"TargetCount", 21}});
  ASSERT_EQ(answer.size(), GuidanceNode::frames_per_answer);
  const auto status = values_of("GuidanceStatus", answer[2]);
  EXPECT_EQ(status.at("Mode"), static_cast<double>(Mode::approach));
  EXPECT_NEAR(status.at("Distance"), 20.0, 0.2);
  EXPECT_EQ(status.at("AnswerTo"), 0.0);
  const auto thrust = values_of("ThrustCommand", answer[0]);
  // The capsule's x looks along -y of the station, its y along x: it moves to smaller x.
  EXPECT_GT(thrust.at("ForceX"), 100.0);
  EXPECT_LT(thrust.at("ForceY"), -100.0);
  EXPECT_EQ(values_of("TorqueCommand", answer[1]).at("TorqueX"), 0.0);
}

TEST_F(GuidanceNodeTest, IncompleteListHasNoAnswer) {
  send_attitude(test::facing_the_port());
  send("Target0", {{"Range", 10.0}}, false);
  EXPECT_TRUE(send("ScanHeader", {{"TargetCount", 2}}).empty());
  EXPECT_EQ(node_->counters().incomplete_lists, 1U);
  EXPECT_FALSE(send("ScanHeader", {{"TargetCount", 0}}).empty());
}

TEST_F(GuidanceNodeTest, FrameWithAWrongChecksumIsRefused) {
  const can::DbcMessage& header = *dbc_.database.find_message("ScanHeader");
  can::MessageEncoder encoder(header, protection);
  const std::vector<double> values(header.signals.size(), 0.0);
  can::MessageEncoder::Tally tally;
  can::Frame frame = encoder.build(values, tally);
  frame.raw.data[0] ^= 1;
  frame.direction = can::Direction::rx;
  EXPECT_TRUE(node_->handle(frame).empty());
  EXPECT_EQ(node_->counters().refused_frames, 1U);
}

TEST_F(GuidanceNodeTest, AttitudeThatIsNoRotationIsIgnored) {
  send_attitude(glm::dquat(0.0, 0.0, 0.0, 0.0));
  const auto answer = send("ScanHeader", {});
  ASSERT_EQ(answer.size(), GuidanceNode::frames_per_answer);
  EXPECT_EQ(values_of("GuidanceStatus", answer[2]).at("Mode"), static_cast<double>(Mode::blind));
}

TEST(GuidanceDatabase, WhatIsMissingIsNamed) {
  const auto problems = GuidanceNode::database_problems({});
  ASSERT_GE(problems.size(), 14U);
  EXPECT_EQ(problems[0], "the database has no message 'Attitude'");
}

}  // namespace
}  // namespace hil::docking::guidance
