#pragma once
// A transaction is declared completely and then submitted: preconditions, writes (of entities and shapes),
// queries. Writes come first, then the queries on the version that the writes make. All take effect or none,
// in one serial order (paper,
// Section 4: ACID guarantees, deadlines and priorities). A transaction without writes reads a snapshot.
//
// Threads: one thread declares and submits a transaction. The database executes it on its engine thread.
// Tick: begin, the declaring calls, Database::submit, Database::execute and outcome neither allocate nor
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

/// The row of an entity in one version. `written_by`: the version that wrote it last.
struct EntityState {
  EntityId id{};
  EntityRow row{};
  Version written_by = 0;
};

/// Consequence of a missed deadline.
enum class DeadlineClass : std::uint8_t {
  hard,         ///< a miss is a fault: the transaction is executed all the same, and counted as hard miss
  firm,         ///< published in time or not at all; admission control may refuse it
  soft,         ///< may be late; Outcome::lateness says by how much
  best_effort,  ///< no guarantee; cancelled first when the queue is full
};

/// Which version a transaction without writes reads.
struct ReadAt {
  /// The latest version; a numbered one; the one that covers a world time (AS OF).
  enum class Kind : std::uint8_t { latest, version, time } kind = Kind::latest;
  Version version = 0;
  WorldTime time{};
  static ReadAt latest() { return {}; }
  static ReadAt pinned(Version version) { return {Kind::version, version, {}}; }
  static ReadAt as_of(WorldTime time) { return {Kind::time, 0, time}; }
};

/// The terms of a transaction.
struct Terms {
  DeadlineClass deadline_class = DeadlineClass::best_effort;
  ClockTime deadline = ClockTime::max();  ///< of publication
  /// Priority: 0 to max_importance, higher first; within one importance, the earliest deadline first.
  std::uint8_t importance = 0;
  /// Time of the version that the writes make: it covers world time from here on. Not before the time of the
  /// latest version.
  WorldTime world_time{};
  ReadAt read_at{};  ///< ignored if there are writes
  /// Reservation that the transaction belongs to; null: none. If `deadline` is not set, it is the
  /// reservation's deadline after submission.
  Reservation* reservation = nullptr;
};

/// State of a transaction, and its outcome. Except for committed, late and truncated, nothing was published,
/// and its queries have no answers unless a LatePolicy provides them.
enum class Status : std::uint8_t {
  idle,         ///< not submitted since begin
  pending,      ///< submitted, no outcome yet
  committed,    ///< completed in time
  late,         ///< completed after its deadline (hard, soft); answers may be incomplete
  missed,       ///< firm: its deadline passed before it could be published
  refused,      ///< by admission control or the log, see Outcome::refused_by
  conflict,     ///< a precondition did not hold
  cancelled,    ///< see Outcome::cancelled_by
  truncated,    ///< completed in time, but at least one answer is incomplete or overflowed
  device_lost,  ///< the GPU stopped answering; the transaction may be submitted again (see Health)
  bad_input,    ///< a value that is not allowed, see Outcome::bad_input
};
/// Whether the transaction has completed: its writes are published and its answers are valid.
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
  unknown_material,
  unknown_light,
  too_many_entities,
  world_time_goes_back,
  time_not_covered,
  window_too_long,
  snapshot_too_old,
  beyond_history,  ///< values: the requested time (s), and the time from which on nothing is known (s)
  unknown_version,
  bad_ray,           ///< the direction of a ray or a cone
  bad_lambda_range,  ///< of a ray
  bad_region,
  unknown_region_kind,  ///< a shape or a test that is not one of the enumerators
  bad_nearest,
  bad_cone,     ///< its opening angle or its lambda_max
  bad_contact,  ///< its margin; a second entity without a first one, or equal to it
  bad_impact,   ///< its window or its tolerance; a second entity that is the first one
  bad_camera,   ///< its angle, orientation, near_m, exposure or times
  no_geometry,  ///< the entity of an overlap or a contact query has none
  geometry_does_not_deform,
  wrong_position_count,
  too_many_positions,
};

/// Fault of the input, with its values; describe() makes a sentence of it. `element`: index of the
/// write, of the geometry update, or of the query's element.
struct BadInput {
  static constexpr std::uint32_t no_element = 0xFFFFFFFFu;  ///< the Terms are wrong
  BadInputReason reason = BadInputReason::none;
  std::uint32_t element = 0;
  EntityId entity{};
  double values[4] = {};
  bool in_geometry_update = false;
  Version version = 0;  ///< snapshot_too_old, unknown_version: the requested version; 0 if requested by time
  /// not_finite, out_of_limits, bad_region, bad_nearest, bad_cone, bad_contact, bad_impact, bad_camera: the
  /// wrong member, such as "scale.x", its value, and its lower and upper limit (infinite: no limit). `unit`:
  /// of all three, where the name of the member does not have it. Otherwise empty. The texts are constants.
  std::string_view field{};
  std::string_view unit{};
  double value = 0.0;
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
};

/// Why a transaction was cancelled.
enum class CancelledBy : std::uint8_t {
  none,        ///< it was not cancelled
  caller,      ///< Database::cancel
  full_queue,  ///< DatabaseOptions::queue_capacity
  closing      ///< Database::close
};

/// Why a transaction was refused.
enum class RefusedBy : std::uint8_t {
  none,       ///< it was not refused
  admission,  ///< its deadline could not be met, see Outcome::earliest_feasible
  /// Modes group and sync: the log's ring has no room for its writes; if they need more than half of the
  /// ring, it never has.
  log_full,
  /// Modes group and sync: the log's disk fails; in mode sync also until the checkpoint after a failure is on
  /// disk.
  log_fault,
  read_only,  ///< it writes, and the database is a history (history.hpp)
};

/// Which precondition did not hold, and the entity's state.
struct Conflict {
  std::uint32_t precondition = 0;  ///< ordinal among the transaction's calls of expect_*
  EntityId entity{};
  bool entity_exists = false;
  Version written_by = 0;  ///< the version that wrote the entity last, if it exists
};

/// The outcome of a transaction. Members that do not belong to its status have their defaults.
struct Outcome {
  Status status = Status::idle;
  DeadlineClass deadline_class = DeadlineClass::soft;  ///< of its Terms
  BadInput bad_input{};
  std::int32_t bad_query = -1;  ///< bad_input: ordinal of the wrong add_query; -1: a write, or the Terms
  Conflict conflict{};
  CancelledBy cancelled_by = CancelledBy::none;
  RefusedBy refused_by = RefusedBy::none;
  bool truncated = false;    ///< at least one answer is incomplete or overflowed; also set when late
  bool partial = false;      ///< LatePolicy::partial: some elements were answered by the deadline, others not
  bool stale = false;        ///< not completed; LatePolicy::last_good: a query has earlier answers
  Version version = 0;       ///< the version made or read; in_doubt: the version that may exist
  WorldTime version_time{};  ///< the time of that version
  // Five timestamps on the clock of deadlines; zero: the transaction did not get that far.
  ClockTime submitted{}, admitted{}, started{}, computed{}, published{};
  /// Late: published - deadline. Missed: time from the deadline to the end of the transaction.
  Nanoseconds lateness{0};
  Nanoseconds predicted_cost{0}, actual_cost{0};  ///< from started to published, without `interrupted`
  /// Time that the transaction was preempted by others of higher priority, or waited for the device to finish
  /// a chunk of one of lower priority.
  Nanoseconds interrupted{0};
  /// Number of restarts, because it blocked a transaction with a reservation. The timestamps are of the last
  /// attempt.
  std::uint32_t restarts = 0;
  /// Part of the actual cost spent on the device. An upper bound if the device has no timestamps.
  Nanoseconds gpu_time{0};
  ClockTime earliest_feasible{};  ///< refused: the earliest deadline that would be admitted if submitted now
  /// Modes group and sync: its writes are on disk, since durable_at. False and done(): mode group, and the
  /// disk failed.
  bool durable = false;
  ClockTime durable_at{};
  /// Mode sync: the transaction failed, but the disk failed too before the log recorded that. If the process
  /// ends before it does, the writes may exist after recovery.
  bool in_doubt = false;

  /// Whether the transaction has completed: its writes are published and its answers are valid.
  bool done() const noexcept { return is_done(status); }
};

const char* to_string(Status status) noexcept;
const char* to_string(DeadlineClass deadline_class) noexcept;
const char* to_string(BadInputReason reason) noexcept;
const char* to_string(RefusedBy refused_by) noexcept;
const char* to_string(CancelledBy by) noexcept;
const char* to_string(ReadAt::Kind kind) noexcept;
/// A sentence for the user, with the values. Both allocate: not for the tick.
std::string describe(const BadInput& bad_input);
std::string describe(const Outcome& outcome);

/// Room of a transaction: the largest number of calls of each kind between two calls of begin.
struct TransactionOptions {
  std::uint32_t max_writes = 0;
  std::uint32_t max_preconditions = 0;
  std::uint32_t max_queries = 0;
  std::uint32_t max_reads = 0;
  std::uint32_t max_geometry_updates = 0;
  std::uint32_t max_positions = 0;  ///< total number of positions in its geometry updates
};

/// Made by Database::make_transaction. Misuse: to exceed a count of its options, except max_positions; to
/// destroy a pending transaction. It must not outlive its Database.
class Transaction {
 public:
  virtual ~Transaction() = default;

  /// Starts a new declaration: removes what was declared before and sets the terms. Misuse: to call begin
  /// while the transaction is pending; to declare, submit or calibrate it without a call of begin since the
  /// last outcome; an importance above max_importance.
  virtual void begin(const Terms& terms) noexcept = 0;

  /// Precondition: the entity exists / was last written by exactly this version. Otherwise Status::conflict.
  /// All preconditions apply to the version before the writes.
  virtual void expect_exists(EntityId entity) noexcept = 0;
  virtual void expect_written_by(EntityId entity, Version version) noexcept = 0;

  /// Writes apply in the order of the calls, each to the result of those before it. The first write that is
  /// not allowed ends the transaction as bad_input.
  /// create: adds an entity; its id uses the lowest free index. Returns the ordinal of this create, for
  /// created().
  virtual std::uint32_t create(const EntityRow& row) noexcept = 0;
  /// Replaces the whole row.
  virtual void update(EntityId entity, const EntityRow& row) noexcept = 0;
  /// Replaces the motion only.
  virtual void update_motion(EntityId entity, const Motion& motion) noexcept = 0;
  virtual void remove(EntityId entity) noexcept = 0;
  /// A write: replaces the positions of a deforming geometry (GeometryOptions::deforms), for all entities
  /// that have it, from the new version on. As many positions as the mesh has, in its order, in the entity
  /// frame; they are copied. A later update of the same geometry in the same transaction replaces an earlier
  /// one. All triangles may lose their area; then no ray hits them.
  /// Older versions keep their shapes as far as GeometryOptions::retained_shapes reaches. A transaction with
  /// queries at a version whose shapes are no longer kept ends as bad_input (snapshot_too_old); one that only
  /// reads rows does not. The acceleration structure on the device is updated when the first query needs the
  /// new shape. Distances have a sign if the surface is closed in the new shape (NearestQueryOptions):
  /// positions with different indices that part open the body, and close it when they coincide again.
  /// Bad input, checked after the writes of entities, with its values: unknown_geometry,
  /// geometry_does_not_deform (index of the geometry); wrong_position_count (given, needed);
  /// too_many_positions (given, room left in max_positions); not_finite, out_of_limits (the position, then
  /// its index).
  virtual void update_geometry(GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept = 0;

  /// Reads the entity's row in the version that the transaction makes or reads. Returns the ordinal of this
  /// read, for state().
  virtual std::uint32_t read(EntityId entity) noexcept = 0;

  /// Adds a query with the first `count` elements of its input span, at most its capacity. Zero elements are
  /// allowed.
  /// Misuse: the same query twice in a transaction, since it has one output span.
  virtual void add_query(Query& query, std::uint32_t count) noexcept = 0;

  /// After the outcome: the id of a created entity; invalid if the transaction did not complete.
  virtual EntityId created(std::uint32_t ordinal) const noexcept = 0;
  /// After the outcome: the row that a read found; null if the entity is not in that version, or if the
  /// transaction did not complete. Valid until the next begin.
  virtual const EntityState* state(std::uint32_t ordinal) const noexcept = 0;
  /// Any thread may call it. The outcome is final when this is neither idle nor pending.
  virtual Status status() const noexcept = 0;
  /// Misuse: before the outcome. It aborts where nothing was submitted since the last begin.
  virtual const Outcome& outcome() const noexcept = 0;
};

}  // namespace rtstdb
