#include "bench/spatial/latency.hpp"

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t entity_count = 1000;
constexpr std::uint32_t ray_count = 64;
/// About the density of ray_moving_instances.
constexpr float half_m = 23.0f;
constexpr std::int64_t tick_ns = 1'000'000;

class SmallQueries {
 public:
  SmallQueries() : world_(entity_count), bodies_(moving_bodies(entity_count, half_m, 10)) {
    for (const rtstdb::TriangleMesh& mesh : bodies_.meshes)
      world_.add(mesh);
    // Slow enough to be still in range at the last query.
    for (rtstdb::EntityRow& row : bodies_.rows)
      row.motion.v_world_mps *= 0.05;
    ids_ = world_.create(bodies_.rows);
    query_ = must(world_.database().prepare(rtstdb::RayQueryOptions{.name = "bench", .capacity = ray_count}));
    rays_ = timed_rays(ray_count, half_m, 40.0f, 0, 11);
    transaction_ = world_.database().make_transaction({.max_writes = 1, .max_queries = 1});
  }

  /// In microseconds.
  std::vector<double> run(int count, bool with_update) {
    std::vector<double> latencies_us;
    latencies_us.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      if (with_update) now_ += rtstdb::Nanoseconds(tick_ns);
      for (std::uint32_t ray = 0; ray < ray_count; ++ray) {
        rays_[ray].t = now_;
        query_->rays()[ray] = rays_[ray];
      }
      rtstdb::Terms terms;
      terms.world_time = now_;
      transaction_->begin(terms);
      if (with_update) {
        const std::size_t entity = static_cast<std::size_t>(i) % entity_count;
        transaction_->update_motion(ids_[entity], rtstdb::rebased(bodies_.rows[entity].motion, now_));
      }
      transaction_->add_query(*query_, ray_count);
      latencies_us.push_back(1e6 * seconds_of([&] { world_.database().execute(*transaction_); }));
      if (transaction_->status() != rtstdb::Status::committed)
        throw std::runtime_error(rtstdb::describe(transaction_->outcome()));
    }
    return latencies_us;
  }

 private:
  OurWorld world_;
  MovingBodies bodies_;
  std::vector<rtstdb::EntityId> ids_;
  std::vector<rtstdb::Ray> rays_;
  std::unique_ptr<rtstdb::RayQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::WorldTime now_{};
};

}  // namespace

std::vector<Figure> measure_latency(const SuiteOptions& options) {
  const int warm_up = options.tiny ? 5 : 200;
  const int count = options.tiny ? 20 : 4000;
  SmallQueries queries;
  std::vector<Figure> figures;
  for (const bool with_update : {false, true}) {
    const std::string name = with_update ? "latency_small_update_query" : "latency_small_query";
    queries.run(warm_up, with_update);
    const std::vector<double> latencies_us = queries.run(count, with_update);
    for (const auto& [suffix, share] : {std::pair{"_p50", 0.5}, std::pair{"_p99", 0.99}}) {
      figures.push_back({name + suffix, quantile(latencies_us, share), "us", "", std::nullopt, Better::lower,
                         static_cast<std::uint64_t>(count)});
    }
  }
  return figures;
}

}  // namespace hil::bench
