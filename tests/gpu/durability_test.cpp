// A database with a directory: when it is opened again, it has its entities, geometries and shapes; and
// options that it refuses.

#include <glm/gtc/quaternion.hpp>

#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "database_fixture.hpp"

namespace rtstdb::test {
namespace {

class DurabilityTest : public DatabaseTest {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "hil_durability_XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    directory_ = name;
  }
  void TearDown() override {
    DatabaseTest::TearDown();
    std::filesystem::remove_all(directory_);
  }
  float depth_m(EntityId first, EntityId second) {
    const auto query = prepare(ContactQueryOptions{.name = "contacts", .capacity = 1});
    query->searches()[0] = {.first = first, .second = second};
    EXPECT_TRUE(run(*query, 1).done());
    return -query->answers()[0].pairs[0].distance_m;
  }
  DatabaseOptions with(DurabilityMode mode) const {
    DatabaseOptions options;
    options.durability.directory = directory_ / "log";
    options.durability.mode = mode;
    options.durability.segment_bytes = std::uint64_t{1} << 20;
    return options;
  }

  std::filesystem::path directory_;
};

TEST_F(DurabilityTest, RestoresEntitiesGeometriesAndShapes) {
  open(with(DurabilityMode::group));
  EXPECT_FALSE(database().recovery().found);
  EXPECT_EQ(database().durability().mode, DurabilityMode::group);
  const GeometryId box = add(make_box({2.0, 2.0, 2.0}));
  const TriangleMesh sheet = make_rectangle(4.0, 4.0);
  GeometryOptions deforms;
  deforms.deforms = true;
  const auto soft = database().add_geometry(sheet, "soft", deforms);
  ASSERT_TRUE(soft.ok());
  EntityRow row = row_of(box, {10.0, 0.0, 0.0});
  row.motion.v_world_mps = {1.0, 0.0, 0.0};
  const EntityId moving = create(row);
  const EntityId fixed = create(row_of(soft.value(), {0.0, 0.0, -5.0}));
  std::vector<glm::vec3> raised = sheet.positions_m;
  for (glm::vec3& position : raised)
    position.z += 2.0f;
  const auto raise = database().make_transaction(
      {.max_geometry_updates = 1, .max_positions = static_cast<std::uint32_t>(raised.size())});
  raise->begin(terms_at({}));
  raise->update_geometry(soft.value(), raised);
  EXPECT_TRUE(database().execute(*raise).durable) << describe(raise->outcome());
  EXPECT_GE(raise->outcome().durable_at, raise->outcome().published);
  const VersionInfo latest = database().latest();
  EXPECT_EQ(database().durable(), latest.version);
  const RayHit hit = trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, at_s(1.0)));
  const RayHit below = trace(ray_from({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f}, at_s(1.0)));
  EXPECT_EQ(hit.entity, moving);
  EXPECT_EQ(below.entity, fixed);
  EXPECT_TRUE(database().close().ok());

  open(with(DurabilityMode::async));
  const Recovery& recovery = database().recovery();
  EXPECT_TRUE(recovery.found);
  EXPECT_TRUE(recovery.closed) << recovery.summary;
  EXPECT_EQ(recovery.version, latest.version);
  EXPECT_EQ(database().latest().version, latest.version);
  EXPECT_EQ(database().find_geometry("soft"), soft.value());
  EXPECT_EQ(database().find_geometry("none"), std::nullopt);
  EXPECT_EQ(database().geometry(soft.value())->positions_m, raised);
  const RayHit restored = trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, at_s(1.0)));
  EXPECT_EQ(restored.entity, moving);
  EXPECT_EQ(restored.lambda, hit.lambda);
  EXPECT_EQ(trace(ray_from({0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, -1.0f}, at_s(1.0))).lambda, below.lambda);
  // New ids continue the old ones.
  const GeometryId third = add(make_box({1.0, 1.0, 1.0}));
  EXPECT_EQ(third.index, 2u);
  const EntityId next = create(row_of(third));
  EXPECT_EQ(next.index, 2u);
  EXPECT_EQ(database().latest().version, latest.version + 1);
  EXPECT_TRUE(database().wait_until_durable(database().latest().version, Nanoseconds::max()));
  EXPECT_TRUE(database().health().degraded.empty());
}

TEST_F(DurabilityTest, RestoresGivenConvexParts) {
  GeometryOptions halves;
  for (const float x : {-0.5f, 0.5f}) {
    auto& corners_m = halves.convex_parts_m.emplace_back(make_box({1.0, 1.0, 1.0}).positions_m);
    for (glm::vec3& corner : corners_m)
      corner.x += x;
  }
  // A sheet inside makes the shape concave, but its parts stand for it.
  TriangleMesh mesh = make_box({2.0, 1.0, 1.0});
  const TriangleMesh sheet = make_rectangle(0.5, 0.5);
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  mesh.positions_m.insert(mesh.positions_m.end(), sheet.positions_m.begin(), sheet.positions_m.end());
  for (const glm::uvec3& triangle : sheet.triangles)
    mesh.triangles.push_back(triangle + first);
  open(with(DurabilityMode::sync));
  const auto added = database().add_geometry(mesh, "halves", halves);
  ASSERT_TRUE(added) << added.error().message;
  EXPECT_EQ(database().geometry_info(added.value())->convex_parts, 2u);
  const EntityId still = create(row_of(added.value()));
  const EntityId touching = create(row_of(added.value(), {1.9, 0.0, 0.0}));
  EXPECT_NEAR(depth_m(still, touching), 0.1f, 1e-5f);
  EXPECT_TRUE(database().close().ok());
  open(with(DurabilityMode::async));
  EXPECT_EQ(database().geometry_info(added.value())->convex_parts, 2u);
  EXPECT_EQ(database().geometry_info(added.value())->hull_corners, 16u);
  EXPECT_NEAR(depth_m(still, touching), 0.1f, 1e-5f);
  halves.deforms = true;
  const auto deforming = database().add_geometry(mesh, "deforming", halves);
  ASSERT_FALSE(deforming);
  EXPECT_NE(deforming.error().message.find("deforms can not have convex parts"), std::string::npos);
}

TEST_F(DurabilityTest, RestoresSolids) {
  GeometryOptions options;
  options.solid = Solid{.kind = SolidKind::cylinder,
                        .radius_m = 0.5,
                        .height_m = 2.0,
                        .q_entity = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(0.0, 1.0, 0.0))};
  TriangleMesh mesh = make_cylinder(0.5, 2.0);
  for (glm::vec3& p_m : mesh.positions_m)
    p_m = glm::vec3(options.solid->q_entity * glm::dvec3(p_m));
  open(with(DurabilityMode::sync));
  const auto added = database().add_geometry(mesh, "roller", options);
  ASSERT_TRUE(added) << added.error().message;
  // Turned so that an edge of the mesh's sides is not at the lowest place.
  EntityRow row = row_of(added.value(), {0.0, 0.0, 0.499});
  row.motion.q_world = glm::angleAxis(std::numbers::pi / 32.0, glm::dvec3(1.0, 0.0, 0.0));
  const EntityId roller = create(row);
  const EntityId floor = create(row_of(add(make_box({4.0, 4.0, 1.0})), {0.0, 0.0, -0.5}));
  EXPECT_NEAR(depth_m(roller, floor), 0.001f, 2e-5f);
  EXPECT_TRUE(database().close().ok());
  open(with(DurabilityMode::async));
  EXPECT_TRUE(database().geometry_info(added.value())->solid);
  EXPECT_NEAR(depth_m(roller, floor), 0.001f, 2e-5f);
}

TEST_F(DurabilityTest, RestoresCornerNormalsAndColours) {
  TriangleMesh mesh = make_box({1.0, 1.0, 1.0});
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const float share = static_cast<float>(i) / 16.0f;
    mesh.corner_normals.push_back({glm::vec3(share, 1, 0), glm::vec3(0, share, 2), glm::vec3(-1)});
    mesh.corner_colors.push_back({glm::vec3(share, 1, 0), glm::vec3(0, share, 1), glm::vec3(1)});
  }
  open(with(DurabilityMode::sync));
  const auto still = database().add_geometry(mesh, "still");
  const auto soft = database().add_geometry(mesh, "soft", {.deforms = true});
  ASSERT_TRUE(still && soft);
  for (const bool reopened : {false, true}) {
    SCOPED_TRACE(reopened);
    if (reopened) {
      EXPECT_TRUE(database().close().ok());
      open(with(DurabilityMode::async));
    }
    EXPECT_EQ(database().geometry(still.value())->corner_normals, mesh.corner_normals);
    EXPECT_EQ(database().geometry(still.value())->corner_colors, mesh.corner_colors);
    // The normals would not fit another shape.
    EXPECT_TRUE(database().geometry(soft.value())->corner_normals.empty());
    EXPECT_EQ(database().geometry(soft.value())->corner_colors, mesh.corner_colors);
  }
  mesh.corner_colors.pop_back();
  const auto refused = database().add_geometry(mesh, "wrong");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("corner colours for 11 triangles"), std::string::npos);
}

TEST_F(DurabilityTest, RefusesADirectoryInUse) {
  open(with(DurabilityMode::async));
  const auto second = Database::open(with(DurabilityMode::async));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::file);
  EXPECT_NE(second.error().message.find((directory_ / "log").string()), std::string::npos);
}

TEST_F(DurabilityTest, RefusesBadOptions) {
  const auto refused = [](const DurabilityOptions& durability, ErrorCode code, const char* part) {
    DatabaseOptions options;
    options.durability = durability;
    const auto opened = Database::open(options);
    ASSERT_FALSE(opened.ok()) << part;
    EXPECT_EQ(opened.error().code, code) << opened.error().message;
    EXPECT_NE(opened.error().message.find(part), std::string::npos) << opened.error().message;
  };
  const auto directory = directory_ / "log";
  refused({.mode = DurabilityMode::sync}, ErrorCode::bad_input, "mode sync needs a directory");
  refused({.directory = directory, .mode = DurabilityMode::volatile_only}, ErrorCode::bad_input,
          "mode volatile");
  refused({.directory = directory, .flush_interval = Nanoseconds(-1)}, ErrorCode::bad_input,
          "flush_interval is -1");
  refused({.directory = directory, .flush_interval = Nanoseconds::max()}, ErrorCode::bad_input,
          "flush_interval is 9223372036854775807 ns; 0 to 3600000000000 are allowed");
  refused({.directory = directory, .ring_bytes = 100}, ErrorCode::bad_input, "ring_bytes is 100");
  refused({.directory = directory, .segment_bytes = 100}, ErrorCode::bad_input, "segment_bytes is 100");
  refused({.directory = directory_ / "not" / "there"}, ErrorCode::file, "No such file or directory");
  EXPECT_FALSE(std::filesystem::exists(directory)) << "a refused database has created it";
}

/// A sum with a time must not overflow.
TEST_F(DurabilityTest, RefusesNegativeAndHugeDurations) {
  for (const Nanoseconds duration : {Nanoseconds(-1), Nanoseconds::max()}) {
    DatabaseOptions options;
    options.chunk = duration;
    const auto opened = Database::open(options);
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().message,
              "chunk is " + std::to_string(duration.count()) + " ns; 0 to 3600000000000 are allowed");
  }
}

TEST_F(DurabilityTest, RefusesBadPriorities) {
  const auto refusal = [](const DatabaseOptions& options) {
    const auto opened = Database::open(options);
    return opened.ok() ? std::string() : opened.error().message;
  };
  for (const int priority : {-3, 1000}) {
    DatabaseOptions options;
    options.thread_priority = priority;
    EXPECT_EQ(refusal(options),
              "thread_priority is " + std::to_string(priority) + "; 0, ordinary, and 1 to 99 are allowed");
  }
}

TEST_F(DurabilityTest, IsVolatileWithoutADirectory) {
  open({});
  create(row_of(add(make_box({1.0, 1.0, 1.0}))));
  EXPECT_EQ(database().durability().mode, DurabilityMode::volatile_only);
  EXPECT_EQ(database().durable(), 0u);
  EXPECT_FALSE(database().wait_until_durable(1, Nanoseconds(1)));
  EXPECT_FALSE(database().recovery().found);
  EXPECT_TRUE(database().close().ok());
}

}  // namespace
}  // namespace rtstdb::test
