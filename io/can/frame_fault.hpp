#pragma once
// The port between the path of a frame through a CAN device and one fault of the frames of a message. The
// kinds of fault derive from it (runtime/buses/can/faults).
//
// Threads: the problems on the setup thread; act on the device's thread.

#include <cstdint>
#include <span>
#include <string>

#include "io/can/frame.hpp"
#include "io/can/log_playback.hpp"
#include "io/can/message_coder.hpp"
#include "io/run_clock.hpp"

namespace hil::io::can {

/// What becomes of a frame on which an active fault acts.
struct FrameAction {
  bool acts = true;           ///< false: the frame goes on as it came, and is not counted as an effect
  bool drops = false;         ///< it goes no further
  std::uint32_t copies = 0;   ///< that go on before it
  std::int64_t delay_ns = 0;  ///< above 0: it goes on so much later
};

class FrameFault {
 public:
  virtual ~FrameFault() = default;
  /// Why frames of this message can not have the fault, as a clause; empty: they can.
  virtual std::string problem(const MessageLayout& layout) const = 0;
  /// The same for frames of an identifier that a playback sends, and that no message of the DBC file has.
  /// `of_identifier` is not empty.
  virtual std::string played_problem(std::span<const PlayedFrame> of_identifier) const = 0;
  /// Each frame that comes. While the fault is active, it may change the frame, and the result counts.
  /// `layout`: of its message; null: there is no description of the frame.
  virtual FrameAction act(Frame& frame, bool is_active, const MessageLayout* layout) = 0;
};

inline std::span<std::uint8_t> payload_of(Frame& frame) {
  return {frame.raw.data, frame.raw.len};
}
/// Sets the checksum that fits the payload, where the message has one.
void correct_checksum(const MessageLayout& layout, Frame& frame);

}  // namespace hil::io::can
