#include "runtime/run/device_watch.hpp"

namespace hil::run {

DeviceWatch::DeviceWatch(const std::vector<const io::Device*>& devices) {
  for (const io::Device* device : devices)
    watched_.push_back({.device = device, .connected = true, .faulty = false});
}

void DeviceWatch::look(std::int64_t run_time_ns,
                       const std::function<void(bool good, const std::string&)>& tell) {
  for (Watched& watched : watched_) {
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

}  // namespace hil::run
