// flip_bits: bits of the payload are inverted; a checksum is not corrected.

#include <algorithm>

#include "runtime/buses/can/can_fault.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::buses::can {
namespace {

using Bits = std::vector<std::uint32_t>;  ///< 8 * byte + bit

class FlippedFrames final : public io::can::FrameFault {
 public:
  explicit FlippedFrames(Bits bits) : bits_(std::move(bits)) {}

  std::string problem(const io::can::MessageLayout& layout) const override {
    const std::size_t count = 8 * layout.frame_length();
    for (const std::uint32_t bit : bits_) {
      if (bit >= count)
        return "bit " + std::to_string(bit) + " is not in its frames, which have the bits 0 to " +
               std::to_string(count - 1);
    }
    return {};
  }
  std::string played_problem(std::span<const io::can::PlayedFrame> of_identifier) const override {
    const std::size_t count =
        8U * std::ranges::max(of_identifier, {}, [](const auto& one) { return one.raw.len; }).raw.len;
    for (const std::uint32_t bit : bits_) {
      if (bit >= count)
        return "bit " + std::to_string(bit) + " is not in its longest frame, which has " +
               (count == 0 ? "none" : "the bits 0 to " + std::to_string(count - 1));
    }
    return {};
  }
  io::can::FrameAction act(io::can::Frame& frame, bool is_active,
                           const io::can::MessageLayout* /*layout*/) override {
    for (const std::uint32_t bit : bits_) {
      if (is_active && bit < 8U * frame.raw.len)
        frame.raw.data[bit / 8] = static_cast<std::uint8_t>(frame.raw.data[bit / 8] ^ (1U << (bit % 8)));
    }
    return {};
  }

 private:
  const Bits bits_;
};

class FlipBitsMessageFault final : public MessageFault {
 public:
  explicit FlipBitsMessageFault(Bits bits) : bits_(std::move(bits)) {}
  std::string sentence() const override {
    std::vector<std::string> numbers;
    for (const std::uint32_t bit : bits_)
      numbers.push_back(std::to_string(bit));
    return (numbers.size() == 1 ? "with inverted bit " : "with inverted bits ") + config::text_list(numbers);
  }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<FlippedFrames>(bits_);
  }

  const Bits bits_;
};

config::Schema flip_bits_schema() {
  return config::Schema::list(config::Schema::integer(0, 511), 1, 512);
}

std::shared_ptr<const config::FaultEffect> read_flip_bits(const config::Value& value,
                                                          const config::FaultContext& context) {
  Bits bits;
  for (const config::Value& bit : value.items()) {
    const auto number = static_cast<std::uint32_t>(bit.integer());
    if (std::ranges::find(bits, number) != bits.end())
      context.diagnostics.add(bit.place(), "'flip_bits': bit " + std::to_string(number) + " is listed twice");
    bits.push_back(number);
  }
  return std::make_shared<const FlipBitsMessageFault>(std::move(bits));
}

}  // namespace

config::FaultKind flip_bits_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "flip_bits",
          .about =
              "Of a message: the bits of its payload that are inverted, as 8 * byte + bit; a checksum is "
              "not corrected.",
          .schema = flip_bits_schema,
          .read = read_flip_bits};
}

}  // namespace hil::buses::can
