// Shapes of geometry that deforms, and which versions have them.

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <variant>

#include "rows.hpp"

namespace rtstdb::store::test {
namespace {

using Positions = std::vector<glm::vec3>;

Positions all_at(float x) {
  return Positions(4, glm::vec3(x, 2.0f * x, -x));
}

class Shapes : public testing::Test {
 protected:
  Shapes() { deform(GeometryId{1}, 2); }
  void deform(GeometryId geometry, std::uint32_t kept) {
    store_.keep_shapes(geometry, ShapeHistory::make(all_at(0.0f), kept));
  }
  static ShapeWrite moved(GeometryId geometry, const Positions& positions) {
    return {geometry, positions.size(), 100, positions};
  }
  Version commit_shape(GeometryId geometry, float x) {
    const Positions positions = all_at(x);
    WriteSet set = set_of(0, {});
    set.shapes = {moved(geometry, positions)};
    EXPECT_FALSE(commit(store_, set));
    return store_.latest().version;
  }
  std::variant<Snapshot, BadInput> read(Version version) {
    return store_.read(ReadAt::pinned(version), ReadFor::rows_and_shapes);
  }
  /// Where the shape's first corner is.
  float x_at(Version version, GeometryId geometry = GeometryId{1}) {
    const auto found = read(version);
    if (!std::holds_alternative<Snapshot>(found)) return -1.0f;
    return std::get<Snapshot>(found).shape(geometry).positions_m[0].x;
  }
  Store store_{options(8)};
};

TEST_F(Shapes, AreValidFromTheirVersionOn) {
  EXPECT_EQ(x_at(0), 0.0f);
  const Version first = commit_shape(GeometryId{1}, 1.0f);
  EXPECT_EQ(x_at(first), 1.0f);
  EXPECT_EQ(x_at(0), 0.0f);
  ASSERT_FALSE(commit(store_, set_of(0, {create(row_at(5))})));
  EXPECT_EQ(x_at(first + 1), 1.0f);
  EXPECT_EQ(std::get<Snapshot>(read(first + 1)).shape(GeometryId{1}).version, first);

  const Version second = commit_shape(GeometryId{1}, 2.0f);
  EXPECT_EQ(x_at(second), 2.0f);
  EXPECT_EQ(x_at(first), 1.0f);
  const auto found = read(0);
  ASSERT_TRUE(std::holds_alternative<BadInput>(found)) << "two shapes are kept";
  EXPECT_EQ(std::get<BadInput>(found).reason, BadInputReason::snapshot_too_old);
  EXPECT_EQ(std::get<BadInput>(found).values[0], 0.0);
  EXPECT_EQ(std::get<BadInput>(found).values[1], static_cast<double>(first));
  EXPECT_TRUE(std::holds_alternative<Snapshot>(store_.read(ReadAt::pinned(0)))) << "its rows are kept";
}

TEST_F(Shapes, AreStagedPublishedAndDiscardedWithTheRows) {
  const Version first = commit_shape(GeometryId{1}, 1.0f);
  const Positions lost = all_at(7.0f);
  WriteSet set = set_of(0, {create(row_at(1))});
  set.shapes = {moved(GeometryId{1}, lost)};
  ASSERT_FALSE(store_.stage(set));
  EXPECT_EQ(store_.staged_snapshot().shape(GeometryId{1}).positions_m[0].x, 7.0f);
  EXPECT_EQ(store_.staged_snapshot().shape(GeometryId{1}).version, first + 1);
  EXPECT_EQ(store_.latest_snapshot().shape(GeometryId{1}).positions_m[0].x, 1.0f);
  store_.publish();
  EXPECT_EQ(store_.latest_snapshot().shape(GeometryId{1}).positions_m[0].x, 7.0f);
  store_.discard();
  EXPECT_EQ(x_at(first), 1.0f);
  EXPECT_EQ(x_at(0), 0.0f) << "a discarded shape takes no place";
  EXPECT_EQ(commit_shape(GeometryId{1}, 2.0f), first + 2);
  EXPECT_EQ(x_at(first), 1.0f);
}

TEST_F(Shapes, OfOneVersionReplaceEachOther) {
  deform(GeometryId{2}, 3);
  const Positions one = all_at(1.0f), two = all_at(2.0f), other = all_at(9.0f);
  WriteSet set = set_of(0, {});
  set.shapes = {moved(GeometryId{1}, one), moved(GeometryId{2}, other), moved(GeometryId{1}, two)};
  ASSERT_FALSE(commit(store_, set));
  EXPECT_EQ(x_at(1), 2.0f);
  EXPECT_EQ(x_at(1, GeometryId{2}), 9.0f);
  EXPECT_EQ(x_at(0), 0.0f) << "they take one place";
}

TEST_F(Shapes, AreUnchangedAfterAFault) {
  const Positions good = all_at(1.0f);
  Positions bad = all_at(2.0f);
  bad[2].y = NAN;
  WriteSet set = set_of(0, {create(row_at(1))});
  set.shapes = {moved(GeometryId{1}, good), moved(GeometryId{1}, bad)};
  const auto fault = store_.stage(set);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->reason, BadInputReason::not_finite);
  EXPECT_TRUE(fault->in_geometry_update);
  EXPECT_EQ(fault->element, 1u);
  EXPECT_EQ(fault->values[3], 2.0);
  EXPECT_EQ(store_.latest().version, 0u);
  EXPECT_EQ(x_at(0), 0.0f);
  WriteSet rows = set_of(0, {create(row_at(1))});
  ASSERT_FALSE(commit(store_, rows));
  EXPECT_EQ(rows.writes[0].state.id, (EntityId{0, 1})) << "the id was not used up";
  EXPECT_EQ(x_at(1), 0.0f);
}

TEST_F(Shapes, AreDroppedAsKeepsAfterPredicts) {
  const Positions positions = all_at(1.0f);
  WriteSet set = set_of(0, {});
  set.shapes = {moved(GeometryId{1}, positions)};
  EXPECT_TRUE(store_.keeps_after(0, set));
  ASSERT_FALSE(commit(store_, set));
  EXPECT_FALSE(store_.keeps_after(0, set));
  EXPECT_TRUE(store_.keeps_after(1, set));
  WriteSet unknown = set_of(0, {});
  unknown.shapes = {moved(GeometryId{}, positions)};
  EXPECT_TRUE(store_.keeps_after(0, unknown)) << "the commit is refused";
}

/// Versions without rows are dropped too: each counts as one change of the history.
TEST(ShapesWithShortHistory, AreDroppedWithTheirVersions) {
  Store store(options(8, 3));
  store.keep_shapes(GeometryId{0}, ShapeHistory::make(all_at(0.0f), 100));
  const auto write = [&](float x) {
    const Positions positions = all_at(x);
    WriteSet set = set_of(0, {});
    set.shapes = {{GeometryId{0}, positions.size(), 100, positions}};
    return commit(store, set);
  };
  for (int k = 1; k <= 3; ++k)
    ASSERT_FALSE(write(static_cast<float>(k)));
  const Positions last = all_at(4.0f);
  WriteSet next = set_of(0, {});
  next.shapes = {{GeometryId{0}, last.size(), 100, last}};
  EXPECT_FALSE(store.keeps_after(0, next));
  EXPECT_TRUE(store.keeps_after(1, next));
  ASSERT_FALSE(commit(store, next));
  EXPECT_EQ(store.oldest_kept(), 1u);
  const auto dropped = store.read(ReadAt::pinned(0));
  ASSERT_TRUE(std::holds_alternative<BadInput>(dropped));
  EXPECT_EQ(std::get<BadInput>(dropped).reason, BadInputReason::snapshot_too_old);
  EXPECT_EQ(std::get<BadInput>(dropped).values[1], 1.0);
  for (Version version = 1; version <= 4; ++version) {
    const auto found = store.read(ReadAt::pinned(version), ReadFor::rows_and_shapes);
    ASSERT_TRUE(std::holds_alternative<Snapshot>(found));
    EXPECT_EQ(std::get<Snapshot>(found).shape(GeometryId{0}).positions_m[3].x, static_cast<float>(version));
  }
}

TEST(ShapeModel, AgreesAfterRandomCommits) {
  constexpr std::uint32_t kept[] = {1, 2, 5};
  std::mt19937 random(5);
  Store store(options(8, 1000));
  std::vector<std::vector<std::pair<Version, float>>> model(3);
  for (std::uint32_t geometry = 0; geometry < 3; ++geometry) {
    store.keep_shapes(GeometryId{geometry}, ShapeHistory::make(all_at(0.0f), kept[geometry]));
    model[geometry].emplace_back(0, 0.0f);
  }
  int readable = 0, refused = 0;
  for (int round = 0; round < 500; ++round) {
    std::vector<std::pair<std::uint32_t, Positions>> changed;
    WriteSet set = set_of(0, {});
    for (std::uint32_t geometry = 0; geometry < 3; ++geometry)
      if (random() % 3 == 0) changed.emplace_back(geometry, all_at(static_cast<float>(round + 1)));
    for (const auto& [geometry, positions] : changed)
      set.shapes.push_back({GeometryId{geometry}, positions.size(), 100, positions});
    if (set.empty()) continue;
    const Version before = store.latest().version;
    ASSERT_FALSE(store.stage(set));
    if (random() % 4 == 0) {
      store.discard();
      EXPECT_EQ(store.latest().version, before);
    } else {
      store.publish();
      store.complete_commit();
      for (const auto& [geometry, positions] : changed)
        model[geometry].emplace_back(store.latest().version, positions[0].x);
    }
    const Version version = random() % (store.latest().version + 1);
    const auto found = store.read(ReadAt::pinned(version), ReadFor::rows_and_shapes);
    bool expected = std::holds_alternative<Snapshot>(store.read(ReadAt::pinned(version)));
    for (std::uint32_t geometry = 0; geometry < 3; ++geometry) {
      const auto& shapes = model[geometry];
      const std::size_t oldest = shapes.size() > kept[geometry] ? shapes.size() - kept[geometry] : 0;
      expected = expected && version >= shapes[oldest].first;
    }
    ASSERT_EQ(std::holds_alternative<Snapshot>(found), expected) << "round " << round;
    (expected ? readable : refused) += 1;
    if (!expected) continue;
    for (std::uint32_t geometry = 0; geometry < 3; ++geometry) {
      float x = 0.0f;
      for (const auto& [from, shape_x] : model[geometry])
        if (from <= version) x = shape_x;
      EXPECT_EQ(std::get<Snapshot>(found).shape(GeometryId{geometry}).positions_m[1].x, x);
    }
  }
  EXPECT_GT(readable, 5);
  EXPECT_GT(refused, 5);
}

}  // namespace
}  // namespace rtstdb::store::test
