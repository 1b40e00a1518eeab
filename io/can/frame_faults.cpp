#include "io/can/frame_faults.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

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
  faults_.push_back(std::make_unique<Fault>(injected, layout, faults_.size()));
  if (layout != nullptr) identifier = layout->can_id();
  if (identifier) by_id_[*identifier & id_mask].push_back(faults_.back().get());
}

bool FrameFaults::is_bus_off() const noexcept {
  return std::ranges::any_of(
      faults_, [this](const auto& fault) { return fault->is_of_device() && is_active(*fault); });
}

std::optional<std::size_t> FrameFaults::stopped_by(std::size_t number) const noexcept {
  const Fault& fault = *faults_[number];
  const std::size_t other = fault.stopped_by.load(std::memory_order_relaxed);
  const bool is_all = fault.effects.get() == 0 && !fault.left_unchanged.load(std::memory_order_relaxed);
  return is_all && other != Fault::none ? std::optional(other) : std::nullopt;
}

void FrameFaults::note_blocked_frame(canid_t identifier) noexcept {
  const Fault* bus_off = nullptr;
  for (const auto& fault : faults_) {
    if (!fault->is_of_device() || !is_active(*fault)) continue;
    fault->count.add();
    fault->effects.add();
    bus_off = fault.get();
  }
  const auto of_message = by_id_.find(identifier & id_mask);
  if (bus_off == nullptr || of_message == by_id_.end()) return;
  for (Fault* const fault : of_message->second)
    if (is_active(*fault)) fault->stopped_by.store(bus_off->number, std::memory_order_relaxed);
}

void FrameFaults::note_dropped(const std::vector<Fault*>& faults, std::size_t by) noexcept {
  faults[by]->effects.add();
  for (Fault* const fault : passage_.acted)
    fault->stopped_by.store(faults[by]->number, std::memory_order_relaxed);
  for (std::size_t i = by + 1; i < faults.size(); ++i)
    if (is_active(*faults[i])) faults[i]->stopped_by.store(faults[by]->number, std::memory_order_relaxed);
}

void FrameFaults::note_passed(bool differs) noexcept {
  for (Fault* const fault : passage_.acted) {
    if (!differs) {
      fault->left_unchanged.store(true, std::memory_order_relaxed);
    } else if (std::exchange(fault->last_effect, passage_.number) != passage_.number) {
      fault->effects.add();  // once for all copies of a frame
    }
  }
}

void FrameFaults::end_all() noexcept {
  is_ended_ = true;
  for (auto& [due_ns, held] : held_) {
    passage_ = std::move(held.passage);
    note_passed(true);
  }
  held_.clear();
}

std::span<const Frame> FrameFaults::pass(const Frame& frame, RunTimeNs now_ns) {
  passed_.clear();
  const auto of_message = by_id_.find(frame.raw.can_id & id_mask);
  if (of_message == by_id_.end()) {
    passed_.push_back(frame);
  } else {
    passage_.first = frame;
    passage_.number = ++frames_;
    passage_.acted.clear();
    pass_from(of_message->second, 0, frame, now_ns, false);
  }
  return passed_;
}

std::span<const Frame> FrameFaults::take_due(RunTimeNs now_ns) {
  passed_.clear();
  while (!held_.empty() && held_.begin()->first <= now_ns) {
    const auto node = held_.extract(held_.begin());
    Held& held = node.mapped();
    held.frame.time_ns = node.key();
    passage_ = std::move(held.passage);
    pass_from(by_id_.at(held.frame.raw.can_id & id_mask), held.next_fault, held.frame, now_ns, true);
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
                            RunTimeNs now_ns, bool differs) {
  const std::size_t acted_before = passage_.acted.size();
  for (std::size_t i = first; i < faults.size(); ++i) {
    Fault& fault = *faults[i];
    const InjectedFault& injected = fault.injected;
    const bool active = is_active(fault);
    if (injected.kind == FaultKind::wrong_counter) keep_counter(fault, active, frame);
    if (injected.kind == FaultKind::frozen) keep_payload(fault, active, frame);
    // Drawn for each frame, so that one fault's numbers do not depend on when it is active.
    const bool is_chosen = static_cast<double>(fault.random() >> 11U) * 0x1.0p-53 < injected.share;
    if (!active) continue;
    fault.count.add();
    if (injected.kind == FaultKind::drop && !is_chosen) {
      fault.left_unchanged.store(true, std::memory_order_relaxed);
      continue;
    }
    if (injected.kind != FaultKind::drop) passage_.acted.push_back(&fault);
    switch (injected.kind) {
      case FaultKind::drop:
        note_dropped(faults, i);
        passage_.acted.resize(acted_before);
        return;
      case FaultKind::repeat:
        for (std::uint32_t copy = 0; copy < injected.number; ++copy)
          pass_from(faults, i + 1, frame, now_ns, true);
        differs = true;
        break;
      case FaultKind::delay:
        held_.emplace(now_ns + injected.delay_ns, Held{frame, i + 1, passage_});
        passage_.acted.resize(acted_before);
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
  }
  const bool is_changed = !frame.same_content(passage_.first);
  frame.is_altered |= is_changed;
  note_passed(differs || is_changed);
  passage_.acted.resize(acted_before);
  passed_.push_back(frame);
}

}  // namespace hil::io::can
