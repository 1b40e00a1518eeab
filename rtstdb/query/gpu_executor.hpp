#pragma once
// The executor on the GPU: geometry pool, TLAS slots and prepared queries. What takes no longer than a chunk is carried
// out in one submission where the scene is small enough for it.
//
// Threads: after create, the database's thread alone; setup calls are brought there by whoever owns the
// engine.

#include <array>
#include <atomic>
#include <memory>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/chunked_run.hpp"
#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

class GpuExecutor final : public Executor {
 public:
  static Result<std::unique_ptr<GpuExecutor>> create(gpu::Device& device, const DatabaseOptions& options);

  Result<GeometryId> add_geometry(const TriangleMesh& mesh, const GeometryOptions& options);
  bool knows_geometry(GeometryId id) const noexcept;
  /// Connects a query to the pool and the slots, and has its shader compiled; add_geometry does it again for all
  /// that are prepared where the pool has grown.
  Result<void> bind(GpuQuery& query);
  RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                Meanwhile* meanwhile) noexcept override;
  /// Any thread.
  ShapeCounts shape_counts() const noexcept {
    return {refits_.load(std::memory_order_relaxed), builds_.load(std::memory_order_relaxed)};
  }

 private:
  explicit GpuExecutor(gpu::Device& device) : device_(device) {}
  Result<void> rebind_structures();
  Result<void> connect(GpuQuery& query);
  accel::Submit& setup_lane() noexcept { return lanes_[0][0]; }

  std::shared_ptr<PreparedQueries> prepared_ = std::make_shared<PreparedQueries>();
  gpu::Device& device_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
  Structures structures_{device_, pool_, tlas_};
  std::array<Lanes, max_nesting + 1> lanes_;  // by depth: a run in another's gap has its own
  std::uint32_t depth_ = 0;
  std::uint32_t tlas_generation_ = 0;
  std::atomic<std::uint64_t> refits_{0}, builds_{0};
};

}  // namespace rtstdb::query
