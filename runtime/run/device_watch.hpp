#pragma once
// Records for the report when devices become faulty or disconnected and when they recover, and collects the
// devices' own events.
//
// Threads: check from one thread, in real time an ordinary one; events after it has ended.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

class DeviceWatch {
 public:
  struct Subject {
    const io::Device* device = nullptr;  ///< outlives the watch
    std::string name;                    ///< with the noun of its type: "CAN bus car"
  };
  /// Whether events have the device's sentence on its fault. It may name a port or a folder that differs from
  /// run to run.
  enum class Causes : std::uint8_t { in_events, only_reported };
  DeviceWatch(std::vector<Subject> subjects, Causes causes);

  /// Compares each device's state with that of the last check, takes its events, and calls `report` with a
  /// sentence for each change and each event; `is_expected`: as in io::DeviceEvent, and of a device that
  /// works again. The first check reports only devices that are not connected or have a fault.
  void check(std::int64_t run_time_ns,
             const std::function<void(bool is_expected, const std::string&)>& report);
  /// After the run: takes the events since the last check. Ignores the state of the devices, which are
  /// stopped.
  void collect_last_events(const std::function<void(bool is_expected, const std::string&)>& report);
  /// All changes, with the run time of the check that found them, and all events, with their own time.
  const std::vector<report::Event>& events() const noexcept { return events_; }

 private:
  struct Watched {
    Subject subject;
    bool connected = true;
    bool faulty = false;
    std::size_t events = 0;  ///< taken so far
  };
  void collect_events(Watched& watched,
                      const std::function<void(bool is_expected, const std::string&)>& report);

  std::vector<Watched> watched_;
  const Causes causes_;
  std::vector<report::Event> events_;
};

}  // namespace hil::run
