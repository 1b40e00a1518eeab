#pragma once
// The port between the transaction engine and the GPU: what a prepared query is to the engine, and who
// executes batches of queries. Tests of the engine bring a simulated executor.
//
// Threads: everything here is called on the engine thread, except PreparedQuery's constructor and destructor.

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include <rtstdb/database.hpp>

#include "rtstdb/store/row_source.hpp"

namespace rtstdb::query {

using store::RowSource;
using store::Shape;
using store::TimeSpan;

/// The cost class of a query: queries of one class share their estimates of cost.
enum class CostClass : std::uint8_t {
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) __VA_ARGS__,
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND
  count
};

/// Its name in rtstdb/query_kinds.def. Not for `count`.
constexpr std::string_view to_string(CostClass kind) noexcept {
  std::string_view names =
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) #__VA_ARGS__ ", "
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND
      ;
  for (auto k = static_cast<std::size_t>(kind); k > 0; --k)
    names.remove_prefix(names.find(", ") + 2);
  return names.substr(0, names.find(", "));
}

/// A prepared query as the engine sees it; implemented beside RayQuery and the other kinds.
class PreparedQuery {
 public:
  /// Unique within the process, from 1 on.
  const std::uint64_t id = next_id();
  /// Set by a run: by how much its most expensive chunk exceeded the predicted cost; 0: no chunk did, or the
  /// batch was not divided.
  double worst_cost_ratio = 0.0;
  /// What the caller gets about the answers that it reads.
  AnswerInfo info;

  explicit PreparedQuery(LatePolicy late = LatePolicy::discard) : late_(late) {}
  virtual ~PreparedQuery() = default;
  LatePolicy late() const noexcept { return late_; }
  virtual CostClass cost_class() const noexcept = 0;
  virtual std::uint32_t capacity() const noexcept = 0;
  /// Into so many parts of about the same cost the engine divides each element of the caller. All other
  /// counts of this interface, and those of AnswerInfo, are of parts: below, a part is called an element.
  virtual std::uint32_t parts_per_element() const noexcept { return 1; }
  /// Checks the first `count` elements: values finite, carriers alive, sizes positive, times not before the
  /// version's. Widens `times` by their times. Returns the first fault.
  virtual std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                        TimeSpan& times) const noexcept = 0;
  /// Number of elements that the last run has answered so far, in the executor's order.
  virtual std::uint32_t answered() const noexcept = 0;
  /// Of the first `answered` of them, the number that is incomplete.
  virtual std::uint32_t incomplete(std::uint32_t answered) const noexcept = 0;
  /// Whether the run will retry incomplete elements.
  virtual bool has_retries() const noexcept { return false; }
  /// Whether an answer of the last run is incomplete or has overflowed.
  virtual bool truncated() const noexcept = 0;
  /// The caller reads the answers of the last run from now on, for `count` elements. All but the first
  /// `answered`, in the executor's order, are marked as incomplete.
  virtual void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept = 0;
  /// The answers of the last run are not published. With LatePolicy::last_good the caller goes on reading the
  /// earlier ones, else it reads none.
  virtual void discard_answers() noexcept = 0;

 protected:
  void set_late(LatePolicy late) noexcept { late_ = late; }

 private:
  static std::uint64_t next_id() noexcept {
    static std::atomic<std::uint64_t> last{0};
    return last.fetch_add(1, std::memory_order_relaxed) + 1;
  }

  LatePolicy late_;
};

/// One batch of a run.
struct Request {
  PreparedQuery* query = nullptr;
  std::uint32_t count = 0;
  /// The span of its elements' times, at most max_query_window_ns; first > last: it has no element.
  TimeSpan times{};
  /// Elements that are predicted to take `chunk_time`; 0: the batch is not divided.
  std::uint32_t per_chunk = 0;
  /// The fraction of per_chunk that the first chunk gets: its elements may cost more than predicted.
  double initial_chunk_fraction = 1.0;
  /// The time that a chunk should take. Where chunks take longer, the following ones are smaller.
  Nanoseconds chunk_time{0};
  /// The engine's note: elements answered at the last preemption point before the deadline.
  std::uint32_t answered_in_time = 0;
};

enum class RunStatus : std::uint8_t {
  done,
  truncated,    ///< at least one answer is incomplete or has overflowed
  partial,      ///< ended at a preemption point; the answers so far are valid
  stopped,      ///< ended at a preemption point; no answer may be used
  device_lost,  ///< no answer may be used
};

/// The structures that a run brought to the device.
struct StructureWork {
  bool refitted = false;       ///< bounds, in a tree that stayed
  bool built = false;          ///< a tree of entities
  std::uint32_t rows = 0;      ///< rows written to the device
  std::uint32_t entities = 0;  ///< of the version, about
  std::uint32_t shapes = 0;    ///< of geometry that deforms
  bool any() const noexcept { return refitted || built || shapes > 0; }
};

struct RunReport {
  RunStatus status = RunStatus::done;
  std::int64_t gpu_ns = 0;
  StructureWork structures = {};
};

/// What an executor calls during a run, on the thread that called run. Between begin_wait and end_wait, and
/// inside on_preemption_point, other transactions may commit; the rows of the version that the run reads stay
/// as they are.
class ExecutorCallbacks {
 public:
  /// How a run goes on after a preemption point.
  enum class Continuation : std::uint8_t {
    go_on,
    finish_in_flight,  ///< ends with the chunk in flight: RunStatus::partial
    stop,              ///< ends: RunStatus::stopped
  };

  virtual ~ExecutorCallbacks() = default;
  /// Around each wait for the device.
  virtual void begin_wait() noexcept = 0;
  virtual void end_wait() noexcept = 0;
  /// Called in a wait. True: a preemption point is wanted; the chunk in flight may end early.
  virtual bool preemption_requested() noexcept { return false; }
  /// Around the time in which a nested run waits, before it begins, for what the device still executes of the
  /// run that it preempts.
  virtual void begin_drain() noexcept {}
  virtual void end_drain() noexcept {}
  /// A chunk is complete and others follow. Inside the call the executor may be run again (a nested run), on
  /// any version, with other queries, and with preemption points of its own.
  virtual Continuation on_preemption_point() noexcept = 0;
};

/// The largest number of runs that may be nested in the outermost one.
inline constexpr std::uint32_t max_nesting = 6;

/// Executes batches of prepared queries on a version: brings the device's copy of rows and structures to that
/// version, runs the queries, leaves the answers in their output spans.
class Executor {
 public:
  virtual ~Executor() = default;
  /// `times` covers all elements of all requests. Returns when the answers are there or the run has ended
  /// early. `callbacks` may be null: then no batch is divided.
  virtual RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                        ExecutorCallbacks* callbacks) noexcept = 0;

  /// There is no device: run returns device_lost at once.
  virtual bool lost() const noexcept { return false; }
  /// Opens another device where the device is lost, unless the last attempt failed too recently. True: there
  /// is a device. Not inside a run. The whole call is one wait of `callbacks`, which may be null.
  virtual bool revive(ExecutorCallbacks* /*callbacks*/) noexcept { return !lost(); }
  /// How long revive takes, about.
  virtual Nanoseconds revival_takes() const noexcept { return Nanoseconds(0); }
};

}  // namespace rtstdb::query
