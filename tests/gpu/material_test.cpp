// Materials: registered once, named by rows, part of each answer, kept by the log.

#include <string>
#include <vector>

#include <rtstdb/limits.hpp>
#include <rtstdb/log.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb::test {
namespace {

class Materials : public DatabaseTest {
 protected:
  MaterialId add_material(const Material& material, std::string_view name) {
    const auto added = database().add_material(material, name);
    EXPECT_TRUE(added.ok()) << added.error().message;
    return added ? added.value() : MaterialId{};
  }
};

TEST_F(Materials, HaveAscendingIdsAndKeepTheirProperties) {
  EXPECT_EQ(database().material({}), Material{}) << "the default material";
  EXPECT_EQ(database().find_material(""), std::nullopt) << "it has no name";
  const Material paint{.reflectance = 0.3}, foil{.reflectance = 0.9, .retro_gain = 300.0};
  const MaterialId first = add_material(paint, "paint");
  const MaterialId second = add_material(foil, "foil");
  const MaterialId third = add_material(foil, "paint");
  EXPECT_EQ(second.index, first.index + 1);
  EXPECT_EQ(third.index, second.index + 1);
  EXPECT_EQ(database().material(first), paint);
  EXPECT_EQ(database().material(second), foil);
  EXPECT_EQ(database().find_material("foil"), second);
  EXPECT_EQ(database().find_material("paint"), third) << "the last of that name";
  EXPECT_EQ(database().material({third.index + 1}), std::nullopt);
  EXPECT_EQ(database().find_material("none"), std::nullopt);
}

TEST_F(Materials, RefuseBadProperties) {
  const auto refused = database().add_material({.reflectance = 1.5}, "too bright");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_EQ(refused.error().message, "material 'too bright': reflectance is 1.5; allowed is 0 to 1");
  EXPECT_EQ(database().find_material("too bright"), std::nullopt);
}

TEST_F(Materials, RefuseMoreThanTheLimit) {
  std::uint32_t index = 0;
  while (database().material({index}))
    ++index;
  for (; index < max_materials; ++index)
    ASSERT_TRUE(database().add_material({}, "").ok()) << index;
  const auto beyond = database().add_material({}, "one more");
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, ErrorCode::capacity);
  EXPECT_NE(beyond.error().message.find("4096"), std::string::npos) << beyond.error().message;
}

TEST_F(Materials, ArePartOfAnswers) {
  const MaterialId foil = add_material({.retro_gain = 100.0}, "foil");
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0});
  row.material = foil;
  const EntityId entity = create(row);
  EXPECT_EQ(trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f})).material, foil);
  const auto cones = prepare(ConeQueryOptions{.name = "cone", .capacity = 1});
  cones->cones()[0].opening_angle_rad = 0.01f;
  ASSERT_TRUE(run(*cones, 1).done());
  EXPECT_EQ(cones->returns()[0].material, foil);
  const auto nearest = prepare(NearestQueryOptions{.name = "nearest", .capacity = 1});
  ASSERT_TRUE(run(*nearest, 1).done());
  ASSERT_EQ(nearest->answers()[0].neighbors.size(), 1u);
  EXPECT_EQ(nearest->answers()[0].neighbors[0].material, foil);

  row.material = {};
  execute([&](Transaction& transaction) { transaction.update(entity, row); });
  EXPECT_EQ(trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f})).material, MaterialId{});
}

TEST_F(Materials, UnknownOnesAreRefusedWithTheirNumber) {
  EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})));
  row.material = {77};
  const Outcome outcome = execute([&](Transaction& transaction) { transaction.create(row); });
  EXPECT_EQ(outcome.status, Status::bad_input);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::unknown_material);
  EXPECT_NE(describe(outcome).find("material 77 does not exist"), std::string::npos) << describe(outcome);
}

/// The materials that a log holds, in their order.
class MaterialListener final : public LogListener {
 public:
  void world(const VersionInfo&, std::span<const EntityState>) override {}
  void geometry(GeometryId, std::string_view, const GeometryOptions&, const TriangleMesh&) override {}
  void material(MaterialId id, std::string_view name, const Material& properties) override {
    EXPECT_EQ(id.index, materials.size() + 1);
    materials.emplace_back(name, properties);
  }
  void light(LightId, std::string_view, const Light&) override {}
  void commit(const VersionInfo&, std::span<const LogWrite>, std::span<const LogShape>) override {}
  void gap(Version, Version) override {}
  void unresolved(Version, Version, std::uint64_t) override {}

  std::vector<std::pair<std::string, Material>> materials;
};

class LoggedMaterials : public Materials {
 protected:
  void SetUp() override { open_logged(); }
  void TearDown() override {
    Materials::TearDown();
    EXPECT_TRUE(database().close().ok());  // before its folder goes
  }
  void open_logged() {
    DatabaseOptions options;
    options.durability = {.directory = folder_.path(), .mode = DurabilityMode::group};
    // A checkpoint after each few commits.
    options.durability.checkpoint_every_bytes = 4096;
    open(options);
  }
  const hil::tests::TemporaryFolder folder_;
};

TEST_F(LoggedMaterials, AreRecoveredWithTheirIds) {
  const GeometryId box = add(make_box({2.0, 2.0, 2.0}));
  const Material foil{.reflectance = 0.9, .retro_gain = 300.0};
  const Material paint{.reflectance = 0.3, .base_color{0.1, 0.2, 0.3}, .roughness = 0.25};
  const MaterialId of_foil = add_material(foil, "foil");
  EntityRow row = row_of(box, {10.0, 0.0, 0.0});
  row.material = of_foil;
  const EntityId entity = create(row);
  for (int k = 1; k < 60; ++k)
    create(row_of(box, {0.0, 10.0 * k, 0.0}), at_s(0.01 * k));
  const MaterialId of_paint = add_material(paint, "paint");
  row.material = of_paint;
  execute([&](Transaction& transaction) { transaction.update(entity, row); }, at_s(1.0));
  ASSERT_TRUE(database().close().ok());

  const auto contents = inspect_log(folder_.path());
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  EXPECT_TRUE(contents.value().damage.empty()) << contents.value().damage.front();
  MaterialListener listener;
  ASSERT_TRUE(read_log(folder_.path(), listener).ok());
  ASSERT_EQ(listener.materials.size(), of_paint.index);
  EXPECT_EQ(listener.materials[of_foil.index - 1], std::pair(std::string("foil"), foil));
  EXPECT_EQ(listener.materials[of_paint.index - 1], std::pair(std::string("paint"), paint));

  open_logged();
  EXPECT_EQ(database().material(of_foil), foil);
  EXPECT_EQ(database().find_material("paint"), of_paint);
  EXPECT_EQ(trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, at_s(1.0))).material, of_paint);
  EXPECT_EQ(add_material({}, "next").index, of_paint.index + 1) << "new ids continue the old ones";
}

TEST_F(LoggedMaterials, RefuseANameThatTheLogCannotHold) {
  const auto refused = database().add_material({}, std::string(5000, 'x'));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_NE(refused.error().message.find("5000 bytes"), std::string::npos);
}

}  // namespace
}  // namespace rtstdb::test
