#pragma once
// The executor on the GPU: geometry pool, TLAS slots and prepared queries. What takes no longer than a chunk is carried
// out in one submission where the scene is small enough for it.
//
// A lost device takes its whole epoch with it: what runs ends as lost, and revive makes another epoch from what the host
// keeps. A query comes to the new device when it is asked for the first time there, and a kernel is compiled by its
// first dispatch, so that the first answer waits for nothing but what it needs.
//
// Threads: after create, the database's thread alone; setup calls are brought there by whoever owns the
// engine.

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "rtstdb/query/device_epoch.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/revival_pace.hpp"

namespace rtstdb::query {

/// Opens the device, the first one and every one after a loss; `compiled` is what the one before had (Device::compiled).
using OpenDevice =
    std::function<Result<std::unique_ptr<gpu::Device>>(const std::vector<std::byte>& compiled)>;

class GpuExecutor final : public Executor {
 public:
  /// `open` is called on the database's thread later on.
  static Result<std::unique_ptr<GpuExecutor>> create(OpenDevice open, const DatabaseOptions& options);

  /// Of the device that the database was opened with.
  const DeviceInfo& device_info() const noexcept { return device_info_; }

  // When the device is lost meanwhile, or was before, these have it revived and are tried once more.
  Result<GeometryId> add_geometry(const std::shared_ptr<const TriangleMesh>& mesh,
                                  const GeometryOptions& options);
  /// Makes the query, connects it to the pool and the slots, and has its shader compiled; add_geometry connects all that
  /// are prepared again where the pool has grown.
  Result<std::unique_ptr<GpuQuery>> prepare(const AnyQueryOptions& options);

  /// Of what was added last.
  Bounds last_bounds() const noexcept { return epoch_->pool.bounds(geometry_count_ - 1); }
  bool knows_geometry(GeometryId id) const noexcept { return !id.valid() || id.index < geometry_count_; }
  RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                ExecutorCallbacks* callbacks) noexcept override;
  bool lost() const noexcept override { return epoch_ == nullptr || epoch_->device.lost() || broken_; }
  bool revive(ExecutorCallbacks* callbacks) noexcept override;
  Nanoseconds revival_takes() const noexcept override { return revival_took_; }

  // Any thread.
  ShapeCounts shape_counts() const noexcept {
    return {refits_.load(std::memory_order_relaxed), builds_.load(std::memory_order_relaxed)};
  }
  /// All but `degraded`.
  Health device_health() const;

 private:
  GpuExecutor(OpenDevice open, const DatabaseOptions& options)
      : open_(std::move(open)), options_(options), fork_join_(options.thread_priority) {}
  Result<GeometryId> add_here(const std::shared_ptr<const TriangleMesh>& mesh,
                              const GeometryOptions& options);
  Result<void> join(GpuQuery& query);
  Result<void> connect(GpuQuery& query);
  /// For a run. False: it can not be had on this device.
  bool is_here(GpuQuery& query) noexcept;
  Result<void> move_here(GpuQuery& query);
  /// Tries again on another device when the first is lost. An exception breaks the epoch: nobody knows what is half
  /// done.
  template <class Step>
  auto on_device(Step step) -> decltype(step());
  Result<void> make_epoch(bool late);
  /// Lets go of all that is on the device, but for what queries that are being destroyed have there.
  void drop_epoch();
  enum class Patience : std::uint8_t { keeps_pace, tries_at_once };
  /// Nothing where there is a device.
  Result<void> try_to_revive(Patience patience);
  Result<void> not_revived(const Error& why);
  /// Waits for what the device executes of the runs that this one preempts. They ask for their slots again when they
  /// resume, so that nothing of theirs has to stay. False: the device is lost.
  bool drain_outer_runs() noexcept;
  /// Executes the requests in as many successive runs as their times need windows. Between two of them is a
  /// preemption point.
  RunReport run_windows(Lanes& lanes, const RowSource& rows, std::span<const Request> requests,
                        const TimeSpan& times, ExecutorCallbacks* callbacks) noexcept;
  void note_counts() noexcept;

  const OpenDevice open_;
  const DatabaseOptions options_;
  threads::ForkJoin fork_join_;
  DeviceInfo device_info_;
  std::shared_ptr<PreparedQueries> prepared_ = std::make_shared<PreparedQueries>();
  accel::KeptGeometries kept_;  // of the epoch before; one that stands has its own
  std::vector<std::byte> compiled_;
  std::uint32_t geometry_count_ = 0;
  std::unique_ptr<DeviceEpoch> epoch_;
  std::uint32_t epoch_number_ = 0;  // of the last one; the first is 1
  bool broken_ = false;             // something was left half done on a device that lives
  std::uint32_t depth_ = 0;
  RevivalPace pace_;
  Nanoseconds revival_took_{0};
  ShapeCounts shapes_before_;  // of epochs that are gone
  std::atomic<std::uint64_t> refits_{0}, builds_{0};

  mutable std::mutex health_mutex_;  // also over changes of epoch_, which any thread may look through
  bool loss_counted_ = false;        // of this epoch
  Health health_;
};

template <class Step>
auto GpuExecutor::on_device(Step step) -> decltype(step()) {
  for (bool again = false;; again = true) {
    try {
      // Whoever sets up can wait, and is not put off.
      if (auto revived = try_to_revive(Patience::tries_at_once); !revived) return revived.error();
      auto result = step();
      if (again || result.ok() || !lost()) return result;
    } catch (...) {
      broken_ = true;
      throw;
    }
  }
}

}  // namespace rtstdb::query
