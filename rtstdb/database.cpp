// Implements Database: it connects the query executor with its device, the transaction engine, the log,
// the lists of geometries, materials and lights, and the follower of standing queries.

#include <pthread.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/catch_out_of_memory.hpp"
#include "rtstdb/definition_list.hpp"
#include "rtstdb/directory_error.hpp"
#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/geometry_list.hpp"
#include "rtstdb/gpu/device.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/open_database.hpp"
#include "rtstdb/open_history_range.hpp"
#include "rtstdb/option_check.hpp"
#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/standing/follower.hpp"
#include "rtstdb/standing/query_spec.hpp"
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

/// Null: the options name no directory.
Result<std::unique_ptr<transaction::CommitLog>> open_log(const DatabaseOptions& options) {
  const std::filesystem::path& directory = options.durability.directory;
  if (directory.empty()) return std::unique_ptr<transaction::CommitLog>();
  auto disk = log::open_directory(directory);
  if (!disk) return with_directory(directory, {ErrorCode::file, disk.error().describe()});
  auto opened =
      transaction::CommitLog::open(std::move(disk.value()), {.durability = options.durability,
                                                             .max_entities = options.max_entities,
                                                             .max_geometries = options.max_geometries});
  if (!opened) return with_directory(directory, opened.error());
  return opened;
}

class DatabaseImpl final : public Database, private query::Appearance {
 public:
  /// `recovered`: recovered geometries, already on the device. `world` has the recovered materials and
  /// lights; null: none. `spin`, `past`: see EngineOptions.
  DatabaseImpl(std::unique_ptr<query::GpuExecutor> executor, const DatabaseOptions& options, Nanoseconds spin,
               std::unique_ptr<transaction::CommitLog> log, std::vector<ListedGeometry> recovered,
               const log::World* world, std::function<void(store::Store&)> past)
      : executor_(std::move(executor)),
        materials_(world != nullptr ? std::span(world->materials) : std::span<const log::LoggedMaterial>()),
        lights_(world != nullptr ? std::span(world->lights) : std::span<const log::LoggedLight>()),
        is_history_(static_cast<bool>(past)),
        is_virtual_(options.clock != nullptr && options.clock->is_virtual()),
        engine_({.store = {.max_entities = options.max_entities,
                           .retained_changes = options.retained_changes,
                           .geometry_known = [this](GeometryId id) { return executor_->knows_geometry(id); },
                           .material_known = [this](MaterialId id) { return materials_.knows(id); },
                           .light_known = [this](LightId id) { return lights_.knows(id); },
                           .max_geometries = options.max_geometries},
                 .queue_capacity = options.queue_capacity,
                 .chunk = options.chunk,
                 .thread_priority = options.thread_priority,
                 .spin = spin,
                 .past = std::move(past)},
                *executor_, options.clock != nullptr ? *options.clock : monotonic_clock_, std::move(log)),
        follower_(engine_, {.max_entities = options.max_entities,
                            .max_geometries = options.max_geometries,
                            .is_virtual = is_virtual_}),
        geometries_({engine_, *executor_, follower_, options.chunk}, std::move(recovered)) {
    executor_->set_appearance(*this);
  }

  const DeviceInfo& device() const noexcept override { return executor_->device_info(); }

  Result<GeometryId> add_geometry(const TriangleMesh& mesh, std::string_view name,
                                  const GeometryOptions& options) override {
    require_open("Database::add_geometry");
    return catch_out_of_memory<GeometryId>("geometry", name, [&]() -> Result<GeometryId> {
      const auto add = [&]() -> Result<GeometryId> {
        if (is_history_) return history_error();
        if (auto valid = validate(mesh); !valid) return valid.error();
        if (auto valid = check_options(options); !valid) return valid.error();
        return geometries_.add(mesh, name, options);
      };
      auto added = add();
      if (!added) return with_geometry_name(name, added.error());
      return added;
    });
  }

  Result<MaterialId> add_material(const Material& material, std::string_view name) override {
    require_open("Database::add_material");
    return add_definition("material", materials_, material, name, validate_material);
  }
  std::optional<MaterialId> find_material(std::string_view name) const override {
    return materials_.find(name);
  }
  std::optional<Material> material(MaterialId id) const noexcept override {
    return materials_.find_value(id);
  }
  std::uint32_t materials() const noexcept override { return materials_.count(); }

  Result<LightId> add_light(const Light& light, std::string_view name) override {
    require_open("Database::add_light");
    return add_definition("light", lights_, light, name, validate_light);
  }
  std::optional<LightId> find_light(std::string_view name) const override { return lights_.find(name); }
  std::optional<Light> light(LightId id) const noexcept override { return lights_.find_value(id); }

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
  const Outcome& wait(Transaction& transaction) noexcept override {
    const Outcome& outcome = engine_.wait(transaction);
    if (is_virtual_ && outcome.done()) follower_.wait_until_evaluated(outcome.version);
    return outcome;
  }
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
    return geometries_.find(name);
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

  Result<FieldReport> build_field(GeometryId id, const FieldOptions& options) override {
    require_open("Database::build_field");
    return geometries_.build_field(id, options);
  }
  std::optional<FieldReport> field(GeometryId id) const override {
    const auto geometry = geometries_.find(id);
    return geometry ? geometry->field : std::nullopt;
  }

  std::optional<GeometryInfo> geometry_info(GeometryId id) const override {
    const auto geometry = geometries_.find(id);
    return geometry ? std::optional(info_of(*geometry)) : std::nullopt;
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

  static Error history_error() { return {ErrorCode::bad_input, "a history can not be written"}; }

  /// Adds a material or a light.
  template <class Value>
  Result<store::DefinitionId<Value>> add_definition(const char* noun, DefinitionList<Value>& list,
                                                    const Value& value, std::string_view name,
                                                    Result<void> (*validate_value)(const Value&)) {
    using Id = store::DefinitionId<Value>;
    return catch_out_of_memory<Id>(noun, name, [&]() -> Result<Id> {
      const auto add = [&]() -> Result<Id> {
        if (is_history_) return history_error();
        if (auto valid = validate_value(value); !valid) return valid.error();
        return list.add(value, name, engine_);
      };
      auto added = add();
      if (!added)
        return Error{added.error().code, noun + (" '" + std::string(name)) + "': " + added.error().message};
      return added;
    });
  }

  Result<TriangleMesh> copy_mesh(GeometryId id, const ReadAt& read_at) const {
    const auto geometry = geometries_.find(id);
    if (!geometry)
      return Error{ErrorCode::bad_input, "geometry " + std::to_string(id.index) + " does not exist"};
    TriangleMesh mesh = *geometry->mesh;
    if (!geometry->deforms) return mesh;
    require_open("Database::geometry");
    auto positions = engine_.shape(id, mesh.positions_m.size(), read_at);
    if (!positions) return positions.error();
    mesh.positions_m = std::move(positions).value();
    return mesh;
  }

  Result<std::unique_ptr<Query>> prepare_query(QueryOptionsRef options) override {
    using Made = std::unique_ptr<query::GpuQuery>;
    const std::string& name =
        std::visit([](const auto* of_kind) -> const std::string& { return of_kind->name; }, options);
    require_open("Database::prepare");
    return catch_out_of_memory<std::unique_ptr<Query>>(
        "query", name, [&]() -> Result<std::unique_ptr<Query>> {
          if (const auto* const* cone = std::get_if<const ConeQueryOptions*>(&options);
              cone != nullptr && (*cone)->mode == ConeMode::fast) {
            if (auto built = geometries_.build_fields_on_first_use(); !built) return built.error();
          }
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
  DefinitionList<Material> materials_;
  DefinitionList<Light> lights_;
  const bool is_history_;
  const bool is_virtual_;
  const Recovery no_recovery_;
  mutable transaction::Engine engine_;
  standing::Follower follower_;
  GeometryList geometries_;
};

/// `range`: the range of a history; null: a live database.
Result<std::unique_ptr<Database>> open_with(const DatabaseOptions& options, gpu::DeviceOptions device,
                                            Nanoseconds spin, log::VersionRange* range) {
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
        auto recovered = world != nullptr
                             ? add_recovered_geometries(*world, *executor.value())
                             : Result<std::vector<ListedGeometry>>(std::vector<ListedGeometry>());
        if (!recovered) return recovered.error();
        std::function<void(store::Store&)> past;
        if (range != nullptr) past = [range](store::Store& store) { apply_range(*range, store); };
        auto database =
            std::make_unique<DatabaseImpl>(std::move(executor).value(), options, spin, std::move(log).value(),
                                           std::move(recovered).value(), world, std::move(past));
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

Result<std::unique_ptr<Database>> open_database(const DatabaseOptions& options, gpu::DeviceOptions device,
                                                Nanoseconds spin) {
  return open_with(options, std::move(device), spin, nullptr);
}

Result<std::unique_ptr<Database>> open_history_range(const DatabaseOptions& options,
                                                     log::VersionRange range) {
  return open_with(options, {}, transaction::default_spin, &range);
}

}  // namespace rtstdb
