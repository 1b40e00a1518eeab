#include "runtime/executive/host_pause_detector.hpp"

#include <algorithm>

namespace hil::executive {

void HostPauseDetector::note_sleep(std::int64_t wake_ns, std::int64_t now_ns,
                                   std::int64_t process_ran_ns) noexcept {
  const std::int64_t overslept_ns = now_ns - wake_ns;
  if (overslept_ns < smallest_pause_ns) return;
  // A part of that CPU time may have been used before the planned wake-up, or by several threads at once.
  const std::int64_t process_pause_ns = std::max<std::int64_t>(overslept_ns - process_ran_ns, 0);
  add({.begin_ns = wake_ns,
       .end_ns = now_ns,
       .length_ns = overslept_ns,
       .process_pause_ns = process_pause_ns});
}

void HostPauseDetector::note_steal(std::int64_t now_ns, std::int64_t steal_total_ns) noexcept {
  if (steal_known_ && steal_total_ns > steal_total_ns_) {
    const std::int64_t stolen_ns = std::min(steal_total_ns - steal_total_ns_, now_ns - steal_read_ns_);
    add({.begin_ns = steal_read_ns_, .end_ns = now_ns, .length_ns = stolen_ns, .stolen = true});
  }
  steal_known_ = true;
  steal_total_ns_ = steal_total_ns;
  steal_read_ns_ = now_ns;
}

void HostPauseDetector::add(const Pause& pause) noexcept {
  pauses_[next_] = pause;
  next_ = (next_ + 1) % max_pauses;
}

std::int64_t HostPauseDetector::pause_ns(std::int64_t begin_ns, std::int64_t end_ns,
                                         std::int64_t off_cpu_ns) const noexcept {
  std::int64_t longest_ns = 0, stolen_ns = 0;
  for (const Pause& pause : pauses_) {
    const std::int64_t overlap_ns = std::min(end_ns, pause.end_ns) - std::max(begin_ns, pause.begin_ns);
    if (overlap_ns <= 0 || off_cpu_ns * 2 < pause.length_ns) continue;
    const std::int64_t length_ns = std::min(overlap_ns, pause.length_ns);
    if (pause.stolen) {
      stolen_ns += length_ns;
    } else {
      longest_ns = std::max(longest_ns, length_ns);
    }
  }
  return std::min(std::max(longest_ns, stolen_ns), off_cpu_ns);
}

std::int64_t HostPauseDetector::process_pause_ns(std::int64_t begin_ns, std::int64_t end_ns) const noexcept {
  std::int64_t sum_ns = 0;
  for (const Pause& pause : pauses_) {
    if (pause.stolen) continue;  // the time may have been stolen from another processor
    const std::int64_t overlap_ns = std::min(end_ns, pause.end_ns) - std::max(begin_ns, pause.begin_ns);
    const std::int64_t ran_ns = pause.length_ns - pause.process_pause_ns;
    sum_ns += std::max<std::int64_t>(overlap_ns - ran_ns, 0);
  }
  return sum_ns;
}

}  // namespace hil::executive
