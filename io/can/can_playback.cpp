// What a CAN device puts on its bus from a log, and what it counts and notes.

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

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
    const Frame frame{.raw = due->raw, .is_fd = due->is_fd};
    switch (bus_->send(frame)) {
      case SendResult::sent:
        counts_.played.add();
        full_since_ns_.reset();
        if (!playback_->has_begun()) note_event(now, "begins");
        playback_->sent(now);
        break;
      case SendResult::no_buffer:
        counts_.no_buffer.add();
        note_full_queue(now);
        if (playback_->retry(now)) return;
        break;
      case SendResult::error:
        counts_.send_errors.add();
        note_send_error("a frame of the log " + config_.playback->name);
        playback_->not_sent(now);
        break;
    }
    if (playback_->is_complete()) note_event(now, "ends");
  }
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

void CanDevice::note_send_error(const std::string& what) {
  const int error = bus_->send_error();
  const bool lost = error == ENETDOWN || error == ENODEV || error == ENXIO || error == ENOTCONN;
  if (lost && config_.may_be_lost) return;
  set_send_fault(what + " could not be sent on CAN bus '" + config_.name + "' (" + bus_->description() +
                 "): " + std::strerror(error));
}

CanCounters CanDevice::counters() const noexcept {
  CanCounters all;
  all.rx = counts_.rx.get();
  all.tx = counts_.tx.get();
  const BusCounters bus = bus_->counters();
  all.dropped = bus.dropped;
  all.injected = bus.injected;
  all.played = counts_.played.get();
  all.errors = counts_.errors.get();
  all.no_buffer = counts_.no_buffer.get();
  all.send_errors = counts_.send_errors.get();
  all.bad_checksum = counts_.bad_checksum.get();
  all.bad_counter = counts_.bad_counter.get();
  all.wrong_kind = counts_.wrong_kind.get();
  all.unknown_id = counts_.unknown_id.get();
  all.saturated = counts_.saturated.get();
  all.refused_values = counts_.refused_values.get();
  all.dropped_releases = counts_.dropped_releases.get();
  all.log_dropped = log_ ? log_->dropped() : 0;
  all.lost_arrivals = counts_.lost_arrivals.get();
  all.bus_load = load_.latest();
  all.bus_load_peak = load_.peak();
  all.bus_load_mean = load_.mean();
  return all;
}

std::vector<LengthCounts> CanDevice::other_lengths() const {
  std::vector<LengthCounts> all;
  for (const Received& received : received_) {
    const LengthCounts counts{received.message, received.longer->get(), received.shorter->get()};
    if (counts.longer + counts.shorter > 0) all.push_back(counts);
  }
  return all;
}

}  // namespace hil::io::can
