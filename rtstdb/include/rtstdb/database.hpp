#pragma once
// A real-time spatio-temporal database (paper, Section 4): one world of entities on one GPU.
//
// Units and frames: metres, seconds and radians in the right-handed world frame, unless a name says
// otherwise.
// Time bases: WorldTime for the simulated world, ClockTime for deadlines and costs (time.hpp).
//
// Threads:
//   setup   open, add_geometry, build_field, add_material, add_light, prepare, watch, make_transaction,
//           calibrate, reserve and close allocate and block. Any thread may call them, but not from the tick.
//   tick    submit, execute, wait, cancel, latest, durable, material and light neither allocate nor take a
//           lock. Any number of threads may call them at the same time.
//   other   snapshot, geometry, geometry_info, field, find_geometry, find_material, find_light and the
//           functions for counts and health may be called by any thread; they may allocate and block unless
//           the function says otherwise.
// The database executes transactions on an engine thread; a second thread helps it with large results. Both,
// and the threads of the Vulkan driver, are created inside open. Threads inherit the priority and the CPU
// affinity of their creator, so call open before the calling thread changes its own.
//
// Processes: only the process that opened a database uses it. A child that was forked has none of its
// threads: it executes another program or ends by _exit, or opens a database of its own. submit and execute
// abort there.
//
// Lifetime: transactions, prepared queries, standing queries and reservations must be destroyed before the
// database. Its destructor aborts if a query is left.
//
// Device loss: the database opens another device by itself. A transaction that was using the lost device ends
// as Status::device_lost; waiting transactions are executed when the new device is ready; transactions
// without queries are executed meanwhile. A waiting firm transaction with queries whose deadline lies before
// the expected return of the device ends as device_lost at once. If no device can be opened, the database
// tries again after growing pauses, and transactions with queries end as device_lost in between. Prepared
// queries and their spans stay valid. On the new device the first batch of each kind of query compiles its
// kernels, so that transaction allocates and takes longer.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/durability.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/light.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>
#include <rtstdb/query.hpp>
#include <rtstdb/result.hpp>
#include <rtstdb/srgb.hpp>
#include <rtstdb/standing.hpp>
#include <rtstdb/time.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

enum class Validation : std::uint8_t {
  build_default,  ///< on in dev builds, off in release builds
  on,             ///< the Khronos validation layer; its messages are in Health::validation_messages
  off,
};
const char* to_string(Validation validation) noexcept;

struct DatabaseOptions {
  /// A device's index in devices() ("0"), a part of its name ("llvmpipe"), or "auto": the first discrete
  /// device, else the first integrated one, else the first software one.
  std::string gpu = "auto";
  Validation validation = Validation::build_default;
  std::uint32_t max_entities = 4096;    ///< alive at the same time; 1 to rtstdb::max_entities
  std::uint32_t max_geometries = 1024;  ///< 1 to rtstdb::max_geometries
  /// Number of row changes kept for readers of older versions; one change is one written row. It is also the
  /// largest number of older versions kept. 1 to max_retained_changes.
  std::uint32_t retained_changes = 1u << 16;
  /// Number of transactions that may wait at the same time. When the queue is full, the database cancels a
  /// transaction (CancelledBy::full_queue), best effort first. 1 to max_queue_capacity.
  std::uint32_t queue_capacity = 256;
  /// Upper bound (approximate) on how long a higher-priority query waits for the running one. Large batches
  /// are split into chunks; two chunks are in flight at a time. The cost model sizes the first chunks; each
  /// later chunk is sized by the measured time of those before it, half of this bound per chunk.
  /// If a higher-priority transaction waits and a chunk takes longer than predicted, the database halts it:
  /// elements that have not started are executed later. This needs a device that shares memory with the host,
  /// as software devices do; other devices finish the chunk. A halted chunk still finishes the elements that
  /// it has started, up to eight per processor.
  /// Not split, and so not covered by the bound: building the acceleration structures of a version, and
  /// preparing a batch on the host, which takes time in proportion to its elements. Chunks are not made
  /// shorter than 0.2 ms, or 0.8 ms where the fixed cost of a dispatch exceeds the cost of its elements.
  /// Zero: batches are never split, as under a virtual clock. At most max_option_duration_ns.
  Nanoseconds chunk{1'000'000};
  /// Clock of deadlines and costs; null: CLOCK_MONOTONIC. Must outlive the database.
  const Clock* clock = nullptr;
  /// SCHED_FIFO priority of the database's threads: 1 to 99; 0: ordinary scheduling. The driver's threads,
  /// which compute on a software device, get a priority lower by two, at least 1. If the operating system
  /// refuses the priority, Health::degraded says so.
  int thread_priority = 0;
  /// The part of the world that survives a crash; by default none.
  DurabilityOptions durability{};
};

struct DeviceInfo {
  std::string name{};    ///< "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string driver{};  ///< "llvmpipe Mesa 22.3.6"
  std::string api{};     ///< "1.3.230"
  bool software = false;
  /// It has a queue for graphics: image queries can use the rasteriser (FirstHits::rasterised).
  bool draws = false;
};

struct VersionInfo {
  Version version = 0;
  WorldTime time{};  ///< the version covers world time from here on, up to the next version's time
};

/// Transactions since open. Each submitted transaction is either pending or counted once in the second group,
/// which holds one count per final Status.
struct TransactionCounts {
  std::uint64_t submitted = 0;
  std::uint64_t committed = 0, truncated = 0, late = 0, missed = 0, refused = 0, conflicts = 0, cancelled = 0,
                bad_input = 0, device_lost = 0;
  /// Firm transactions that were published after their deadline. Always 0; anything else is a defect of the
  /// database.
  std::uint64_t firm_late_commits = 0;
  /// Firm transactions published in time whose owner saw the outcome after the deadline, because the
  /// operating system preempted the engine thread in between.
  std::uint64_t firm_delivered_late = 0;
  std::uint64_t hard_misses = 0;  ///< the hard ones among `late`
  /// The ones among `refused` that the log refused: its ring is full or its disk fails (modes group and sync
  /// only).
  std::uint64_t refused_by_log = 0;
};

/// Ratio of predicted to actual cost, over the completed transactions whose queries are of one kind.
struct CostPredictions {
  std::string_view cost_class{};  ///< its name in rtstdb/query_kinds.def
  std::uint64_t count = 0;
  double p01 = 0.0, median = 0.0, p99 = 0.0;  ///< accurate to 4 %, clamped to 1/256 to 256
};

/// How well the scheduler predicted costs and kept deadlines, since open.
struct SchedulerCounts {
  std::vector<CostPredictions> predictions{};
  /// Firm transactions that were admitted by their predicted cost and started (`promised`); of these, the
  /// ones published in time (`kept`), and the ones that missed because of transactions of higher priority
  /// (`outranked`).
  std::uint64_t promised = 0, kept = 0, outranked = 0;
  /// The existing reservations, in the order of their creation.
  std::vector<ReservationCounts> reservations{};
  std::uint64_t restarts = 0;  ///< sum of Outcome::restarts
};

/// How the acceleration structures of deforming geometry were updated, since open.
struct ShapeCounts {
  std::uint64_t refits = 0;    ///< updates that recomputed the boxes of an unchanged tree
  std::uint64_t rebuilds = 0;  ///< refits after which the tree was rebuilt (GeometryOptions::rebuild_growth)
};

struct Health {
  std::vector<std::string> degraded{};             ///< a sentence for each thing that the machine refused
  std::vector<std::string> validation_messages{};  ///< of the validation layer, when it is on
  bool device_lost = false;                        ///< no device at present; see "Device loss" above
  std::uint64_t device_losses = 0;                 ///< since open
  std::string device_loss{};  ///< a sentence on the last device loss and its recovery; empty: none
};

class Database {
 public:
  /// Opens the device, starts the threads and, with DatabaseOptions::durability, recovers the world from the
  /// log.
  /// Errors:
  ///   capacity       an option is outside its range, or the recovered world does not fit into the options
  ///   bad_input      an option is outside its range (durations, shares, priorities, durability)
  ///   no_device      no device fits; the message says what was requested, what was found and what to install
  ///   file           the directory cannot be read or written, is open in another process, or is damaged; the
  ///                  message holds the place
  ///   out_of_memory  host or device memory
  static Result<std::unique_ptr<Database>> open(const DatabaseOptions& options);
  /// The devices that open can choose from, by index. Empty: no device, or no Vulkan loader.
  static std::vector<DeviceInfo> devices();

  /// Closes the database as close() does and ignores its error. Misuse: a standing query still exists.
  virtual ~Database() = default;

  /// The device in use; after a device loss, the last one opened.
  virtual const DeviceInfo& device() const noexcept = 0;

  // ---- setup ----
  // Setup calls run on the engine thread, between transactions. All transactions wait for them, hard ones and
  // ones without queries too. Finish setup before the loop begins.

  /// Copies the mesh to the device and builds its bottom-level acceleration structure (BLAS; paper, Section
  /// 4.2). Ids are assigned in ascending order. Names need not be unique. With a log, the mesh is on disk
  /// when this returns.
  /// Errors: those of validate; bad_input for options outside their range, and in a history (history.hpp);
  /// capacity for more than DatabaseOptions::max_geometries or more triangles than the device can hold, and
  /// for a distance field of more than FieldOptions::max_bytes; out_of_memory; device_lost, if no other
  /// device could be opened; file, if the disk fails or the log has no room for ten seconds.
  virtual Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name,
                                          const GeometryOptions& options) = 0;
  Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name) {
    return add_geometry(mesh, name, {});
  }
  /// Builds the distance field of a geometry that has none (GeometryOptions::field builds it with the
  /// geometry). Other threads may submit transactions during the build: the engine computes the distances in
  /// parts of about DatabaseOptions::chunk and runs transactions between them. Cone queries use the field
  /// from the next transaction on. After a device loss the field is copied to the next device. The log does
  /// not hold fields: a recovered geometry, and one of a history, has none until this is called.
  /// Errors: bad_input for options outside their range, for a geometry that does not exist, that deforms, or
  /// that has a field; capacity, with both numbers, for a field larger than FieldOptions::max_bytes or than
  /// the device can bind; out_of_memory; device_lost, if no other device could be opened.
  virtual Result<FieldReport> build_field(GeometryId id, const FieldOptions& options) = 0;
  /// The report of a geometry's distance field; empty: it has none.
  virtual std::optional<FieldReport> field(GeometryId id) const = 0;
  /// Empty: no such geometry.
  virtual std::optional<GeometryInfo> geometry_info(GeometryId id) const = 0;
  /// The last added geometry of that name, those recovered from the log included; empty: none.
  virtual std::optional<GeometryId> find_geometry(std::string_view name) const = 0;
  /// Registers a material: rows may name it once this has returned. Ids are assigned in ascending order.
  /// Names need not be unique. The log has a material before every row that names it.
  /// Errors: those of validate_material; bad_input in a history (history.hpp), and for a name that the log
  /// cannot hold; capacity for more than max_materials; out_of_memory; file, if the disk fails or the log has
  /// no room for ten seconds.
  virtual Result<MaterialId> add_material(const Material& material, std::string_view name) = 0;
  /// The last added material of that name, those recovered from the log included; empty: none. The default
  /// material has no name.
  virtual std::optional<MaterialId> find_material(std::string_view name) const = 0;
  /// Registers a light, as add_material registers a material. Errors: those of validate_light, and of
  /// add_material with max_lights.
  virtual Result<LightId> add_light(const Light& light, std::string_view name) = 0;
  /// The last added light of that name, those recovered from the log included; empty: none.
  virtual std::optional<LightId> find_light(std::string_view name) const = 0;
  /// Allocates the query's buffers and dispatches its kernels once, since drivers compile at the first
  /// dispatch. Before a cone query in ConeMode::fast, the distance fields of all geometries with
  /// FieldOptions::on_first_use are built that do not exist yet.
  /// Errors: those of build_field, with the geometry's name; capacity, if a count is 0 or above its limit
  /// (limits.hpp); bad_input for options that contradict one another; out_of_memory; device_lost, if no
  /// other device could be opened.
  template <class Options>
  Result<std::unique_ptr<typename Options::Prepared>> prepare(const Options& options) {
    auto query = prepare_query(&options);
    if (!query) return query.error();
    return std::unique_ptr<typename Options::Prepared>(
        static_cast<typename Options::Prepared*>(query.value().release()));
  }
  /// Registers a standing query (standing.hpp). Its first events list the members in the latest version or a
  /// later one; from then on an event follows for each entity that enters or exits.
  /// Errors: bad_input for values that a one-shot query refuses too, for a region or radius that no entity
  /// can be within for any length of time, for a carrier or an excluded entity that does not exist, for k or
  /// ring_capacity outside its range; out_of_memory.
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingRegion& query,
                                                       const StandingOptions& options) = 0;
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingRay& query,
                                                       const StandingOptions& options) = 0;
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingNearest& query,
                                                       const StandingOptions& options) = 0;
  /// A transaction with room for as many operations as the options say. Throws std::bad_alloc if memory runs
  /// out.
  virtual std::unique_ptr<Transaction> make_transaction(const TransactionOptions& options) = 0;
  /// Measures what a transaction costs, so that admission control can predict it. Executes a transaction that
  /// is declared and not submitted several times on the latest version, with parts of its batches and whole.
  /// Nothing is published, but version numbers are used up if it writes. Afterwards the transaction is
  /// declared as before; the contents of its queries' answers are unspecified. Does nothing under a virtual
  /// clock.
  /// Errors: bad_input, if the transaction would end as bad_input or conflict; device_lost.
  virtual Result<void> calibrate(Transaction& transaction) = 0;

  /// Reserves engine time for the transactions that name the reservation (reservation.hpp), until it is
  /// destroyed. All reservations together reserve less than max_reserved_share of it. Calibrate expensive
  /// transactions first: the test of feasibility counts the longest piece of work that cannot be preempted,
  /// as measured so far (a chunk with the largest build of acceleration structures, or a commit of as many
  /// rows).
  /// Errors: bad_input for options outside their range; capacity, with the sums, if the reservation is not
  /// feasible beside the existing ones, if max_reservations exist, and if DatabaseOptions::chunk is zero,
  /// since then the longest piece has no bound.
  virtual Result<std::unique_ptr<Reservation>> reserve(const ReservationOptions& options) = 0;

  // ---- tick ----
  /// Queues the transaction and returns at once. The outcome is final when Transaction::status() is neither
  /// idle nor pending. Misuse: a transaction that was not begun since its last outcome, or of another
  /// database.
  virtual void submit(Transaction& transaction) noexcept = 0;
  /// Blocks until a submitted transaction has its outcome. One thread at a time for each transaction. The
  /// thread polls for 30 us before it sleeps, unless the process has one processor, the thread has a
  /// real-time policy (checked every 10 ms), or DatabaseOptions::thread_priority is set. Under a virtual
  /// clock it also waits until standing queries have been evaluated for the version of a completed
  /// transaction.
  virtual const Outcome& wait(Transaction& transaction) noexcept = 0;
  /// submit and wait.
  const Outcome& execute(Transaction& transaction) noexcept {
    submit(transaction);
    return wait(transaction);
  }
  /// Requests the cancellation of a submitted transaction and returns at once. Any thread may call it; the
  /// caller keeps the transaction alive during the call. A waiting transaction is cancelled at once; a
  /// running one at its next preemption point, or before it is published. A request that comes later, or for
  /// a transaction that is not pending, has no effect. The transaction has one outcome in any case.
  virtual void cancel(Transaction& transaction) noexcept = 0;
  /// The latest published version. Version 0, the empty world, holds from -max_world_time_ns on.
  virtual VersionInfo latest() const noexcept = 0;
  /// Every published version up to this one is on disk. Without a log: 0.
  virtual Version durable() const noexcept = 0;
  /// The properties of a material; empty: there is no such material.
  virtual std::optional<Material> material(MaterialId id) const noexcept = 0;
  /// The properties of a light; empty: there is no such light.
  virtual std::optional<Light> light(LightId id) const noexcept = 0;

  // ---- durability ----
  /// Requests that a version be written to disk now, and blocks until it is there or the timeout `timeout`
  /// has passed.
  /// False: it is not on disk; durability() says why. Without a log: false. Any thread.
  virtual bool wait_until_durable(Version version, Nanoseconds timeout) noexcept = 0;
  virtual Durability durability() const = 0;
  /// The result of reading the log's directory in open.
  virtual const Recovery& recovery() const noexcept = 0;
  /// Waits for the running transaction, cancels all waiting ones (CancelledBy::closing), writes the rest of
  /// the log and closes it. From then on, submitted transactions are cancelled at once; setup calls and
  /// snapshot are misuse; standing queries have failed. The log's directory can be opened again only after
  /// this database is destroyed. A second call has no effect.
  /// Errors: file, if the disk fails; versions up to durable() are on disk all the same.
  virtual Result<void> close() = 0;

  // ---- inspection, not for the tick ----
  /// All entities of a version, by ascending index. Errors: bad_input if the version is unknown or no longer
  /// kept; out_of_memory.
  virtual Result<std::vector<EntityState>> snapshot(const ReadAt& read_at) const = 0;
  /// The mesh with its shape in the latest version; empty: no such geometry. Throws std::bad_alloc if memory
  /// runs out.
  virtual std::optional<TriangleMesh> geometry(GeometryId id) const = 0;
  /// The mesh with its shape in a version. Errors: bad_input if there is no such geometry, if the version is
  /// unknown, or if the shape of a deforming geometry is no longer kept for that version; out_of_memory.
  virtual Result<TriangleMesh> geometry(GeometryId id, const ReadAt& read_at) const = 0;
  virtual TransactionCounts counts() const noexcept = 0;
  virtual SchedulerCounts scheduler_counts() const = 0;
  virtual ShapeCounts shape_counts() const noexcept = 0;
  virtual StandingCounts standing_counts() const noexcept = 0;
  virtual Health health() const = 0;

 private:
  /// A query of the options' class.
  virtual Result<std::unique_ptr<Query>> prepare_query(QueryOptionsRef options) = 0;
};

}  // namespace rtstdb
