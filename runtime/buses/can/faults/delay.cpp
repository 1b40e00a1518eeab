// delay: each frame of a message comes later.

#include <hil/quantity.hpp>

#include "runtime/buses/can/can_fault.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::buses::can {
namespace {

class DelayedFrames final : public AnyFrameFault {
 public:
  explicit DelayedFrames(std::int64_t delay_ns) : delay_ns_(delay_ns) {}
  io::can::FrameAction act(io::can::Frame& /*frame*/, bool /*is_active*/,
                           const io::can::MessageLayout* /*layout*/) override {
    return {.delay_ns = delay_ns_};
  }

 private:
  const std::int64_t delay_ns_;
};

class DelayMessageFault final : public MessageFault {
 public:
  explicit DelayMessageFault(std::int64_t delay_ns) : delay_ns_(delay_ns) {}
  std::string sentence() const override { return "delayed by " + config::format_duration(delay_ns_); }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<DelayedFrames>(delay_ns_);
  }

  const std::int64_t delay_ns_;
};

config::Schema delay_schema() {
  return config::duration_schema(config::min_duration_s, config::max_fault_delay_s);
}

std::shared_ptr<const config::FaultEffect> read_delay(const config::Value& value,
                                                      const config::FaultContext& /*context*/) {
  return std::make_shared<const DelayMessageFault>(value.duration_ns());
}

}  // namespace

config::FaultKind delay_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "delay",
          .about = "a frame of a message",
          .schema = delay_schema,
          .read = read_delay};
}

}  // namespace hil::buses::can
