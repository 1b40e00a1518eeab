// drop: a share of the frames of a message is lost.

#include <random>

#include <hil/numbers.hpp>

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class DroppedFrames final : public AnyFrameFault {
 public:
  DroppedFrames(double share, std::uint64_t seed) : share_(share), random_(seed) {}
  io::can::FrameAction act(io::can::Frame& /*frame*/, bool /*is_active*/,
                           const io::can::MessageLayout* /*layout*/) override {
    // Drawn for each frame, so that the numbers do not depend on when the fault is active.
    const bool is_dropped = static_cast<double>(random_() >> 11U) * 0x1.0p-53 < share_;
    return {.acts = is_dropped, .drops = is_dropped};
  }

 private:
  const double share_;
  std::mt19937_64 random_;
};

class DropMessageFault final : public MessageFault {
 public:
  explicit DropMessageFault(double share) : share_(share) {}
  std::string sentence() const override {
    return "without " + config::format_number(100.0 * share_) + " % of its frames";
  }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t seed) const override {
    return std::make_unique<DroppedFrames>(share_, seed);
  }

  const double share_;
};

config::Schema drop_schema() {
  return config::Schema::quantity(config::Quantity::share, 0.0, 1.0);
}

std::shared_ptr<const config::FaultEffect> read_drop(const config::Value& value,
                                                     const config::FaultContext& context) {
  return std::make_shared<const DropMessageFault>(
      config::read_fault_share(value, "drop", context.diagnostics));
}

}  // namespace

config::FaultKind drop_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "drop",
          .about = "Of a message: the share of its frames that is lost, from the run's seed.",
          .schema = drop_schema,
          .read = read_drop};
}

}  // namespace hil::buses::can
