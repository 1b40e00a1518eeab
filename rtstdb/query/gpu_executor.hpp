#pragma once
// The executor on the GPU: geometry pool, TLAS slots and prepared queries, carried out in one submission where the scene is
// small enough for it.
//
// Threads: setup calls hold the executor's lock against the database's thread; run is the database's thread.

#include <mutex>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {

class GpuExecutor final : public Executor {
 public:
  static Result<std::unique_ptr<GpuExecutor>> create(gpu::Device& device, const DatabaseOptions& options);

  Result<GeometryId> add_geometry(const TriangleMesh& mesh);
  bool knows_geometry(GeometryId id) const noexcept;
  /// Connects a query to the pool and the slots. Every query must have been bound since the last add_geometry, or its next
  /// run does it.
  Result<void> bind(GpuQuery& query);
  RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times) noexcept override;

 private:
  explicit GpuExecutor(gpu::Device& device) : device_(device) {}
  Result<void> rebind_structures();

  gpu::Device& device_;
  mutable std::mutex mutex_;
  accel::GeometryPool pool_;
  accel::Tlas tlas_;
  accel::Submit submit_;
  std::uint32_t tlas_generation_ = 0;
};

}  // namespace rtstdb::query
