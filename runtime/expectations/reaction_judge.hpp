#pragma once
// Judges whether each time that one condition becomes true another one is true in time.
//
// A reaction begins at each instant at which `when` becomes true, and at the first one if it is true there.
// It is in time when `then` is true at an instant from its begin to `within` after it, both included, and
// stays true for `for_at_least` from there on. Where `then` is true in time, but never for that long, it is
// too short. Nobody knows of a reaction whether it was in time where `then` was true or unknown for long
// enough, and was not known to be true for long enough; it is not judged, as one whose time has not passed
// when the run ends. At most 65536 reactions are open; beyond that the oldest is not judged.
//
// The margin is the smallest of these:
// - of each reaction, `within` minus the time to `then`, up to the end of the run if `then` never came;
// - of each one whose `then` became false again, the time that `then` stayed true minus `for_at_least`.
// `then` stays true from the first instant at which it counts to the last one.
//
// Threads: as Judge.

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/expectations/judge.hpp"
#include "runtime/expectations/watched_condition.hpp"

namespace hil::expectations {

/// Each time that `when` becomes true, `then` is true within the time.
struct Reaction {
  config::Expression when;
  config::Expression then;
  std::int64_t within_ns = 0;
  std::uint64_t at_least = 1;  ///< with fewer judged reactions, not checked
  std::int64_t hold_ns = 0;    ///< for which `then` stays true; 0: one instant suffices
};

class ReactionJudge final : public Judge {
 public:
  /// Keeps the times of the first million reactions. Further ones are judged, too.
  ReactionJudge(const Reaction& claim, const JudgeContext& context);

  void check(const signals::SignalTable& table, signals::Instant instant) noexcept override;
  void skip(const signals::SignalTable& table, signals::Instant instant) noexcept override;
  void check_unplaced(const signals::SignalTable& table, signals::Instant instant,
                      bool in_gap) noexcept override;
  report::Expectation result(const Extent& extent) const override;
  std::optional<report::ResponseTime> response_times(std::int64_t end_ns) const override;

 private:
  struct OpenReaction {
    std::int64_t begin_ns = 0;
    std::uint64_t evaluated_before = 0;  ///< evaluated ticks before the begin
    std::int64_t came_ns = 0;     ///< start of the longest true phase of `then` that began within `within`
    std::int64_t stayed_ns = -1;  ///< length of this phase; -1: there was none
    std::int64_t ended_ns = 0;    ///< the first instant after this phase
    bool may_be_in_time = false;  ///< in a phase that has ended, in which `then` was true or unknown
  };
  OpenReaction& oldest() noexcept { return open_[first_ % open_.size()]; }
  /// The greatest number of reactions that may be open, before the limit.
  static std::uint64_t max_at_once(const Reaction& claim, const JudgeContext& context);
  void begin(std::int64_t time_ns) noexcept;
  /// `then` is true: completes those that it has followed for long enough.
  void complete(std::int64_t time_ns) noexcept;
  /// Ends those whose time has ended before, and to which `then` is not responding.
  void end_before(std::int64_t time_ns) noexcept;
  /// `then` was true up to the instant before.
  void note_then_ended(std::int64_t time_ns) noexcept;
  /// `then` is false, and was true or unknown up to the instant before.
  void note_possible_then_ended() noexcept;
  /// Notes the phase of `then`, and ends the reactions whose time has ended before.
  void follow(std::int64_t time_ns, Truth then) noexcept;
  /// After follow: completes those that are in time, or ends those whose time ends now.
  void conclude(std::int64_t time_ns, Truth then) noexcept;
  /// Whether `then` may have been true for long enough after the begin, in the phase at possible_since_ns_.
  bool may_be_in_time(const OpenReaction& reaction) const noexcept;
  void note_margin(std::int64_t begin_ns, std::int64_t margin_ns) noexcept;
  std::string figures() const;

  const std::string name_;
  std::vector<WatchedCondition> conditions_;  ///< when, then
  Coverage coverage_;
  const std::int64_t within_ns_;
  const std::uint64_t at_least_;
  const std::int64_t hold_ns_;
  std::vector<OpenReaction> open_;  ///< a ring, the oldest first
  std::uint64_t first_ = 0, end_ = 0;
  std::uint64_t in_time_ = 0, late_ = 0, too_short_ = 0;
  std::uint64_t unknown_ = 0;                           ///< not judged, since `then` was unknown
  std::uint64_t not_judged_ = 0;                        ///< since there were too many at once
  std::int64_t slowest_ns_ = 0, slowest_begin_ns_ = 0;  ///< of those in time
  OpenReaction shortest_;                               ///< of those that were too short
  std::int64_t margin_ns_ = std::numeric_limits<std::int64_t>::max(), worst_begin_ns_ = 0;  ///< of all
  std::optional<std::int64_t> late_begin_ns_;      ///< of the oldest late one that `then` has not followed
  std::optional<std::int64_t> then_since_ns_;      ///< `then` is true since
  std::int64_t then_last_ns_ = 0;                  ///< the last instant at which it was true
  std::optional<std::int64_t> possible_since_ns_;  ///< `then` has been true or unknown since
  std::int64_t possible_last_ns_ = 0;              ///< the last instant at which it was true or unknown
  /// Begin of the reaction that `then` completed last, and since when `then` is true; empty when it is false.
  std::optional<std::int64_t> completed_begin_ns_, completed_since_ns_;
  std::optional<std::int64_t> first_failure_ns_;
  std::vector<std::int64_t> times_ns_;
};

void check_claim(const Reaction& claim, const ClaimCheck& check);
std::vector<signals::SignalId> judged_arrivals_of(const Reaction& claim, const signals::SignalTable& table);
std::unique_ptr<Judge> judge_of(const Reaction& claim, const JudgeContext& context);
PlotContent plot_content_of(const Reaction& claim, const signals::SignalTable& table);

config::ExpectationKind reaction_kind();

}  // namespace hil::expectations
