#pragma once
// Standing queries (continuous queries): Database::watch registers a region, a ray or a nearest query once.
// From then on, an event follows for each entity that enters or exits, with its instant. Rows are functions
// of time, so crossings between versions are found too.
//
//   frame      as for one-shot queries: the world, or the carrier with which the query moves
//   precision  Double. The time of an event is the first nanosecond at which the entity is inside (enter) or
//              outside (exit). The border is about 2 nm thick, plus a few units in the last place of the
//              distances involved: an entity that rests on it is inside, and an entity that enters by less
//              than this may produce no event.
//   finality   An event is published when a version's time has passed the event's time, and is never revoked.
//   threads    Database::watch and the destructor are setup: they allocate and block. One thread at a time
//              calls next_events, which is made for the tick; any thread may call progress, status and lost.
//              A thread of the database with ordinary priority, the follower, finds the events; the engine
//              only copies written rows for it.
//   virtual    Under a virtual clock (Clock::is_virtual) Database::wait returns after the follower has
//   clock      evaluated the transaction's version. The events are then a function of the commits, if one
//              thread at a time commits and fetches events. A list of members after lost events comes with
//              the next version.
//   lifetime   The destructor of a standing query ends it. It must not outlive its Database.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <rtstdb/entity.hpp>
#include <rtstdb/query.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

/// Which part of an entity is tested. Entities without geometry are never found.
enum class StandingTarget : std::uint8_t {
  bounds,  ///< its oriented bounding box, which is solid: as RegionLevel::bounds, NearestTarget::bounds
  center,  ///< the centre of that box: as NearestTarget::center
};

/// Members: the entities in the region. `region.t` is ignored. For StandingTarget::center, touching and
/// inside are the same.
struct StandingRegion {
  Region region{};
  StandingTarget target = StandingTarget::bounds;
  EntityId excluded{};  ///< never found; default: none
};

/// Members: the entities whose bounding box the ray meets within its range, from inside too, whatever is in
/// front of them. `ray.t` is ignored. A one-shot ray tests triangles, so it may miss an entity that is a
/// member here.
struct StandingRay {
  Ray ray{};
  EntityId excluded{};
};

/// Members: the k nearest entities within the radius. `point.t` is ignored. At equal distance, the lowest
/// entity index is nearer; if two distances differ by less than 1 nm, the entity that was nearer before stays
/// nearer.
struct StandingNearest {
  Nearest point{};
  StandingTarget target = StandingTarget::bounds;
  std::uint32_t k = 1;  ///< 1 to max_neighbors
};

struct StandingOptions {
  std::string name{};                  ///< for error texts
  std::uint32_t ring_capacity = 1024;  ///< events that can wait for next_events: 2 to max_standing_events
};

enum class EventKind : std::uint8_t {
  reset,     ///< the list of members follows; the first event, and after lost events
  present,   ///< a member; between reset and complete
  complete,  ///< end of the list of members
  enter,     ///< an entity became a member
  exit,      ///< an entity is no longer a member
};

enum class EventCause : std::uint8_t {
  motion,  ///< the entity crossed the border; `time` is the instant
  /// A write of `version`, at its time: the entity or the carrier was created, moved, removed or otherwise
  /// changed.
  write,
  /// A write of one of several versions that the follower skipped, because its queue was full
  /// (standing_queue_capacity); found at `version`.
  gap,
  list,  ///< of reset, present and complete: membership did not change
};

/// Events of one query are ordered by time, then by version, then by entity index.
struct StandingEvent {
  EventKind kind = EventKind::reset;
  EventCause cause = EventCause::list;
  EntityId entity{};  ///< present, enter, exit
  WorldTime time{};
  Version version = 0;     ///< version at which the event was found; its time is not before the event's
  std::uint64_t seq = 0;   ///< 1, 2, ... for each query; a missing number is a lost event
  std::uint64_t lost = 0;  ///< reset: events lost since the previous reset
};

/// How far a standing query has been evaluated.
struct Progress {
  Version version = 0;
  /// The events of all crossings before this instant, and of all writes up to `version`, are in the ring or
  /// were fetched; or a reset follows.
  WorldTime until{};
};

enum class StandingStatus : std::uint8_t {
  following,  ///< the query is evaluated
  ended,      ///< the carrier was removed; all members have exited
  failed,     ///< the follower ran out of memory, or the database was closed; no further events
};

/// Made by Database::watch.
class StandingQuery {
 public:
  virtual ~StandingQuery() = default;

  /// Moves the oldest events into `events` and returns their number. Neither allocates nor blocks. After
  /// `complete`, the members are the entities that were present or entered and have not exited.
  /// Ring full: events are lost. When there is room again, a reset and the list of members follow, as room
  /// permits; a member of that list enters or exits only after its `present`.
  virtual std::size_t next_events(std::span<StandingEvent> events) noexcept = 0;
  virtual Progress progress() const noexcept = 0;
  virtual StandingStatus status() const noexcept = 0;
  /// A sentence on why the status is ended or failed; empty while following. Allocates.
  virtual std::string reason() const = 0;
  /// Number of events lost so far because the ring was full.
  virtual std::uint64_t lost() const noexcept = 0;
};

/// Work of the follower since open, over all standing queries.
struct StandingCounts {
  std::uint64_t queries = 0;           ///< registered now
  std::uint64_t versions = 0;          ///< evaluated one by one
  std::uint64_t rows = 0;              ///< written in these versions
  std::uint64_t examinations = 0;      ///< searches for a crossing of one entity and one query
  std::uint64_t events = 0;            ///< published or lost
  std::uint64_t gaps = 0;              ///< times the queue was full and the latest version was read
  std::uint64_t skipped_versions = 0;  ///< not evaluated one by one
};

const char* to_string(StandingTarget target) noexcept;
const char* to_string(EventKind kind) noexcept;
const char* to_string(EventCause cause) noexcept;
const char* to_string(StandingStatus status) noexcept;

}  // namespace rtstdb
