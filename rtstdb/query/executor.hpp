#pragma once
// Between the transaction engine and the GPU side: what a snapshot must tell, what a prepared query is to the
// engine, and who carries out a batch. The engine's tests use a simulated executor.
//
// Threads: everything here is called on the database's thread alone, except that RowSource may be read by
// others where its implementation says so.

#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/store/row_source.hpp"

namespace rtstdb::query {

using store::RowSource;
using store::Shape;
using store::TimeSpan;

enum class QueryKind : std::uint8_t {
  ray_closest,
  ray_any,
  ray_first,
  region,
  region_surface,
  region_triangle,
  nearest,
  overlap,
  count
};

/// A prepared query as the engine sees it; implemented beside RayQuery and its like.
class PreparedQuery {
 public:
  /// Different for each query of the process, from 1 on; the scheduler keeps what it knows of a query by this.
  const std::uint64_t id = next_id();
  std::uint32_t answered_in_time = 0;  ///< of the run under way
  double worst_cost_ratio =
      0.0;  ///< of that: its costliest chunk took so many times what was thought; 0: not divided
  AnswerInfo info;

  explicit PreparedQuery(LatePolicy late = LatePolicy::discard) : late_(late) {}
  virtual ~PreparedQuery() = default;
  LatePolicy late() const noexcept { return late_; }
  virtual QueryKind kind() const noexcept = 0;
  virtual std::uint32_t capacity() const noexcept = 0;
  /// Looks at the first `count` elements: finite, carriers alive, sizes positive, times not before the
  /// version's; widens `times`. The first fault goes to the result.
  virtual std::optional<BadInput> check(std::uint32_t count, const RowSource& rows,
                                        TimeSpan& times) const noexcept = 0;
  /// Elements that the run under way has answered, or the last one, in whatever order the executor has them.
  virtual std::uint32_t answered() const noexcept = 0;
  /// Of the first `answered` of them, those that are incomplete.
  virtual std::uint32_t incomplete(std::uint32_t answered) const noexcept = 0;
  /// Whether some of those are still to be asked again.
  virtual bool has_retries() const noexcept { return false; }
  /// Whether an answer of that run is incomplete or overflowed.
  virtual bool truncated() const noexcept = 0;
  /// The caller reads what the last run left from here on, of `count` elements. Of them all but the first `answered`, in
  /// that order, are marked as incomplete.
  virtual void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept = 0;
  /// The caller does not read it: LatePolicy::last_good, what stood before does; else nothing.
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

struct Request {
  PreparedQuery* query = nullptr;
  std::uint32_t count = 0;
  /// The span of its elements' times, at most max_query_window_ns; first > last: it has no element.
  TimeSpan times{};
  /// Elements that take about `chunk_time` where none is costlier than others; 0: the batch is not divided.
  std::uint32_t per_chunk = 0;
  /// Of those, so much until it is seen what the first take: they may cost more than was thought.
  double initial_chunk_fraction = 1.0;
  /// Half of what an urgent transaction may wait. Where chunks take longer, those that follow are smaller.
  Nanoseconds chunk_time{0};
};

enum class RunStatus : std::uint8_t {
  done,
  truncated,
  partial,  ///< ended in a gap: what was answered until then stands
  stopped,  ///< given up in a gap, no answer may be drawn from it
  device_lost,
};

/// What had to be brought to the device for a run.
struct StructureWork {
  bool refitted = false;       ///< boxes, over a tree that stayed
  bool built = false;          ///< a tree of entities
  std::uint32_t rows = 0;      ///< written to the device
  std::uint32_t entities = 0;  ///< of the version, about
  std::uint32_t shapes = 0;    ///< of geometry that deforms
  bool any() const noexcept { return refitted || built || shapes > 0; }
};

struct RunReport {
  RunStatus status = RunStatus::done;
  std::int64_t gpu_ns = 0;
  StructureWork structures = {};
};

/// Told around an executor's waits for the device, and in the gaps between the chunks of a run, on the thread that
/// called run. Rows of the version being asked stay as they are.
class ExecutorCallbacks {
 public:
  enum class Gap : std::uint8_t {
    go_on,
    finish_in_flight,  ///< what is under way is the last that is answered
    stop,
  };

  virtual ~ExecutorCallbacks() = default;
  /// From here to end_wait others may commit.
  virtual void begin_wait() noexcept = 0;
  virtual void end_wait() noexcept = 0;
  /// Asked within a wait: whether a gap would be of use now. Then the chunk under way may end early.
  virtual bool preemption_requested() noexcept { return false; }
  /// A run that stands in the gap of another begins, `time` after it was called: until then the device was busy with that one.
  virtual void on_outer_drained(Nanoseconds /*time*/) noexcept {}
  /// A chunk is done and others are to come. Inside the call the executor may be run again, on any version and with
  /// other queries, also with gaps of its own, and others may commit.
  virtual Gap on_preemption_point() noexcept = 0;
};

/// So deep may runs stand in one another's gaps.
inline constexpr std::uint32_t max_nesting = 6;

/// Carries out batches of prepared queries on a version: brings the device's copy of rows and structure to
/// that version, runs the queries, leaves the answers in their output spans.
class Executor {
 public:
  virtual ~Executor() = default;
  /// `times` covers every element of every request. Blocks until the answers stand, or a gap says stop.
  /// `callbacks` may be null: then nothing is divided.
  virtual RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                        ExecutorCallbacks* callbacks) noexcept = 0;

  /// There is no device: run says device_lost at once.
  virtual bool lost() const noexcept { return false; }
  /// Where the device is lost, another one takes its place, unless it failed so lately that it is too soon. True: there
  /// is a device. Not inside a run. All of it is a wait that `callbacks` is told of, which may be null.
  virtual bool revive(ExecutorCallbacks* /*meanwhile*/) noexcept { return !lost(); }
  /// How long that takes, about.
  virtual Nanoseconds revival_takes() const noexcept { return Nanoseconds(0); }
};

}  // namespace rtstdb::query
