#include "bench/transactions/answers.hpp"

#include <memory>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::uint32_t ray_count = 64;
constexpr std::int64_t tick_ns = 1'000'000;

/// In each tick one body gets a new motion and 64 rays are traced in that version.
class Ticks {
 public:
  explicit Ticks(std::uint32_t entity_count)
      : world_(entity_count), bodies_(moving_bodies(entity_count, half_m, 30)) {
    for (const rtstdb::TriangleMesh& mesh : bodies_.meshes)
      world_.add(mesh);
    // Slow enough to be still in range at the last ray.
    for (rtstdb::EntityRow& row : bodies_.rows)
      row.motion.v_world_mps *= 0.05;
    ids_ = world_.create(bodies_.rows);
    query_ = must(world_.database().prepare(rtstdb::RayQueryOptions{.name = "rays", .capacity = ray_count}));
    rays_ = timed_rays(ray_count, half_m, 40.0f, 0, 31);
    transaction_ = world_.database().make_transaction({.max_writes = 1, .max_queries = 1});
  }

  /// In microseconds.
  std::vector<double> run(int count) {
    std::vector<double> latencies_us;
    latencies_us.reserve(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) {
      now_ += rtstdb::Nanoseconds(tick_ns);
      for (std::uint32_t ray = 0; ray < ray_count; ++ray) {
        rays_[ray].t = now_;
        query_->rays()[ray] = rays_[ray];
      }
      const std::size_t entity = (next_ += 7919) % ids_.size();
      rtstdb::Terms terms;
      terms.world_time = now_;
      transaction_->begin(terms);
      transaction_->update_motion(ids_[entity], rtstdb::rebased(bodies_.rows[entity].motion, now_));
      transaction_->add_query(*query_, ray_count);
      latencies_us.push_back(1e6 * seconds_of([&] { world_.database().execute(*transaction_); }));
      if (transaction_->status() != rtstdb::Status::committed)
        throw std::runtime_error(rtstdb::describe(transaction_->outcome()));
    }
    return latencies_us;
  }

 private:
  static constexpr float half_m = 50.0f;
  OurWorld world_;
  MovingBodies bodies_;
  std::vector<rtstdb::EntityId> ids_;
  std::vector<rtstdb::Ray> rays_;
  std::unique_ptr<rtstdb::RayQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
  rtstdb::WorldTime now_{};
  std::size_t next_ = 0;
};

}  // namespace

std::vector<Figure> measure_answers(const SuiteOptions& options) {
  Ticks ticks(options.tiny ? 500 : 10'000);
  ticks.run(options.tiny ? 5 : 200);
  std::vector<double> latencies_us = ticks.run(options.tiny ? 20 : 5000);
  std::vector<Figure> figures;
  for (const auto& [suffix, share] :
       {std::pair{"p50", 0.5}, std::pair{"p99", 0.99}, std::pair{"p999", 0.999}}) {
    Figure figure;
    figure.name = std::string("update_and_64_rays_") + suffix;
    figure.ours = quantile(latencies_us, share);
    figure.unit = "us";
    figure.samples = latencies_us.size();
    figures.push_back(figure);
  }
  return figures;
}

}  // namespace hil::bench
