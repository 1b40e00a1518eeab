// stuck: last: frames keep the payload of the frame before the fault; counter and checksum go on.

#include <cstring>
#include <optional>

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class StuckFrames final : public DescribedFrameFault {
 public:
  io::can::FrameAction act(io::can::Frame& frame, bool is_active,
                           const io::can::MessageLayout* layout) override {
    if (!is_active || !last_frame_) last_frame_ = frame;
    if (!is_active) return {};
    const io::can::Frame now = frame;
    frame.raw.len = last_frame_->raw.len;
    std::memcpy(frame.raw.data, last_frame_->raw.data, frame.raw.len);
    if (const auto counter = layout->counter()) {
      const io::can::SignalCodec& codec = layout->codec(*counter);
      if (codec.is_whole_in(now.raw.len) && codec.is_whole_in(frame.raw.len))
        codec.insert(io::can::payload_of(frame), codec.extract(now.payload()));
    }
    io::can::correct_checksum(*layout, frame);
    return {};
  }

 private:
  std::optional<io::can::Frame> last_frame_{};  ///< before the fault
};

class StuckMessageFault final : public MessageFault {
 public:
  std::string sentence() const override { return "stuck at its last payload"; }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<StuckFrames>();
  }
};

std::shared_ptr<const config::FaultEffect> read_stuck(const config::Value& value,
                                                      const config::FaultContext& context) {
  if (value.text() != "last")
    context.diagnostics.add(value.place(), "'stuck' of a message can only be 'last'");
  return std::make_shared<const StuckMessageFault>();
}

}  // namespace

config::FaultKind stuck_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "stuck",
          .about = "Of a message: 'last', the payload before the fault; counter and checksum go on.",
          .schema = config::Schema::text,
          .read = read_stuck};
}

}  // namespace hil::buses::can
