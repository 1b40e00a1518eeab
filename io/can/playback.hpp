#pragma once
// Frames of other stations, from a log, which a CAN device puts on its bus at their times.
//
// Threads: one at a time. Neither allocates nor blocks.

#include <linux/can.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "io/can/assertion.hpp"
#include "io/can/frame.hpp"
#include "io/device.hpp"

namespace hil::io::can {

struct PlayedFrame {
  std::int64_t offset_ns = 0;  ///< from the begin of a round
  canfd_frame raw{};
  bool is_fd = false;
};

struct PlaybackConfig {
  std::string name;                                        ///< of the log, for texts
  std::shared_ptr<const std::vector<PlayedFrame>> frames;  ///< at least one; their offsets do not fall
  RunTimeNs begin_ns = 0;                                  ///< run time of the first round
  std::int64_t round_ns = 0;  ///< from one round to the next, at least the last offset; above 0 with rounds
  std::uint64_t rounds = 1;   ///< 0: without end
};

/// How far a playback has come.
struct PlaybackState {
  std::string name;
  std::uint64_t rounds = 0;  ///< that have begun
  std::uint64_t sent = 0;
  std::uint64_t unsent = 0;
  std::optional<RunTimeNs> first_ns{};  ///< of the first frame on the bus
  std::optional<RunTimeNs> last_ns{};   ///< of the last frame of all rounds
};

class Playback {
 public:
  /// A frame that still meets a full queue is given up when it is this late.
  static constexpr std::int64_t max_late_ns = 100'000'000;

  explicit Playback(PlaybackConfig config) : config_(std::move(config)) {
    require(config_.frames != nullptr && !config_.frames->empty(), "a playback has frames");
    require(config_.rounds == 1 || config_.round_ns > 0, "rounds of a playback take time");
  }

  const PlaybackConfig& config() const noexcept { return config_; }

  /// When the next frame is due, or is tried again; empty: there is none.
  std::optional<RunTimeNs> next_due_ns() const noexcept {
    if (is_over_) return std::nullopt;
    return std::max(due_ns(), retry_ns_);
  }
  /// The frame that is due; null: none is. Afterwards sent(), not_sent() or retry() for it.
  const PlayedFrame* due(RunTimeNs now_ns) const noexcept {
    const auto due_ns = next_due_ns();
    return due_ns && *due_ns <= now_ns ? &(*config_.frames)[index_] : nullptr;
  }
  /// It is on the bus.
  void sent(RunTimeNs now_ns) noexcept {
    ++state_.sent;
    if (!state_.first_ns) state_.first_ns = now_ns;
    advance(now_ns);
  }
  void not_sent(RunTimeNs now_ns) noexcept {
    ++state_.unsent;
    advance(now_ns);
  }
  /// The queue is full. False: it is given up.
  bool retry(RunTimeNs now_ns) noexcept {
    if (now_ns - due_ns() > max_late_ns) {
      not_sent(now_ns);
      return false;
    }
    retry_ns_ = now_ns + retry_after_ns;
    return true;
  }
  /// No further frame is due.
  void end() noexcept { is_over_ = true; }

  /// A frame has been on the bus.
  bool has_begun() const noexcept { return state_.first_ns.has_value(); }
  /// All rounds are over.
  bool is_complete() const noexcept { return state_.last_ns.has_value(); }
  PlaybackState state() const {
    PlaybackState state = state_;
    state.name = config_.name;
    return state;
  }

 private:
  static constexpr std::int64_t retry_after_ns = 500'000;

  RunTimeNs due_ns() const noexcept { return begin_ns_ + (*config_.frames)[index_].offset_ns; }
  void advance(RunTimeNs now_ns) noexcept {
    if (index_ == 0) ++state_.rounds;
    if (++index_ < config_.frames->size()) return;
    index_ = 0;
    begin_ns_ += config_.round_ns;
    if (config_.rounds == 0 || state_.rounds < config_.rounds) return;
    is_over_ = true;
    state_.last_ns = now_ns;
  }

  const PlaybackConfig config_;
  std::size_t index_ = 0;
  RunTimeNs begin_ns_ = config_.begin_ns;  ///< of this round
  RunTimeNs retry_ns_ = std::numeric_limits<RunTimeNs>::min();
  bool is_over_ = false;
  PlaybackState state_;
};

}  // namespace hil::io::can
