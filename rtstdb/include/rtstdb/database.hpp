#pragma once
// The database: one world of entities on one GPU.
//
// Threads: open, add_geometry, prepare, reserve, watch and make_transaction are setup calls: they allocate and
// block, and are not for the tick. submit, execute, wait, cancel and latest may be called from any number of threads
// at once and are made for the tick. The database does its work on a thread of its own, and a second one helps it with long
// answers; they and the Vulkan driver's threads are created inside open, so open must run before the caller raises its own
// priority or pins itself (threads inherit both).
//
// A device that is lost is replaced by the database itself: what was on it ends as device_lost, what waits is answered
// later, what only writes goes on. Prepared queries and their spans stay. Until each kind of query has been asked once
// again, transactions compile and allocate.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/durability.hpp>
#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/query.hpp>
#include <rtstdb/result.hpp>
#include <rtstdb/standing.hpp>
#include <rtstdb/time.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

enum class Validation : std::uint8_t {
  build_default,  ///< on in dev builds, off in release builds
  on,             ///< the Khronos validation layer; a message counts as a fault, see Health
  off,
};
const char* to_string(Validation validation) noexcept;

struct DatabaseOptions {
  /// A device's index ("0"), a part of its name ("llvmpipe"), or "auto": discrete, then integrated, then
  /// software.
  std::string gpu = "auto";
  Validation validation = Validation::build_default;
  std::uint32_t max_entities = 4096;
  std::uint32_t max_geometries = 1024;
  /// How many row changes are kept for readers of older versions; one change is one written row. As many versions
  /// before the latest are kept at the most, also of those that changed shapes alone.
  std::uint32_t retained_changes = 1u << 16;
  /// Transactions waiting at once; one more is cancelled (best effort first).
  std::uint32_t queue_capacity = 256;
  /// So long an urgent transaction that asks waits, about, for one that is being carried out: large batches are divided
  /// into chunks, two of which are under way at a time. The first are as large as the cost model says, or small where
  /// it knows little, each next one as the last two took, half of this. Where somebody waits, a chunk that takes longer is
  /// halted, and the one behind it at once, as long as that throws little away: a device that is the processor itself
  /// goes on to the end of the eight elements that each processor has begun; others do not halt. None is made smaller to take less than 0.2 ms, or 0.8 ms of which most goes with the dispatch
  /// rather than its elements. What brings a version's structures to the device is not divided, nor what the
  /// host does with a batch before its first chunk: up to some 30 ns for each element. Zero: nothing is, as
  /// with a virtual clock. At most max_option_duration_ns, as spin.
  Nanoseconds chunk{1'000'000};
  /// The share of each length of time that reservations may ask for together: above 0, at most 1. The rest is for what is
  /// measured too low, and for all others.
  double max_reserved_share = 0.8;
  /// So long, at most, one who waits for an outcome looks for it before he sleeps, and the database's thread for work: where
  /// the processors are idle a wake-up takes longer than a small transaction. Neither does it where it does not pay, on one
  /// processor, or with real-time priority (a waiting thread's is noticed within 10 ms). Zero: never.
  Nanoseconds spin{30'000};
  /// The deadline clock; null: CLOCK_MONOTONIC. Must outlive the database.
  const Clock* clock = nullptr;
  /// Row changes that wait for the thread that follows standing queries; allocated with the first of them. A version that finds no
  /// room is not lost to them, but what it and those after it wrote is found at a later one (EventCause::gap).
  std::uint32_t followed_changes = 1u << 14;
  /// SCHED_FIFO priority of the database's threads, 0: ordinary. The driver's threads, which do the computing
  /// on a software device, get two less. Where it is refused, Health says so.
  int thread_priority = 0;
  /// What survives; by default nothing.
  DurabilityOptions durability{};
};

struct DeviceInfo {
  std::string name{};    ///< "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string driver{};  ///< "llvmpipe Mesa 22.3.6"
  std::string api{};     ///< "1.3.230"
  bool software = false;
};

struct VersionInfo {
  Version version = 0;
  WorldTime time{};  ///< from when it holds
};

/// Every submitted transaction is pending or counted once in the second group.
struct TransactionCounts {
  std::uint64_t submitted = 0;
  std::uint64_t committed = 0, truncated = 0, late = 0, missed = 0, refused = 0, conflicts = 0, cancelled = 0,
                bad_input = 0, device_lost = 0;
  /// Firm commits that could be read only after their deadline: always 0, or the database broke its word.
  std::uint64_t firm_late_commits = 0;
  /// Firm commits made in time whose outcome reached its owner after the deadline: between the two the
  /// operating system took the processor away.
  std::uint64_t firm_handed_over_late = 0;
  std::uint64_t hard_misses = 0;  ///< of those late: of class hard
  /// Of those refused: writes that the log had no room for, or whose disk refuses. Group and sync alone.
  std::uint64_t refused_by_log = 0;
};

/// Predicted over actual cost of the transactions that asked queries of one kind and were done.
struct CostPredictions {
  std::string_view kind{};
  std::uint64_t count = 0;
  double p01 = 0.0, median = 0.0, p99 = 0.0;  ///< to 4 %, within 1/256 to 256
};

/// How well the scheduler foresaw.
struct SchedulerCounts {
  std::vector<CostPredictions> predictions{};
  /// Firm transactions that were admitted by their predicted costs and carried out; those that were in time; and those
  /// that were not, since more important ones came.
  std::uint64_t promised = 0, kept = 0, outranked = 0;
  /// Those that stand, in the order in which they were made.
  std::vector<ReservationCounts> reservations{};
  std::uint64_t restarts = 0;  ///< see Outcome::restarts
};

/// How the shapes of geometry that deforms came to the device so far.
struct ShapeCounts {
  std::uint64_t refits = 0;    ///< boxes made anew over the tree as it was
  std::uint64_t rebuilds = 0;  ///< of them followed by another tree (GeometryOptions::rebuild_growth)
};

struct Health {
  std::vector<std::string> degraded{};             ///< what the machine did not permit, in words
  std::vector<std::string> validation_messages{};  ///< of the validation layer, when it is on
  bool device_lost = false;         ///< there is none at present: what asks is answered device_lost
  std::uint64_t device_losses = 0;  ///< so far
  std::string device_loss{};        ///< what became of the last one, in words; empty: there was none
};

class Database {
 public:
  /// Errors: no_device with a sentence that says what was looked for, what was found and what to install. Where there is a directory
  /// for what survives: file, when the disk refuses, another process has it, or what is there is damaged, with the place; capacity,
  /// when the world that is there does not fit into the options.
  static Result<std::unique_ptr<Database>> open(const DatabaseOptions& options);
  /// The devices that open could choose from, in the order of their index. Empty: none, or no Vulkan at all.
  static std::vector<DeviceInfo> devices();

  /// As close, without an answer.
  virtual ~Database() = default;

  virtual const DeviceInfo& device() const noexcept = 0;

  // ---- setup ----
  // Transactions wait meanwhile, also hard ones and those that only write: tens of milliseconds for a query or a small mesh, longer for large
  // ones and to calibrate. Set up before the loop begins.

  /// Copies the mesh to the device and builds its structure there. Errors: what validate says; capacity; bad_input
  /// for options that are out of their range. Where there is a log, the mesh is on disk when this returns; file, when the disk
  /// refuses, or has not made room in the log for ten seconds.
  virtual Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name,
                                          const GeometryOptions& options) = 0;
  Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name) {
    return add_geometry(mesh, name, {});
  }
  /// The newest geometry of that name, also one that was there when the database was opened.
  virtual std::optional<GeometryId> find_geometry(std::string_view name) const = 0;
  /// Allocates the query's buffers and runs its pipeline once, since drivers compile at the first dispatch. Here and in
  /// add_geometry, device_lost is an error only where another device does not take the lost one's place.
  /// Errors: capacity, out_of_memory, device_lost; bad_input for options that contradict one another.
  template <class Options>
  Result<std::unique_ptr<typename Options::Prepared>> prepare(const Options& options) {
    auto query = prepare_query(options);
    if (!query) return query.error();
    return std::unique_ptr<typename Options::Prepared>(
        static_cast<typename Options::Prepared*>(query.value().release()));
  }
  /// Registers a standing query: the membership in the latest version or a later one, and from then on who comes and goes. Errors:
  /// bad_input for a question that one-shot queries refuse too or that nobody can be in for any time, for a carrier or an excluded entity
  /// that does not live, for k or a ring's capacity out of range; out_of_memory.
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingRegion& asked,
                                                       const StandingOptions& options) = 0;
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingRay& asked,
                                                       const StandingOptions& options) = 0;
  virtual Result<std::unique_ptr<StandingQuery>> watch(const StandingNearest& asked,
                                                       const StandingOptions& options) = 0;
  /// Throws std::bad_alloc where memory runs out.
  virtual std::unique_ptr<Transaction> make_transaction(const TransactionOptions& options) = 0;
  /// Carries out a transaction that is declared and not submitted some times on the world as it stands, with parts of its
  /// batches and whole, to learn what it costs; publishes nothing, but version numbers are used up where it writes.
  /// Afterwards it is declared as it was, and what its queries answer is not to be used. Nothing under a virtual clock.
  /// Errors: bad_input for what would be its outcome, also for a conflict; device_lost.
  virtual Result<void> calibrate(Transaction& transaction) = 0;

  /// Keeps time free for transactions that name it (reservation.hpp), until it is destroyed. Calibrate what is dear first:
  /// the longest piece of work that can not be interrupted is a chunk with the largest build of structures, or a commit of
  /// as many rows, as was measured until now. Transactions wait meanwhile.
  /// Errors: bad_input for options out of their range; capacity, with the sums, when it can not be kept beside those that
  /// stand, and where DatabaseOptions::chunk is zero, so that no piece has an end.
  virtual Result<std::unique_ptr<Reservation>> reserve(const ReservationOptions& options) = 0;

  // ---- tick ----
  /// Hands the transaction over and returns at once. Its outcome is final when its status says so.
  virtual void submit(Transaction& transaction) noexcept = 0;
  /// Waits for the outcome of a submitted transaction.
  virtual const Outcome& wait(Transaction& transaction) noexcept = 0;
  const Outcome& execute(Transaction& transaction) noexcept {
    submit(transaction);
    return wait(transaction);
  }
  /// Asks that a submitted transaction come to nothing. From any thread, which sees to it that the transaction is there
  /// during the call. One that waits is cancelled at once, one that is being carried out between two chunks or before it
  /// is published; whoever comes later changes nothing. Whichever it is, the transaction has one outcome.
  virtual void cancel(Transaction& transaction) noexcept = 0;
  virtual VersionInfo latest() const noexcept = 0;
  /// Every version up to this one is on disk, or came to nothing. Without a log: 0.
  virtual Version durable() const noexcept = 0;

  // ---- what survives
  /// Sees to it that a version gets to the disk soon and waits for that, so long at most. False: it is not there, see durability().
  /// Any thread; blocks.
  virtual bool wait_until_durable(Version version, Nanoseconds at_most) noexcept = 0;
  virtual Durability durability() const = 0;
  /// What was found when the database was opened.
  virtual const Recovery& recovery() const noexcept = 0;
  /// Lets the transaction that runs finish, cancels all that wait, writes down what is left to write and ends the log. From then on
  /// transactions are cancelled at once, and setup and looking into versions are misuse. Errors: file, when the disk refuses; what
  /// durable() says is safe all the same. Again: does nothing. The log's directory is another database's to open once this one
  /// is destroyed.
  virtual Result<void> close() = 0;

  // ---- looking in from outside the tick ----
  /// All entities of a version, by ascending index. Errors: bad_input when the version is unknown or no
  /// longer kept; out_of_memory.
  virtual Result<std::vector<EntityState>> snapshot(const ReadAt& read_at) const = 0;
  /// As it stands in the latest version; empty: there is no such geometry. Throws std::bad_alloc where memory runs out.
  virtual std::optional<TriangleMesh> geometry(GeometryId id) const = 0;
  /// As it stands in a version. Errors: bad_input when there is no such geometry, when the version is unknown, or
  /// when a shape of geometry that deforms is no longer kept for it; out_of_memory.
  virtual Result<TriangleMesh> geometry(GeometryId id, const ReadAt& read_at) const = 0;
  virtual TransactionCounts counts() const noexcept = 0;
  virtual SchedulerCounts scheduler_counts() const = 0;
  virtual ShapeCounts shape_counts() const noexcept = 0;
  virtual StandingCounts standing_counts() const noexcept = 0;
  virtual Health health() const = 0;

 private:
  /// A query of the options' class.
  virtual Result<std::unique_ptr<Query>> prepare_query(const AnyQueryOptions& options) = 0;
};

}  // namespace rtstdb
