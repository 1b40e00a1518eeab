// Lights: registered once, named by rows, kept by the log; an entity with a light needs no geometry.

#include <string>
#include <utility>
#include <vector>

#include <rtstdb/limits.hpp>
#include <rtstdb/log.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb::test {
namespace {

const Light lamp{.kind = LightKind::point, .color{1.0, 0.5, 0.25}, .intensity_cd = 100.0};
const Light beam{
    .kind = LightKind::spot, .intensity_cd = 5e4, .inner_angle_rad = 0.1, .outer_angle_rad = 0.4};
const Light sun{.kind = LightKind::directional, .illuminance_lx = 1e5, .angular_diameter_rad = 0.009};
const Light day{
    .kind = LightKind::sky, .zenith_cdpm2{3000.0, 3000.0, 3000.0}, .horizon_cdpm2{8000.0, 9000.0, 1e4}};

class Lights : public DatabaseTest {
 protected:
  LightId add_light(const Light& light, std::string_view name) {
    const auto added = database().add_light(light, name);
    EXPECT_TRUE(added.ok()) << added.error().message;
    return added ? added.value() : LightId{};
  }
  /// The light of an entity in the latest version.
  LightId light_of(EntityId entity) {
    const std::vector<EntityState> states = database().snapshot({}).value();
    for (const EntityState& state : states)
      if (state.id == entity) return state.row.light;
    ADD_FAILURE() << "no such entity";
    return {};
  }
  static EntityRow row_with(LightId light) {
    EntityRow row;
    row.light = light;
    return row;
  }
};

TEST_F(Lights, HaveAscendingIdsAndKeepTheirProperties) {
  EXPECT_EQ(database().light({}), std::nullopt) << "no light";
  EXPECT_EQ(database().light({0}), std::nullopt);
  EXPECT_EQ(database().find_light(""), std::nullopt);
  const LightId first = add_light(lamp, "lamp");
  const LightId second = add_light(sun, "sun");
  const LightId third = add_light(day, "lamp");
  EXPECT_EQ(first.index, 0u);
  EXPECT_EQ(second.index, 1u);
  EXPECT_EQ(third.index, 2u);
  EXPECT_EQ(database().light(first), lamp);
  EXPECT_EQ(database().light(second), sun);
  EXPECT_EQ(database().light(third), day);
  EXPECT_EQ(database().find_light("sun"), second);
  EXPECT_EQ(database().find_light("lamp"), third) << "the last of that name";
  EXPECT_EQ(database().light({3}), std::nullopt);
  EXPECT_EQ(database().find_light("none"), std::nullopt);
}

TEST_F(Lights, RefuseBadProperties) {
  const auto refused = database().add_light({.kind = LightKind::sky, .intensity_cd = 5.0}, "odd");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_EQ(refused.error().message,
            "light 'odd': intensity_cd is not used by a light of kind sky; leave it at its default");
  EXPECT_EQ(database().find_light("odd"), std::nullopt);
}

TEST_F(Lights, RefuseMoreThanTheLimit) {
  for (std::uint32_t index = 0; index < max_lights; ++index)
    ASSERT_EQ(add_light(lamp, "").index, index);
  const auto beyond = database().add_light(lamp, "one more");
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, ErrorCode::capacity);
  EXPECT_NE(beyond.error().message.find("4096"), std::string::npos) << beyond.error().message;
}

TEST_F(Lights, AreNamedByRowsWithAndWithoutGeometry) {
  const LightId of_lamp = add_light(lamp, "lamp"), of_sun = add_light(sun, "sun");
  EntityRow body = row_of(add(make_box({2.0, 2.0, 2.0})), {10.0, 0.0, 0.0});
  body.light = of_lamp;
  const EntityId lit = create(body), alone = create(row_with(of_sun));
  EXPECT_EQ(light_of(lit), of_lamp);
  EXPECT_EQ(light_of(alone), of_sun);
  EXPECT_EQ(trace(ray_from({0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f})).entity, lit);

  Motion motion;
  motion.p_world_m = {20.0, 0.0, 0.0};
  update_motion(lit, motion, at_s(1.0));
  EXPECT_EQ(light_of(lit), of_lamp) << "a motion leaves the light";
  body.light = {};
  execute([&](Transaction& transaction) { transaction.update(lit, body); }, at_s(2.0));
  EXPECT_FALSE(light_of(lit).valid());
  EXPECT_EQ(light_of(alone), of_sun);
}

TEST_F(Lights, UnknownOnesAreRefusedWithTheirNumber) {
  const Outcome outcome = execute([&](Transaction& transaction) { transaction.create(row_with({7})); });
  EXPECT_EQ(outcome.status, Status::bad_input);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::unknown_light);
  EXPECT_NE(describe(outcome).find("light 7 does not exist"), std::string::npos) << describe(outcome);
}

/// The lights that a log holds, in their order, and the light of each created row.
class LightListener final : public LogListener {
 public:
  void world(const VersionInfo&, std::span<const EntityState>) override {}
  void geometry(GeometryId, std::string_view, const GeometryOptions&, const TriangleMesh&) override {}
  void material(MaterialId, std::string_view, const Material&) override {}
  void light(LightId id, std::string_view name, const Light& light) override {
    EXPECT_EQ(id.index, lights.size());
    lights.emplace_back(name, light);
  }
  void commit(const VersionInfo&, std::span<const LogWrite> writes, std::span<const LogShape>) override {
    for (const LogWrite& write : writes)
      if (write.kind == LogWrite::Kind::create) created.push_back(write.state.row.light);
  }
  void gap(Version, Version) override {}
  void unresolved(Version, Version, std::uint64_t) override {}

  std::vector<std::pair<std::string, Light>> lights;
  std::vector<LightId> created;
};

class LoggedLights : public Lights {
 protected:
  void SetUp() override { open_logged(); }
  void TearDown() override {
    Lights::TearDown();
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

TEST_F(LoggedLights, AreRecoveredWithTheirIdsAndRows) {
  const LightId of_lamp = add_light(lamp, "lamp"), of_beam = add_light(beam, "beam");
  const EntityId entity = create(row_with(of_lamp));
  for (int k = 1; k < 60; ++k)
    create(row_with(k % 2 == 0 ? of_beam : LightId{}), at_s(0.01 * k));
  const LightId of_sun = add_light(sun, "sun"), of_day = add_light(day, "day");
  execute([&](Transaction& transaction) { transaction.update(entity, row_with(of_day)); }, at_s(1.0));
  ASSERT_TRUE(database().close().ok());

  const auto contents = inspect_log(folder_.path());
  ASSERT_TRUE(contents.ok()) << contents.error().message;
  EXPECT_TRUE(contents.value().damage.empty()) << contents.value().damage.front();
  LightListener listener;
  ASSERT_TRUE(read_log(folder_.path(), listener).ok());
  using Named = std::pair<std::string, Light>;
  EXPECT_EQ(listener.lights,
            (std::vector{Named("lamp", lamp), Named("beam", beam), Named("sun", sun), Named("day", day)}));
  ASSERT_EQ(listener.created.size(), 60u);
  EXPECT_EQ(listener.created[0], of_lamp);
  EXPECT_EQ(listener.created[1], LightId{});
  EXPECT_EQ(listener.created[2], of_beam);

  open_logged();
  EXPECT_EQ(database().light(of_beam), beam);
  EXPECT_EQ(database().light(of_sun), sun);
  EXPECT_EQ(database().find_light("day"), of_day);
  EXPECT_EQ(light_of(entity), of_day);
  EXPECT_EQ(add_light(lamp, "next").index, of_day.index + 1) << "new ids continue the old ones";
}

TEST_F(LoggedLights, RefuseANameThatTheLogCannotHold) {
  const auto refused = database().add_light(lamp, std::string(5000, 'x'));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_input);
  EXPECT_NE(refused.error().message.find("5000 bytes"), std::string::npos);
}

}  // namespace
}  // namespace rtstdb::test
