// The frames of a log that a CAN device sends, and the events of its playback.

#include <algorithm>
#include <string>

#include "io/can/can_device.hpp"

namespace hil::io::can {

namespace {

constexpr std::size_t played_per_pass = 256;  // before received frames are processed again

}  // namespace

void CanDevice::play_due_frames() {
  if (!playback_) return;
  const RunTimeNs now = now_ns();
  const bool is_limited = pacing_ == Pacing::realtime;
  for (std::size_t count = 0; !is_limited || count < played_per_pass; ++count) {
    const PlayedFrame* const due = playback_->due(now);
    if (due == nullptr) return;
    if (playback_->is_at_begin()) discontinuous_ids_ = played_ids_;
    const canid_t identifier = due->raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK);
    const Frame frame{.raw = due->raw,
                      .is_fd = due->is_fd,
                      .direction = Direction::tx,
                      .is_discontinuous = discontinuous_ids_.contains(identifier)};
    switch (play(frame, now)) {
      case SendResult::sent:
        if (!playback_->has_begun()) note_event(now, "begins");
        discontinuous_ids_.erase(identifier);
        playback_->sent(now);
        break;
      case SendResult::no_buffer:
        if (playback_->retry(now)) return;
        discontinuous_ids_.insert(identifier);
        break;
      case SendResult::error:
        discontinuous_ids_.insert(identifier);
        playback_->drop(now);
        break;
    }
    if (playback_->is_complete()) note_event(now, "ends");
  }
}

SendResult CanDevice::play(const Frame& frame, RunTimeNs now_ns) {
  const canid_t identifier = frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK);
  if (!faults_.is_for(frame) || received_by_id_.contains(identifier)) return put_played_on_bus(frame, now_ns);
  std::optional<SendResult> first;  // empty: a fault drops or holds the frame
  for (const Frame& passed : faults_.pass(frame, now_ns)) {
    const SendResult result = put_played_on_bus(passed, now_ns);
    if (!first) first = result;
  }
  return first.value_or(SendResult::sent);
}

SendResult CanDevice::put_played_on_bus(const Frame& frame, RunTimeNs now_ns) {
  const SendResult result = bus_->send(frame);
  switch (result) {
    case SendResult::sent:
      counts_.played.add();
      full_since_ns_.reset();
      break;
    case SendResult::no_buffer:
      counts_.no_buffer.add();
      note_full_queue(now_ns);
      break;
    case SendResult::error:
      note_send_error("a frame of the log " + config_.playback->name);
      break;
  }
  return result;
}

bool CanDevice::is_played(const Frame& frame) const noexcept {
  if (!playback_) return false;
  return std::ranges::none_of(
      sent_, [&](const Sent& sent) { return sent.encoder.layout().can_id() == frame.raw.can_id; });
}

void CanDevice::note_event(RunTimeNs time_ns, const std::string& change) {
  const std::lock_guard lock(health_mutex_);
  events_.push_back(
      {time_ns, "log " + config_.playback->name + " " + change + " on CAN bus " + config_.name, true});
}

std::vector<DeviceEvent> CanDevice::events_since(std::size_t first) const {
  const std::lock_guard lock(health_mutex_);
  return {events_.begin() + static_cast<std::ptrdiff_t>(std::min(first, events_.size())), events_.end()};
}

}  // namespace hil::io::can
