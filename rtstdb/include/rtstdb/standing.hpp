#pragma once
// Standing queries: a region, a ray or a nearest question registered once with Database::watch. From then on it is told who comes
// and who goes, each with the instant at which it does, found between versions too: rows are functions of time.
//
//   frame      as for one-shot queries: world, or the carrier's, with which the question moves
//   precision  double. An event's time is the first nanosecond at which its entity is in (enter), or out (exit). The border is
//              about 2 nm thick, and some units in the last place of the distances at play: who rests on it is in, and what
//              enters by less than that may stay unresolved
//   finality   an event is told when a version's time has passed its own, and never taken back
//   threads    watch and the destructor are setup calls: they allocate and block. next_events is one thread's at a time, and made
//              for the tick; progress, status and lost are anybody's. Events are found on a thread of the database's own, which
//              has ordinary priority: the engine only copies written rows for it
//   lifetime   a standing query ends with its destructor, and must not outlive its Database

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <rtstdb/entity.hpp>
#include <rtstdb/query.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

/// What of an entity is looked at. Entities without geometry are never found.
enum class StandingTarget : std::uint8_t {
  bounds,  ///< its oriented bounds, which are solid: as RegionLevel::bounds, NearestTarget::bounds
  center,  ///< their centre: as NearestTarget::center
};

/// Who is in the region. `region.t` is not looked at. By centre, touching and inside are the same.
struct StandingRegion {
  Region region{};
  StandingTarget target = StandingTarget::bounds;
  EntityId excluded{};  ///< never found; default: none
};

/// Whose bounds the ray meets within its range, also from inside: a light barrier that bodies do not shadow. `ray.t` is not looked
/// at. A one-shot ray finds triangles, and so may miss who is told here.
struct StandingRay {
  Ray ray{};
  EntityId excluded{};
};

/// Who is among the k nearest within the radius. `point.t` is not looked at. At the same distance the lowest entity index; of
/// distances that differ by less than 1 nm that of who was nearer before.
struct StandingNearest {
  Nearest point{};
  StandingTarget target = StandingTarget::bounds;
  std::uint32_t k = 1;  ///< 1 to max_neighbors
};

struct StandingOptions {
  std::string name{};                  ///< shown in errors
  std::uint32_t ring_capacity = 1024;  ///< events that wait to be fetched: 2 to max_standing_events
};

enum class EventKind : std::uint8_t {
  reset,     ///< forget all members: they are told anew. The first event of all, and after a loss
  present,   ///< a member, told after reset
  complete,  ///< all members have been told
  enter,
  exit,
};

enum class EventCause : std::uint8_t {
  motion,  ///< it crossed the border: `time` is the instant
  write,  ///< by a write of `version`, whose time it is: it or the carrier appeared, jumped, was removed, or changed otherwise
  gap,    ///< by a write of one of several versions that the follower could not follow: found at `version`
  list,   ///< reset, present, complete: nothing happened
};

/// Events of one query come in the order of their times, those of one time by version and then by entity index.
struct StandingEvent {
  EventKind kind = EventKind::reset;
  EventCause cause = EventCause::list;
  EntityId entity{};  ///< present, enter, exit
  WorldTime time{};
  Version version = 0;     ///< in which it was known: its time is not before the event's
  std::uint64_t seq = 0;   ///< 1, 2, ... of this query; numbers that are missing were lost
  std::uint64_t lost = 0;  ///< reset: events lost since the reset before
};

struct Progress {
  Version version = 0;
  /// All crossings before this instant, and what this version and those before it wrote, have been told: they are in the ring or were
  /// fetched, or a reset is on its way.
  WorldTime until{};
};

enum class StandingStatus : std::uint8_t {
  following,
  ended,   ///< the carrier was removed; everybody has left
  failed,  ///< memory ran out on the follower's thread; nothing is told any more
};

/// Made by Database::watch.
class StandingQuery {
 public:
  virtual ~StandingQuery() = default;

  /// Moves the oldest events into `events` and returns how many. Neither allocates nor waits. After `complete`, whoever was
  /// present or entered and did not exit is a member. While the ring is full, events are lost, and once there is
  /// room a reset follows with all members; they too come as there is room, and who enters or exits among them is told only after it was present.
  virtual std::size_t next_events(std::span<StandingEvent> events) noexcept = 0;
  virtual Progress progress() const noexcept = 0;
  virtual StandingStatus status() const noexcept = 0;
  /// Why it is not following any more, in words; empty while it is. Allocates.
  virtual std::string reason() const = 0;
  /// Events that found no room so far.
  virtual std::uint64_t lost() const noexcept = 0;
};

/// How following went so far; of all standing queries.
struct StandingCounts {
  std::uint64_t queries = 0;       ///< registered now
  std::uint64_t versions = 0;      ///< followed
  std::uint64_t rows = 0;          ///< written in them
  std::uint64_t examinations = 0;  ///< of one entity for one query: crossings looked for
  std::uint64_t events = 0;        ///< told or lost
  std::uint64_t gaps = 0;          ///< times that the feed was full and the latest version was read instead
  std::uint64_t skipped_versions = 0;  ///< that were not followed one by one
};

const char* to_string(StandingTarget target) noexcept;
const char* to_string(EventKind kind) noexcept;
const char* to_string(EventCause cause) noexcept;
const char* to_string(StandingStatus status) noexcept;

}  // namespace rtstdb
