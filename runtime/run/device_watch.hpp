#pragma once
// Sees devices get lost and come back while a run goes on, so that the report can say when.
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

  /// Compares each device's health with the last look and calls `tell` with a sentence for each change. The
  /// first look tells only what is lost.
  void look(std::int64_t run_time_ns, const std::function<void(bool good, const std::string&)>& tell);
  /// All changes, with the run time of the look that saw them.
  const std::vector<report::Event>& events() const noexcept { return events_; }

 private:
  struct Watched {
    const io::Device* device;
    bool connected = true;
    bool faulty = false;
  };
  std::vector<Watched> watched_;
  std::vector<report::Event> events_;
};

}  // namespace hil::run
