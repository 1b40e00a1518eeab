#pragma once
// The executor on the GPU: geometry pool, TLAS slots and prepared queries, carried out in one submission
// where the scene is small enough for it.
//
// Threads: after create, the database's thread alone; setup calls are brought there by whoever owns the
// engine.

#include <atomic>
#include <memory>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
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
  /// What GpuQuery::record_again is for. False: the device is lost.
  RunReport run_bound(const RowSource& rows, std::span<const Request> requests,
                      const TimeSpan& times) noexcept;
  bool show_shapes(const RowSource& rows) noexcept;
  bool run_again(std::span<const Request> requests, const accel::TlasView& view) noexcept;

  std::shared_ptr<PreparedQueries> prepared_ = std::make_shared<PreparedQueries>();
  gpu::Device& device_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
  accel::Submit submit_;
  std::uint32_t tlas_generation_ = 0;
  std::atomic<std::uint64_t> refits_{0}, builds_{0};
};

}  // namespace rtstdb::query
