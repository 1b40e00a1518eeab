// length: the frames of a message have another number of bytes; further ones are zero.

#include <algorithm>
#include <cstring>

#include "runtime/buses/can/can_fault.hpp"

namespace hil::buses::can {
namespace {

class FramesOfLength final : public io::can::FrameFault {
 public:
  explicit FramesOfLength(std::uint32_t bytes) : bytes_(bytes) {}

  std::string problem(const io::can::MessageLayout& layout) const override {
    if (!io::can::valid_length(bytes_, layout.is_fd())) return no_frame(layout.is_fd());
    return bytes_ == layout.frame_length() ? no_change() : "";
  }
  std::string played_problem(std::span<const io::can::PlayedFrame> of_identifier) const override {
    const bool is_fd = std::ranges::max(of_identifier, {}, [](const auto& one) { return one.raw.len; }).is_fd;
    if (!io::can::valid_length(bytes_, is_fd)) return no_frame(is_fd);
    const bool all_have_it =
        std::ranges::all_of(of_identifier, [&](const auto& one) { return one.raw.len == bytes_; });
    return all_have_it ? no_change() : "";
  }
  io::can::FrameAction act(io::can::Frame& frame, bool is_active,
                           const io::can::MessageLayout* /*layout*/) override {
    if (!is_active) return {};
    if (bytes_ > frame.raw.len) std::memset(frame.raw.data + frame.raw.len, 0, bytes_ - frame.raw.len);
    frame.raw.len = static_cast<std::uint8_t>(bytes_);
    return {};
  }

 private:
  std::string no_frame(bool is_fd) const {
    return "no " + std::string(is_fd ? "CAN FD" : "classic CAN") + " frame has " + std::to_string(bytes_) +
           " bytes";
  }
  std::string no_change() const {
    return "all its frames already have a length of " + std::to_string(bytes_) + "; give another";
  }

  const std::uint32_t bytes_;
};

class LengthMessageFault final : public MessageFault {
 public:
  explicit LengthMessageFault(std::uint32_t bytes) : bytes_(bytes) {}
  std::string sentence() const override { return "with frames of " + std::to_string(bytes_) + " bytes"; }

 private:
  std::unique_ptr<io::can::FrameFault> make(std::uint64_t /*seed*/) const override {
    return std::make_unique<FramesOfLength>(bytes_);
  }

  const std::uint32_t bytes_;
};

config::Schema length_schema() {
  return config::Schema::integer(0, 64);
}

std::shared_ptr<const config::FaultEffect> read_length(const config::Value& value,
                                                       const config::FaultContext& /*context*/) {
  return std::make_shared<const LengthMessageFault>(static_cast<std::uint32_t>(value.integer()));
}

}  // namespace

config::FaultKind length_can_fault() {
  return {.target = config::FaultTarget::message,
          .key = "length",
          .about = "Of a message: the bytes of its frames; further ones are zero.",
          .schema = length_schema,
          .read = read_length};
}

}  // namespace hil::buses::can
