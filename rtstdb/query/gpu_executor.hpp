#pragma once
// The executor on the GPU: executes batches of prepared queries on the device's geometry pool and TLAS slots.
// Batches that are not divided, in a scene whose structures need no submission of their own, take one
// submission.
//
// A lost device is replaced (RevivableDevice). A prepared query moves to the new device when it runs there
// for the first time, and a kernel is compiled at its first dispatch, so that the first answer waits for
// nothing that it does not need.
//
// Threads: after create, the engine's; setup calls are made on it (Engine::call). Functions that say so: any.

#include <memory>
#include <span>

#include "rtstdb/query/device_epoch.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/revivable_device.hpp"

namespace rtstdb::query {

class GpuExecutor final : public Executor {
 public:
  /// Misuse while a query is left.
  ~GpuExecutor() override {
    RTSTDB_REQUIRE(prepared_->empty(), "Database's destructor",
                   "a prepared query outlives its database; destroy it first");
  }
  /// `open` is also called later, on the engine thread.
  static Result<std::unique_ptr<GpuExecutor>> create(OpenDevice open, const DatabaseOptions& options);

  /// Sets the materials and lights of rows for image queries. `appearance` must outlive the last run.
  /// Without it, rows name the default material and no light.
  void set_appearance(const Appearance& appearance) noexcept { appearance_ = &appearance; }

  /// Describes the device that the database was opened with.
  const DeviceInfo& device_info() const noexcept { return device_info_; }

  // ---- setup; a device that is lost before or during these calls is replaced, and the call repeated once
  /// `parts`: as for GeometryPool::add.
  Result<GeometryId> add_geometry(const std::shared_ptr<const TriangleMesh>& mesh,
                                  const GeometryOptions& options,
                                  const std::shared_ptr<const ConvexParts>& parts = nullptr);
  /// Creates the query, binds it to the pool and the slots, and has its kernels compiled. add_geometry binds
  /// all prepared queries again when the pool has grown.
  Result<std::unique_ptr<GpuQuery>> prepare(QueryOptionsRef options);

  /// Computes distances to a geometry, for a build of its distance field (accel::FieldSampler).
  Result<void> sample_field(GeometryId geometry, FieldSign sign, float front_sign,
                            std::span<const shared::FieldPoint> points,
                            std::span<shared::FieldSample> samples);
  /// Gives a field to a geometry that has none and does not deform.
  Result<void> attach_field(GeometryId geometry, const std::shared_ptr<const field::StoredField>& field);
  /// True: rows can not name the geometry that was added last. False: they can.
  void withhold_last_geometry(bool withheld) noexcept { last_withheld_ = withheld; }
  /// Removes the geometry that was added last and withheld.
  Result<void> remove_last_geometry();

  /// Bounds of the newest geometry.
  Bounds last_bounds() const noexcept { return device_.epoch().pool.bounds(device_.geometry_count() - 1); }
  bool knows_geometry(GeometryId id) const noexcept {
    return !id.valid() || id.index + (last_withheld_ ? 1u : 0u) < device_.geometry_count();
  }

  RunReport run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                ExecutorCallbacks* callbacks) noexcept override;
  bool lost() const noexcept override { return device_.lost(); }
  bool revive(ExecutorCallbacks* callbacks) noexcept override;
  Nanoseconds revival_takes() const noexcept override { return device_.revival_takes(); }

  // ---- any thread
  ShapeCounts shape_counts() const noexcept { return device_.shape_counts(); }
  /// All but `degraded`.
  Health device_health() const { return device_.health(); }

 private:
  GpuExecutor(OpenDevice open, const DatabaseOptions& options)
      : fork_join_(options.thread_priority), device_(std::move(open), options, *prepared_) {}
  Result<GeometryId> add_to_pool(const std::shared_ptr<const TriangleMesh>& mesh,
                                 const GeometryOptions& options,
                                 const std::shared_ptr<const ConvexParts>& parts);
  /// Binds the slots and the prepared queries to a pool that has grown.
  Result<void> rebind_to_pool();
  Result<void> join(GpuQuery& query);
  Result<void> connect(GpuQuery& query);
  /// Moves and binds the query where it is not on this device yet. False: the device can not hold it.
  bool bring_here(GpuQuery& query) noexcept;
  Result<void> move_here(GpuQuery& query);
  /// Waits for what the device executes of the runs that this one preempts. They ask for their slots again
  /// when they resume, so that nothing of theirs has to stay. False: the device is lost.
  bool drain_outer_runs() noexcept;
  /// Executes the requests in as many successive runs as their times need windows. Between two of them is a
  /// preemption point.
  RunReport run_windows(Lanes& lanes, const RowSource& rows, std::span<const Request> requests,
                        const TimeSpan& times, ExecutorCallbacks* callbacks) noexcept;

  static inline const DefaultAppearance default_appearance;

  threads::ForkJoin fork_join_;
  const Appearance* appearance_ = &default_appearance;
  DeviceInfo device_info_;
  bool last_withheld_ = false;
  const std::shared_ptr<PreparedQueries> prepared_ = std::make_shared<PreparedQueries>();
  RevivableDevice device_;
  std::uint32_t depth_ = 0;  ///< of nested runs
};

}  // namespace rtstdb::query
