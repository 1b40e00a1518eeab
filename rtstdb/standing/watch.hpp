#pragma once
// One standing query: its members, its next instants of change, and its queue of events. A kinetic data
// structure (Basch, Guibas, Hershberger, 1997): a certificate names the next instant at which a membership
// changes or has to be examined again.
//
// Threads: the user's side as in standing.hpp; everything else is called by the follower. If memory runs out,
// std::bad_alloc is thrown; from then on only fail() may be called.

#include <atomic>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/standing.hpp>

#include "rtstdb/standing/event_ring.hpp"
#include "rtstdb/standing/membership_predictor.hpp"
#include "rtstdb/standing/mirror.hpp"
#include "rtstdb/standing/query_spec.hpp"
#include "rtstdb/threads/event_count.hpp"
#include "rtstdb/transaction/latest_version.hpp"

namespace rtstdb::standing {

/// How far ahead a search for a crossing looks at first. The time doubles after each search without a
/// crossing.
inline constexpr std::int64_t initial_look_ahead_ns = 250'000'000;
inline constexpr std::uint8_t max_doublings = 8;

/// Counts over all standing queries; any thread may read them.
struct WorkCounts {
  std::atomic<std::uint64_t> examinations{0}, events{0};
};

class Watch {
 public:
  Watch(const QuerySpec& spec, const StandingOptions& options, const Mirror& mirror,
        threads::EventCount& follower_wake_up, WorkCounts& work);
  virtual ~Watch() = default;
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  // ---- the user's side
  std::size_t next_events(std::span<StandingEvent> events) noexcept;
  Progress progress() const noexcept;
  StandingStatus status() const noexcept { return status_.load(std::memory_order_acquire); }
  std::string reason() const;
  std::uint64_t lost() const noexcept { return all_lost_.load(std::memory_order_relaxed); }

  // ---- the follower
  const QuerySpec& spec() const noexcept { return spec_; }
  bool follows() const noexcept { return status() == StandingStatus::following; }
  /// Determines the members in the mirror's version.
  void begin();
  /// Invalidates the certificates of these entities.
  virtual void invalidate(std::span<const std::uint32_t> indices) noexcept;
  /// Publishes the crossings before the time of that version.
  void advance(VersionInfo to);
  /// The mirror is at a new version, in which these entities have changed.
  void follow(std::span<const std::uint32_t> changed, EventCause cause);
  /// Publishes the list of members after a loss, as far as the ring has room.
  void publish_list();
  void fail(const char* why) noexcept;

 protected:
  struct Entry {
    std::uint32_t stamp = 0;       ///< of its valid certificate
    std::uint32_t generation = 0;  ///< of the entity that the query found there last
    std::uint8_t doublings = 0;    ///< of the time that a search looks ahead
    bool considered = false;       ///< the query considers the entity
    bool member = false;
    bool candidate = false;  ///< nearest: within the guard radius
  };
  struct Certificate {
    std::int64_t ns = 0;
    std::uint32_t index = 0, stamp = 0;
    bool changes = false;  ///< true: the membership changes; false: to be examined again
  };

  /// Handles a certificate whose instant has come.
  virtual void on_due(const Certificate& certificate) = 0;
  virtual bool is_current(const Certificate& certificate) const noexcept {
    return entries_[certificate.index].stamp == certificate.stamp;
  }
  /// The rows at these indices have changed; the carrier of the query has moved differently.
  virtual void reevaluate(std::span<const std::uint32_t> indices, std::int64_t now_ns, EventCause cause) = 0;
  virtual void reevaluate_all(std::int64_t now_ns, EventCause cause) = 0;

  /// Null: no entity there, or the query does not consider it.
  const EntityState* considered_state(std::uint32_t index) const noexcept;
  MembershipPredictor predictor(const EntityState& state) const noexcept { return predictor(state, spec_); }
  MembershipPredictor predictor(const EntityState& state, const QuerySpec& spec) const noexcept;
  void schedule(std::uint32_t index, const MembershipPredictor::Next& next);
  void push(const Certificate& certificate);
  void set_member(std::uint32_t index, bool member, std::int64_t ns, EventCause cause);
  std::uint32_t index_limit() const noexcept { return mirror_.index_limit(); }
  const Mirror& mirror() const noexcept { return mirror_; }
  void count_examination() noexcept { work_.examinations.fetch_add(1, std::memory_order_relaxed); }
  void clear_certificates() noexcept { certificates_.clear(); }

  const QuerySpec spec_;
  std::vector<Entry> entries_;  ///< by index

 private:
  enum class ListState : std::uint8_t { listed, reset_pending, members };
  void grow_entries();
  void publish(EventKind kind, EventCause cause, EntityId entity, std::int64_t ns) noexcept;
  void count_lost() noexcept;
  void push_event(StandingEvent event) noexcept;
  void end(EventCause cause);

  const Mirror& mirror_;
  threads::EventCount& follower_wake_up_;
  WorkCounts& work_;
  const std::string name_;

  std::vector<Certificate> certificates_;  ///< a heap, the earliest first; includes invalid ones
  VersionInfo version_info_;
  bool initializing_ = true;  ///< true during begin: the first members come as a list, not as events

  EventRing ring_;
  ListState list_state_ = ListState::reset_pending;
  std::uint32_t listed_below_ = 0;  ///< during the list of members: indices below it are in the ring
  std::uint64_t seq_ = 0, lost_since_reset_ = 0;
  std::atomic<bool> waits_for_space_{false};
  std::atomic<std::uint64_t> all_lost_{0};

  transaction::LatestVersion progress_;
  std::atomic<StandingStatus> status_{StandingStatus::following};
  mutable std::mutex reason_mutex_;
  const char* reason_ = "";
};

}  // namespace rtstdb::standing
