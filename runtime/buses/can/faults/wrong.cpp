// wrong: the counter of a message stands still, with the right checksum; or its checksum is inverted.

#include <optional>

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class WrongCounters final : public DescribedFrameFault {
 public:
  std::string problem(const io::can::MessageLayout& layout) const override {
    return layout.counter() ? "" : "the scenario names no counter of this message";
  }
  io::can::FrameAction act(io::can::Frame& frame, bool is_active,
                           const io::can::MessageLayout* layout) override {
    const io::can::SignalCodec& counter = layout->codec(*layout->counter());
    if (!counter.is_whole_in(frame.raw.len)) return {};
    if (!is_active || !last_counter_) last_counter_ = counter.extract(frame.payload());
    if (!is_active) return {};
    counter.insert(io::can::payload_of(frame), *last_counter_);
    io::can::correct_checksum(*layout, frame);
    return {};
  }

 private:
  std::optional<std::uint64_t> last_counter_{};  ///< before the fault
};

class WrongChecksums final : public DescribedFrameFault {
 public:
  std::string problem(const io::can::MessageLayout& layout) const override {
    return layout.checksum() ? "" : "the scenario names no checksum of this message";
  }
  io::can::FrameAction act(io::can::Frame& frame, bool is_active,
                           const io::can::MessageLayout* layout) override {
    const io::can::SignalCodec& checksum = layout->codec(*layout->checksum());
    if (is_active && checksum.is_whole_in(frame.raw.len))
      checksum.insert(io::can::payload_of(frame), checksum.extract(frame.payload()) ^ checksum.mask());
    return {};
  }
};

class WrongCounterFault final : public MessageFault {
 public:
  std::string sentence() const override { return "with a counter that stands still"; }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<WrongCounters>();
  }
};

class WrongChecksumFault final : public MessageFault {
 public:
  std::string sentence() const override { return "with a wrong checksum"; }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<WrongChecksums>();
  }
};

config::Schema wrong_schema() {
  return config::Schema::one_of({"counter", "checksum"});
}

std::shared_ptr<const config::FaultEffect> read_wrong(const config::Value& value,
                                                      const config::FaultContext& /*context*/) {
  if (value.text() == "counter") return std::make_shared<const WrongCounterFault>();
  return std::make_shared<const WrongChecksumFault>();
}

}  // namespace

config::FaultKind wrong_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "wrong",
          .about =
              "Of a message: its counter keeps its last value, with the right checksum; or all bits of its "
              "checksum are inverted.",
          .schema = wrong_schema,
          .read = read_wrong};
}

}  // namespace hil::buses::can
