// The counters of a CAN device, as one record.

#include <algorithm>
#include <iterator>

#include "io/can/can_device.hpp"

namespace hil::io::can {

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
  all.lost_arrivals = arrivals_.lost();
  all.bus_load = load_.latest();
  all.bus_load_peak = load_.peak();
  all.bus_load_mean = load_.mean();
  return all;
}

std::vector<LengthCounts> CanDevice::other_lengths() const {
  std::vector<LengthCounts> all;
  for (const Received& received : received_) {
    const LengthCounts counts{received.message, received.counts->longer.get(),
                              received.counts->shorter.get()};
    if (counts.longer + counts.shorter > 0) all.push_back(counts);
  }
  return all;
}

std::vector<RejectionCounts> CanDevice::rejections() const {
  std::vector<RejectionCounts> all;
  for (const Received& received : received_) {
    const ReceivedCounts& counts = *received.counts;
    const RejectionCounts rejections{received.message, counts.bad_checksum.get(), counts.bad_counter.get(),
                                     counts.wrong_kind.get(), counts.rejected_by_scenario.get()};
    if (rejections.bad_checksum + rejections.bad_counter + rejections.wrong_kind > 0)
      all.push_back(rejections);
  }
  return all;
}

std::uint64_t CanDevice::faulted_values(std::size_t input) const noexcept {
  const auto next = std::ranges::upper_bound(received_, input, {}, &Received::first_input);
  require(next != received_.begin(), "an input of a received message");
  const Received& received = *std::prev(next);
  return received.counts->faulted_values[input - received.first_input].get();
}

RejectedFrames CanDevice::rejected(std::size_t group) const noexcept {
  const ReceivedCounts& counts = *received_[received_of_group_[group]].counts;
  return {counts.bad_checksum.get() + counts.bad_counter.get() + counts.wrong_kind.get(),
          counts.rejected_by_scenario.get()};
}

}  // namespace hil::io::can
