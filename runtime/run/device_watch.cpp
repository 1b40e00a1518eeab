#include "runtime/run/device_watch.hpp"

#include <algorithm>

namespace hil::run {

DeviceWatch::DeviceWatch(const std::vector<const io::Device*>& devices) {
  for (const io::Device* device : devices)
    watched_.push_back({.device = device, .connected = true, .faulty = false});
}

void DeviceWatch::look(std::int64_t run_time_ns,
                       const std::function<void(bool good, const std::string&)>& tell) {
  for (Watched& watched : watched_) {
    take_events(watched, [&](const std::string& sentence) { tell(false, sentence); });
    const io::DeviceHealth health = watched.device->health();
    const bool faulty = !health.fault.empty();
    if (health.connected == watched.connected && faulty == watched.faulty) continue;
    watched.connected = health.connected;
    watched.faulty = faulty;
    const bool good = health.connected && !faulty;
    std::string sentence = "device " + watched.device->name();
    sentence += good               ? " works again"
                : health.connected ? " has a fault"
                : faulty           ? " is lost"
                                   : " is not connected";
    if (faulty) sentence += ": " + health.fault;
    events_.push_back({run_time_ns, sentence});
    tell(good, sentence);
  }
}

void DeviceWatch::take_last_events(const std::function<void(const std::string&)>& tell) {
  for (Watched& watched : watched_)
    take_events(watched, tell);
}

void DeviceWatch::take_events(Watched& watched, const std::function<void(const std::string&)>& tell) {
  for (io::DeviceEvent& event : watched.device->events_since(watched.events)) {
    ++watched.events;
    // An event from before the run is listed at its beginning.
    const std::int64_t time_ns = std::max<io::RunTimeNs>(event.time_ns, 0);
    tell(event.text);
    events_.push_back({time_ns, std::move(event.text)});
  }
}

}  // namespace hil::run
