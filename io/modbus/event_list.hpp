#pragma once
// A bounded list of a device's events, for its events_since. The last entry of a full list says that further
// events are not listed.

#include <mutex>
#include <string>
#include <vector>

#include "io/device.hpp"

namespace hil::io::modbus {

/// Threads: any, except the tick's in real time, since calls allocate and lock.
class EventList {
 public:
  static constexpr std::size_t capacity = 1000;

  void add(RunTimeNs time_ns, std::string text) {
    const std::scoped_lock lock(mutex_);
    if (events_.size() >= capacity) return;
    if (events_.size() + 1 == capacity) text = "further events of this unit are not listed (limit 1000)";
    events_.push_back({time_ns, std::move(text)});
  }
  /// The events from number `first` on, with times converted by `clock` (RunClock::to_run_time).
  std::vector<DeviceEvent> since(std::size_t first, const RunClock& clock) const {
    const std::scoped_lock lock(mutex_);
    std::vector<DeviceEvent> events;
    for (std::size_t i = first; i < events_.size(); ++i)
      events.push_back({clock.to_run_time(events_[i].time_ns), events_[i].text});
    return events;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<DeviceEvent> events_;
};

}  // namespace hil::io::modbus
