#include "tests/gpu/device_loss_world.hpp"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <variant>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/open_database.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t element_count = 48;
/// Of expensive kinds.
constexpr std::uint32_t few_elements = 2;
constexpr std::uint32_t bodies = 30;
constexpr float world_m = 8.0f;

/// Steps before those that prepare queries.
constexpr int steps_before = 2;

glm::vec3 random_vector(Random& random) {
  return world_m * glm::vec3(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0));
}

/// So small that no search is incomplete: the content of an incomplete answer depends on the tree.
void shrink(std::span<Region> regions) {
  for (Region& region : regions) {
    region.half_extent_m = glm::min(region.half_extent_m, glm::vec3(0.4f));
    region.near_m = 0.0f;
  }
}

void shrink(std::span<Cone> cones) {
  for (Cone& cone : cones)
    cone.opening_angle_rad = std::min(cone.opening_angle_rad, 0.02f);
}

EntityRow body(GeometryId geometry, Random& random) {
  EntityRow row;
  row.geometry = geometry;
  row.motion.p_world_m = random_vector(random);
  row.motion.v_world_mps = glm::dvec3(random_vector(random)) * 0.2;
  row.motion.w_world_radps = glm::dvec3(random_vector(random)) * 0.1;
  return row;
}

TriangleMesh with_corner_values(TriangleMesh mesh) {
  const glm::vec3 up(0, 0, 1), white(1);
  mesh.corner_normals.resize(mesh.triangles.size(), {up, up, up});
  mesh.corner_colors.resize(mesh.triangles.size(), {white, up, up});
  return mesh;
}

Terms at(unsigned round) {
  Terms terms;
  terms.world_time = world_time_ns(1'000'000 * std::int64_t{round});
  return terms;
}

}  // namespace

DeviceLossWorld::DeviceLossWorld(On device, DatabaseOptions options) {
  if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
  options.max_entities = 64;
  gpu::DeviceOptions device_options;
  if (device == On::failing_device) device_options.loader_library = FAULT_LOADER;
  device_options.imports_host_memory = device != On::copying_device;
  auto opened = open_database(options, device_options);
  EXPECT_TRUE(opened.ok()) << opened.error().message;
  if (opened) database_ = std::move(opened).value();
}

int DeviceLossWorld::setup_steps() {
  return steps_before + static_cast<int>(one_option_per_kind().size()) + 1;
}

std::vector<int> DeviceLossWorld::query_steps() {
  std::vector<int> steps(one_option_per_kind().size());
  std::iota(steps.begin(), steps.end(), steps_before);
  return steps;
}

Result<void> DeviceLossWorld::set_up(int step) {
  if (step == 0) return add_geometries();
  if (step == 1) return add_geometry_that_deforms();
  const auto kinds = one_option_per_kind();
  const auto k = static_cast<std::size_t>(step - steps_before);
  return k < kinds.size() ? prepare_queries(kind_name(kinds[k])) : create_entities();
}

void DeviceLossWorld::set_up() {
  for (int step = 0; step < setup_steps(); ++step) {
    const auto done = set_up(step);
    ASSERT_TRUE(done.ok()) << "step " << step << ": " << done.error().message;
  }
}

Result<void> DeviceLossWorld::add_geometries() {
  // The first mesh has a distance field. The second one is larger than the initial pools.
  const GeometryOptions with_field{.field = FieldOptions{.cell_m = 0.3}};
  for (const TriangleMesh& mesh : {make_box({1.0, 0.8, 0.6}), with_corner_values(make_sphere(0.6, 5))}) {
    auto added = database_->add_geometry(mesh, "body", geometries_.empty() ? with_field : GeometryOptions{});
    if (!added) return added.error();
    geometries_.push_back(added.value());
  }
  return {};
}

Result<void> DeviceLossWorld::add_geometry_that_deforms() {
  deforming_mesh_ = with_corner_values(make_sphere(0.7, 2));
  auto added = database_->add_geometry(deforming_mesh_, "deforming", {.deforms = true});
  if (!added) return added.error();
  geometries_.push_back(added.value());
  return {};
}

Result<void> DeviceLossWorld::prepare_queries(std::string_view kind) {
  for (const AnyQueryOptions& options : all_tested_options()) {
    if (kind_name(options) != kind) continue;
    const std::uint32_t count = is_expensive(options) ? few_elements : element_count;
    auto made = try_to_prepare_case(*database_, with(options, count));
    if (!made) return made.error();
    KindCase& query = *queries_.emplace_back(std::move(made).value());
    kinds_.push_back(
        {.name = query.name(),
         .declare =
             [this, &query](Transaction& transaction, unsigned round) {
               Random random(round);
               query.fill(random, {states_, {.radius_m = double{world_m}}, at(round).world_time, 0.1});
               if (auto* regions = dynamic_cast<RegionQuery*>(&query.query())) shrink(regions->regions());
               if (auto* cones = dynamic_cast<ConeQuery*>(&query.query())) shrink(cones->cones());
               transaction.add_query(query.query(), query.capacity());
             },
         .append_answers =
             [&query](AnswerBits& all_bits) {
               for (const Words& words : query.words()) {
                 EXPECT_FALSE(is_incomplete(words))
                     << query.name() << ": the content of an incomplete answer depends on the tree";
                 all_bits.insert(all_bits.end(), words.begin(), words.end());
               }
             }});
  }
  return {};
}

Result<void> DeviceLossWorld::create_entities() {
  transaction_ = database_->make_transaction(
      {.max_writes = bodies, .max_queries = 2, .max_geometry_updates = 1, .max_positions = 1024});
  Random random(7);
  transaction_->begin({});
  for (std::uint32_t k = 0; k < bodies; ++k) {
    states_.push_back({.id = {}, .row = body(geometries_[k % geometries_.size()], random), .written_by = 1});
    transaction_->create(states_.back().row);
  }
  const Outcome& outcome = database_->execute(*transaction_);
  if (!outcome.done()) return Error{ErrorCode::bad_input, describe(outcome)};
  for (std::uint32_t k = 0; k < bodies; ++k) {
    entities_.push_back(transaction_->created(k));
    states_[k].id = entities_[k];
  }
  add_writing_kinds();
  return {};
}

void DeviceLossWorld::add_writing_kinds() {
  const TransactionCase closest = kinds_.front();
  TransactionCase moves{
      .name = "write and query", .declare = {}, .append_answers = closest.append_answers, .writes = true};
  moves.declare = [this, add_query = closest.declare](Transaction& transaction, unsigned round) {
    Random random(round + 4);
    for (int k = 0; k < 5; ++k) {
      const EntityId entity = entities_[static_cast<std::size_t>(random.uniform(0.0, bodies))];
      EntityRow row = body(newest_, random);
      row.motion.valid_from = at(round).world_time;
      if (newest_.valid())
        transaction.update(entity, row);
      else
        transaction.update_motion(entity, row.motion);
    }
    add_query(transaction, round);
  };
  TransactionCase deforms = moves;
  deforms.name = "deform and query";
  deforms.declare = [this, add_query = closest.declare](Transaction& transaction, unsigned round) {
    Random random(round + 5);
    std::vector<glm::vec3> positions = deforming_mesh_.positions_m;
    for (glm::vec3& p : positions)
      p *= static_cast<float>(random.uniform(0.5, 1.5));
    transaction.update_geometry(geometries_.back(), positions);
    add_query(transaction, round);
  };
  kinds_.push_back(std::move(moves));
  kinds_.push_back(std::move(deforms));
}

const Outcome& DeviceLossWorld::execute(const TransactionCase& kind, unsigned round) {
  transaction_->begin(at(round));
  kind.declare(*transaction_, round);
  return database_->execute(*transaction_);
}

AnswerBits DeviceLossWorld::answers(const TransactionCase& kind) const {
  AnswerBits all;
  kind.append_answers(all);
  return all;
}

std::vector<EntityState> DeviceLossWorld::rows() const {
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
