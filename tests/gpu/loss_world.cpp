#include "tests/gpu/loss_world.hpp"

#include <bit>
#include <cstdlib>
#include <random>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/open_database.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t elements = 48;
constexpr std::uint32_t bodies = 30;
constexpr float world_m = 8.0f;

std::uint32_t bits(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

void append(AnswerBits& all, const glm::vec3& v) {
  all.insert(all.end(), {bits(v.x), bits(v.y), bits(v.z)});
}

void append(AnswerBits& all, const RayHit& hit) {
  all.insert(all.end(), {static_cast<std::uint32_t>(hit.status), bits(hit.lambda), bits(hit.u), bits(hit.v),
                         hit.entity.index, hit.mask, hit.material, hit.triangle, hit.front_face ? 1u : 0u});
  append(all, hit.n_world);
  append(all, hit.v_relative_mps);
}

void append(AnswerBits& all, const RegionAnswer& answer) {
  EXPECT_FALSE(answer.incomplete) << "what it lists then depends on the tree";
  all.insert(all.end(), {answer.found, answer.overflow ? 1u : 0u, answer.incomplete ? 1u : 0u});
  for (const EntityId id : answer.entities)
    all.push_back(id.index);
  for (const EntityTriangle& triangle : answer.triangles)
    all.insert(all.end(), {triangle.entity.index, triangle.triangle});
}

void append(AnswerBits& all, const NearestAnswer& answer) {
  all.insert(all.end(), {static_cast<std::uint32_t>(answer.neighbors.size()), answer.incomplete ? 1u : 0u});
  for (const Neighbor& neighbor : answer.neighbors) {
    all.insert(all.end(),
               {neighbor.entity.index, neighbor.mask, neighbor.material, neighbor.triangle,
                bits(neighbor.distance_m), bits(neighbor.u), bits(neighbor.v), neighbor.has_sign ? 1u : 0u});
    append(all, neighbor.p_world_m);
    append(all, neighbor.v_relative_mps);
  }
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float in(float low, float high) {
    return low + (high - low) * static_cast<float>(engine_() % 65536) / 65536.0f;
  }
  glm::vec3 point() { return {in(-world_m, world_m), in(-world_m, world_m), in(-world_m, world_m)}; }
  /// In a window of a tenth of a second, which each round has later.
  WorldTime time(unsigned round) {
    return world_time_ns(1'000'000 * (std::int64_t{round} + static_cast<std::int64_t>(engine_() % 100)));
  }

 private:
  std::mt19937 engine_;
};

EntityRow body(GeometryId geometry, Random& random) {
  EntityRow row;
  row.geometry = geometry;
  row.motion.p_world_m = random.point();
  row.motion.v_world_mps = glm::dvec3(random.point()) * 0.2;
  row.motion.w_world_radps = glm::dvec3(random.point()) * 0.1;
  return row;
}

Terms at(unsigned round) {
  Terms terms;
  terms.world_time = world_time_ns(1'000'000 * std::int64_t{round});
  return terms;
}

}  // namespace

LossWorld::LossWorld(On device, DatabaseOptions options) {
  if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
  options.max_entities = 64;
  gpu::DeviceOptions device_options;
  if (device == On::failing_device) device_options.loader_library = FAULT_LOADER;
  device_options.imports_host_memory = device != On::copying_device;
  auto opened = open_database(options, device_options);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (opened) database_ = std::move(opened).value();
}

Result<void> LossWorld::set_up(int step) {
  switch (step) {
    case 0:
      return add_geometries();
    case 1:
      return add_geometry_that_deforms();
    case 2:
      return prepare_rays();
    case 3:
      return prepare_regions();
    case 4:
      return prepare_nearest();
    default:
      return create_entities();
  }
}

void LossWorld::set_up() {
  for (int step = 0; step < setup_steps; ++step) {
    const auto done = set_up(step);
    ASSERT_TRUE(done.ok()) << "step " << step << ": " << done.error().message;
  }
}

Result<void> LossWorld::add_geometries() {
  // The second is more than the pool begins with.
  for (const TriangleMesh& mesh : {make_box({1.0, 0.8, 0.6}), make_sphere(0.6, 5)}) {
    auto added = database_->add_geometry(mesh, "body");
    if (!added) return added.error();
    geometries_.push_back(added.value());
  }
  return {};
}

Result<void> LossWorld::add_geometry_that_deforms() {
  skin_ = make_sphere(0.7, 2);
  auto added = database_->add_geometry(skin_, "skin", {.deforms = true});
  if (!added) return added.error();
  geometries_.push_back(added.value());
  return {};
}

Result<void> LossWorld::prepare_rays() {
  const RayQueryOptions all[] = {
      {.name = "closest", .capacity = elements, .mode = RayMode::closest},
      {.name = "any", .capacity = elements, .mode = RayMode::any},
      {.name = "first", .capacity = elements, .mode = RayMode::first, .hits_per_ray = 4},
      {.name = "still", .capacity = elements, .mode = RayMode::closest, .ignore_motion = true},
  };
  for (const RayQueryOptions& options : all) {
    auto made = database_->prepare(options);
    if (!made) return made.error();
    RayQuery& query = *rays_.emplace_back(std::move(made).value());
    kinds_.push_back({.name = options.name,
                      .declare =
                          [&query](Transaction& transaction, unsigned round) {
                            Random random(round);
                            for (Ray& ray : query.rays()) {
                              ray.origin_m = random.point();
                              ray.direction = random.point();
                              ray.t = random.time(round);
                            }
                            transaction.add_query(query, elements);
                          },
                      .append_answers =
                          [&query](AnswerBits& all_bits) {
                            for (const RayHit& hit : query.hits())
                              append(all_bits, hit);
                          }});
  }
  return {};
}

Result<void> LossWorld::prepare_regions() {
  const RegionQueryOptions all[] = {
      {.name = "bounds", .capacity = elements, .level = RegionLevel::bounds, .ids_per_region = 4},
      {.name = "count", .capacity = elements, .level = RegionLevel::bounds, .ids_per_region = 0},
      {.name = "surface", .capacity = elements, .level = RegionLevel::surface, .ids_per_region = 4},
      {.name = "triangles", .capacity = elements, .level = RegionLevel::triangle, .ids_per_region = 16},
  };
  for (const RegionQueryOptions& options : all) {
    auto made = database_->prepare(options);
    if (!made) return made.error();
    RegionQuery& query = *regions_.emplace_back(std::move(made).value());
    const bool query_is_wide = options.level == RegionLevel::bounds;
    kinds_.push_back({.name = options.name,
                      .declare =
                          [&query, query_is_wide](Transaction& transaction, unsigned round) {
                            Random random(round + 1);
                            std::uint32_t shape = 0;
                            for (Region& region : query.regions()) {
                              region.shape = static_cast<RegionShape>(shape++ % 3);
                              region.center_m = random.point();
                              region.half_extent_m = glm::vec3(random.in(0.1f, query_is_wide ? 3.0f : 0.4f));
                              region.t = random.time(round);
                            }
                            transaction.add_query(query, elements);
                          },
                      .append_answers =
                          [&query](AnswerBits& all_bits) {
                            for (const RegionAnswer& answer : query.answers())
                              append(all_bits, answer);
                          }});
  }
  return {};
}

Result<void> LossWorld::prepare_nearest() {
  const NearestQueryOptions all[] = {
      {.name = "centers", .capacity = elements, .target = NearestTarget::center},
      {.name = "boxes", .capacity = elements, .target = NearestTarget::bounds, .k = 8},
      {.name = "surfaces", .capacity = elements, .target = NearestTarget::surface, .k = 8, .is_signed = true},
      {.name = "nearest triangle", .capacity = elements, .target = NearestTarget::triangle},
  };
  for (const NearestQueryOptions& options : all) {
    auto made = database_->prepare(options);
    if (!made) return made.error();
    NearestQuery& query = *nearest_.emplace_back(std::move(made).value());
    kinds_.push_back({.name = options.name,
                      .declare =
                          [&query](Transaction& transaction, unsigned round) {
                            Random random(round + 2);
                            for (Nearest& point : query.points()) {
                              point.point_m = random.point();
                              point.t = random.time(round);
                            }
                            transaction.add_query(query, elements);
                          },
                      .append_answers =
                          [&query](AnswerBits& all_bits) {
                            for (const NearestAnswer& answer : query.answers())
                              append(all_bits, answer);
                          }});
  }
  auto made =
      database_->prepare(OverlapQueryOptions{.name = "overlaps", .capacity = bodies, .ids_per_entity = 4});
  if (!made) return made.error();
  overlaps_ = std::move(made).value();
  return {};
}

Result<void> LossWorld::create_entities() {
  transaction_ = database_->make_transaction(
      {.max_writes = bodies, .max_queries = 2, .max_geometry_updates = 1, .max_positions = 1024});
  Random random(7);
  transaction_->begin({});
  for (std::uint32_t k = 0; k < bodies; ++k)
    transaction_->create(body(geometries_[k % geometries_.size()], random));
  const Outcome& outcome = database_->execute(*transaction_);
  if (!outcome.done()) return Error{ErrorCode::bad_input, describe(outcome)};
  for (std::uint32_t k = 0; k < bodies; ++k)
    entities_.push_back(transaction_->created(k));
  kinds_.push_back({.name = "overlaps",
                    .declare =
                        [this](Transaction& transaction, unsigned round) {
                          Random times(round + 3);
                          for (std::uint32_t k = 0; k < bodies; ++k)
                            overlaps_->overlaps()[k] = {.entity = entities_[k], .t = times.time(round)};
                          transaction.add_query(*overlaps_, bodies);
                        },
                    .append_answers =
                        [this](AnswerBits& all) {
                          for (const OverlapAnswer& answer : overlaps_->answers())
                            append(all, answer);
                        }});
  add_writing_kinds();
  return {};
}

void LossWorld::add_writing_kinds() {
  const Kind closest = kinds_.front();
  Kind moves{
      .name = "write and ask", .declare = {}, .append_answers = closest.append_answers, .writes = true};
  moves.declare = [this, ask = closest.declare](Transaction& transaction, unsigned round) {
    Random random(round + 4);
    for (int k = 0; k < 5; ++k) {
      const EntityId entity = entities_[static_cast<std::size_t>(random.in(0.0f, bodies))];
      EntityRow row = body(newest_, random);
      row.motion.valid_from = at(round).world_time;
      if (newest_.valid())
        transaction.update(entity, row);
      else
        transaction.update_motion(entity, row.motion);
    }
    ask(transaction, round);
  };
  Kind deforms = moves;
  deforms.name = "deform and ask";
  deforms.declare = [this, ask = closest.declare](Transaction& transaction, unsigned round) {
    Random random(round + 5);
    std::vector<glm::vec3> positions = skin_.positions_m;
    for (glm::vec3& p : positions)
      p *= random.in(0.5f, 1.5f);
    transaction.update_geometry(geometries_.back(), positions);
    ask(transaction, round);
  };
  kinds_.push_back(std::move(moves));
  kinds_.push_back(std::move(deforms));
}

const Outcome& LossWorld::execute(const Kind& kind, unsigned round) {
  transaction_->begin(at(round));
  kind.declare(*transaction_, round);
  return database_->execute(*transaction_);
}

AnswerBits LossWorld::answers(const Kind& kind) const {
  AnswerBits all;
  kind.append_answers(all);
  return all;
}

std::vector<EntityState> LossWorld::rows() const {
  auto rows = database_->snapshot(ReadAt::latest());
  EXPECT_TRUE(rows.ok());
  return rows ? std::move(rows).value() : std::vector<EntityState>{};
}

bool same(const EntityState& a, const EntityState& b) {
  const Motion& m = a.row.motion;
  const Motion& n = b.row.motion;
  return a.id == b.id && a.row.geometry == b.row.geometry && m.p_world_m == n.p_world_m &&
         m.q_world == n.q_world && m.v_world_mps == n.v_world_mps && m.w_world_radps == n.w_world_radps &&
         m.valid_from == n.valid_from;
}

}  // namespace rtstdb::test
