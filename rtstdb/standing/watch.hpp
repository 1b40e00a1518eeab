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
#include "rtstdb/standing/mirror.hpp"
#include "rtstdb/standing/question.hpp"
#include "rtstdb/threads/bell.hpp"
#include "rtstdb/transaction/latest_version.hpp"

namespace rtstdb::standing {

/// How far ahead a search for a crossing looks at first. The time doubles after each search without a
/// crossing.
inline constexpr std::int64_t first_look_ahead_ns = 250'000'000;
inline constexpr std::uint8_t max_doublings = 8;

/// Counts over all standing queries; any thread may read them.
struct Work {
  std::atomic<std::uint64_t> examinations{0}, events{0};
};

class Watch {
 public:
  Watch(const Question& question, const StandingOptions& options, const Mirror& mirror,
        threads::Bell& follower, Work& work);
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
  const Question& question() const noexcept { return question_; }
  bool follows() const noexcept { return status() == StandingStatus::following; }
  /// Determines the members in the mirror's version.
  void begin();
  /// Invalidates the certificates of these entities.
  virtual void forget(std::span<const std::uint32_t> indices) noexcept;
  /// Publishes the crossings before the time of that version.
  void advance(VersionInfo to);
  /// The mirror is at a new version, in which these entities have changed.
  void follow(std::span<const std::uint32_t> changed, EventCause cause);
  /// Publishes the list of members after a loss, as far as the ring has room.
  void pump();
  void fail(const char* why) noexcept;

 protected:
  struct Entry {
    std::uint32_t stamp = 0;       ///< of its valid certificate
    std::uint32_t generation = 0;  ///< of the entity that the query found there last
    std::uint8_t doublings = 0;    ///< of the time that a search looks ahead
    bool seen = false;             ///< the query considers the entity
    bool member = false;
    bool candidate = false;  ///< nearest: within the guard radius
  };
  struct Certificate {
    std::int64_t ns = 0;
    std::uint32_t index = 0, stamp = 0;
    bool flip = false;  ///< true: the membership changes; false: to be examined again
  };

  /// Handles a certificate whose instant has come.
  virtual void due(const Certificate& certificate) = 0;
  virtual bool is_current(const Certificate& certificate) const noexcept {
    return entries_[certificate.index].stamp == certificate.stamp;
  }
  /// The rows at these indices have changed; the carrier of the query has moved differently.
  virtual void changed_rows(std::span<const std::uint32_t> indices, std::int64_t now_ns,
                            EventCause cause) = 0;
  virtual void changed_question(std::int64_t now_ns, EventCause cause) = 0;

  /// Null: no entity there, or the query does not consider it.
  const EntityState* seen(std::uint32_t index) const noexcept;
  MembershipPredictor sight(const EntityState& state) const noexcept { return sight(state, question_); }
  MembershipPredictor sight(const EntityState& state, const Question& question) const noexcept;
  void schedule(std::uint32_t index, const MembershipPredictor::Next& next);
  void push(const Certificate& certificate);
  void set_member(std::uint32_t index, bool member, std::int64_t ns, EventCause cause);
  std::uint32_t index_limit() const noexcept { return mirror_.index_limit(); }
  const Mirror& mirror() const noexcept { return mirror_; }
  void count_examination() noexcept { work_.examinations.fetch_add(1, std::memory_order_relaxed); }
  void clear_certificates() noexcept { certificates_.clear(); }

  const Question question_;
  std::vector<Entry> entries_;  ///< by index

 private:
  enum class Telling : std::uint8_t { steadily, reset_next, members };
  void grow_entries();
  void tell(EventKind kind, EventCause cause, EntityId entity, std::int64_t ns) noexcept;
  void lose() noexcept;
  void push_event(StandingEvent event) noexcept;
  void end(EventCause cause);

  const Mirror& mirror_;
  threads::Bell& follower_;
  Work& work_;
  const std::string name_;

  std::vector<Certificate> certificates_;  ///< a heap, the earliest first; includes invalid ones
  VersionInfo known_in_;
  bool silent_ = true;  ///< true during begin: the first members come as a list, not as events

  EventRing ring_;
  Telling telling_ = Telling::reset_next;
  std::uint32_t told_below_ = 0;  ///< during the list of members: indices below it are in the ring
  std::uint64_t seq_ = 0, lost_since_reset_ = 0;
  std::atomic<bool> waits_for_room_{false};
  std::atomic<std::uint64_t> all_lost_{0};

  transaction::LatestVersion progress_;
  std::atomic<StandingStatus> status_{StandingStatus::following};
  mutable std::mutex reason_mutex_;
  const char* reason_ = "";
};

}  // namespace rtstdb::standing
