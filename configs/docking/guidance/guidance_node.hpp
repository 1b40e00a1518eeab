#pragma once
// The guidance as a node of a CAN bus: it decodes and encodes the frames of configs/docking/docking.dbc.
//
// An attitude is an Attitude message and the Rates message after it. A list of targets is a sequence of
// Target messages, which a ScanHeader ends. The node answers the header with a ThrustCommand, a
// TorqueCommand and a GuidanceStatus if all targets of the list were received since the previous header; else
// it counts an incomplete list.
//
// Threads: one.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "configs/docking/guidance/controller.hpp"
#include "io/can/dbc.hpp"
#include "io/can/message_coder.hpp"

namespace hil::docking::guidance {

namespace can = io::can;

struct GuidanceCounters {
  std::uint64_t answers = 0;
  std::uint64_t incomplete_lists = 0;
  std::uint64_t refused_frames = 0;  ///< wrong kind, checksum or counter
};

class GuidanceNode {
 public:
  static constexpr std::size_t max_targets = 8;
  static constexpr std::size_t frames_per_answer = 3;

  /// Sentences on what the database lacks for this guidance; empty: nothing.
  static std::vector<std::string> database_problems(const can::Dbc& database);

  /// Misuse (asserts): a database with problems.
  explicit GuidanceNode(const can::Dbc& database, const Parameters& parameters = {});

  /// Takes a received frame. Returns the frames to send, valid until the next call; usually none. The frame's
  /// time_ns is the time of the guidance.
  std::span<const can::Frame> handle(const can::Frame& frame);
  /// Frame `index` of the answer was sent: its message has the next counter in the next answer.
  void confirm_sent(std::size_t index) noexcept { answer_encoders_[index].confirm_sent(); }

  const GuidanceCounters& counters() const noexcept { return counters_; }
  const Controller& controller() const noexcept { return controller_; }

 private:
  bool accept(can::MessageDecoder& decoder, const can::Frame& frame);
  void take_attitude(const can::Frame& frame);
  void take_rates(const can::Frame& frame);
  void take_target(std::size_t slot, const can::Frame& frame);
  std::span<const can::Frame> answer(const can::Frame& header);
  void encode(const Command& command, double list_counter);

  Controller controller_;
  can::MessageDecoder attitude_, rates_, scan_header_;
  std::vector<can::MessageDecoder> targets_;
  std::vector<can::MessageEncoder> answer_encoders_;  ///< thrust, torque, status

  std::optional<glm::dquat> received_attitude_;  ///< since the last rates
  std::array<Detection, max_targets> detections_{};
  std::array<bool, max_targets> received_{};  ///< since the last header
  std::array<can::Frame, frames_per_answer> frames_{};
  GuidanceCounters counters_;

  // Indices of the signals in their messages.
  std::array<std::size_t, 4> attitude_signals_{};
  std::array<std::size_t, 3> rate_signals_{}, target_signals_{}, thrust_signals_{}, torque_signals_{};
  std::size_t scan_index_, target_count_, captured_, list_counter_;
  std::size_t mode_, distance_, answer_to_;
};

}  // namespace hil::docking::guidance
