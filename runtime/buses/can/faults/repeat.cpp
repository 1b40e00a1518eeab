// repeat: each frame of a message comes several times.

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class RepeatedFrames final : public AnyFrameFault {
 public:
  explicit RepeatedFrames(std::uint32_t copies) : copies_(copies) {}
  io::can::FrameAction act(io::can::Frame& /*frame*/, bool /*is_active*/,
                           const io::can::MessageLayout* /*layout*/) override {
    return {.copies = copies_};
  }

 private:
  const std::uint32_t copies_;
};

class RepeatMessageFault final : public MessageFault {
 public:
  explicit RepeatMessageFault(std::uint32_t copies) : copies_(copies) {}
  std::string sentence() const override {
    return "with each frame " + std::to_string(copies_) + (copies_ == 1 ? " more time" : " more times");
  }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<RepeatedFrames>(copies_);
  }

  const std::uint32_t copies_;
};

config::Schema repeat_schema() {
  return config::Schema::integer(1, 100);
}

std::shared_ptr<const config::FaultEffect> read_repeat(const config::Value& value,
                                                       const config::FaultContext& /*context*/) {
  return std::make_shared<const RepeatMessageFault>(static_cast<std::uint32_t>(value.integer()));
}

}  // namespace

config::FaultKind repeat_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "repeat",
          .about = "Of a message: how many more times each frame comes.",
          .schema = repeat_schema,
          .read = read_repeat};
}

}  // namespace hil::buses::can
