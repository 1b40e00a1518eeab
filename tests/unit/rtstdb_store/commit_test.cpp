// Effects of write sets, and their refusal as a whole.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

#include "rows.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::store::test {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Commit, AppliesWritesInTheirOrder) {
  Store store(options(4));
  Motion motion;
  motion.p_world_m = {7, 8, 9};
  motion.q_world = {0, 2, 0, 0};
  WriteSet set = set_of(0, {create(row_at(1, 2)), update_motion({0, 1}, motion), create(row_at(2)),
                            remove({1, 1}), create(row_at(3))});
  ASSERT_FALSE(commit(store, set));
  const Snapshot now = store.latest_snapshot();
  const EntityState* moved = now.find({0, 1});
  ASSERT_NE(moved, nullptr);
  EXPECT_EQ(moved->row.geometry.index, 2u) << "a motion update leaves the rest of the row";
  EXPECT_EQ(moved->row.mask, 1u);
  EXPECT_EQ(moved->row.motion.p_world_m, motion.p_world_m);
  EXPECT_EQ(moved->row.motion.q_world, glm::dquat(0, 1, 0, 0)) << "normalised on entry";
  EXPECT_EQ(now.find({1, 1}), nullptr);
  ASSERT_NE(now.find({1, 2}), nullptr) << "removed and created within one set";
  EXPECT_EQ(now.find({1, 2})->row.mask, 3u);
  EXPECT_EQ(now.find({1, 2})->written_by, 1u);
}

// The unchanged words of each write; zeros of different signs differ.
TEST(Commit, FindsUnchangedWords) {
  Store store(options(8));
  EntityRow row = row_at(1);
  row.motion.w_world_radps = {0.0, 2.0, 3.0};
  ASSERT_FALSE(commit(store, set_of(1, {create(row), create(row)})));
  Motion first = row.motion;
  first.p_world_m.x = 9.0;
  first.w_world_radps.x = -0.0;
  Motion second = first;
  second.valid_from = world_time_ns(5);
  WriteSet set = set_of(
      2, {update_motion({0, 1}, first), update_motion({0, 1}, second), update_motion({1, 1}, row.motion)});
  ASSERT_FALSE(commit(store, set));
  EXPECT_EQ(set.writes[0].unchanged, all_motion_words & ~(1u << 0 | 1u << 10));
  EXPECT_EQ(set.writes[0].base_version_low, 1u);
  EXPECT_EQ(set.writes[1].unchanged, all_motion_words & ~(1u << 13));
  EXPECT_EQ(set.writes[1].base_version_low, 2u) << "the write before it, of the same version";
  EXPECT_EQ(set.writes[2].unchanged, all_motion_words);
  EXPECT_EQ(set.writes[2].base_version_low, 1u);
}

struct Refusal {
  const char* name;
  Write bad;
  BadInputReason reason;
  double first_value;
};

std::vector<Refusal> refusals() {
  EntityRow not_finite = row_at(1);
  not_finite.motion.v_world_mps.y = nan;
  EntityRow no_orientation = row_at(1);
  no_orientation.motion.q_world = {0, 0, 0, 0};
  EntityRow far_away = row_at(1);
  far_away.motion.p_world_m.x = 2e5;
  EntityRow late = row_at(1);
  late.motion.valid_from = WorldTime::max();
  Motion bad_motion;
  bad_motion.p_world_m.x = nan;
  return {
      {"NaN", create(not_finite), BadInputReason::not_finite, 1.0},
      {"zero quaternion", update({0, 1}, no_orientation), BadInputReason::zero_quaternion, 0.0},
      {"too far", update({0, 1}, far_away), BadInputReason::out_of_limits, 2e5},
      {"time beyond limits", create(late), BadInputReason::out_of_limits,
       seconds_between({}, WorldTime::max())},
      {"NaN motion", update_motion({0, 1}, bad_motion), BadInputReason::not_finite, nan},
      {"geometry 9", create(row_at(1, 9)), BadInputReason::unknown_geometry, 9.0},
      {"material 9", create(of_material(9)), BadInputReason::unknown_material, 9.0},
      {"light 0", create(with_light(0)), BadInputReason::unknown_light, 0.0},
      {"light 7", update({0, 1}, with_light(7)), BadInputReason::unknown_light, 7.0},
      {"never created", update({3, 1}, row_at(1)), BadInputReason::unknown_entity, 0.0},
      {"older generation", remove({0, 0}), BadInputReason::unknown_entity, 0.0},
      {"no id", remove(EntityId{}), BadInputReason::unknown_entity, 0.0},
      {"removed before", update_motion({1, 1}, Motion{}), BadInputReason::unknown_entity, 0.0},
      {"removed twice", remove({1, 1}), BadInputReason::unknown_entity, 0.0},
  };
}

TEST(Commit, IsRefusedAsAWholeForOneFault) {
  for (const Refusal& refusal : refusals()) {
    SCOPED_TRACE(refusal.name);
    Store store(options(4));
    ASSERT_FALSE(commit(store, set_of(5, {create(row_at(1)), create(row_at(2))})));
    const auto fault = commit(store, set_of(6, {update({0, 1}, row_at(8)), remove({1, 1}), create(row_at(9)),
                                                remove({1, 2}), refusal.bad, create(row_at(10))}));
    ASSERT_TRUE(fault);
    EXPECT_EQ(fault->reason, refusal.reason);
    EXPECT_EQ(fault->element, 4u);
    const bool names_entity = refusal.bad.kind != WriteKind::create;
    EXPECT_EQ(fault->entity, names_entity ? refusal.bad.state.id : EntityId{});
    if (std::isnan(refusal.first_value)) {
      EXPECT_TRUE(std::isnan(fault->values[0]));
    } else {
      EXPECT_DOUBLE_EQ(fault->values[0], refusal.first_value);
    }

    EXPECT_EQ(store.latest().version, 1u);
    EXPECT_EQ(store.latest_snapshot().find({0, 1})->row.mask, 1u);
    EXPECT_EQ(store.latest_snapshot().find({1, 1})->row.mask, 2u);
    WriteSet next = set_of(6, {create(row_at(3))});
    ASSERT_FALSE(commit(store, next));
    EXPECT_EQ(next.writes[0].state.id, (EntityId{2, 1})) << "indices and generations are not used up";
  }
}

TEST(Commit, RefusesTooManyEntities) {
  Store store(options(2));
  const auto fault = commit(store, set_of(0, {create(row_at(1)), create(row_at(2)), create(row_at(3))}));
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->reason, BadInputReason::too_many_entities);
  EXPECT_EQ(fault->element, 2u);
  EXPECT_EQ(fault->values[0], 2.0);
  EXPECT_FALSE(commit(store, set_of(0, {create(row_at(1)), create(row_at(2))})));
}

TEST(Commit, RefusesADecreasingWorldTime) {
  Store store(options(4));
  ASSERT_FALSE(commit(store, set_of(-3'000'000'000, {create(row_at(1))})))
      << "the origin of time is the caller's";
  ASSERT_FALSE(commit(store, set_of(2'000'000'000, {create(row_at(1))})));
  ASSERT_FALSE(commit(store, set_of(2'000'000'000, {create(row_at(1))}))) << "equal times are allowed";
  const auto fault = commit(store, set_of(1'500'000'000, {create(row_at(1))}));
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->reason, BadInputReason::world_time_goes_back);
  EXPECT_DOUBLE_EQ(fault->values[0], 1.5);
  EXPECT_DOUBLE_EQ(fault->values[1], 2.0);
  EXPECT_EQ(fault->element, BadInput::no_element);
  const auto beyond = commit(store, set_of(WorldTime::max().time_since_epoch().count(), {create(row_at(1))}));
  EXPECT_EQ(beyond->reason, BadInputReason::out_of_limits);
  EXPECT_EQ(beyond->element, BadInput::no_element) << "of the terms, not of a write";
}

TEST(Commit, UsesUpTheVersionNumberOfADiscardedSet) {
  Store store(options(4));
  ASSERT_FALSE(commit(store, set_of(1, {create(row_at(1)), create(row_at(2))})));
  for (const bool published : {false, true}) {
    WriteSet set =
        set_of(2, {update({0, 1}, row_at(7)), remove({1, 1}), create(row_at(8)), create(row_at(9))});
    ASSERT_FALSE(store.stage(set));
    if (published) store.publish();
    EXPECT_EQ(store.latest().version, published ? set.version : 1u);
    EXPECT_EQ(store.staged_snapshot().find({0, 1})->row.mask, 7u);
    EXPECT_EQ(store.staged_snapshot().find({1, 2})->row.mask, 8u);
    store.discard();
    EXPECT_EQ(store.latest().version, 1u);
    EXPECT_EQ(store.latest_snapshot().find({0, 1})->row.mask, 1u);
    EXPECT_NE(store.latest_snapshot().find({1, 1}), nullptr);
    EXPECT_EQ(std::get<BadInput>(store.read(ReadAt::pinned(set.version))).reason,
              BadInputReason::unknown_version);
  }
  WriteSet next = set_of(2, {create(row_at(3))});
  ASSERT_FALSE(commit(store, next));
  EXPECT_EQ(next.version, 4u);
  EXPECT_EQ(next.writes[0].state.id, (EntityId{2, 1}));
}

TEST(CommitDeathTest, StepsOutOfOrderAbort) {
  Store store(options(4));
  EXPECT_DEATH(store.publish(), "assertion failed: no commit is staged");
  EXPECT_DEATH(store.complete_commit(), "assertion failed: no commit is published");
  EXPECT_DEATH(store.discard(), "assertion failed: no commit is staged");
  EXPECT_DEATH(static_cast<void>(store.staged_snapshot()), "assertion failed: no commit is staged");
  WriteSet empty;
  EXPECT_DEATH(static_cast<void>(store.stage(empty)), "assertion failed: the commit has no writes");
  WriteSet set = set_of(0, {create(row_at(1))});
  ASSERT_FALSE(store.stage(set));
  EXPECT_DEATH(static_cast<void>(store.stage(set)), "assertion failed: a commit is staged already");
  EXPECT_DEATH(store.complete_commit(), "assertion failed: no commit is published");
}

}  // namespace
}  // namespace rtstdb::store::test
