#pragma once
// A transaction is declared whole and then submitted: preconditions, writes (of entities and of shapes), queries. Writes come first, then
// the queries on the version they make: all or nothing, in one serial order. A transaction without writes
// reads a snapshot.
//
// Threads: one thread declares and submits a given transaction. The database carries it out on a thread of
// its own. In the tick: begin, the declaring calls, Database::submit/execute and outcome neither allocate nor
// block on a lock.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include <rtstdb/entity.hpp>
#include <rtstdb/query.hpp>
#include <rtstdb/reservation.hpp>

namespace rtstdb {

/// One row as it stands in a version.
struct EntityState {
  EntityId id{};
  EntityRow row{};
  Version written_by = 0;
};

enum class DeadlineClass : std::uint8_t {
  hard,         ///< a miss is a fault of the run: carried out all the same, and counted
  firm,         ///< met or not done: never committed late
  soft,         ///< may be late and says by how much
  best_effort,  ///< no promise; first to be shed when the queue is full
};

/// Which version a transaction without writes reads.
struct ReadAt {
  enum class Kind : std::uint8_t { latest, version, time } kind = Kind::latest;
  Version version = 0;
  WorldTime time{};
  static ReadAt latest() { return {}; }
  static ReadAt pinned(Version version) { return {Kind::version, version, {}}; }
  static ReadAt as_of(WorldTime time) { return {Kind::time, 0, time}; }
};

struct Terms {
  DeadlineClass deadline_class = DeadlineClass::best_effort;
  ClockTime deadline = ClockTime::max();
  std::uint8_t importance =
      0;  ///< 0 to max_importance, higher first; earliest deadline first inside one importance
  /// The instant the writes belong to: the new version covers world time from here on. Not before the latest
  /// version's.
  WorldTime world_time{};
  ReadAt read_at{};  ///< ignored when there are writes
  /// Time that is kept free for it; the deadline is the reservation's, from submitted on, where none is given. Null: none.
  Reservation* reservation = nullptr;
};

enum class Status : std::uint8_t {
  idle,       ///< never submitted
  pending,    ///< submitted, no outcome yet
  committed,  ///< done in time
  late,       ///< done after its deadline (hard, soft), answers whole or not
  missed,   ///< firm: the deadline passed before it could be published; nothing was done (but see LatePolicy)
  refused,  ///< admission, or the log: see refused_by; nothing was done (but see LatePolicy)
  conflict,     ///< a precondition did not hold; nothing was done
  cancelled,    ///< by Database::cancel, from a full queue or by the database closing; nothing was done
  truncated,    ///< committed, but at least one answer is incomplete or overflowed
  device_lost,  ///< the GPU stopped answering, and nothing was published; may be submitted again: see Health
  bad_input,    ///< a value that no caller may pass, see bad_input; nothing was done
};
/// Whether the writes are in and the answers stand.
constexpr bool is_done(Status status) noexcept {
  return status == Status::committed || status == Status::truncated || status == Status::late;
}

enum class BadInputReason : std::uint8_t {
  none,
  not_finite,
  zero_quaternion,
  out_of_limits,
  unknown_entity,
  unknown_geometry,
  too_many_entities,
  world_time_goes_back,
  time_not_covered,
  window_too_long,
  snapshot_too_old,
  beyond_history,  ///< the time asked for, and from when on nothing is known (s)
  unknown_version,
  bad_ray,           ///< its direction
  bad_lambda_range,  ///< of a ray
  bad_region,
  unknown_region_kind,  ///< a shape or a test that is none of the enumerators
  bad_nearest,
  no_geometry,  ///< an entity without one was asked for its overlaps
  geometry_does_not_deform,
  wrong_position_count,
  too_many_positions,
};

/// What was wrong, with the values. `element`: index of the write, of the geometry update, or of the query's
/// element.
struct BadInput {
  static constexpr std::uint32_t no_element = 0xFFFFFFFFu;  ///< the terms are at fault
  BadInputReason reason = BadInputReason::none;
  std::uint32_t element = 0;
  EntityId entity{};
  double values[4] = {};
  bool in_geometry_update = false;
  Version version = 0;  ///< snapshot_too_old, unknown_version: that was asked for; 0 where it was by time
  /// not_finite, out_of_limits, bad_region, bad_nearest: the member at fault, as "scale.x", its value, and
  /// its lower and upper limit (infinite: no limit). Else empty. The text lives as long as the program.
  std::string_view field{};
  double value = 0.0;
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

/// Why a transaction was cancelled.
enum class CancelledBy : std::uint8_t { nobody, caller, full_queue, closing };

/// Why a transaction was refused.
enum class RefusedBy : std::uint8_t {
  nobody,
  admission,  ///< its deadline could not be met, see earliest_feasible
  log_full,  ///< group, sync: the log has no room for its writes now, or never where they take more than half of its ring
  log_fault,  ///< group, sync: the log's disk refuses
  read_only,  ///< it writes, and the database is a history's
};

/// Which precondition did not hold.
struct Conflict {
  std::uint32_t precondition = 0;  ///< ordinal among the transaction's expect calls
  EntityId entity{};
  bool entity_exists = false;
  Version written_by = 0;  ///< of the entity, when it exists
};

struct Outcome {
  Status status = Status::idle;
  BadInput bad_input{};
  std::int32_t bad_query = -1;  ///< bad_input: ordinal of the ask at fault; -1: a write or the terms
  Conflict conflict{};
  CancelledBy cancelled_by = CancelledBy::nobody;
  RefusedBy refused_by = RefusedBy::nobody;
  bool truncated = false;    ///< at least one answer is incomplete or overflowed, also when late
  bool partial = false;      ///< LatePolicy::partial: some elements were answered by the deadline, others not
  bool stale = false;        ///< not done, and LatePolicy::last_good: a query has its answers of before
  Version version = 0;       ///< the version made, or read; in doubt: that may stand
  WorldTime version_time{};  ///< from when that version holds
  // Five timestamps on the deadline clock; zero where the transaction did not get that far.
  ClockTime submitted{}, admitted{}, started{}, computed{}, published{};
  /// Late: published - deadline. Missed: how long the deadline had passed when the transaction was given up.
  Nanoseconds lateness{0};
  Nanoseconds predicted_cost{0}, actual_cost{0};  ///< started to published, but for `interrupted`
  /// Spent on others: on more urgent ones, which ran in between, and until the device was done with a chunk of a less urgent one.
  Nanoseconds interrupted{0};
  /// Times it was begun anew, since it stood in the way of a reserved one. The timestamps are those of the last time.
  std::uint32_t restarts = 0;
  /// Of the actual cost, spent on the device, or at most that where the host has to time it.
  Nanoseconds gpu_time{0};
  ClockTime earliest_feasible{};  ///< refused: the earliest deadline that is admitted when asked for at once
  /// Group, sync: what it wrote is on disk, and was at that instant. False and done: group, and the disk refused.
  bool durable = false;
  ClockTime durable_at{};
  /// Sync: nothing was done, but the disk refused when that was to be written down; if the process ends before it is, the writes
  /// may stand when the database is opened again.
  bool in_doubt = false;

  /// Whether the writes are in and the answers stand.
  bool done() const noexcept { return is_done(status); }
};

const char* to_string(Status status) noexcept;
const char* to_string(DeadlineClass deadline_class) noexcept;
const char* to_string(BadInputReason reason) noexcept;
const char* to_string(RefusedBy refused_by) noexcept;
const char* to_string(CancelledBy by) noexcept;
const char* to_string(ReadAt::Kind kind) noexcept;
/// One sentence for the user, with the values. Allocates: not in the tick.
std::string describe(const BadInput& bad_input);
std::string describe(const Outcome& outcome);

struct TransactionOptions {
  std::uint32_t max_writes = 0;
  std::uint32_t max_preconditions = 0;
  std::uint32_t max_queries = 0;
  std::uint32_t max_reads = 0;
  std::uint32_t max_geometry_updates = 0;
  std::uint32_t max_positions = 0;  ///< of all its geometry updates together
};

/// Made by Database::make_transaction. Going over its options' counts is misuse, but for max_positions. Must not
/// outlive its Database; destroying one that is pending is misuse.
class Transaction {
 public:
  virtual ~Transaction() = default;

  /// Empties the transaction, also of what was declared and not submitted, and sets its terms. Misuse: to
  /// declare, submit or calibrate without a call of begin since the last outcome; to call begin while pending.
  virtual void begin(const Terms& terms) noexcept = 0;

  /// The transaction is a conflict unless the entity exists / was last written by exactly this version.
  virtual void expect_exists(EntityId entity) noexcept = 0;
  virtual void expect_written_by(EntityId entity, Version version) noexcept = 0;

  /// Returns the ordinal of this create, for created().
  virtual std::uint32_t create(const EntityRow& row) noexcept = 0;
  virtual void update(EntityId entity, const EntityRow& row) noexcept = 0;
  /// Changes pose and velocities only.
  virtual void update_motion(EntityId entity, const Motion& motion) noexcept = 0;
  virtual void remove(EntityId entity) noexcept = 0;
  /// A write: moves the corners of a geometry that was added as one that deforms, wherever entities show it, from
  /// the version on that the transaction makes. As many positions as the mesh has, in its order, entity frame; they
  /// are copied. A later update of the same geometry in one transaction takes the place of an earlier one. All
  /// triangles may lose their area: then no ray hits them. Versions before it keep the shapes that they had, as
  /// far as GeometryOptions::kept_shapes goes; a transaction that asks queries at an older one is refused
  /// (snapshot_too_old), one that reads rows alone is not.
  /// The structure follows on the device when the first query asks for a version with that shape. Where triangles run
  /// along every edge in both directions (by the places of its ends, as for a mesh that was added with these
  /// positions), distances have a sign: corners with different numbers that part open the body, and close it when
  /// they meet again.
  /// Bad input, looked at after the writes to entities: unknown_geometry, geometry_does_not_deform (its index);
  /// wrong_position_count (given, needed); too_many_positions (given, room that was left); not_finite, out_of_limits
  /// (the position, then its index).
  virtual void update_geometry(GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept = 0;

  /// Reads the entity's row in the version that the transaction makes or reads. Returns the ordinal of this
  /// read, for state().
  virtual std::uint32_t read(EntityId entity) noexcept = 0;

  /// Asks the first `count` elements of the query's input span. Zero is allowed and answers nothing. Once per
  /// query: its answers have one place (a second time is misuse).
  virtual void add_query(RayQuery& query, std::uint32_t count) noexcept = 0;
  virtual void add_query(RegionQuery& query, std::uint32_t count) noexcept = 0;
  virtual void add_query(NearestQuery& query, std::uint32_t count) noexcept = 0;
  virtual void add_query(OverlapQuery& query, std::uint32_t count) noexcept = 0;

  /// After the outcome: the id of a created entity; invalid when the transaction came to nothing.
  virtual EntityId created(std::uint32_t ordinal) const noexcept = 0;
  /// After the outcome: what a read found; null when the entity is not in that version, or nothing was done.
  /// Valid until the next begin.
  virtual const EntityState* state(std::uint32_t ordinal) const noexcept = 0;
  /// Any thread may poll; the rest of the outcome is valid once this is neither idle nor pending.
  virtual Status status() const noexcept = 0;
  virtual const Outcome& outcome() const noexcept = 0;
};

}  // namespace rtstdb
