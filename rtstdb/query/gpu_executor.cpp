#include "rtstdb/query/gpu_executor.hpp"

#include <algorithm>
#include <utility>

namespace rtstdb::query {
namespace {

constexpr RunReport lost{.status = RunStatus::device_lost, .gpu_ns = 0};

}  // namespace

Result<std::unique_ptr<GpuExecutor>> GpuExecutor::create(gpu::Device& device,
                                                         const DatabaseOptions& options) {
  std::unique_ptr<GpuExecutor> executor(new GpuExecutor(device));
  auto submit = accel::Submit::create(device);
  if (!submit) return submit.error();
  executor->submit_ = std::move(submit).value();
  // A version of a million entities takes half a gigabyte.
  const std::uint32_t slots = options.max_entities > 1u << 17 ? 2 : 4;
  const accel::TlasOptions tlas_options{.max_entities = options.max_entities, .slots = slots};
  auto pool = accel::GeometryPool::create(device, options.max_geometries, executor->submit_);
  if (!pool) return pool.error();
  executor->pool_ = std::move(pool).value();
  auto tlas = accel::Tlas::create(device, tlas_options);
  if (!tlas) return tlas.error();
  executor->tlas_ = std::move(tlas).value();
  if (auto bound = executor->rebind_structures(); !bound) return bound.error();
  executor->submit_.begin();
  executor->tlas_.record_warm_up(executor->submit_.recorder());
  if (!executor->submit_.run())
    return Error{ErrorCode::device_lost, "the GPU stopped answering while the database opened"};
  return executor;
}

Result<void> GpuExecutor::rebind_structures() {
  tlas_generation_ = pool_.generation();
  return tlas_.bind(device_, pool_);
}

Result<GeometryId> GpuExecutor::add_geometry(const TriangleMesh& mesh, const GeometryOptions& options) {
  auto index = pool_.add(device_, mesh, submit_, options);
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
  submit_.begin();
  query.record_warm_up(submit_.recorder());
  if (!submit_.run())
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
  // What setup took is not this transaction's.
  submit_.take_gpu_ns();
  submit_.while_waiting(meanwhile);
  const RunReport report = run_bound(rows, requests, times);
  submit_.while_waiting(nullptr);
  return report;
}

RunReport GpuExecutor::run_bound(const RowSource& rows, std::span<const Request> requests,
                                 const TimeSpan& times) noexcept {
  const auto gpu_query = [](const Request& request) { return static_cast<GpuQuery*>(request.query); };
  if (!show_shapes(rows)) return lost;
  submit_.begin();
  std::uint64_t elements = 0;
  for (const Request& request : requests)
    elements += request.count;
  const auto view =
      tlas_.prepare(rows, {.times = times, .elements = elements, .shapes = pool_.shown()}, submit_);
  if (!view) return lost;
  for (const Request& request : requests) {
    if (request.count > 0) gpu_query(request)->record(request.count, rows, tlas_, *view, submit_.recorder());
  }
  if (!submit_.run()) return lost;
  bool incomplete = false;
  for (const Request& request : requests) {
    gpu_query(request)->unpack(request.count, *view);
    incomplete = incomplete || gpu_query(request)->has_incomplete();
  }
  if (incomplete && !run_again(requests, *view)) return lost;
  const bool truncated =
      std::ranges::any_of(requests, [&](const Request& request) { return gpu_query(request)->truncated(); });
  return {.status = truncated ? RunStatus::truncated : RunStatus::done, .gpu_ns = submit_.take_gpu_ns()};
}

bool GpuExecutor::show_shapes(const RowSource& rows) noexcept {
  if (!pool_.show(device_, rows, submit_)) return false;
  refits_.store(pool_.counts().refits, std::memory_order_relaxed);
  builds_.store(pool_.counts().builds, std::memory_order_relaxed);
  return true;
}

bool GpuExecutor::run_again(std::span<const Request> requests, const accel::TlasView& view) noexcept {
  submit_.begin();
  for (const Request& request : requests)
    static_cast<GpuQuery*>(request.query)->record_again(view, submit_.recorder());
  if (!submit_.run()) return false;
  for (const Request& request : requests)
    static_cast<GpuQuery*>(request.query)->unpack_again(view);
  return true;
}

}  // namespace rtstdb::query
