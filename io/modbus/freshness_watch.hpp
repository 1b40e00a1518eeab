#pragma once
// Detects in the tick that inputs grow older than their max_age, and adds the events outside the tick. An
// episode of an input ends when the input has been fresh for longer than max_age, which means that two
// successive values came in time. So a unit that is permanently too slow causes one event, not one per cycle.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "io/device.hpp"
#include "io/modbus/event_list.hpp"

namespace hil::io::modbus {

class FreshnessWatch {
 public:
  /// `max_age_ns` 0: inputs do not age.
  FreshnessWatch(std::size_t inputs, std::int64_t max_age_ns)
      : max_age_ns_(max_age_ns), states_(inputs), episodes_(capacity) {}

  /// Called by the tick's thread after each latch. Neither allocates nor locks. `samples`: one per input.
  void observe(std::span<const Sample> samples, RunTimeNs now_ns) noexcept {
    if (max_age_ns_ <= 0) return;
    Episode begun{now_ns, 0, 0};
    std::uint64_t went_stale = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      State& state = states_[i];
      if (samples[i].fresh) {
        if (!state.fresh) state.fresh_since_ns = now_ns;
        if (now_ns - state.fresh_since_ns > max_age_ns_) state.in_episode = false;
      } else if (state.fresh) {
        ++went_stale;
        if (!state.in_episode && begun.inputs++ == 0) begun.first_input = i;
        state.in_episode = true;
      }
      state.fresh = samples[i].fresh;
    }
    if (went_stale > 0) stale_.fetch_add(went_stale, std::memory_order_relaxed);
    if (begun.inputs == 0) return;
    const std::size_t at = begun_.load(std::memory_order_relaxed);
    if (at == episodes_.size()) return;
    episodes_[at] = begun;
    begun_.store(at + 1, std::memory_order_release);
  }

  /// How often an input went from fresh to stale. Any thread.
  std::uint64_t stale() const noexcept { return stale_.load(std::memory_order_relaxed); }

  /// Adds an event for each episode since the last call. Any ordinary thread. `device` begins the sentence
  /// ("Modbus unit plc"); `missed` says what was not done to the input ("was not read").
  void report(std::span<const ChannelInfo> inputs, const std::string& device, const std::string& missed,
              EventList& events) const {
    const std::scoped_lock lock(mutex_);
    for (const std::size_t end = begun_.load(std::memory_order_acquire); reported_ < end; ++reported_) {
      const Episode& episode = episodes_[reported_];
      std::string text = device + ": register " + inputs[episode.first_input].name;
      if (episode.inputs > 1) text += " (and " + std::to_string(episode.inputs - 1) + " more)";
      text += ' ' + missed + " for longer than its max_age of " + std::to_string(max_age_ns_ / 1'000'000) +
              " ms; it is stale and reads its safe value";
      events.add(episode.time_ns, std::move(text));
    }
  }

 private:
  static constexpr std::size_t capacity = EventList::capacity;
  /// The inputs whose episodes began in the same tick.
  struct Episode {
    RunTimeNs time_ns = 0;
    std::size_t first_input = 0;
    std::size_t inputs = 0;
  };
  struct State {
    bool fresh = false;
    bool in_episode = false;
    RunTimeNs fresh_since_ns = 0;
  };

  const std::int64_t max_age_ns_;
  std::vector<State> states_;
  std::vector<Episode> episodes_;
  std::atomic<std::size_t> begun_{0};
  std::atomic<std::uint64_t> stale_{0};
  mutable std::mutex mutex_;  ///< never locked by the tick
  mutable std::size_t reported_ = 0;
};

}  // namespace hil::io::modbus
