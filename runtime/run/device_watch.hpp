#pragma once
// Records when devices get lost and come back during a run, and collects the devices' own events, for the
// report.
//
// Threads: look from one ordinary thread; events after it has ended.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

class DeviceWatch {
 public:
  /// The devices outlive it.
  explicit DeviceWatch(const std::vector<const io::Device*>& devices);

  /// Compares each device's health with the last look, takes its events, and calls `tell` with a sentence for
  /// each change and event. The first look reports only what is lost.
  void look(std::int64_t run_time_ns, const std::function<void(bool good, const std::string&)>& tell);
  /// After the run: takes the events since the last look. Ignores the health of the devices, which are
  /// stopped.
  void take_last_events(const std::function<void(const std::string&)>& tell);
  /// All changes, with the run time of the look that saw them, and all events, with their own.
  const std::vector<report::Event>& events() const noexcept { return events_; }

 private:
  struct Watched {
    const io::Device* device;
    bool connected = true;
    bool faulty = false;
    std::size_t events = 0;  ///< taken so far
  };
  void take_events(Watched& watched, const std::function<void(const std::string&)>& tell);

  std::vector<Watched> watched_;
  std::vector<report::Event> events_;
};

}  // namespace hil::run
