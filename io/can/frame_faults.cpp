#include "io/can/frame_faults.hpp"

#include <algorithm>
#include <utility>

namespace hil::io::can {

void correct_checksum(const MessageLayout& layout, Frame& frame) {
  if (!layout.checksum()) return;
  const SignalCodec& checksum = layout.codec(*layout.checksum());
  if (checksum.is_whole_in(frame.raw.len))
    checksum.insert(payload_of(frame), layout.checksum_of(frame.payload()));
}

void FrameFaults::add(std::unique_ptr<FrameFault> fault, const MessageLayout& layout) {
  add(std::move(fault), &layout, layout.can_id());
}

void FrameFaults::add(std::unique_ptr<FrameFault> fault, canid_t identifier) {
  add(std::move(fault), nullptr, identifier);
}

void FrameFaults::add(std::unique_ptr<FrameFault> fault, const MessageLayout* layout, canid_t identifier) {
  faults_.push_back(std::make_unique<Fault>(std::move(fault), layout, faults_.size()));
  by_id_[identifier & id_mask].push_back(faults_.back().get());
}

void FrameFaults::add_bus_off() {
  faults_.push_back(std::make_unique<Fault>(nullptr, nullptr, faults_.size()));
}

bool FrameFaults::is_bus_off() const noexcept {
  return std::ranges::any_of(faults_,
                             [this](const auto& fault) { return fault->is_bus_off() && is_active(*fault); });
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
    if (!fault->is_bus_off() || !is_active(*fault)) continue;
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

void FrameFaults::pass_from(const std::vector<Fault*>& faults, std::size_t first, Frame frame,
                            RunTimeNs now_ns, bool differs) {
  const std::size_t acted_before = passage_.acted.size();
  for (std::size_t i = first; i < faults.size(); ++i) {
    Fault& fault = *faults[i];
    const bool active = is_active(fault);
    const FrameAction action = fault.frames->act(frame, active, fault.layout);
    if (!active) continue;
    fault.count.add();
    if (!action.acts) {
      fault.left_unchanged.store(true, std::memory_order_relaxed);
      continue;
    }
    if (action.drops) {
      note_dropped(faults, i);
      passage_.acted.resize(acted_before);
      return;
    }
    passage_.acted.push_back(&fault);
    for (std::uint32_t copy = 0; copy < action.copies; ++copy)
      pass_from(faults, i + 1, frame, now_ns, true);
    differs |= action.copies > 0;
    if (action.delay_ns > 0) {
      held_.emplace(now_ns + action.delay_ns, Held{frame, i + 1, passage_});
      passage_.acted.resize(acted_before);
      return;
    }
  }
  const bool is_changed = !frame.same_content(passage_.first);
  frame.is_altered |= is_changed;
  note_passed(differs || is_changed);
  passage_.acted.resize(acted_before);
  passed_.push_back(frame);
}

}  // namespace hil::io::can
