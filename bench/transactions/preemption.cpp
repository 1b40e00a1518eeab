#include "bench/transactions/preemption.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr float half_m = 50.0f;
constexpr std::uint32_t small_rays = 16;

/// Moving bodies in a database with the default chunk size.
class BusyWorld {
 public:
  explicit BusyWorld(bool tiny)
      : tiny_(tiny),
        bodies_(moving_bodies(tiny ? 500 : 10'000, half_m, 40)),
        world_({.max_entities = static_cast<std::uint32_t>(bodies_.rows.size()), .max_geometries = 4}) {
    for (const rtstdb::TriangleMesh& mesh : bodies_.meshes)
      world_.add(mesh);
    ids_ = world_.create(bodies_.rows);
    small_query_ = must(database().prepare(rtstdb::RayQueryOptions{.name = "small", .capacity = small_rays}));
    std::ranges::copy(timed_rays(small_rays, half_m, 40.0f, 0, 41), small_query_->rays().begin());
    small_ = database().make_transaction({.max_queries = 1});
  }

  rtstdb::Database& database() { return world_.database(); }
  std::uint32_t count(std::uint32_t large) const { return tiny_ ? large / 64 : large; }
  const std::vector<rtstdb::EntityId>& ids() const { return ids_; }

  /// Two figures: while the large batch is queried repeatedly, transactions of higher priority arrive at
  /// uncorrelated times.
  template <class Query>
  std::vector<Figure> waits_beside(const std::string& kind, PreparedBatch<Query> large) {
    large.run();
    preemption_wait_us();
    std::exception_ptr broken;
    std::jthread flood([&](const std::stop_token& stop) {
      try {
        while (!stop.stop_requested())
          large.run();
      } catch (...) {
        broken = std::current_exception();
      }
    });
    std::vector<double> waits_us;
    Random random(42);
    for (int k = 0; k < (tiny_ ? 20 : 2000); ++k) {
      std::this_thread::sleep_for(std::chrono::microseconds(1000 + random.next() % 4000));
      waits_us.push_back(preemption_wait_us());
    }
    flood.request_stop();
    flood.join();
    if (broken) std::rethrow_exception(broken);
    return {figure("preemption_wait_" + kind + "_p50", waits_us, 0.5),
            figure("preemption_wait_" + kind + "_p99", waits_us, 0.99)};
  }

 private:
  /// The time from submit to the result in this thread, without the time in which the database worked on the
  /// transaction.
  double preemption_wait_us() {
    rtstdb::Terms terms;
    terms.importance = 1;
    small_->begin(terms);
    small_->add_query(*small_query_, small_rays);
    const double whole_us = 1e6 * seconds_of([&] { database().execute(*small_); });
    if (!small_->outcome().done()) throw std::runtime_error(rtstdb::describe(small_->outcome()));
    return whole_us - 1e-3 * static_cast<double>(small_->outcome().actual_cost.count());
  }

  static Figure figure(const std::string& name, const std::vector<double>& waits_us, double share) {
    Figure figure;
    figure.name = name;
    figure.ours = quantile(waits_us, share);
    figure.unit = "us";
    figure.samples = waits_us.size();
    return figure;
  }

  bool tiny_;
  MovingBodies bodies_;
  OurWorld world_;
  std::vector<rtstdb::EntityId> ids_;
  std::unique_ptr<rtstdb::RayQuery> small_query_;
  std::unique_ptr<rtstdb::Transaction> small_;
};

/// A large batch of one kind, and its name in the figures.
template <class Query>
struct Large {
  std::string name;
  PreparedBatch<Query> batch;
};

Large<rtstdb::RayQuery> large_batch(BusyWorld& world, const rtstdb::RayQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 18);
  auto query = must(world.database().prepare(rtstdb::RayQueryOptions{.name = "rays", .capacity = count}));
  std::ranges::copy(timed_rays(count, half_m, 40.0f, 0, 43), query->rays().begin());
  return {"rays", {world.database(), std::move(query), count}};
}

Large<rtstdb::NearestQuery> large_batch(BusyWorld& world, const rtstdb::NearestQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 15);
  auto query = must(
      world.database().prepare(rtstdb::NearestQueryOptions{.name = "nearest", .capacity = count, .k = 4}));
  Random random(44);
  for (rtstdb::Nearest& point : query->points())
    point.point_m = random.in_box(glm::vec3(half_m));
  return {"nearest", {world.database(), std::move(query), count}};
}

Large<rtstdb::RegionQuery> large_batch(BusyWorld& world, const rtstdb::RegionQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 15);
  auto query = must(world.database().prepare(rtstdb::RegionQueryOptions{
      .name = "regions", .capacity = count, .level = rtstdb::RegionLevel::surface, .ids_per_region = 128}));
  Random random(45);
  for (rtstdb::Region& region : query->regions()) {
    region.center_m = random.in_box(glm::vec3(half_m));
    region.half_extent_m = glm::vec3(5.0f);
  }
  return {"regions", {world.database(), std::move(query), count}};
}

Large<rtstdb::OverlapQuery> large_batch(BusyWorld& world, const rtstdb::OverlapQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 15);
  auto query =
      must(world.database().prepare(rtstdb::OverlapQueryOptions{.name = "overlaps", .capacity = count}));
  for (std::size_t k = 0; rtstdb::Overlap & overlap : query->overlaps())
    overlap.entity = world.ids()[k++ % world.ids().size()];
  return {"overlaps", {world.database(), std::move(query), count}};
}

Large<rtstdb::ConeQuery> large_batch(BusyWorld& world, const rtstdb::ConeQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 15);
  auto query = must(world.database().prepare(
      rtstdb::ConeQueryOptions{.name = "cones", .capacity = count, .returns_per_cone = 2}));
  const auto rays = timed_rays(count, half_m, 40.0f, 0, 46);
  for (std::size_t k = 0; rtstdb::Cone & cone : query->cones()) {
    cone.origin_m = rays[k].origin_m;
    cone.direction = rays[k++].direction;
    cone.opening_angle_rad = 0.01f;
  }
  return {"cones", {world.database(), std::move(query), count}};
}

Large<rtstdb::ContactQuery> large_batch(BusyWorld& world, const rtstdb::ContactQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 10);
  auto query = must(world.database().prepare(rtstdb::ContactQueryOptions{.name = "contacts",
                                                                         .capacity = count,
                                                                         .pairs_per_search = 32,
                                                                         .max_bodies = count,
                                                                         .max_surface_triangles = 1u << 20}));
  for (std::size_t k = 0; rtstdb::ContactSearch & search : query->searches())
    search.first = world.ids()[k++ % world.ids().size()];
  return {"contacts", {world.database(), std::move(query), count}};
}

Large<rtstdb::ImpactQuery> large_batch(BusyWorld& world, const rtstdb::ImpactQuery* /*kind*/) {
  const std::uint32_t count = world.count(1u << 7);
  auto query = must(world.database().prepare(
      rtstdb::ImpactQueryOptions{.name = "impacts", .capacity = count, .candidates_per_search = 64}));
  for (std::size_t k = 0; rtstdb::ImpactSearch & search : query->searches()) {
    search.first = world.ids()[k++ % world.ids().size()];
    search.window = std::chrono::milliseconds(100);
  }
  return {"impacts", {world.database(), std::move(query), count}};
}

Large<rtstdb::ImageQuery> large_batch(BusyWorld& world, const rtstdb::ImageQuery* /*kind*/) {
  const std::uint32_t side = world.count(1u << 8);
  auto query = must(world.database().prepare(rtstdb::ImageQueryOptions{
      .name = "images", .width = side, .height = side, .samples_per_pixel = 2, .bounces = 2}));
  return {"images", {world.database(), std::move(query), 1}};
}

}  // namespace

std::vector<Figure> measure_preemption(const SuiteOptions& options) {
  BusyWorld world(options.tiny);
  std::vector<Figure> figures;
  const auto append = [&](const std::vector<Figure>& more) {
    figures.insert(figures.end(), more.begin(), more.end());
  };
  const auto measure = [&](const auto* kind) {
    auto large = large_batch(world, kind);
    append(world.waits_beside(large.name, std::move(large.batch)));
  };
#define QUERY_KIND(kind, Class, Element, elements, Answer, answers, ...) \
  measure(static_cast<const rtstdb::Class*>(nullptr));
#include <rtstdb/query_kinds.def>
#undef QUERY_KIND
  return figures;
}

}  // namespace hil::bench
