#include "tests/gpu/database_fixture.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <mutex>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>

#include "rtstdb/open_database.hpp"
#include "rtstdb/oracle/judge.hpp"
#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/parallel.hpp"

namespace rtstdb::test {
namespace {

constexpr std::size_t failures_shown = 10;

std::string describe(const Ray& ray) {
  std::ostringstream text;
  text.precision(9);
  text << "ray from (" << ray.origin_m.x << ", " << ray.origin_m.y << ", " << ray.origin_m.z << ") along ("
       << ray.direction.x << ", " << ray.direction.y << ", " << ray.direction.z << "), lambda "
       << ray.lambda_min << " to " << ray.lambda_max << ", t " << ray.t.time_since_epoch().count()
       << " ns, mask " << ray.mask << ", carrier " << static_cast<std::int32_t>(ray.carrier.index);
  return text.str();
}

std::string describe(const Cone& cone) {
  std::ostringstream text;
  text.precision(9);
  text << "cone from (" << cone.origin_m.x << ", " << cone.origin_m.y << ", " << cone.origin_m.z
       << ") along (" << cone.direction.x << ", " << cone.direction.y << ", " << cone.direction.z << "), "
       << cone.opening_angle_rad << " rad, lambda up to " << cone.lambda_max << ", t "
       << cone.t.time_since_epoch().count() << " ns, mask " << cone.mask << ", carrier "
       << static_cast<std::int32_t>(cone.carrier.index);
  return text.str();
}

std::string describe(const ContactSearch& search) {
  std::ostringstream text;
  text.precision(9);
  text << "contacts of " << static_cast<std::int32_t>(search.first.index) << " and "
       << static_cast<std::int32_t>(search.second.index) << ", masks " << search.first_mask << " and "
       << search.second_mask << ", t " << search.t.time_since_epoch().count() << " ns, margin "
       << search.margin_m << " m";
  return text.str();
}

std::string describe(const ImpactSearch& search) {
  std::ostringstream text;
  text.precision(9);
  text << "impacts of " << static_cast<std::int32_t>(search.first.index) << " and "
       << static_cast<std::int32_t>(search.second.index) << ", mask " << search.second_mask << ", t "
       << search.t.time_since_epoch().count() << " ns, window " << search.window.count() << " ns, tolerance "
       << search.tolerance_m << " m";
  return text.str();
}

std::string describe(const Nearest& point) {
  std::ostringstream text;
  text.precision(9);
  text << "point (" << point.point_m.x << ", " << point.point_m.y << ", " << point.point_m.z << "), radius "
       << point.radius_m << " m, t " << point.t.time_since_epoch().count() << " ns, mask " << point.mask
       << ", carrier " << static_cast<std::int32_t>(point.carrier.index) << ", excluded "
       << static_cast<std::int32_t>(point.excluded.index);
  return text.str();
}

/// Judges elements 0 to count-1 with `judge_one` and reports those that differ.
Tally judge_all(std::size_t count, const std::function<oracle::Judgement(std::size_t)>& judge_one,
                const std::function<std::string(std::size_t)>& name) {
  Tally tally{.elements = count};
  std::mutex mutex;
  std::vector<std::string> wrong;
  for_each_in_parallel(count, [&](std::size_t i) {
    const oracle::Judgement judgement = judge_one(i);
    if (judgement.verdict == oracle::Verdict::agrees) return;
    const std::lock_guard lock(mutex);
    if (judgement.verdict == oracle::Verdict::too_close) {
      ++tally.too_close;
    } else {
      wrong.push_back("element " + std::to_string(i) + ": " + judgement.reason + "; " + name(i));
    }
  });
  for (std::size_t i = 0; i < std::min(wrong.size(), failures_shown); ++i)
    ADD_FAILURE() << wrong[i];
  EXPECT_EQ(wrong.size(), 0u) << "of " << count << " answers";
  return tally;
}

/// Judges each element; all have the same number of answers.
template <class Element, class Answer, class Options>
Tally judge_elements(const oracle::World& world, std::span<const Element> elements,
                     std::span<const Answer> answers, const Options& options,
                     const std::function<std::string(std::size_t)>& name) {
  if (elements.empty()) return {};
  const std::size_t per_element = answers.size() / elements.size();
  EXPECT_EQ(elements.size() * per_element, answers.size());
  return judge_all(
      elements.size(),
      [&](std::size_t i) {
        return oracle::judge(world, elements[i], answers.subspan(i * per_element, per_element), options);
      },
      name);
}

void count_found(Tally& tally, std::span<const RegionAnswer> answers) {
  for (const RegionAnswer& answer : answers) {
    tally.hits += answer.found > 0 ? 1 : 0;
    tally.full += answer.overflow ? 1 : 0;
  }
}

}  // namespace

Tally& Tally::operator+=(const Tally& other) {
  elements += other.elements;
  hits += other.hits;
  too_close += other.too_close;
  full += other.full;
  inside += other.inside;
  return *this;
}

void DatabaseTest::open(DatabaseOptions options, gpu::DeviceOptions device) {
  closest_.reset();
  database_.reset();
  if (const char* select = std::getenv("HIL_TEST_GPU"); select != nullptr) options.gpu = select;
  options.validation = Validation::on;
  device.shared = device.loader_library == gpu::DeviceOptions{}.loader_library;
  auto opened = open_database(options, device);
  ASSERT_TRUE(opened.ok()) << opened.error().message;
  database_ = std::move(opened).value();
  // Those of random scenes. A log may have brought them.
  for (std::uint32_t index = 1; index < scene_materials; ++index) {
    if (database_->material({index})) continue;
    const auto added = database_->add_material({.reflectance = 0.2 * index}, "scene");
    ASSERT_TRUE(added.ok()) << added.error().message;
  }
}

void DatabaseTest::TearDown() {
  if (!database_) return;
  for (const std::string& message : database_->health().validation_messages)
    ADD_FAILURE() << "validation layer: " << message;
  EXPECT_FALSE(database_->health().device_lost);
}

GeometryId DatabaseTest::add(const TriangleMesh& mesh) {
  auto added = database_->add_geometry(mesh, "test");
  if (!added) {
    ADD_FAILURE() << added.error().message;
    return {};
  }
  return added.value();
}

Outcome DatabaseTest::execute(const std::function<void(Transaction&)>& declare, WorldTime world_time,
                              const ReadAt& read_at) {
  const auto transaction =
      database_->make_transaction({.max_writes = 8192, .max_queries = 8, .max_reads = 8});
  transaction->begin(terms_at(world_time, read_at));
  declare(*transaction);
  return database_->execute(*transaction);
}

std::vector<EntityId> DatabaseTest::create(std::span<const EntityRow> rows, WorldTime world_time) {
  const auto transaction =
      database_->make_transaction({.max_writes = static_cast<std::uint32_t>(rows.size())});
  transaction->begin(terms_at(world_time));
  for (const EntityRow& row : rows)
    transaction->create(row);
  const Outcome& outcome = database_->execute(*transaction);
  EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
  std::vector<EntityId> ids;
  for (std::uint32_t i = 0; i < rows.size(); ++i)
    ids.push_back(transaction->created(i));
  return ids;
}

EntityId DatabaseTest::create(const EntityRow& row, WorldTime world_time) {
  return create(std::span(&row, 1), world_time).front();
}

void DatabaseTest::update_motion(EntityId entity, const Motion& motion, WorldTime world_time) {
  const Outcome outcome =
      execute([&](Transaction& transaction) { transaction.update_motion(entity, motion); }, world_time);
  ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
}

void DatabaseTest::remove(EntityId entity, WorldTime world_time) {
  const Outcome outcome = execute([&](Transaction& transaction) { transaction.remove(entity); }, world_time);
  ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
}

Outcome DatabaseTest::run(Query& query, std::size_t count, const ReadAt& read_at) {
  return execute(
      [&](Transaction& transaction) { transaction.add_query(query, static_cast<std::uint32_t>(count)); }, {},
      read_at);
}

std::unique_ptr<RayQuery> DatabaseTest::prepare_rays(RayMode mode, bool ignore_motion,
                                                     std::uint32_t capacity) {
  return prepare(
      RayQueryOptions{.name = "rays", .capacity = capacity, .mode = mode, .ignore_motion = ignore_motion});
}

std::vector<RayHit> DatabaseTest::trace(RayQuery& query, std::span<const Ray> rays, const ReadAt& read_at) {
  std::vector<RayHit> hits;
  const std::size_t capacity = query.rays().size();
  for (std::size_t first = 0; first < rays.size(); first += capacity) {
    const auto batch = rays.subspan(first, std::min(capacity, rays.size() - first));
    std::ranges::copy(batch, query.rays().begin());
    const Outcome outcome = run(query, batch.size(), read_at);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    hits.insert(hits.end(), query.hits().begin(), query.hits().end());
  }
  EXPECT_EQ(hits.size(), rays.size());
  hits.resize(rays.size());
  return hits;
}

std::vector<RayHit> DatabaseTest::trace(std::span<const Ray> rays, const ReadAt& read_at) {
  if (!closest_) closest_ = prepare_rays();
  auto hits = trace(*closest_, rays, read_at);
  constexpr std::size_t copies = query::rays_per_packet;
  std::vector<Ray> packets;
  for (const Ray& ray : rays.first(std::min<std::size_t>(rays.size(), 4096)))
    packets.insert(packets.end(), copies, ray);
  const auto together = trace(*closest_, packets, read_at);
  for (std::size_t i = 0; i < together.size(); ++i) {
    const RayHit& alone = hits[i / copies];
    EXPECT_TRUE(same_bits(together[i], alone))
        << describe(packets[i]) << ": together entity " << together[i].entity.index << " triangle "
        << together[i].triangle << " lambda " << together[i].lambda << ", alone " << alone.entity.index
        << ", " << alone.triangle << ", " << alone.lambda;
  }
  return hits;
}

RayHit DatabaseTest::trace(const Ray& ray, const ReadAt& read_at) {
  return trace(std::span(&ray, 1), read_at).front();
}

oracle::World DatabaseTest::world(const ReadAt& read_at) {
  auto entities = database_->snapshot(read_at);
  if (!entities) {
    ADD_FAILURE() << entities.error().message;
    return {{}, {}};
  }
  const Outcome outcome = execute([](Transaction&) {}, {}, read_at);
  EXPECT_EQ(outcome.status, Status::committed);
  std::vector<TriangleMesh> meshes;
  for (std::uint32_t i = 0;; ++i) {
    auto mesh = database_->geometry({i}, read_at);
    if (!mesh) break;
    meshes.push_back(std::move(mesh).value());
  }
  std::vector<const TriangleMesh*> pointers;
  pointers.reserve(meshes.size());
  for (const TriangleMesh& mesh : meshes)
    pointers.push_back(&mesh);
  oracle::World world(std::move(entities).value(), pointers, outcome.version_time);
  for (std::uint32_t i = 0; i < meshes.size(); ++i)
    if (database_->geometry_info({i})->deforms) world.mark_deforming({i});
  return world;
}

bool same_bits(const RayHit& a, const RayHit& b) {
  const auto bits = [](const RayHit& hit) {
    return std::tuple(hit.status, std::bit_cast<std::uint32_t>(hit.lambda),
                      std::bit_cast<std::uint32_t>(hit.u), std::bit_cast<std::uint32_t>(hit.v), hit.entity,
                      hit.mask, hit.material, hit.triangle, hit.front_face,
                      std::bit_cast<std::array<std::uint32_t, 3>>(hit.n_world),
                      std::bit_cast<std::array<std::uint32_t, 3>>(hit.v_relative_mps));
  };
  return bits(a) == bits(b);
}

Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits, RayMode mode,
            bool ignore_motion) {
  return judge(world, rays, hits, RayQueryOptions{.mode = mode, .ignore_motion = ignore_motion});
}

Tally judge(const oracle::World& world, std::span<const Ray> rays, std::span<const RayHit> hits,
            const RayQueryOptions& options) {
  EXPECT_TRUE(options.mode != RayMode::any || options.faces == Faces::both)
      << "an answer of RayMode::any does not tell the side of the triangle";
  const std::size_t per_ray = options.hits_per_ray;
  Tally tally = judge_elements(world, rays, hits, options, [&](std::size_t i) { return describe(rays[i]); });
  for (std::size_t i = 0; i + per_ray <= hits.size(); i += per_ray) {
    tally.hits += hits[i].status == HitStatus::hit ? 1 : 0;
    tally.full += hits[i + per_ray - 1].status == HitStatus::hit ? 1 : 0;
  }
  return tally;
}

Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, const RegionQueryOptions& options) {
  Tally tally = judge_elements(world, regions, answers, options, [](std::size_t) { return "region"; });
  count_found(tally, answers);
  return tally;
}

Tally judge(const oracle::World& world, std::span<const Region> regions,
            std::span<const RegionAnswer> answers, RegionLevel level) {
  return judge(world, regions, answers, RegionQueryOptions{.level = level});
}

Tally judge(const oracle::World& world, std::span<const Overlap> overlaps,
            std::span<const OverlapAnswer> answers, const OverlapQueryOptions& options) {
  Tally tally = judge_elements(world, overlaps, answers, options, [](std::size_t) { return "overlap"; });
  count_found(tally, answers);
  return tally;
}

Tally judge(const oracle::World& world, std::span<const Nearest> points,
            std::span<const NearestAnswer> answers, const NearestQueryOptions& options) {
  Tally tally =
      judge_elements(world, points, answers, options, [&](std::size_t i) { return describe(points[i]); });
  for (const NearestAnswer& answer : answers) {
    tally.hits += answer.neighbors.size() == options.k ? 1 : 0;
    tally.inside += !answer.neighbors.empty() && answer.neighbors[0].distance_m < 0.0f ? 1 : 0;
  }
  return tally;
}

Tally judge(const oracle::World& world, std::span<const Cone> cones, std::span<const ConeReturn> returns,
            const ConeQueryOptions& options) {
  const std::size_t each = options.returns_per_cone;
  Tally tally =
      judge_elements(world, cones, returns, options, [&](std::size_t i) { return describe(cones[i]); });
  for (std::size_t i = 0; i + each <= returns.size(); i += each) {
    tally.hits += returns[i].status == HitStatus::hit ? 1 : 0;
    tally.full += returns[i + each - 1].status == HitStatus::hit ? 1 : 0;
  }
  return tally;
}

Tally judge(const oracle::World& world, std::span<const ContactSearch> searches,
            std::span<const ContactAnswer> answers, const ContactQueryOptions& options) {
  Tally tally =
      judge_elements(world, searches, answers, options, [&](std::size_t i) { return describe(searches[i]); });
  for (const ContactAnswer& answer : answers) {
    tally.hits +=
        std::ranges::any_of(answer.pairs, [](const ContactPair& pair) { return pair.point_count > 0; });
    tally.full += answer.overflow ? 1 : 0;
  }
  return tally;
}

Tally judge(const oracle::World& world, std::span<const ImpactSearch> searches,
            std::span<const ImpactAnswer> answers, const ImpactQueryOptions& options) {
  Tally tally =
      judge_elements(world, searches, answers, options, [&](std::size_t i) { return describe(searches[i]); });
  for (const ImpactAnswer& answer : answers) {
    tally.hits += answer.status == ImpactStatus::impact ? 1 : 0;
    tally.full += answer.overflow ? 1 : 0;
  }
  return tally;
}

Tally judge(const oracle::World& world, std::span<const Camera> cameras, std::span<const Image> images,
            const ImageQueryOptions& options) {
  Tally tally = judge_elements(world, cameras, images, options, [](std::size_t) { return "camera"; });
  for (const Image& image : images)
    tally.hits += std::ranges::any_of(image.entities, &EntityId::valid) ? 1 : 0;
  return tally;
}

Terms terms_at(WorldTime world_time, const ReadAt& read_at) {
  Terms terms;
  terms.world_time = world_time;
  terms.read_at = read_at;
  return terms;
}

EntityRow row_of(GeometryId geometry, const glm::dvec3& p_world_m) {
  EntityRow row;
  row.geometry = geometry;
  row.motion.p_world_m = p_world_m;
  return row;
}

Region region_of(RegionShape shape, RegionTest test, const glm::vec3& center_m,
                 const glm::vec3& half_extent_m) {
  Region region;
  region.shape = shape;
  region.test = test;
  region.center_m = center_m;
  region.half_extent_m = half_extent_m;
  return region;
}

Ray ray_from(const glm::vec3& origin_m, const glm::vec3& direction, WorldTime t) {
  Ray ray;
  ray.origin_m = origin_m;
  ray.direction = direction;
  ray.t = t;
  return ray;
}

}  // namespace rtstdb::test
