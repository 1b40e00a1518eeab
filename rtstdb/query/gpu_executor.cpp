#include "rtstdb/query/gpu_executor.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/make_query.hpp"

namespace rtstdb::query {
namespace {

constexpr RunReport lost_report{.status = RunStatus::device_lost, .gpu_ns = 0};

/// Whether one run can cover these times: acceleration structures are built for the times of one run.
bool fit_one_window(const TimeSpan& times) noexcept {
  return times.last - times.first <= Nanoseconds(max_query_window_ns);
}

/// The end of the requests from `first` on whose times fit into one window. Sets `window` to the span of
/// their times.
std::size_t end_of_window(std::span<const Request> requests, std::size_t first, TimeSpan& window) noexcept {
  std::size_t end = first;
  for (; end < requests.size(); ++end) {
    const TimeSpan& times = requests[end].times;
    if (times.first > times.last) continue;  // it has no element
    const TimeSpan both{std::min(window.first, times.first), std::max(window.last, times.last)};
    if (end > first && window.first <= window.last && !fit_one_window(both)) break;
    window = both;
  }
  return end;
}

/// Passes the waits of a run's submissions on to the executor's caller.
class LaneWait final : public accel::WaitCallbacks {
 public:
  explicit LaneWait(ExecutorCallbacks* callbacks) : callbacks_(callbacks) {}
  void begin_wait() noexcept override { callbacks_->begin_wait(); }
  void end_wait() noexcept override { callbacks_->end_wait(); }
  bool halt_requested() noexcept override { return callbacks_->preemption_requested(); }

 private:
  ExecutorCallbacks* callbacks_;
};

/// While it exists, kernels are compiled when they are made.
class CompileNow {
 public:
  explicit CompileNow(gpu::Device& device) : device_(device), before_(device.compiles_on_first_dispatch()) {
    device_.compile_on_first_dispatch(false);
  }
  ~CompileNow() { device_.compile_on_first_dispatch(before_); }
  CompileNow(const CompileNow&) = delete;
  CompileNow& operator=(const CompileNow&) = delete;

 private:
  gpu::Device& device_;
  const bool before_;
};

}  // namespace

Result<std::unique_ptr<GpuExecutor>> GpuExecutor::create(OpenDevice open, const DatabaseOptions& options) {
  std::unique_ptr<GpuExecutor> executor(new GpuExecutor(std::move(open), options));
  if (auto opened = executor->device_.open(); !opened) return opened.error();
  executor->device_info_ = executor->device_.epoch().device.info();
  return executor;
}

Result<GeometryId> GpuExecutor::add_geometry(const std::shared_ptr<const TriangleMesh>& mesh,
                                             const GeometryOptions& options,
                                             const std::shared_ptr<const ConvexParts>& parts) {
  return device_.execute_setup([&] { return add_to_pool(mesh, options, parts); });
}

Result<GeometryId> GpuExecutor::add_to_pool(const std::shared_ptr<const TriangleMesh>& mesh,
                                            const GeometryOptions& options,
                                            const std::shared_ptr<const ConvexParts>& parts) {
  DeviceEpoch& epoch = device_.epoch();
  const CompileNow here(epoch.device);
  auto index = epoch.pool.add(epoch.device, mesh, epoch.setup_lane(), options, parts);
  if (!epoch.pool.is_whole()) {
    device_.mark_broken();
    return index.error();
  }
  // Also after a refusal: the pool may have grown before it.
  if (auto bound = rebind_to_pool(); !bound) return bound.error();
  if (!index) return index.error();
  device_.keep_geometries();
  return GeometryId{index.value()};
}

Result<void> GpuExecutor::rebind_to_pool() {
  DeviceEpoch& epoch = device_.epoch();
  if (epoch.is_bound()) return {};
  Result<void> connected = epoch.rebind();
  // Drivers compile again for buffers of another size.
  if (connected) {
    prepared_->visit([&](GpuQuery& query) {
      if (query.epoch == device_.epoch_number()) connected = connect(query);
      return static_cast<bool>(connected);
    });
  }
  if (!connected) device_.mark_broken();  // the next epoch is made without what was being added
  return connected;
}

Result<void> GpuExecutor::sample_field(GeometryId geometry, FieldSign sign, float front_sign,
                                       std::span<const shared::FieldPoint> points,
                                       std::span<shared::FieldSample> samples) {
  return device_.execute_setup([&]() -> Result<void> {
    DeviceEpoch& epoch = device_.epoch();
    if (!epoch.field_sampler) {
      auto sampler = accel::FieldSampler::create(epoch.device);
      if (!sampler) return sampler.error();
      epoch.field_sampler = std::move(sampler).value();
    }
    return epoch.field_sampler->sample(epoch.device, epoch.pool, geometry.index, sign, front_sign, points,
                                       samples, epoch.setup_lane());
  });
}

Result<void> GpuExecutor::attach_field(GeometryId geometry,
                                       const std::shared_ptr<const field::StoredField>& field) {
  return device_.execute_setup([&]() -> Result<void> {
    DeviceEpoch& epoch = device_.epoch();
    const CompileNow here(epoch.device);
    auto attached = epoch.pool.attach_field(epoch.device, geometry.index, field, epoch.setup_lane());
    auto bound = rebind_to_pool();
    if (attached && !bound) epoch.pool.forget_field(geometry.index);
    return attached ? bound : attached;
  });
}

Result<void> GpuExecutor::remove_last_geometry() {
  return device_.execute_setup([&]() -> Result<void> {
    device_.epoch().pool.remove_last();
    device_.keep_geometries();
    last_withheld_ = false;
    return {};
  });
}

Result<std::unique_ptr<GpuQuery>> GpuExecutor::prepare(QueryOptionsRef options) {
  return device_.execute_setup([&]() -> Result<std::unique_ptr<GpuQuery>> {
    auto query = make_any_query(device_.epoch().device, options);
    if (!query) return query;
    if (auto joined = join(*query.value()); !joined) return joined.error();
    return query;
  });
}

Result<void> GpuExecutor::join(GpuQuery& query) {
  const CompileNow here(device_.epoch().device);
  query.epoch = device_.epoch_number();
  if (auto connected = connect(query); !connected) return connected;
  query.join(prepared_, fork_join_);
  return {};
}

Result<void> GpuExecutor::connect(GpuQuery& query) {
  DeviceEpoch& epoch = device_.epoch();
  query.bound = false;
  if (auto bound = query.bind(epoch.device, epoch.pool, epoch.tlas); !bound) return bound;
  query.bound = true;
  query.bound_generation = epoch.pool.generation();
  epoch.setup_lane().begin();
  query.record_warm_up(epoch.setup_lane().recorder());
  if (!epoch.setup_lane().run())
    return Error{ErrorCode::device_lost, "the GPU stopped answering while a query was prepared"};
  return {};
}

bool GpuExecutor::bring_here(GpuQuery& query) noexcept {
  if (query.bound && query.epoch == device_.epoch_number() &&
      query.bound_generation == device_.epoch().pool.generation())
    return true;
  try {
    return static_cast<bool>(move_here(query));
  } catch (const std::exception&) {
    return false;  // out of memory
  }
}

Result<void> GpuExecutor::move_here(GpuQuery& query) {
  query.bound = false;
  if (query.epoch != device_.epoch_number()) {
    if (auto moved = query.move_to(device_.epoch().device); !moved) return moved;
    query.epoch = device_.epoch_number();
  }
  if (auto bound = query.bind(device_.epoch().device, device_.epoch().pool, device_.epoch().tlas); !bound)
    return bound;
  query.bound = true;
  query.bound_generation = device_.epoch().pool.generation();
  return {};
}

RunReport GpuExecutor::run(const RowSource& rows, std::span<const Request> requests, const TimeSpan& times,
                           ExecutorCallbacks* callbacks) noexcept {
  // Every request may be empty.
  if (times.first > times.last) return {};
  if (lost()) return lost_report;
  DeviceEpoch& epoch = device_.epoch();
  for (const Request& request : requests) {
    if (!bring_here(*static_cast<GpuQuery*>(request.query))) return lost_report;
  }
  if (depth_ > 0) {
    if (callbacks != nullptr) callbacks->begin_drain();
    const bool drained = drain_outer_runs();
    if (callbacks != nullptr) callbacks->end_drain();
    if (!drained) return lost_report;
  }
  Lanes& lanes = epoch.lanes[depth_++];
  ++epoch.structures.runs;
  epoch.structures.appearance = appearance_;
  LaneWait wait(callbacks);
  for (accel::Submit& lane : lanes)
    lane.set_wait_callbacks(callbacks != nullptr ? &wait : nullptr);
  const accel::Tlas::Counts trees = epoch.tlas.counts();
  const accel::GeometryPool::Counts shapes = epoch.pool.counts();
  RunReport report = run_windows(lanes, rows, requests, times, callbacks);
  // Includes the structures of nested runs.
  report.structures = {
      .refitted = epoch.tlas.counts().refits + epoch.tlas.counts().patches > trees.refits + trees.patches,
      .built = epoch.tlas.counts().builds > trees.builds,
      .rows = static_cast<std::uint32_t>(epoch.tlas.counts().rows - trees.rows),
      .entities = rows.index_limit(),
      .shapes = static_cast<std::uint32_t>(epoch.pool.counts().refits - shapes.refits)};
  for (accel::Submit& lane : lanes)
    lane.set_wait_callbacks(nullptr);
  --depth_;
  device_.publish_counts();
  if (report.status != RunStatus::device_lost) device_.note_answered();
  return report;
}

bool GpuExecutor::drain_outer_runs() noexcept {
  for (std::uint32_t outer = 0; outer < depth_; ++outer) {
    for (accel::Submit& lane : device_.epoch().lanes[outer]) {
      if (!lane.finish(true)) return false;
    }
  }
  return true;
}

RunReport GpuExecutor::run_windows(Lanes& lanes, const RowSource& rows, std::span<const Request> requests,
                                   const TimeSpan& times, ExecutorCallbacks* callbacks) noexcept {
  Structures& structures = device_.epoch().structures;
  if (fit_one_window(times)) return ChunkedRun(structures, lanes, rows, requests, times, callbacks).run();
  // A query whose window has not run has an empty batch, not the batch of an earlier run.
  for (const Request& request : requests)
    static_cast<GpuQuery*>(request.query)->begin_batch(0, {rows, structures.pool, *appearance_});
  RunReport all;
  for (std::size_t first = 0; first < requests.size();) {
    if (first > 0 && callbacks != nullptr) {
      switch (callbacks->on_preemption_point()) {
        case ExecutorCallbacks::Continuation::stop:
          all.status = RunStatus::stopped;
          return all;
        case ExecutorCallbacks::Continuation::finish_in_flight:
          all.status = RunStatus::partial;
          return all;
        case ExecutorCallbacks::Continuation::go_on:
          break;
      }
    }
    TimeSpan window;
    const std::size_t end = end_of_window(requests, first, window);
    if (window.first > window.last) window = {rows.time(), rows.time()};  // the requests have no element
    const RunReport report =
        ChunkedRun(structures, lanes, rows, requests.subspan(first, end - first), window, callbacks).run();
    all.gpu_ns += report.gpu_ns;
    if (report.status != RunStatus::done) all.status = report.status;
    if (report.status != RunStatus::done && report.status != RunStatus::truncated) return all;
    first = end;
  }
  return all;
}

bool GpuExecutor::revive(ExecutorCallbacks* callbacks) noexcept {
  if (!lost()) return true;
  RTSTDB_ASSERT(depth_ == 0, "a query is in progress");
  if (callbacks != nullptr) callbacks->begin_wait();
  bool revived = false;
  try {
    revived = static_cast<bool>(device_.revive(RevivableDevice::Patience::keeps_pace));
  } catch (const std::exception&) {
    // Out of memory, or of threads. What is left of the epoch is dropped by the next attempt.
  }
  if (callbacks != nullptr) callbacks->end_wait();
  return revived;
}

}  // namespace rtstdb::query
