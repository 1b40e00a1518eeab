#pragma once
// Frames of a log and the times at which a CAN device sends them, as frames of other stations.
//
// Threads: one at a time. All functions except the constructor and state() neither allocate nor block.

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
  std::int64_t offset_ns = 0;  ///< from the start of a pass
  canfd_frame raw{};
  bool is_fd = false;
  bool is_unknown = false;  ///< the database has no message with its identifier
};

struct PlaybackConfig {
  std::string name;                                        ///< of the log, for texts
  std::shared_ptr<const std::vector<PlayedFrame>> frames;  ///< at least one; non-decreasing offsets
  RunTimeNs begin_ns = 0;                                  ///< run time at which the first pass starts
  /// From the start of a pass to that of the next one: at least the last offset, and above 0 unless there is
  /// one pass.
  std::int64_t pass_period_ns = 0;
  std::uint64_t passes = 1;  ///< how often the log is played; 0: without end
};

/// How far a playback has come.
struct PlaybackState {
  std::string name;
  std::uint64_t passes = 0;             ///< that have started
  std::uint64_t sent = 0;               ///< also frames that a fault then drops or delays
  std::uint64_t sent_unknown = 0;       ///< of `sent`: is_unknown
  std::uint64_t dropped = 0;            ///< frames that were due and not sent
  std::optional<RunTimeNs> first_ns{};  ///< when the first frame was sent
  std::optional<RunTimeNs> last_ns{};   ///< when the last frame of all passes was sent or dropped
};

class LogPlayback {
 public:
  /// The device drops a frame that the send queue has refused for longer than this.
  static constexpr std::int64_t max_late_ns = 100'000'000;

  explicit LogPlayback(PlaybackConfig config) : config_(std::move(config)) {
    require(config_.frames != nullptr && !config_.frames->empty(), "a playback has frames");
    require(config_.passes == 1 || config_.pass_period_ns > 0, "passes of a playback take time");
  }

  const PlaybackConfig& config() const noexcept { return config_; }

  /// When the next frame is due, or is tried again; empty: there is none.
  std::optional<RunTimeNs> next_due_ns() const noexcept {
    if (has_ended_) return std::nullopt;
    return std::max(due_ns(), retry_ns_);
  }
  /// The frame that is due; null: none is. The caller then reports the result by sent(), drop() or retry().
  const PlayedFrame* due(RunTimeNs now_ns) const noexcept {
    const auto due_ns = next_due_ns();
    return due_ns && *due_ns <= now_ns ? &(*config_.frames)[index_] : nullptr;
  }
  void sent(RunTimeNs now_ns) noexcept {
    ++state_.sent;
    if ((*config_.frames)[index_].is_unknown) ++state_.sent_unknown;
    if (!state_.first_ns) state_.first_ns = now_ns;
    advance(now_ns);
  }
  void drop(RunTimeNs now_ns) noexcept {
    ++state_.dropped;
    advance(now_ns);
  }
  /// The send queue is full. False: the frame was dropped.
  bool retry(RunTimeNs now_ns) noexcept {
    if (now_ns - due_ns() > max_late_ns) {
      drop(now_ns);
      return false;
    }
    retry_ns_ = now_ns + retry_after_ns;
    return true;
  }
  /// The next frame is the first one of a pass.
  bool is_at_begin() const noexcept { return index_ == 0; }
  /// No further frame is due.
  void cancel() noexcept { has_ended_ = true; }

  /// A frame was sent.
  bool has_begun() const noexcept { return state_.first_ns.has_value(); }
  /// All frames of all passes were sent or dropped.
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
    if (index_ == 0) ++state_.passes;
    if (++index_ < config_.frames->size()) return;
    index_ = 0;
    begin_ns_ += config_.pass_period_ns;
    if (config_.passes == 0 || state_.passes < config_.passes) return;
    has_ended_ = true;
    state_.last_ns = now_ns;
  }

  const PlaybackConfig config_;
  std::size_t index_ = 0;
  RunTimeNs begin_ns_ = config_.begin_ns;  ///< of this pass
  RunTimeNs retry_ns_ = std::numeric_limits<RunTimeNs>::min();
  bool has_ended_ = false;
  PlaybackState state_;
};

}  // namespace hil::io::can
