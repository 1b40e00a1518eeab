#include "rtstdb/query/gpu_executor.hpp"

#include <utility>

namespace rtstdb::query {
namespace {

constexpr RunReport lost{.status = RunStatus::device_lost, .gpu_ns = 0};

}  // namespace

Result<std::unique_ptr<GpuExecutor>> GpuExecutor::create(gpu::Device& device,
                                                         const DatabaseOptions& options) {
  std::unique_ptr<GpuExecutor> executor(new GpuExecutor(device));
  const auto device_free = std::make_shared<accel::Submit::DeviceFree>();
  for (Lanes& lanes : executor->lanes_) {
    for (accel::Submit& lane : lanes) {
      auto submit = accel::Submit::create(device, device_free);
      if (!submit) return submit.error();
      lane = std::move(submit).value();
    }
  }
  accel::Submit& setup = executor->setup_lane();
  // A version of a million entities takes half a gigabyte.
  const std::uint32_t slots = options.max_entities > 1u << 17 ? 2 : 4;
  const accel::TlasOptions tlas_options{.max_entities = options.max_entities, .slots = slots};
  auto pool = accel::GeometryPool::create(device, options.max_geometries, setup);
  if (!pool) return pool.error();
  executor->pool_ = std::move(pool).value();
  auto tlas = accel::Tlas::create(device, tlas_options);
  if (!tlas) return tlas.error();
  executor->tlas_ = std::move(tlas).value();
  if (auto bound = executor->rebind_structures(); !bound) return bound.error();
  setup.begin();
  executor->tlas_.record_warm_up(setup.recorder());
  if (!setup.run())
    return Error{ErrorCode::device_lost, "the GPU stopped answering while the database opened"};
  return executor;
}

Result<void> GpuExecutor::rebind_structures() {
  tlas_generation_ = pool_.generation();
  return tlas_.bind(device_, pool_);
}

Result<GeometryId> GpuExecutor::add_geometry(const TriangleMesh& mesh, const GeometryOptions& options) {
  auto index = pool_.add(device_, mesh, setup_lane(), options);
  // Also after a refusal: the pool may have grown before it.
  if (tlas_generation_ != pool_.generation()) {
    if (auto bound = rebind_structures(); !bound) return bound.error();
    // Drivers compile again for buffers of another size.
    Result<void> connected;
    prepared_->visit([&](GpuQuery& query) {
      connected = connect(query);
      return static_cast<bool>(connected);
    });
    if (!connected) return connected.error();
  }
  if (!index) return index.error();
  return GeometryId{index.value()};
}

bool GpuExecutor::knows_geometry(GeometryId id) const noexcept {
  return !id.valid() || id.index < pool_.count();
}

Result<void> GpuExecutor::bind(GpuQuery& query) {
  if (auto connected = connect(query); !connected) return connected;
  query.join(prepared_);
  return {};
}

Result<void> GpuExecutor::connect(GpuQuery& query) {
  if (auto bound = query.bind(device_, pool_, tlas_); !bound) return bound;
  query.bound = true;
  query.bound_generation = pool_.generation();
  setup_lane().begin();
  query.record_warm_up(setup_lane().recorder());
  if (!setup_lane().run())
    return Error{ErrorCode::device_lost, "the GPU stopped answering while a query was prepared"};
  return {};
}

RunReport GpuExecutor::run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                           Meanwhile* meanwhile) noexcept {
  // Every request may be empty.
  if (times.first > times.last) return {};
  for (const Request& request : requests) {
    GpuQuery& query = *static_cast<GpuQuery*>(request.query);
    if (query.bound && query.bound_generation == pool_.generation()) continue;
    if (!query.bind(device_, pool_, tlas_)) return lost;
    query.bound = true;
    query.bound_generation = pool_.generation();
  }
  // Those whose gap this is. They ask for their slots again, so that nothing of theirs has to stay.
  for (std::uint32_t outer = 0; outer < depth_; ++outer) {
    for (accel::Submit& lane : lanes_[outer]) {
      if (!lane.finish()) return lost;
    }
  }
  Lanes& lanes = lanes_[depth_++];
  ++structures_.runs;
  for (accel::Submit& lane : lanes)
    lane.while_waiting(meanwhile);
  const accel::Tlas::Counts trees = tlas_.counts();
  const accel::GeometryPool::Counts shapes = pool_.counts();
  RunReport report = ChunkedRun(structures_, lanes, rows, requests, times, meanwhile).run();
  // Together with those in its gaps, if there were any.
  report.structures = {
      .refitted = tlas_.counts().refits + tlas_.counts().patches > trees.refits + trees.patches,
      .built = tlas_.counts().builds > trees.builds,
      .rows = static_cast<std::uint32_t>(tlas_.counts().rows - trees.rows),
      .entities = rows.index_limit(),
      .shapes = static_cast<std::uint32_t>(pool_.counts().refits - shapes.refits)};
  for (accel::Submit& lane : lanes)
    lane.while_waiting(nullptr);
  --depth_;
  refits_.store(pool_.counts().refits, std::memory_order_relaxed);
  builds_.store(pool_.counts().builds, std::memory_order_relaxed);
  return report;
}

}  // namespace rtstdb::query
