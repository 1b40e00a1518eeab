#pragma once
// The bodies that enter and leave a region between ticks: the events of a standing query
// (rtstdb/standing.hpp), up to the version that a step reads.
//
// Threads: constructed while the module is configured; all else in its step: nothing allocates or blocks.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <hil/event_log.hpp>
#include <hil/world/world_module.hpp>
#include <rtstdb/database.hpp>

namespace hil::modules {

class RegionCrossings {
 public:
  /// Watches the region under `name`, which the text of an event has if crossings are lost. Throws
  /// SetupError, whose sentence begins with `caller`.
  RegionCrossings(rtstdb::Database& database, const rtstdb::Region& region, const std::string& name,
                  const std::string& caller, EventLog& events);

  /// Calls use(event) for each event that a version up to the step's has made final, in their order. Not for
  /// those of a version that is newer than the step's: a later step gets them. A body that was created in the
  /// region before the first tick is present, it has not entered. After lost events a reset and the list of
  /// members follow; the number of lost events is noted in the event log.
  template <class Use>
  void take(const WorldStep& context, Use use) noexcept {
    for (;; ++next_) {
      if (next_ == count_) {
        next_ = 0;
        count_ = query_->next_events(events_);
        if (count_ == 0) return;
      }
      rtstdb::StandingEvent& event = events_[next_];
      if (event.version > context.version) return;
      if (event.lost > 0) context.events->note(lost_, context.time_ns, static_cast<double>(event.lost));
      reported_lost_ += event.lost;
      if (event.kind == rtstdb::EventKind::enter && event.time <= rtstdb::world_time_ns(0))
        event.kind = rtstdb::EventKind::present;
      use(std::as_const(event));
    }
  }

  /// Whether take() has had all crossings before the instant of the step. False: versions up to the step's
  /// have not decided the time since the last of them, or the follower is behind.
  bool is_complete(const WorldStep& context) const noexcept {
    const rtstdb::Progress progress = query_->progress();
    return progress.version == context.version && progress.until >= context.world_time();
  }
  /// False: crossings were lost, and the list of members is still to come, or the query is evaluated no more,
  /// for want of memory.
  bool is_known() const noexcept {
    return query_->lost() == reported_lost_ && query_->status() != rtstdb::StandingStatus::failed;
  }

 private:
  std::unique_ptr<rtstdb::StandingQuery> query_;
  std::array<rtstdb::StandingEvent, 64> events_{};  ///< those from next_ to count_ are still to be taken
  std::size_t next_ = 0, count_ = 0;
  std::uint64_t reported_lost_ = 0;
  EventLog::Kind lost_;
};

}  // namespace hil::modules
