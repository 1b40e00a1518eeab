#pragma once
// The controller as a station on a CAN bus: it decodes and encodes the frames of
// configs/crossing/crossing.dbc.
//
// An object list is a sequence of Object messages and an ObjectHeader that ends it. The station answers the
// header with one BrakeCommand if Object0 to Object<ObjectCount - 1> were received since the header before;
// else it counts an incomplete list.
//
// Threads: one.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "configs/crossing/aeb_controller/controller.hpp"
#include "io/can/dbc.hpp"
#include "io/can/message_coder.hpp"

namespace hil::crossing::aeb {

namespace can = io::can;

struct StationCounters {
  std::uint64_t answers = 0;
  std::uint64_t incomplete_lists = 0;
  std::uint64_t refused_frames = 0;  ///< wrong kind, checksum or counter
};

class Station {
 public:
  static constexpr std::size_t object_slots = 4;

  /// Sentences on what the database lacks for this controller; empty: nothing.
  static std::vector<std::string> database_problems(const can::Dbc& database);

  /// Misuse (asserts): a database with problems.
  explicit Station(const can::Dbc& database, const Parameters& parameters = {});

  /// Takes a received frame. Returns the answer to send, if there is one. The frame's time_ns is the time
  /// of the controller.
  std::optional<can::Frame> handle(const can::Frame& frame);
  /// The answer was sent: the next one has the next counter.
  void confirm_sent() noexcept { brake_command_.confirm_sent(); }

  const StationCounters& counters() const noexcept { return counters_; }

 private:
  bool accept(can::MessageDecoder& decoder, const can::Frame& frame);
  void take_object(std::size_t slot, const can::Frame& frame);
  std::optional<can::Frame> answer(const can::Frame& header);

  Controller controller_;
  can::MessageDecoder ego_status_;
  std::vector<can::MessageDecoder> objects_;
  can::MessageDecoder object_header_;
  can::MessageEncoder brake_command_;
  std::array<ObjectReport, object_slots> reports_{};
  std::array<bool, object_slots> reported_{};  ///< since the last header
  StationCounters counters_;

  // Indices of the signals in their messages.
  std::size_t speed_, yaw_rate_;
  std::array<std::size_t, 7> object_signals_;
  std::size_t object_count_, list_counter_;
  std::size_t deceleration_, warning_, degraded_, answer_to_;
};

}  // namespace hil::crossing::aeb
