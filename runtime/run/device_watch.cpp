#include "runtime/run/device_watch.hpp"

#include <algorithm>
#include <utility>

namespace hil::run {

DeviceWatch::DeviceWatch(std::vector<Subject> subjects, Causes causes) : causes_(causes) {
  for (Subject& subject : subjects)
    watched_.push_back({.subject = std::move(subject), .connected = true, .faulty = false});
}

void DeviceWatch::check(std::int64_t run_time_ns,
                        const std::function<void(bool is_expected, const std::string&)>& report) {
  for (Watched& watched : watched_) {
    collect_events(watched, report);
    const bool connected = watched.subject.device->connected();
    const std::string fault = watched.subject.device->fault();
    const bool faulty = !fault.empty();
    if (connected == watched.connected && faulty == watched.faulty) continue;
    watched.connected = connected;
    watched.faulty = faulty;
    const bool works = connected && !faulty;
    std::string sentence = watched.subject.name;
    sentence += works       ? " works again"
                : connected ? " has a fault"
                : faulty    ? " is lost"
                            : " is not connected";
    const std::string with_cause = faulty ? sentence + ": " + fault : sentence;
    events_.push_back({run_time_ns, causes_ == Causes::in_events ? with_cause : sentence});
    report(works, with_cause);
  }
}

void DeviceWatch::collect_last_events(
    const std::function<void(bool is_expected, const std::string&)>& report) {
  for (Watched& watched : watched_)
    collect_events(watched, report);
}

void DeviceWatch::collect_events(Watched& watched,
                                 const std::function<void(bool is_expected, const std::string&)>& report) {
  for (io::DeviceEvent& event : watched.subject.device->events_since(watched.events)) {
    ++watched.events;
    // An event from before the run is listed at its beginning.
    const std::int64_t time_ns = std::max<io::RunTimeNs>(event.time_ns, 0);
    report(event.is_expected, event.text);
    events_.push_back({time_ns, std::move(event.text)});
  }
}

}  // namespace hil::run
