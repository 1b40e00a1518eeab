// What a query reads: the writes of its transaction or a pinned version, never the writes of an aborted
// transaction.

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/stepping_clock.hpp"

namespace rtstdb::test {
namespace {

class Versions : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    box_ = add(make_box({2.0, 2.0, 2.0}));
  }
  EntityRow box_at(double x_m) const { return row_of(box_, {x_m, 0.0, 0.0}); }
  static Ray along_x(WorldTime t = {}) { return ray_from({}, {1, 0, 0}, t); }
  /// Of the ray along x; -1: a miss.
  float lambda(const ReadAt& read_at = {}, WorldTime t = {}) {
    const RayHit hit = trace(along_x(t), read_at);
    return hit.status == HitStatus::hit ? hit.lambda : -1.0f;
  }
  GeometryId box_;
};

TEST_F(Versions, AreEmptyAtFirst) {
  EXPECT_EQ(lambda(), -1.0f);
  EXPECT_EQ(trace(*prepare_rays(RayMode::any), std::vector<Ray>(100, along_x()))[99].status, HitStatus::miss);
  const EntityId only = create(box_at(5.0));
  EXPECT_EQ(lambda(), 4.0f);
  remove(only, {});
  EXPECT_EQ(lambda(), -1.0f);
}

TEST_F(Versions, StayReadableWhilePinned) {
  const EntityId body = create(box_at(1.0 + 10.0));
  const Version first = database().latest().version;
  std::mt19937 random(9);
  for (std::uint32_t k = 1; k < 60; ++k) {
    update_motion(body, box_at(10.0 * (k + 1) + 1.0).motion, at_s(0.01 * k));
    for (int i = 0; i < 3; ++i) {
      const auto old = static_cast<std::uint32_t>(random() % (k + 1));
      const WorldTime t = at_s(0.01 * old + 0.005);
      EXPECT_EQ(lambda(ReadAt::pinned(first + old), t), 10.0f * static_cast<float>(old + 1));
      EXPECT_EQ(lambda(ReadAt::as_of(t), t), 10.0f * static_cast<float>(old + 1));
    }
    EXPECT_EQ(lambda({}, at_s(0.01 * k)), 10.0f * static_cast<float>(k + 1));
  }
}

TEST_F(Versions, ReuseAnIndexWithANewGeneration) {
  const EntityId first = create(box_at(11.0), at_s(0.0));
  const Version with_first = database().latest().version;
  remove(first, at_s(0.1));
  const Version with_none = database().latest().version;
  EntityRow row = box_at(21.0);
  row.material = database().add_material({}, "new").value();
  const EntityId second = create(row, at_s(0.2));
  ASSERT_EQ(second.index, first.index);
  ASSERT_NE(second.generation, first.generation);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(trace(along_x(at_s(0.2))).entity, second);
    EXPECT_EQ(trace(along_x(at_s(0.2))).material, row.material);
    EXPECT_EQ(trace(along_x(), ReadAt::pinned(with_first)).entity, first);
    EXPECT_EQ(lambda(ReadAt::pinned(with_none), at_s(0.1)), -1.0f);
  }
}

TEST_F(Versions, IncludeTheWritesOfTheTransaction) {
  const auto ids = create(std::vector{box_at(31.0), box_at(41.0)});
  const auto query = prepare_rays();
  query->rays()[0] = along_x(at_s(1.0));
  query->rays()[1] = ray_from({}, {-1, 0, 0}, at_s(1.0));
  const auto transaction = database().make_transaction({.max_writes = 4, .max_queries = 1, .max_reads = 3});
  transaction->begin(terms_at(at_s(1.0)));
  transaction->remove(ids[0]);
  transaction->update(ids[1], box_at(-11.0));
  const auto made = transaction->create(box_at(21.0));
  transaction->add_query(*query, 2);
  const auto removed = transaction->read(ids[0]);
  const auto moved = transaction->read(ids[1]);
  ASSERT_EQ(database().execute(*transaction).status, Status::committed);
  const EntityId nearest = transaction->created(made);
  EXPECT_EQ(query->hits()[0].entity, nearest);
  EXPECT_EQ(query->hits()[0].lambda, 20.0f);
  EXPECT_EQ(query->hits()[1].entity, ids[1]);
  EXPECT_EQ(query->hits()[1].lambda, 10.0f);
  EXPECT_EQ(transaction->state(removed), nullptr);
  ASSERT_NE(transaction->state(moved), nullptr);
  EXPECT_EQ(transaction->state(moved)->row.motion.p_world_m.x, -11.0);
}

TEST_F(Versions, MayUseGeometryThatIsNewerThanTheQuery) {
  create(box_at(51.0));
  const auto query = prepare_rays();
  const auto regions = prepare(RegionQueryOptions{.name = "region", .capacity = 1, .ids_per_region = 8});
  regions->regions()[0].half_extent_m = glm::vec3(100.0f);
  EXPECT_EQ(trace(*query, std::vector{along_x()})[0].lambda, 50.0f);
  // Large enough that the pools grow more than once.
  for (std::uint32_t subdivisions = 3; subdivisions <= 6; ++subdivisions) {
    const GeometryId sphere = add(make_sphere(1.0, subdivisions));
    EXPECT_EQ(trace(*query, std::vector{along_x()})[0].status, HitStatus::hit);
    const double x_m = 45.0 - 5.0 * subdivisions;
    const EntityId newest = create(row_of(sphere, {x_m, 0.0, 0.0}));
    const RayHit hit = trace(*query, std::vector{along_x()})[0];
    EXPECT_EQ(hit.entity, newest);
    EXPECT_NEAR(hit.lambda, x_m - 1.0, 0.01);
    ASSERT_EQ(run(*regions, 1).status, Status::committed);
    EXPECT_EQ(regions->answers()[0].found, subdivisions - 1);
  }
}

TEST_F(Versions, AreNotChangedByARefusedGeometry) {
  create(box_at(11.0));
  ASSERT_EQ(lambda(), 10.0f);
  // Lavapipe can not bind the sort keys of so many triangles as one buffer.
  TriangleMesh mesh = make_box({1.0, 1.0, 1.0});
  mesh.triangles.reserve(9'000'000);
  while (mesh.triangles.size() < 9'000'000)
    mesh.triangles.push_back(mesh.triangles[mesh.triangles.size() % 12]);
  const auto added = database().add_geometry(mesh, "huge");
  if (database().device().software) {
    ASSERT_FALSE(added.ok());
    EXPECT_EQ(added.error().code, ErrorCode::capacity);
    EXPECT_NE(added.error().message.find("huge"), std::string::npos) << added.error().message;
  }
  EXPECT_EQ(lambda(), 10.0f);
  const EntityId nearer = create(box_at(6.0));
  EXPECT_EQ(trace(along_x()).entity, nearer);
  EXPECT_TRUE(add(make_sphere(1.0, 4)).valid());
  EXPECT_EQ(lambda(), 5.0f);
}

TEST_F(Versions, MayHaveCarriersWithoutGeometry) {
  EntityRow row;
  row.motion.p_world_m = {0.0, 50.0, 0.0};
  const EntityId carrier = create(row);
  EXPECT_EQ(lambda(), -1.0f) << "no entity has geometry";
  create(box_at(11.0));
  create(row_of(box_, {21.0, 50.0, 0.0}));
  Ray ray = along_x();
  ray.carrier = carrier;
  EXPECT_EQ(trace(ray).lambda, 20.0f);
  EXPECT_EQ(lambda(), 10.0f);
  const auto regions = prepare(RegionQueryOptions{.name = "region", .capacity = 2, .ids_per_region = 8});
  regions->regions()[0].half_extent_m = glm::vec3(1000.0f);
  regions->regions()[1].half_extent_m = glm::vec3(25.0f);
  regions->regions()[1].carrier = carrier;
  ASSERT_EQ(run(*regions, 2).status, Status::committed);
  EXPECT_EQ(regions->answers()[0].found, 2u);
  EXPECT_EQ(regions->answers()[1].found, 1u);
  // An entity is hit while it has geometry.
  row.geometry = box_;
  row.motion.p_world_m = {5.0, 0.0, 0.0};
  for (const bool visible : {true, false, true}) {
    row.geometry = visible ? box_ : GeometryId{};
    ASSERT_EQ(execute([&](Transaction& transaction) { transaction.update(carrier, row); }).status,
              Status::committed);
    EXPECT_EQ(lambda(), visible ? 4.0f : 10.0f);
  }
}

TEST_F(Versions, MayShrinkAndBeReadBackAndForth) {
  open({.max_entities = 12'000});
  box_ = add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityRow> rows;
  rows.reserve(10'000);
  for (int i = 0; i < 10'000; ++i)
    rows.push_back(row_of(box_, {10.0 + 3.0 * i, 0.0, 0.0}));
  const auto ids = create(rows);
  const Version full = database().latest().version;
  EXPECT_EQ(trace(along_x()).entity, ids[0]);
  const Outcome outcome = execute([&](Transaction& transaction) {
    for (int i = 0; i < 8000; ++i)
      transaction.remove(ids[static_cast<std::size_t>(i)]);
  });
  ASSERT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(trace(along_x()).entity, ids[8000]) << "one workgroup builds the smaller tree";
  EXPECT_EQ(trace(along_x(), ReadAt::pinned(full)).entity, ids[0]);
  EXPECT_EQ(trace(along_x()).entity, ids[8000]);
}

TEST_F(Versions, HaveNothingOfAMissedTransactionOnTheDevice) {
  const SteppingClock clock;
  open({.clock = &clock});
  box_ = add(make_box({2.0, 2.0, 2.0}));
  const EntityId body = create(box_at(11.0));
  const EntityId other = create(box_at(101.0));
  const auto query = prepare_rays();
  query->rays()[0] = along_x();
  int computed_and_missed = 0;
  for (std::int64_t readings = 1; readings <= 8; ++readings) {
    const auto transaction = database().make_transaction({.max_writes = 3, .max_queries = 1});
    Terms terms;
    terms.deadline_class = DeadlineClass::firm;
    terms.deadline = clock.after_readings(readings);
    transaction->begin(terms);
    transaction->update(body, box_at(501.0));
    transaction->remove(other);
    transaction->create(box_at(5.0));
    transaction->add_query(*query, 1);
    const Outcome& outcome = database().execute(*transaction);
    if (outcome.status != Status::missed) {
      EXPECT_EQ(outcome.status, Status::committed);
      EXPECT_EQ(lambda(), 4.0f);
      break;
    }
    computed_and_missed += outcome.computed != ClockTime{} ? 1 : 0;
    EXPECT_EQ(lambda(), 10.0f) << "after the deadline of " << readings << " readings";
    EXPECT_EQ(trace(along_x()).entity, body);
    update_motion(body, box_at(11.0).motion, {});
    EXPECT_EQ(lambda(), 10.0f);
  }
  EXPECT_GT(computed_and_missed, 0) << "no transaction missed its deadline after its queries ran";
}

}  // namespace
}  // namespace rtstdb::test
