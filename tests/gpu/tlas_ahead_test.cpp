// Slots for the next window of time that are made ahead, a part with each batch, so that no batch waits for a
// refit or build of all boxes. They equal newly made slots.

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "shaders/shared/entity.h"
#include "shaders/shared/node.h"
#include "tests/gpu/tlas_fixture.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

constexpr Nanoseconds milliseconds(std::int64_t count) {
  return Nanoseconds(count * 1'000'000);
}

class SlotsMadeAhead : public TlasTest {
 protected:
  std::uint32_t slots() const override { return 4; }
  /// The instances of the slot at the view's epoch.
  std::vector<std::uint32_t> instance_words(const accel::Tlas& tlas, const accel::TlasView& view) {
    const std::size_t bytes = std::size_t{16} * shared::instance_texels * GetParam();
    const gpu::Buffer copy =
        make_buffer({.name = "copy", .size_bytes = bytes, .memory = gpu::Memory::readback});
    run([&](gpu::Recorder& recorder) { recorder.copy(tlas.instances(view.slot), 0, copy, 0, bytes); });
    const auto words = copy.host_as<const std::uint32_t>();
    return {words.begin(), words.end()};
  }
  /// All entities get new positions and random velocities.
  void disperse(double speed_mps) {
    time_ += milliseconds(1);
    rows_.next(
        [&](std::uint32_t) {
          EntityRow row = anywhere();
          row.motion.v_world_mps = speed_mps * random_.vector();
          row.motion.valid_from = time_;
          return std::optional(row);
        },
        time_);
    settle();
  }
  /// The next version, in which `changed` entities, others in each tick, move by a millimetre.
  void tick_others(std::uint32_t changed) {
    time_ += milliseconds(1);
    std::vector<std::uint32_t> indices(changed);
    for (std::uint32_t& index : indices)
      index = next_changed_++ % GetParam();
    const auto moved = [&](std::uint32_t i) {
      EntityRow row = rows_.row(i)->row;
      row.motion.p_world_m.x += 0.001;
      return std::optional(row);
    };
    rows_.change(indices, moved, time_);
  }
  /// Batches that waited for a refit or build of all boxes.
  static std::uint64_t waits(const accel::Tlas::Counts& counts) {
    return counts.builds + counts.refits - counts.renewals;
  }
  /// Each slot gets the newest rows, and a slot that is being made ahead is discarded.
  void settle() {
    for (int k = 0; k < 40; ++k) {
      prepare(1);
      tick(1, true);
    }
  }
  struct Child {
    std::uint32_t reference;
    glm::dvec3 lo_m, hi_m;  // at the begin of the window
    bool is_inner() const { return (reference & shared::ref_leaf_bit) == 0; }
  };
  /// The children of all nodes of the tree. Expects each in the box of its node, up to two quanta.
  std::vector<Child> children_of(const accel::Tlas& tlas, const accel::TlasView& view) {
    const std::size_t bytes = tlas.nodes(view.slot).size_bytes();
    const gpu::Buffer copy =
        make_buffer({.name = "nodes", .size_bytes = bytes, .memory = gpu::Memory::readback});
    run([&](gpu::Recorder& recorder) { recorder.copy(tlas.nodes(view.slot), 0, copy, 0, bytes); });
    const auto words = copy.host_as<const std::uint32_t>();
    std::vector<Child> children;
    int outside = 0;
    std::vector<Child> remaining{{view.root, glm::dvec3(-1e9), glm::dvec3(1e9)}};
    while (!remaining.empty() && children.size() < words.size()) {
      const Child parent = remaining.back();
      remaining.pop_back();
      const auto node = words.subspan(std::size_t{4} * shared::tlas_node_texels * parent.reference);
      for (int child = 0; child < 8; ++child) {
        if ((node[3] >> (24 + child) & 1u) == 0) continue;
        Child made{node[16 + child], {}, {}};
        for (int axis = 0; axis < 3; ++axis) {
          const double quantum_m = std::ldexp(1.0, static_cast<int>(node[3] >> 8 * axis & 0xFFu) - 127);
          const auto edge_m = [&](int side) {
            const std::uint32_t edges = node[4 + 4 * axis + 2 * side + child / 4];
            return double{std::bit_cast<float>(node[axis])} + quantum_m * (edges >> child % 4 * 8 & 0xFFu);
          };
          made.lo_m[axis] = edge_m(0);
          made.hi_m[axis] = edge_m(1);
          outside += made.lo_m[axis] < parent.lo_m[axis] - 2.0 * quantum_m ? 1 : 0;
          outside += made.hi_m[axis] > parent.hi_m[axis] + 2.0 * quantum_m ? 1 : 0;
        }
        children.push_back(made);
        if (made.is_inner()) remaining.push_back(made);
      }
    }
    EXPECT_EQ(outside, 0);
    return children;
  }
  /// Half the surface area of all boxes of the tree.
  double cost_of(const accel::Tlas& tlas, const accel::TlasView& view) {
    double cost = 0.0;
    for (const Child& child : children_of(tlas, view)) {
      const glm::dvec3 size_m = child.hi_m - child.lo_m;
      cost += size_m.x * size_m.y + size_m.y * size_m.z + size_m.z * size_m.x;
    }
    return cost;
  }
  void expect_each_entity_once(const accel::TlasView& view) {
    std::vector<std::uint32_t> places;
    for (const Child& child : children_of(tlas_, view))
      if (!child.is_inner()) places.push_back(child.reference & shared::ref_instance_mask);
    std::ranges::sort(places);
    EXPECT_EQ(places, first_indices(GetParam()));
  }
  /// Expects the slot to equal one that is made for this version alone. False: their epochs differ, so that
  /// they can not be compared.
  bool expect_equals_new_slot(const accel::TlasView& view) {
    accel::Tlas fresh = make_tlas(1);
    const auto new_view = prepare(fresh, {.times = {time_, time_}});
    if (!new_view || new_view->epoch != view.epoch) return false;
    EXPECT_EQ(instance_words(tlas_, view), instance_words(fresh, *new_view));
    expect_each_entity_once(view);
    for (std::uint32_t i = 0; i < GetParam(); ++i) {
      EXPECT_EQ(view.identities[i].id, new_view->identities[i].id);
      EXPECT_EQ(view.identities[i].material, new_view->identities[i].material);
      EXPECT_EQ(tlas_.place_of(view.slot, i), fresh.place_of(new_view->slot, i));
    }
    return true;
  }

  std::uint32_t next_changed_ = 0;
};

TEST_P(SlotsMadeAhead, AreUsedByLoopsOfSmallBatchesWithFewChanges) {
  const auto move_one = [this](std::int64_t period_ms) {
    return [this, period_ms](std::uint32_t) {
      tick(1, true, milliseconds(period_ms));
      prepare(1);
    };
  };
  const auto move_others = [this](std::uint32_t divisor) {
    return [this, divisor](std::uint32_t) {
      tick_others(GetParam() / divisor);
      prepare(1);
    };
  };
  constexpr std::uint64_t any = std::numeric_limits<std::uint64_t>::max();
  const struct {
    const char* name;
    std::uint32_t ticks, warm_up;
    std::function<void(std::uint32_t)> tick;
    std::uint64_t min_waits, max_waits, min_ahead, max_ahead;
  } loops[] = {
      {"a tick of 1 ms", 1500, 0, move_one(1), 0, 0, 5, any},
      {"a tick of 5 ms", 300, 0, move_one(5), 0, 0, 5, any},
      {"a tick of 10 ms", 150, 0, move_one(10), 0, 0, 5, any},
      {"a tick of 20 ms", 75, 0, move_one(20), 0, 0, 5, any},
      {"a tick as long as a refit", 20, 0, move_one(100), 5, any, 0, 0},
      {"one in 200 entities changes", 2000, 500, move_others(200), 0, 0, 6, any},
      {"one in 50 entities changes", 2000, 500, move_others(50), 0, 0, 6, any},
      {"one in 5 entities changes: each window begins with a refit", 3000, 500, move_others(5), 0, 10, 0, 5},
      {"no entity changes", 1000, 0,
       [this](std::uint32_t) {
         time_ += milliseconds(1);
         prepare(1);
       },
       0, 0, 4, any},
      {"shapes change", 600, 0,
       [this](std::uint32_t k) {
         tick(1, true);
         prepare(1, k / 20);
       },
       29, any, 0, 0},
      {"large batches", 300, 0,
       [this](std::uint32_t) {
         tick(1, true);
         prepare(GetParam());
       },
       0, any, 0, 0},
  };
  for (const auto& loop : loops) {
    SCOPED_TRACE(loop.name);
    SetUp();
    auto before = tlas_.counts();
    for (std::uint32_t k = 0; k < loop.ticks; ++k) {
      loop.tick(k);
      if (k > 0 && k == loop.warm_up) before = tlas_.counts();
    }
    const auto counts = since(before);
    EXPECT_GE(waits(counts), loop.min_waits);
    EXPECT_LE(waits(counts), loop.max_waits);
    EXPECT_GE(counts.ahead, loop.min_ahead);
    EXPECT_LE(counts.ahead, loop.max_ahead);
  }
}

/// With as many loops as slots. A loop that takes the slot of another would make that one take the next.
TEST_P(SlotsMadeAhead, TakeNoSlotOfAnotherLoop) {
  constexpr std::uint32_t ticks = 1500;
  for (const std::uint32_t batches : {1u, 3u}) {  // of each loop with each tick
    const auto before = tlas_.counts();
    for (std::uint32_t k = 0; k < ticks; ++k) {
      tick(1, true);
      for (std::uint32_t batch = 0; batch < batches * slots(); ++batch) {
        const WorldTime then = time_ + milliseconds(10'000 * (batch / batches));
        prepare(tlas_, {.times = {then, then}, .elements = 1, .shapes = 0});
      }
    }
    EXPECT_LE(waits(since(before)), slots() * (1 + ticks / 250)) << batches;
  }
}

TEST_P(SlotsMadeAhead, ServeTwoLoopsAtDifferentTimes) {
  auto before = tlas_.counts();
  for (int k = 0; k < 1600; ++k) {
    tick(1, true);
    prepare(1);
    prepare(tlas_,
            {.times = {time_ + milliseconds(433), time_ + milliseconds(433)}, .elements = 1, .shapes = 0});
    if (k == 600) before = tlas_.counts();
  }
  EXPECT_EQ(waits(since(before)), 0u);
  EXPECT_GE(since(before).ahead, 8u);
}

TEST_P(SlotsMadeAhead, AreMadeAfterAnUnusedOne) {
  for (int k = 0; k < 200; ++k) {
    tick(1, true);
    prepare(1);  // begins a slot that no batch uses
  }
  time_ += milliseconds(2000);
  auto before = tlas_.counts();
  for (int k = 0; k < 1200; ++k) {
    tick(1, true);
    prepare(1);
    if (k == 400) before = tlas_.counts();
  }
  EXPECT_EQ(waits(since(before)), 0u);
  EXPECT_GE(since(before).ahead, 3u);
}

TEST_P(SlotsMadeAhead, EqualNewlyMadeSlots) {
  int compared = 0;
  const auto before = tlas_.counts();
  for (int k = 0; k < 700; ++k) {
    tick(static_cast<std::uint32_t>(random_.below(4)), true);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 47 == 0 && expect_equals_new_slot(*view)) ++compared;
    if (HasFailure()) break;
  }
  EXPECT_GT(compared, 7);
  EXPECT_GE(since(before).ahead, 3u);
}

/// Not even copied from a slot that was used for a discarded version.
TEST_P(SlotsMadeAhead, ContainNothingOfDiscardedVersions) {
  int compared = 0;
  const auto before = tlas_.counts();
  for (std::uint32_t k = 0; k < 700; ++k) {
    const std::uint32_t one = (k * 97) % GetParam();
    const EntityRow was = rows_.row(one)->row;
    time_ += milliseconds(1);
    rows_.change(
        {&one, 1}, [&](std::uint32_t) { return std::optional(anywhere()); }, time_);
    prepare(1);
    if (k % 3 != 0) rows_.discard({&one, 1}, [&](std::uint32_t) { return std::optional(was); });
    tick();
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 31 == 0 && expect_equals_new_slot(*view)) ++compared;
    if (HasFailure()) break;
  }
  EXPECT_GT(compared, 7);
  EXPECT_GE(since(before).ahead, 3u);
}

TEST_P(SlotsMadeAhead, AreDiscardedWhenAnEntityIsRemoved) {
  int compared = 0;
  for (std::uint32_t k = 0; k < 400; ++k) {
    const std::uint32_t one = (k * 31) % GetParam();
    time_ += milliseconds(1);
    const bool is_removed = k % 40 == 39 && rows_.row(one) != nullptr;
    rows_.change(
        {&one, 1}, [&](std::uint32_t) { return is_removed ? std::nullopt : std::optional(anywhere()); },
        time_);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 20 != 0) continue;
    accel::Tlas fresh = make_tlas(1);
    const auto new_view = prepare(fresh, {.times = {time_, time_}});
    ASSERT_TRUE(new_view.has_value());
    for (std::uint32_t i = 0; i < GetParam(); ++i) {
      if (rows_.row(i) == nullptr) continue;
      ASSERT_EQ(tlas_.place_of(view->slot, i), fresh.place_of(new_view->slot, i));
    }
    ++compared;
  }
  EXPECT_EQ(compared, 20);
}

/// No batch waits for the build.
TEST_P(SlotsMadeAhead, GetANewTreeWhenEntitiesDisperse) {
  for (const std::int64_t period_ms : {1, 10}) {
    disperse(30.0);
    const auto before = tlas_.counts();
    int compared = 0;
    for (std::int64_t k = 0; k < 2000 / period_ms; ++k) {
      tick(1, true, milliseconds(period_ms));
      const auto view = prepare(1);
      ASSERT_TRUE(view.has_value());
      if (k % 41 == 0 && expect_equals_new_slot(*view)) ++compared;
      if (HasFailure()) break;
    }
    const auto counts = since(before);
    EXPECT_EQ(waits(counts), 0u);
    EXPECT_GE(counts.ahead, 8u);
    EXPECT_GE(counts.ahead_built, 2u);
    EXPECT_LT(counts.ahead_built, counts.ahead);
    EXPECT_GT(compared, 15 / period_ms);
  }
}

TEST_P(SlotsMadeAhead, HaveTreesAboutAsCheapAsNewlyBuiltOnes) {
  disperse(30.0);
  std::uint64_t built = 0;
  for (std::uint32_t k = 0; k < 4000 && built < 3; ++k) {
    tick(1, true);
    const auto before = tlas_.counts();
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (since(before).ahead_built == 0) continue;
    ++built;
    accel::Tlas fresh = make_tlas(1);
    const auto new_view =
        prepare(fresh, {.times = {view->window_begin, view->window_end}, .elements = 1, .shapes = 0});
    ASSERT_TRUE(new_view.has_value());
    EXPECT_LT(cost_of(tlas_, *view), 1.2 * cost_of(fresh, *new_view));
  }
  EXPECT_EQ(built, 3u);
}

/// Another build takes the memory of one in progress, which is discarded.
TEST_P(SlotsMadeAhead, AreDiscardedWhenAnotherTreeIsBuilt) {
  disperse(30.0);
  const auto before = tlas_.counts();
  int compared = 0;
  for (std::uint32_t k = 0; k < 1500; ++k) {
    tick(1, true);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 53 == 0 && expect_equals_new_slot(*view)) ++compared;
    if (HasFailure()) break;
    if (k % 37 != 11 || k > 1000) continue;
    // A large batch at a later time, at which all entities are elsewhere.
    const WorldTime then = time_ + milliseconds(3000 + 3000 * (k % 7));
    prepare(tlas_, {.times = {then, then}, .elements = GetParam(), .shapes = 0});
  }
  EXPECT_GT(compared, 20);
  EXPECT_GT(since(before).builds, 5u);
  EXPECT_GT(since(before).ahead_built, 0u);
}

/// A tree whose entities have dispersed is built when the window ends. (A small one is built ahead before
/// that.)
class LargeSlotsMadeAhead : public SlotsMadeAhead {};

TEST_P(LargeSlotsMadeAhead, AreNotMadeFromATreeOfDispersedEntities) {
  // All entities but two are close together; these two are far away on opposite sides.
  rows_.next(
      [&](std::uint32_t i) {
        return std::optional(i < 2 ? row_of({0}, glm::dvec3(i == 0 ? 4000.0 : -4000.0)) : anywhere());
      },
      time_ += milliseconds(1));
  settle();
  const auto before = tlas_.counts();
  std::uint32_t next = 2;
  for (std::uint32_t k = 0; k < 600 && since(before).builds == 0; ++k) {
    time_ += milliseconds(1);
    std::vector<std::uint32_t> some{next++};
    if (GetParam() > 5000) some.push_back(next++);
    rows_.change(
        some, [&](std::uint32_t) { return std::optional(row_of({0}, 4000.0 * random_.vector())); }, time_);
    prepare(1);
  }
  EXPECT_GT(since(before).patches, 200u);
  EXPECT_EQ(since(before).builds, 1u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, SlotsMadeAhead,
                         testing::ValuesIn(hil::tests::is_long() ? std::vector{600u, 2500u, 9000u}
                                                                 : std::vector{600u}));
INSTANTIATE_TEST_SUITE_P(Sizes, LargeSlotsMadeAhead, testing::Values(2500u, 9000u));

}  // namespace
}  // namespace rtstdb::test
