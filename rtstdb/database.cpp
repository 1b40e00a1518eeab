// The public face put together: a device, the executor that answers queries on it, and the engine that orders
// transactions.

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

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/gpu/device.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "rtstdb/open_database.hpp"
#include "rtstdb/open_past.hpp"
#include "rtstdb/option_check.hpp"
#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/query/nearest_query.hpp"
#include "rtstdb/query/overlap_query.hpp"
#include "rtstdb/query/ray_query.hpp"
#include "rtstdb/query/region_query.hpp"
#include "rtstdb/standing/follower.hpp"
#include "rtstdb/standing/question.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"

namespace rtstdb {
namespace {

#ifdef RTSTDB_VALIDATION_DEFAULT
constexpr bool validation_default = true;
#else
constexpr bool validation_default = false;
#endif

/// The driver makes its threads while the device opens, and threads inherit scheduling: a software device
/// then computes with real-time priority, below the database's own thread. Where that is refused the engine
/// says so.
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

/// Where not even a sentence fits; this does without memory of its own.
Error out_of_memory(std::string_view what, std::string_view name, std::string_view why) noexcept {
  try {
    std::string sentence(what);
    if (!name.empty()) sentence.append(" '").append(name).append("'");
    return {ErrorCode::out_of_memory, sentence.append(why)};
  } catch (const std::bad_alloc&) {
    return {ErrorCode::out_of_memory, "out of memory"};
  }
}

/// Setup answers with an error when memory runs out; the tick allocates nothing.
template <class Value, class Work>
Result<Value> unless_out_of_memory(std::string_view what, std::string_view name, const Work& work) noexcept {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return out_of_memory(what, name, " does not fit into memory");
  } catch (const std::system_error&) {
    return out_of_memory(what, name, " can have no thread");
  }
}

/// None: nothing is to survive.
Result<std::unique_ptr<transaction::CommitLog>> open_log(const DatabaseOptions& options) {
  const std::filesystem::path& directory = options.durability.directory;
  if (directory.empty()) return std::unique_ptr<transaction::CommitLog>();
  const auto with_place = [&](const std::string& what) {
    return Error{ErrorCode::file, directory.string() + ": " + what};
  };
  auto disk = log::open_directory(directory);
  if (!disk) return with_place(disk.error().in_words());
  auto opened =
      transaction::CommitLog::open(std::move(disk.value()), {.durability = options.durability,
                                                             .max_entities = options.max_entities,
                                                             .max_geometries = options.max_geometries});
  if (!opened) return Error{opened.error().code, with_place(opened.error().message).message};
  return opened;
}

/// A geometry as it was added.
struct Added {
  std::shared_ptr<const TriangleMesh> mesh;
  std::string name;
  bool deforms = false;
};

/// Brings what a log told of to the device, in its order.
Result<std::vector<Added>> add_recovered(const log::World& world, query::GpuExecutor& executor) {
  std::vector<Added> known;
  for (const log::WorldGeometry& geometry : world.geometries) {
    const auto& [id, name, options, file, checksum] = geometry.logged;
    const auto mesh = std::make_shared<const TriangleMesh>(geometry.mesh);
    auto added = executor.add_geometry(mesh, options);
    if (!added)
      return Error{added.error().code, "geometry '" + name + "' of the log: " + added.error().message};
    RTSTDB_ASSERT(added.value() == id);
    known.push_back({mesh, name, options.deforms});
  }
  return known;
}

/// How long add_geometry waits for room in the log.
constexpr Nanoseconds longest_wait_for_log{10'000'000'000};

class DatabaseImpl final : public Database {
 public:
  /// `known`: what the log told of, on the device already. `past`: see EngineOptions.
  DatabaseImpl(std::unique_ptr<query::GpuExecutor> executor, const DatabaseOptions& options,
               std::unique_ptr<transaction::CommitLog> log, std::vector<Added> known,
               std::function<void(store::Store&)> past)
      : executor_(std::move(executor)),
        meshes_(std::move(known)),
        is_past_(static_cast<bool>(past)),
        engine_({.store = {.max_entities = options.max_entities,
                           .retained_changes = options.retained_changes,
                           .geometry_known = [this](GeometryId id) { return executor_->knows_geometry(id); },
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
                            .feed_capacity = options.followed_changes}) {
    for (std::uint32_t index = 0; index < meshes_.size(); ++index) {
      const Added& geometry = meshes_[index];
      follower_.make_room_for_geometry();
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
    return unless_out_of_memory<GeometryId>("geometry", name, [&]() -> Result<GeometryId> {
      if (is_past_) return named(name, {ErrorCode::bad_input, "a history is read-only"});
      if (auto valid = validate(mesh); !valid) return named(name, valid.error());
      if (auto valid = check_options(options); !valid) return named(name, valid.error());
      return add_valid(mesh, name, options);
    });
  }

  Result<std::unique_ptr<RayQuery>> prepare(const RayQueryOptions& options) override {
    return prepare_on_engine<RayQuery, query::GpuRayQuery>(options);
  }
  Result<std::unique_ptr<RegionQuery>> prepare(const RegionQueryOptions& options) override {
    return prepare_on_engine<RegionQuery, query::GpuRegionQuery>(options);
  }
  Result<std::unique_ptr<NearestQuery>> prepare(const NearestQueryOptions& options) override {
    return prepare_on_engine<NearestQuery, query::GpuNearestQuery>(options);
  }
  Result<std::unique_ptr<OverlapQuery>> prepare(const OverlapQueryOptions& options) override {
    return prepare_on_engine<OverlapQuery, query::GpuOverlapQuery>(options);
  }

  Result<std::unique_ptr<StandingQuery>> watch(const StandingRegion& asked,
                                               const StandingOptions& options) override {
    return watch_question(asked, options);
  }
  Result<std::unique_ptr<StandingQuery>> watch(const StandingRay& asked,
                                               const StandingOptions& options) override {
    return watch_question(asked, options);
  }
  Result<std::unique_ptr<StandingQuery>> watch(const StandingNearest& asked,
                                               const StandingOptions& options) override {
    return watch_question(asked, options);
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
    return unless_out_of_memory<std::unique_ptr<Reservation>>("reservation", options.name,
                                                              [&] { return engine_.reserve(options); });
  }

  void submit(Transaction& transaction) noexcept override { engine_.submit(transaction); }
  const Outcome& wait(Transaction& transaction) noexcept override { return engine_.wait(transaction); }
  void cancel(Transaction& transaction) noexcept override { engine_.cancel(transaction); }
  VersionInfo latest() const noexcept override { return engine_.latest(); }

  Version durable() const noexcept override {
    return engine_.log() != nullptr ? engine_.log()->durable() : 0;
  }
  bool wait_until_durable(Version version, Nanoseconds at_most) noexcept override {
    return engine_.log() != nullptr && engine_.log()->wait_until_durable(version, at_most);
  }
  Durability durability() const override {
    return engine_.log() != nullptr ? engine_.log()->state() : Durability{};
  }
  const Recovery& recovery() const noexcept override {
    return engine_.log() != nullptr ? engine_.log()->recovery() : nothing_recovered_;
  }
  Result<void> close() override {
    follower_.close();
    engine_.close();
    return engine_.log() != nullptr ? engine_.log()->close() : Result<void>();
  }

  Result<std::vector<EntityState>> snapshot(const ReadAt& read_at) const override {
    require_open("Database::snapshot");
    return unless_out_of_memory<std::vector<EntityState>>("a snapshot", {},
                                                          [&] { return engine_.snapshot(read_at); });
  }

  std::optional<GeometryId> find_geometry(std::string_view name) const override {
    const std::lock_guard lock(meshes_mutex_);
    for (std::size_t index = meshes_.size(); index-- > 0;)
      if (meshes_[index].name == name) return GeometryId{static_cast<std::uint32_t>(index)};
    return std::nullopt;
  }
  std::optional<TriangleMesh> geometry(GeometryId id) const override {
    auto mesh = copy_of(id, ReadAt::latest());
    if (!mesh) return std::nullopt;
    return std::move(mesh).value();
  }
  Result<TriangleMesh> geometry(GeometryId id, const ReadAt& read_at) const override {
    return unless_out_of_memory<TriangleMesh>("a copy of the geometry", {},
                                              [&] { return copy_of(id, read_at); });
  }

  TransactionCounts counts() const noexcept override { return engine_.counts(); }
  SchedulerCounts scheduler_counts() const override { return engine_.scheduler_counts(); }
  ShapeCounts shape_counts() const noexcept override { return executor_->shape_counts(); }

  StandingCounts standing_counts() const noexcept override { return follower_.counts(); }

  Health health() const override {
    Health health = executor_->device_health();
    health.degraded = engine_.degraded();
    const Durability log = durability();
    if (log.refused_by_disk) health.degraded.push_back("nothing becomes durable now: " + log.last_fault);
    if (log.commits_in_gaps != 0)
      health.degraded.push_back(std::to_string(log.commits_in_gaps) +
                                " commits were not recorded, since the disk was slower than they came");
    return health;
  }

 private:
  void require_open(const char* call) const noexcept {
    RTSTDB_REQUIRE(!engine_.is_closing(), call, "the database is closed (Database::close)");
  }

  Result<TriangleMesh> copy_of(GeometryId id, const ReadAt& read_at) const {
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

  static Error named(std::string_view name, const Error& error) {
    return {error.code, "geometry '" + std::string(name) + "': " + error.message};
  }

  Result<GeometryId> add_valid(const TriangleMesh& mesh, std::string_view name,
                               const GeometryOptions& options) {
    // Held over both, so that meshes stand in the order of their ids.
    const std::lock_guard lock(adding_mutex_);
    Added copy{std::make_shared<const TriangleMesh>(mesh), std::string(name), options.deforms};
    {
      const std::lock_guard reading_lock(meshes_mutex_);
      meshes_.reserve(meshes_.size() + 1);
    }
    follower_.make_room_for_geometry();
    std::unique_ptr<store::ShapeHistory::Kept> shapes;
    if (options.deforms) shapes = store::ShapeHistory::make(mesh.positions_m, options.kept_shapes);
    std::optional<log::LoggedGeometry> logged;
    if (transaction::CommitLog* log = engine_.log()) {
      auto written = log->write_geometry(mesh, name, options);
      if (!written) return named(name, written.error());
      logged = std::move(written).value();
    }
    auto used_positions =
        options.deforms ? standing::Follower::used_positions(mesh) : std::vector<std::uint32_t>();
    std::optional<Result<GeometryId>> added;
    const auto add = [&] {
      if (logged && !engine_.log()->room_for(*logged)) return;
      added.emplace(unless_out_of_memory<GeometryId>(
          "it", {}, [&] { return executor_->add_geometry(copy.mesh, options); }));
      if (!*added) return;
      // Before any version can be read that names it.
      follower_.add_geometry(executor_->last_bounds(), options.deforms);
      if (shapes != nullptr) {
        engine_.keep_shapes(added->value(), std::move(shapes));
        follower_.keep_bounds(added->value(), std::move(used_positions));
      }
      if (logged) logged->id = added->value();
      if (logged) engine_.log()->record_geometry(*logged, mesh.positions_m.size());
    };
    const ClockTime begun = monotonic_clock_.now();
    for (engine_.call(add); !added; engine_.call(add)) {
      if (monotonic_clock_.now() - begun > longest_wait_for_log)
        return named(name, {ErrorCode::file, "the log has no room: " + durability().last_fault});
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    if (!*added) return named(name, added->error());
    const std::lock_guard reading_lock(meshes_mutex_);
    meshes_.push_back(std::move(copy));
    return *added;
  }

  template <class Public, class Prepared, class Options>
  Result<std::unique_ptr<Public>> prepare_on_engine(const Options& options) {
    using Made = std::unique_ptr<Prepared>;
    require_open("Database::prepare");
    return unless_out_of_memory<std::unique_ptr<Public>>(
        "query", options.name, [&]() -> Result<std::unique_ptr<Public>> {
          std::optional<Result<Made>> made;
          engine_.call([&] {
            made.emplace(unless_out_of_memory<Made>("query", options.name,
                                                    [&] { return executor_->prepare<Prepared>(options); }));
          });
          if (!*made) return made->error();
          return std::unique_ptr<Public>(std::move(*made).value());
        });
  }

  template <class Asked>
  Result<std::unique_ptr<StandingQuery>> watch_question(const Asked& asked, const StandingOptions& options) {
    require_open("Database::watch");
    const auto question = standing::question_of(asked, options.name);
    if (!question) return question.error();
    return unless_out_of_memory<std::unique_ptr<StandingQuery>>(
        "standing query", options.name, [&] { return follower_.watch(question.value(), options); });
  }

  transaction::MonotonicClock monotonic_clock_;
  std::unique_ptr<query::GpuExecutor> executor_;
  std::mutex adding_mutex_;
  mutable std::mutex meshes_mutex_;
  std::vector<Added> meshes_;  // by geometry index
  const bool is_past_;
  const Recovery nothing_recovered_;
  mutable transaction::Engine engine_;
  standing::Follower follower_;
};

/// With a stretch of the past, or none.
Result<std::unique_ptr<Database>> open_with(const DatabaseOptions& options, gpu::DeviceOptions device,
                                            log::Stretch* stretch) {
  return unless_out_of_memory<std::unique_ptr<Database>>(
      "the database", {}, [&]() -> Result<std::unique_ptr<Database>> {
        if (auto checked = check_options(options); !checked) return checked.error();
        if (auto checked = check_options(options.durability); !checked) return checked.error();
        device.select = options.gpu;
        device.validation = options.validation == Validation::on ||
                            (options.validation == Validation::build_default && validation_default);
        const auto open = [device, priority = options.thread_priority](const auto& compiled) {
          gpu::DeviceOptions with_compiled = device;
          with_compiled.compiled = compiled;
          return open_device(with_compiled, priority);
        };
        auto executor = query::GpuExecutor::create(open, options);
        if (!executor) return executor.error();
        auto log = open_log(options);
        if (!log) return log.error();
        const log::World* world = stretch != nullptr ? &stretch->begin : nullptr;
        if (log.value() != nullptr) world = &log.value()->recovered_world();
        auto known = world != nullptr ? add_recovered(*world, *executor.value())
                                      : Result<std::vector<Added>>(std::vector<Added>());
        if (!known) return known.error();
        std::function<void(store::Store&)> past;
        if (stretch != nullptr) past = [stretch](store::Store& store) { live_through(*stretch, store); };
        auto database =
            std::make_unique<DatabaseImpl>(std::move(executor).value(), options, std::move(log).value(),
                                           std::move(known).value(), std::move(past));
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

Result<std::unique_ptr<Database>> open_past(const DatabaseOptions& options, log::Stretch stretch) {
  return open_with(options, {}, &stretch);
}

}  // namespace rtstdb
