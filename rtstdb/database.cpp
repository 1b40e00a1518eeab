// Implements Database: it connects the query executor with its device, the transaction engine, the log, and
// the follower of standing queries.

#include <pthread.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <mutex>
#include <new>
#include <optional>
#include <system_error>
#include <thread>
#include <utility>

#include <rtstdb/database.hpp>

#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/gpu/device.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/open_database.hpp"
#include "rtstdb/open_history_range.hpp"
#include "rtstdb/option_check.hpp"
#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/standing/follower.hpp"
#include "rtstdb/standing/query_spec.hpp"
#include "rtstdb/store/material_table.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"

namespace rtstdb {
namespace {

#ifdef RTSTDB_VALIDATION_DEFAULT
constexpr bool validation_default = true;
#else
constexpr bool validation_default = false;
#endif

/// Opens the device on a thread with real-time priority below that of the engine thread. The driver creates
/// its threads during the call, and they inherit the priority, so a software device computes with it. If the
/// priority is refused, the engine reports that for its own threads.
Result<std::unique_ptr<gpu::Device>> open_device(const gpu::DeviceOptions& options, int thread_priority) {
  std::optional<Result<std::unique_ptr<gpu::Device>>> device;
  std::exception_ptr failure;
  std::thread opener([&] {
    if (thread_priority > 0) {
      const sched_param parameters{.sched_priority = std::max(thread_priority - 2, 1)};
      pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    }
    try {
      device.emplace(gpu::Device::open(options));
    } catch (...) {
      failure = std::current_exception();
    }
  });
  opener.join();
  if (failure) std::rethrow_exception(failure);
  return std::move(*device);
}

/// Falls back to a message that is short enough to need no allocation.
Error out_of_memory(std::string_view what, std::string_view name, std::string_view why) noexcept {
  try {
    std::string sentence(what);
    if (!name.empty()) sentence.append(" '").append(name).append("'");
    return {ErrorCode::out_of_memory, sentence.append(why)};
  } catch (const std::bad_alloc&) {
    return {ErrorCode::out_of_memory, "out of memory"};
  }
}

/// Executes `work`; returns an Error if memory runs out or no thread can be created.
template <class Value, class Work>
Result<Value> catch_out_of_memory(std::string_view what, std::string_view name, const Work& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(what, name, " does not fit into memory");
  } catch (const std::system_error&) {
    return out_of_memory(what, name, ": no thread can be created");
  }
}

/// Null: the options name no directory.
Result<std::unique_ptr<transaction::CommitLog>> open_log(const DatabaseOptions& options) {
  const std::filesystem::path& directory = options.durability.directory;
  if (directory.empty()) return std::unique_ptr<transaction::CommitLog>();
  const auto with_directory = [&](const std::string& what) {
    return Error{ErrorCode::file, directory.string() + ": " + what};
  };
  auto disk = log::open_directory(directory);
  if (!disk) return with_directory(disk.error().describe());
  auto opened =
      transaction::CommitLog::open(std::move(disk.value()), {.durability = options.durability,
                                                             .max_entities = options.max_entities,
                                                             .max_geometries = options.max_geometries});
  if (!opened) return Error{opened.error().code, with_directory(opened.error().message).message};
  return opened;
}

/// A geometry with its mesh as it was added.
struct AddedGeometry {
  std::shared_ptr<const TriangleMesh> mesh;
  std::string name;
  bool deforms = false;
};

/// Adds the recovered geometries to the device, in the order of their ids.
Result<std::vector<AddedGeometry>> add_recovered_geometries(const log::World& world,
                                                            query::GpuExecutor& executor) {
  std::vector<AddedGeometry> recovered;
  for (const log::WorldGeometry& geometry : world.geometries) {
    const auto& [id, name, options, file, checksum] = geometry.logged;
    const auto mesh = std::make_shared<const TriangleMesh>(geometry.mesh);
    auto added = executor.add_geometry(mesh, options);
    if (!added)
      return Error{added.error().code, "geometry '" + name + "' of the log: " + added.error().message};
    RTSTDB_ASSERT(added.value() == id);
    recovered.push_back({mesh, name, options.deforms});
  }
  return recovered;
}

/// The default material and the recovered ones.
std::unique_ptr<store::MaterialTable> table_of(std::span<const log::LoggedMaterial> recovered) {
  auto table = std::make_unique<store::MaterialTable>();
  for (const log::LoggedMaterial& material : recovered) {
    table->prepare(material.material, material.name);
    table->publish();
  }
  return table;
}

/// How long add_geometry and add_material wait for room in the log.
constexpr Nanoseconds log_space_timeout{10'000'000'000};

class DatabaseImpl final : public Database {
 public:
  /// `recovered`: recovered geometries, already on the device. `materials`: recovered too. `past`: see
  /// EngineOptions.
  DatabaseImpl(std::unique_ptr<query::GpuExecutor> executor, const DatabaseOptions& options,
               std::unique_ptr<transaction::CommitLog> log, std::vector<AddedGeometry> recovered,
               std::unique_ptr<store::MaterialTable> materials, std::function<void(store::Store&)> past)
      : executor_(std::move(executor)),
        meshes_(std::move(recovered)),
        materials_(std::move(materials)),
        is_history_(static_cast<bool>(past)),
        engine_({.store = {.max_entities = options.max_entities,
                           .retained_changes = options.retained_changes,
                           .geometry_known = [this](GeometryId id) { return executor_->knows_geometry(id); },
                           .material_known = [this](MaterialId id) { return materials_->knows(id); },
                           .max_geometries = options.max_geometries},
                 .queue_capacity = options.queue_capacity,
                 .chunk = options.chunk,
                 .thread_priority = options.thread_priority,
                 .max_reserved_share = options.max_reserved_share,
                 .spin = options.spin,
                 .past = std::move(past)},
                *executor_, options.clock != nullptr ? *options.clock : monotonic_clock_, std::move(log)),
        follower_(engine_, {.max_entities = options.max_entities,
                            .max_geometries = options.max_geometries,
                            .feed_capacity = options.standing_queue_capacity}) {
    for (std::uint32_t index = 0; index < meshes_.size(); ++index) {
      const AddedGeometry& geometry = meshes_[index];
      follower_.make_space_for_geometry();
      follower_.add_geometry(bounds_of(*geometry.mesh), geometry.deforms);
      if (geometry.deforms)
        engine_.call([&, used = standing::Follower::used_positions(*geometry.mesh)]() mutable {
          follower_.keep_bounds(GeometryId{index}, std::move(used));
        });
    }
  }

  const DeviceInfo& device() const noexcept override { return executor_->device_info(); }

  Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name,
                                  const GeometryOptions& options) override {
    require_open("Database::add_geometry");
    return catch_out_of_memory<GeometryId>("geometry", name, [&]() -> Result<GeometryId> {
      if (is_history_) return with_name(name, {ErrorCode::bad_input, "a history can not be written"});
      if (auto valid = validate(mesh); !valid) return with_name(name, valid.error());
      if (auto valid = check_options(options); !valid) return with_name(name, valid.error());
      return add_valid(mesh, name, options);
    });
  }

  Result<MaterialId> add_material(const Material& material, std::string_view name) override {
    require_open("Database::add_material");
    return catch_out_of_memory<MaterialId>("material", name, [&]() -> Result<MaterialId> {
      auto added = add_checked(material, name);
      if (!added)
        return Error{added.error().code, "material '" + std::string(name) + "': " + added.error().message};
      return added;
    });
  }
  std::optional<MaterialId> find_material(std::string_view name) const override {
    const std::lock_guard lock(materials_mutex_);
    return materials_->find(name);
  }
  std::optional<Material> material(MaterialId id) const noexcept override {
    return materials_->find_value(id);
  }

  Result<std::unique_ptr<StandingQuery>> watch(const StandingRegion& query,
                                               const StandingOptions& options) override {
    return watch_spec(query, options);
  }
  Result<std::unique_ptr<StandingQuery>> watch(const StandingRay& query,
                                               const StandingOptions& options) override {
    return watch_spec(query, options);
  }
  Result<std::unique_ptr<StandingQuery>> watch(const StandingNearest& query,
                                               const StandingOptions& options) override {
    return watch_spec(query, options);
  }

  std::unique_ptr<Transaction> make_transaction(const TransactionOptions& options) override {
    return engine_.make_transaction(options);
  }

  Result<void> calibrate(Transaction& transaction) override {
    require_open("Database::calibrate");
    return engine_.calibrate(transaction);
  }
  Result<std::unique_ptr<Reservation>> reserve(const ReservationOptions& options) override {
    require_open("Database::reserve");
    return catch_out_of_memory<std::unique_ptr<Reservation>>("reservation", options.name,
                                                             [&] { return engine_.reserve(options); });
  }

  void submit(Transaction& transaction) noexcept override { engine_.submit(transaction); }
  const Outcome& wait(Transaction& transaction) noexcept override { return engine_.wait(transaction); }
  void cancel(Transaction& transaction) noexcept override { engine_.cancel(transaction); }
  VersionInfo latest() const noexcept override { return engine_.latest(); }

  Version durable() const noexcept override {
    return engine_.log() != nullptr ? engine_.log()->durable() : 0;
  }
  bool wait_until_durable(Version version, Nanoseconds timeout) noexcept override {
    return engine_.log() != nullptr && engine_.log()->wait_until_durable(version, timeout);
  }
  Durability durability() const override {
    return engine_.log() != nullptr ? engine_.log()->state() : Durability{};
  }
  const Recovery& recovery() const noexcept override {
    return engine_.log() != nullptr ? engine_.log()->recovery() : no_recovery_;
  }
  Result<void> close() override {
    follower_.close();
    engine_.close();
    return engine_.log() != nullptr ? engine_.log()->close() : Result<void>();
  }

  Result<std::vector<EntityState>> snapshot(const ReadAt& read_at) const override {
    require_open("Database::snapshot");
    return catch_out_of_memory<std::vector<EntityState>>("a snapshot", {},
                                                         [&] { return engine_.snapshot(read_at); });
  }

  std::optional<GeometryId> find_geometry(std::string_view name) const override {
    const std::lock_guard lock(meshes_mutex_);
    for (std::size_t index = meshes_.size(); index-- > 0;)
      if (meshes_[index].name == name) return GeometryId{static_cast<std::uint32_t>(index)};
    return std::nullopt;
  }
  std::optional<TriangleMesh> geometry(GeometryId id) const override {
    auto mesh = copy_mesh(id, ReadAt::latest());
    if (!mesh) return std::nullopt;
    return std::move(mesh).value();
  }
  Result<TriangleMesh> geometry(GeometryId id, const ReadAt& read_at) const override {
    return catch_out_of_memory<TriangleMesh>("a copy of the geometry", {},
                                             [&] { return copy_mesh(id, read_at); });
  }

  TransactionCounts counts() const noexcept override { return engine_.counts(); }
  SchedulerCounts scheduler_counts() const override { return engine_.scheduler_counts(); }
  ShapeCounts shape_counts() const noexcept override { return executor_->shape_counts(); }

  StandingCounts standing_counts() const noexcept override { return follower_.counts(); }

  Health health() const override {
    Health health = executor_->device_health();
    health.degraded = engine_.degraded();
    const Durability log = durability();
    if (log.last_write_failed) health.degraded.push_back("commits do not become durable: " + log.last_fault);
    if (log.commits_in_gaps != 0)
      health.degraded.push_back(counted(log.commits_in_gaps, "commit") +
                                " could not be recorded because the disk was too slow");
    return health;
  }

 private:
  void require_open(const char* call) const noexcept {
    RTSTDB_REQUIRE(!engine_.is_closing(), call, "the database is closed (Database::close)");
  }

  Result<TriangleMesh> copy_mesh(GeometryId id, const ReadAt& read_at) const {
    TriangleMesh mesh;
    bool deforms = false;
    {
      const std::lock_guard lock(meshes_mutex_);
      if (id.index >= meshes_.size())
        return Error{ErrorCode::bad_input, "geometry " + std::to_string(id.index) + " does not exist"};
      mesh = *meshes_[id.index].mesh;
      deforms = meshes_[id.index].deforms;
    }
    if (!deforms) return mesh;
    require_open("Database::geometry");
    auto positions = engine_.shape(id, mesh.positions_m.size(), read_at);
    if (!positions) return positions.error();
    mesh.positions_m = std::move(positions).value();
    return mesh;
  }

  static Error with_name(std::string_view name, const Error& error) {
    return {error.code, "geometry '" + std::string(name) + "': " + error.message};
  }

  Result<GeometryId> add_valid(const TriangleMesh& mesh, std::string_view name,
                               const GeometryOptions& options) {
    // Held until the mesh is in the list, so that meshes are in the order of their ids.
    const std::lock_guard lock(adding_mutex_);
    AddedGeometry copy{std::make_shared<const TriangleMesh>(mesh), std::string(name), options.deforms};
    {
      const std::lock_guard reading_lock(meshes_mutex_);
      meshes_.reserve(meshes_.size() + 1);
    }
    follower_.make_space_for_geometry();
    std::unique_ptr<store::ShapeHistory::Ring> shapes;
    if (options.deforms) shapes = store::ShapeHistory::make(mesh.positions_m, options.retained_shapes);
    std::optional<log::LoggedGeometry> logged;
    if (transaction::CommitLog* log = engine_.log()) {
      auto written = log->write_geometry(mesh, name, options);
      if (!written) return with_name(name, written.error());
      logged = std::move(written).value();
    }
    auto used_positions =
        options.deforms ? standing::Follower::used_positions(mesh) : std::vector<std::uint32_t>();
    std::optional<Result<GeometryId>> added;
    const auto add_on_engine = [&] {
      if (logged && !engine_.log()->has_space_for(*logged)) return;
      added.emplace(catch_out_of_memory<GeometryId>(
          "it", {}, [&] { return executor_->add_geometry(copy.mesh, options); }));
      if (!*added) return;
      // Before any version that uses the geometry can be read.
      follower_.add_geometry(executor_->last_bounds(), options.deforms);
      if (shapes != nullptr) {
        engine_.keep_shapes(added->value(), std::move(shapes));
        follower_.keep_bounds(added->value(), std::move(used_positions));
      }
      if (logged) logged->id = added->value();
      if (logged) engine_.log()->record_geometry(*logged, mesh.positions_m.size());
    };
    if (auto called = call_until(add_on_engine, [&] { return added.has_value(); }); !called)
      return with_name(name, called.error());
    if (!*added) return with_name(name, added->error());
    const std::lock_guard reading_lock(meshes_mutex_);
    meshes_.push_back(std::move(copy));
    return *added;
  }

  Result<MaterialId> add_checked(const Material& material, std::string_view name) {
    if (is_history_) return Error{ErrorCode::bad_input, "a history can not be written"};
    if (auto valid = validate(material); !valid) return valid.error();
    if (engine_.log() != nullptr && name.size() > log::max_name_bytes)
      return Error{ErrorCode::bad_input, "the name has " + std::to_string(name.size()) +
                                             " bytes; the log allows at most " +
                                             std::to_string(log::max_name_bytes)};
    const std::lock_guard lock(materials_mutex_);
    if (materials_->is_full())
      return Error{ErrorCode::capacity, "a database has at most " + std::to_string(max_materials) +
                                            " materials, the default material included"};
    const MaterialId id = materials_->prepare(material, name);
    std::optional<log::LoggedMaterial> logged;
    if (engine_.log() != nullptr) logged = {id, std::string(name), material};
    bool added = false;
    const auto add_on_engine = [&] {
      if (logged && !engine_.log()->has_space_for(*logged)) return;
      if (logged) engine_.log()->record_material(*logged);
      materials_->publish();
      added = true;
    };
    if (auto called = call_until(add_on_engine, [&] { return added; }); !called) return called.error();
    return id;
  }

  /// Calls `work` on the engine thread until `is_done` holds. Errors: file, if the log has no room for it
  /// within log_space_timeout.
  template <class Work, class IsDone>
  Result<void> call_until(const Work& work, const IsDone& is_done) {
    const ClockTime begin_time = monotonic_clock_.now();
    for (engine_.call(work); !is_done(); engine_.call(work)) {
      if (monotonic_clock_.now() - begin_time > log_space_timeout)
        return Error{ErrorCode::file, "the log has no room: " + durability().last_fault};
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return {};
  }

  Result<std::unique_ptr<Query>> prepare_query(QueryOptionsRef options) override {
    using Made = std::unique_ptr<query::GpuQuery>;
    const std::string& name =
        std::visit([](const auto* of_kind) -> const std::string& { return of_kind->name; }, options);
    require_open("Database::prepare");
    return catch_out_of_memory<std::unique_ptr<Query>>(
        "query", name, [&]() -> Result<std::unique_ptr<Query>> {
          std::optional<Result<Made>> made;
          engine_.call([&] {
            made.emplace(
                catch_out_of_memory<Made>("query", name, [&] { return executor_->prepare(options); }));
          });
          if (!*made) return made->error();
          return std::unique_ptr<Query>(dynamic_cast<Query*>(made->value().release()));
        });
  }

  template <class StandingKind>
  Result<std::unique_ptr<StandingQuery>> watch_spec(const StandingKind& query,
                                                    const StandingOptions& options) {
    require_open("Database::watch");
    const auto spec = standing::make_query_spec(query, options.name);
    if (!spec) return spec.error();
    return catch_out_of_memory<std::unique_ptr<StandingQuery>>(
        "standing query", options.name, [&] { return follower_.watch(spec.value(), options); });
  }

  transaction::MonotonicClock monotonic_clock_;
  std::unique_ptr<query::GpuExecutor> executor_;
  std::mutex adding_mutex_;
  mutable std::mutex meshes_mutex_;
  std::vector<AddedGeometry> meshes_;  // by geometry index
  mutable std::mutex materials_mutex_;
  std::unique_ptr<store::MaterialTable> materials_;
  const bool is_history_;
  const Recovery no_recovery_;
  mutable transaction::Engine engine_;
  standing::Follower follower_;
};

/// `range`: the range of a history; null: a live database.
Result<std::unique_ptr<Database>> open_with(const DatabaseOptions& options, gpu::DeviceOptions device,
                                            log::VersionRange* range) {
  return catch_out_of_memory<std::unique_ptr<Database>>(
      "the database", {}, [&]() -> Result<std::unique_ptr<Database>> {
        if (auto checked = check_options(options); !checked) return checked.error();
        if (auto checked = check_options(options.durability); !checked) return checked.error();
        device.select = options.gpu;
        device.validation = options.validation == Validation::on ||
                            (options.validation == Validation::build_default && validation_default);
        const auto open = [device, priority = options.thread_priority](const auto& compiled) {
          gpu::DeviceOptions with_compiled = device;
          with_compiled.pipeline_cache = compiled;
          return open_device(with_compiled, priority);
        };
        auto executor = query::GpuExecutor::create(open, options);
        if (!executor) return executor.error();
        auto log = open_log(options);
        if (!log) return log.error();
        const log::World* world = range != nullptr ? &range->begin : nullptr;
        if (log.value() != nullptr) world = &log.value()->recovered_world();
        auto recovered = world != nullptr ? add_recovered_geometries(*world, *executor.value())
                                          : Result<std::vector<AddedGeometry>>(std::vector<AddedGeometry>());
        if (!recovered) return recovered.error();
        auto materials =
            table_of(world != nullptr ? world->materials : std::span<const log::LoggedMaterial>());
        std::function<void(store::Store&)> past;
        if (range != nullptr) past = [range](store::Store& store) { apply_range(*range, store); };
        auto database = std::make_unique<DatabaseImpl>(std::move(executor).value(), options,
                                                       std::move(log).value(), std::move(recovered).value(),
                                                       std::move(materials), std::move(past));
        return std::unique_ptr<Database>(std::move(database));
      });
}

}  // namespace

std::vector<DeviceInfo> Database::devices() {
  return gpu::Device::list();
}

Result<std::unique_ptr<Database>> Database::open(const DatabaseOptions& options) {
  return open_database(options, {});
}

Result<std::unique_ptr<Database>> open_database(const DatabaseOptions& options, gpu::DeviceOptions device) {
  return open_with(options, std::move(device), nullptr);
}

Result<std::unique_ptr<Database>> open_history_range(const DatabaseOptions& options,
                                                     log::VersionRange range) {
  return open_with(options, {}, &range);
}

}  // namespace rtstdb
