#include "io/can/frame_faults.hpp"

#include <algorithm>
#include <cstring>

namespace hil::io::can {
namespace {

using FaultKind = InjectedFault::Kind;

constexpr std::int64_t max_delay_ns = 60'000'000'000;  // bounds the memory of held frames

std::span<std::uint8_t> payload_of(Frame& frame) {
  return {frame.raw.data, frame.raw.len};
}

/// The checksum that fits the payload, where the message has one.
void correct_checksum(const MessageLayout& layout, Frame& frame) {
  if (!layout.checksum()) return;
  const SignalCodec& checksum = layout.codec(*layout.checksum());
  if (checksum.is_whole_in(frame.raw.len))
    checksum.insert(payload_of(frame), layout.checksum_of(frame.payload()));
}

}  // namespace

std::string FrameFaults::problem(const InjectedFault& injected, const MessageLayout& layout) {
  switch (injected.kind) {
    case FaultKind::wrong_counter:
      if (!layout.counter()) return "the scenario names no counter of this message";
      break;
    case FaultKind::wrong_checksum:
      if (!layout.checksum()) return "the scenario names no checksum of this message";
      break;
    case FaultKind::length:
      if (!valid_length(injected.number, layout.is_fd()))
        return "no " + std::string(layout.is_fd() ? "CAN FD" : "classic CAN") + " frame has " +
               std::to_string(injected.number) + " bytes";
      if (injected.number == layout.frame_length())
        return "all its frames already have a length of " + std::to_string(injected.number) +
               "; give another";
      break;
    case FaultKind::flip_bits:
      for (const std::uint32_t bit : injected.bits) {
        if (bit >= 8 * layout.frame_length())
          return "bit " + std::to_string(bit) + " is not in its frames, which have the bits 0 to " +
                 std::to_string(8 * layout.frame_length() - 1);
      }
      break;
    case FaultKind::delay:
      if (injected.delay_ns > max_delay_ns) return "a frame can be delayed by at most 60 s";
      break;
    case FaultKind::drop:
    case FaultKind::repeat:
    case FaultKind::frozen:
      break;
    case FaultKind::bus_off:
    case FaultKind::silent:
    case FaultKind::disconnected:
    case FaultKind::exception:
      return "that is no fault of a message";
  }
  return {};
}

std::string FrameFaults::problem(const InjectedFault& injected, std::span<const PlayedFrame> of_identifier) {
  const auto longest =
      std::ranges::max(of_identifier, {}, [](const PlayedFrame& one) { return one.raw.len; });
  switch (injected.kind) {
    case FaultKind::length:
      if (!valid_length(injected.number, longest.is_fd))
        return "no " + std::string(longest.is_fd ? "CAN FD" : "classic CAN") + " frame has " +
               std::to_string(injected.number) + " bytes";
      if (std::ranges::all_of(of_identifier, [&](const auto& one) { return one.raw.len == injected.number; }))
        return "all its frames already have a length of " + std::to_string(injected.number) +
               "; give another";
      return {};
    case FaultKind::flip_bits:
      for (const std::uint32_t bit : injected.bits) {
        if (bit >= 8U * longest.raw.len)
          return "bit " + std::to_string(bit) + " is not in its longest frame, which has " +
                 (longest.raw.len == 0 ? "none" : "the bits 0 to " + std::to_string(8 * longest.raw.len - 1));
      }
      return {};
    case FaultKind::drop:
    case FaultKind::repeat:
    case FaultKind::delay:
      return {};
    default:
      return "only a message of the DBC file can be stuck or have a wrong counter or checksum";
  }
}

void FrameFaults::add(const InjectedFault& injected, const MessageLayout* layout,
                      std::optional<canid_t> identifier) {
  faults_.push_back(std::make_unique<Fault>(injected, layout));
  if (layout != nullptr) identifier = layout->can_id();
  if (identifier) by_id_[*identifier & id_mask].push_back(faults_.back().get());
}

bool FrameFaults::is_bus_off() const noexcept {
  return std::ranges::any_of(
      faults_, [this](const auto& fault) { return fault->is_of_device() && is_active(*fault); });
}

void FrameFaults::note_blocked_frame() noexcept {
  for (const auto& fault : faults_) {
    if (!fault->is_of_device() || !is_active(*fault)) continue;
    fault->count.add();
    fault->effects.add();
  }
}

std::span<const Frame> FrameFaults::pass(const Frame& frame, RunTimeNs now_ns) {
  passed_.clear();
  const auto of_message = by_id_.find(frame.raw.can_id & id_mask);
  if (of_message == by_id_.end()) {
    passed_.push_back(frame);
  } else {
    pass_from(of_message->second, 0, frame, now_ns);
  }
  return passed_;
}

std::span<const Frame> FrameFaults::take_due(RunTimeNs now_ns) {
  passed_.clear();
  while (!held_.empty() && held_.begin()->first <= now_ns) {
    const auto [due_ns, held] = *held_.begin();
    held_.erase(held_.begin());
    Frame frame = held.frame;
    frame.time_ns = due_ns;
    pass_from(by_id_.at(frame.raw.can_id & id_mask), held.next_fault, frame, now_ns);
  }
  return passed_;
}

std::optional<RunTimeNs> FrameFaults::next_due_ns() const noexcept {
  if (held_.empty()) return std::nullopt;
  return held_.begin()->first;
}

void FrameFaults::keep_counter(Fault& fault, bool active, Frame& frame) {
  const SignalCodec& counter = fault.layout->codec(*fault.layout->counter());
  if (!counter.is_whole_in(frame.raw.len)) return;
  if (!active || !fault.last_counter) fault.last_counter = counter.extract(frame.payload());
  if (!active) return;
  counter.insert(payload_of(frame), *fault.last_counter);
  correct_checksum(*fault.layout, frame);
}

void FrameFaults::keep_payload(Fault& fault, bool active, Frame& frame) {
  if (!active || !fault.last_frame) fault.last_frame = frame;
  if (!active) return;
  const Frame now = frame;
  frame.raw.len = fault.last_frame->raw.len;
  std::memcpy(frame.raw.data, fault.last_frame->raw.data, frame.raw.len);
  if (const auto counter = fault.layout->counter()) {
    const SignalCodec& codec = fault.layout->codec(*counter);
    if (codec.is_whole_in(now.raw.len) && codec.is_whole_in(frame.raw.len))
      codec.insert(payload_of(frame), codec.extract(now.payload()));
  }
  correct_checksum(*fault.layout, frame);
}

void FrameFaults::pass_from(const std::vector<Fault*>& faults, std::size_t first, Frame frame,
                            RunTimeNs now_ns) {
  for (std::size_t i = first; i < faults.size(); ++i) {
    Fault& fault = *faults[i];
    const InjectedFault& injected = fault.injected;
    const bool active = is_active(fault);
    const Frame before = frame;
    if (injected.kind == FaultKind::wrong_counter) keep_counter(fault, active, frame);
    if (injected.kind == FaultKind::frozen) keep_payload(fault, active, frame);
    // Drawn for each frame, so that one fault's numbers do not depend on when it is active.
    const bool is_chosen = static_cast<double>(fault.random() >> 11U) * 0x1.0p-53 < injected.share;
    if (!active) continue;
    fault.count.add();
    const bool acts_on_each = injected.kind == FaultKind::repeat || injected.kind == FaultKind::delay;
    if (acts_on_each || (injected.kind == FaultKind::drop && is_chosen)) fault.effects.add();
    switch (injected.kind) {
      case FaultKind::drop:
        if (is_chosen) return;
        break;
      case FaultKind::repeat:
        for (std::uint32_t copy = 0; copy < injected.number; ++copy)
          pass_from(faults, i + 1, frame, now_ns);
        break;
      case FaultKind::delay:
        held_.emplace(now_ns + injected.delay_ns, Held{frame, i + 1});
        return;
      case FaultKind::wrong_checksum: {
        const SignalCodec& checksum = fault.layout->codec(*fault.layout->checksum());
        if (checksum.is_whole_in(frame.raw.len))
          checksum.insert(payload_of(frame), checksum.extract(frame.payload()) ^ checksum.mask());
        break;
      }
      case FaultKind::length:
        if (injected.number > frame.raw.len)
          std::memset(frame.raw.data + frame.raw.len, 0, injected.number - frame.raw.len);
        frame.raw.len = static_cast<std::uint8_t>(injected.number);
        break;
      case FaultKind::flip_bits:
        for (const std::uint32_t bit : injected.bits) {
          if (bit < 8U * frame.raw.len)
            frame.raw.data[bit / 8] = static_cast<std::uint8_t>(frame.raw.data[bit / 8] ^ (1U << (bit % 8)));
        }
        break;
      default:  // wrong_counter and frozen have acted; the others are no faults of a message
        break;
    }
    if (!frame.same_content(before)) fault.effects.add();
  }
  passed_.push_back(frame);
}

}  // namespace hil::io::can
