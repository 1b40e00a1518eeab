// The slot for the next window, made a part with each batch: none waits for a refit of all, and nobody can
// tell.

#include <algorithm>
#include <bit>
#include <cmath>
#include <vector>

#include "shaders/shared/entity.h"
#include "shaders/shared/node.h"
#include "tests/gpu/ticking_trees.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

constexpr Nanoseconds milliseconds(std::int64_t count) {
  return Nanoseconds(count * 1'000'000);
}

class AheadTrees : public TickingTrees {
 protected:
  std::uint32_t slots() const override { return 4; }
  /// Of all instances at the view's epoch.
  std::vector<std::uint32_t> instance_words(const accel::Tlas& tlas, const accel::TlasView& view) {
    const std::size_t bytes = std::size_t{16} * shared::instance_texels * GetParam();
    const gpu::Buffer copy =
        make_buffer({.name = "copy", .size_bytes = bytes, .memory = gpu::Memory::readback});
    run([&](gpu::Recorder& recorder) { recorder.copy(tlas.instances(view.slot), 0, copy, 0, bytes); });
    const auto words = copy.host_as<const std::uint32_t>();
    return {words.begin(), words.end()};
  }
  /// From now on all of them go their way, at up to so many metres a second along each axis.
  void send_off(double most_mps) {
    time_ += milliseconds(1);
    rows_.next(
        [&](std::uint32_t) {
          EntityRow row = anywhere();
          row.motion.v_world_mps = most_mps * random_.vector();
          row.motion.valid_from = time_;
          return std::optional(row);
        },
        time_);
    settle();
  }
  /// So many, other ones from tick to tick, go a millimetre on.
  void tick_around(std::uint32_t changed) {
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
  /// Batches that waited for all boxes to be made.
  static std::uint64_t on_the_spot(const accel::Tlas::Counts& counts) {
    return counts.builds + counts.refits - counts.renewals;
  }
  /// Each slot comes to what has changed, and what was being made before is given up.
  void settle() {
    for (int k = 0; k < 40; ++k) {
      prepare(1);
      tick(1, true);
    }
  }
  struct Child {
    std::uint32_t reference;
    glm::dvec3 lo_m, hi_m;  // at the window's begin
    bool is_inner() const { return (reference & shared::ref_leaf_bit) == 0; }
  };
  /// Of all nodes that can be reached. What a node holds lies in its box, but for its own quanta.
  std::vector<Child> children_of(const accel::Tlas& tlas, const accel::TlasView& view) {
    const std::size_t bytes = tlas.nodes(view.slot).size_bytes();
    const gpu::Buffer copy =
        make_buffer({.name = "nodes", .size_bytes = bytes, .memory = gpu::Memory::readback});
    run([&](gpu::Recorder& recorder) { recorder.copy(tlas.nodes(view.slot), 0, copy, 0, bytes); });
    const auto words = copy.host_as<const std::uint32_t>();
    std::vector<Child> children;
    int outside = 0;
    std::vector<Child> left{{view.root, glm::dvec3(-1e9), glm::dvec3(1e9)}};
    while (!left.empty() && children.size() < words.size()) {
      const Child parent = left.back();
      left.pop_back();
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
        if (made.is_inner()) left.push_back(made);
      }
    }
    EXPECT_EQ(outside, 0);
    return children;
  }
  /// Half the surfaces of all boxes in the tree.
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
    EXPECT_EQ(places, first_ones(GetParam()));
  }
  /// Whether the slot is what one made for this version alone is, if their instants are written down from one
  /// epoch.
  bool expect_as_made_anew(const accel::TlasView& view) {
    accel::Tlas fresh = make_tlas(1);
    const auto beside = prepare(fresh, {.times = {time_, time_}});
    if (!beside || beside->epoch != view.epoch) return false;
    EXPECT_EQ(instance_words(tlas_, view), instance_words(fresh, *beside));
    expect_each_entity_once(view);
    for (std::uint32_t i = 0; i < GetParam(); ++i) {
      EXPECT_EQ(view.identities[i].id, beside->identities[i].id);
      EXPECT_EQ(view.identities[i].material, beside->identities[i].material);
      EXPECT_EQ(tlas_.place_of(view.slot, i), fresh.place_of(beside->slot, i));
    }
    return true;
  }

  std::uint32_t next_changed_ = 0;
};

TEST_P(AheadTrees, NoBatchOfALoopWaitsForARefit) {
  for (const std::int64_t period_ms : {1, 5, 10, 20}) {
    const auto before = tlas_.counts();
    for (std::int64_t k = 0; k < 1500 / period_ms; ++k) {
      tick(1, true, milliseconds(period_ms));
      prepare(1);
    }
    const auto counts = since(before);
    EXPECT_EQ(on_the_spot(counts), 0u) << "at " << period_ms << " ms";
    EXPECT_GE(counts.ahead, 5u) << "at " << period_ms << " ms";
  }
}

/// More changes while a slot is made than it could be brought over at the first try: it is begun later then.
TEST_P(AheadTrees, AreReachedWhereManyChange) {
  for (const std::uint32_t share : {200u, 50u}) {
    auto before = tlas_.counts();
    for (std::uint32_t k = 0; k < 2000; ++k) {
      tick_around(GetParam() / share);
      prepare(1);
      if (k == 500) before = tlas_.counts();
    }
    EXPECT_EQ(on_the_spot(since(before)), 0u) << "one in " << share;
    EXPECT_GE(since(before).ahead, 6u) << "one in " << share;
  }
}

/// Where as many change in a few ticks as a renewal is good for, the next window begins with a refit, as it
/// would without; and hardly any slot is made in vain.
TEST_P(AheadTrees, AreLeftWhereTooManyChange) {
  auto before = tlas_.counts();
  for (std::uint32_t k = 0; k < 3000; ++k) {
    tick_around(GetParam() / 5);
    prepare(1);
    if (k == 500) before = tlas_.counts();
  }
  EXPECT_LE(on_the_spot(since(before)), 10u);
  EXPECT_LE(since(before).ahead, 5u);
}

/// As many loops as there are slots: none takes another's, which would then take the next one's.
TEST_P(AheadTrees, TakeNoSlotThatIsReadInTurn) {
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
    EXPECT_LE(on_the_spot(since(before)), slots() * (1 + ticks / 250)) << batches;
  }
}

TEST_P(AheadTrees, WhereNothingChangesEither) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 1000; ++k) {
    time_ += milliseconds(1);  // of the same version
    prepare(1);
  }
  EXPECT_EQ(on_the_spot(since(before)), 0u);
  EXPECT_GE(since(before).ahead, 4u);
}

TEST_P(AheadTrees, ALoopWithAsMuchTimeAsARefitTakesHasItMade) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 20; ++k) {
    tick(1, true, milliseconds(100));
    prepare(1);
  }
  EXPECT_EQ(since(before).ahead, 0u);
  EXPECT_GT(on_the_spot(since(before)), 4u);
}

TEST_P(AheadTrees, TwoLoopsThatLookAtDifferentTimesBothHaveThem) {
  auto before = tlas_.counts();
  for (int k = 0; k < 1600; ++k) {
    tick(1, true);
    prepare(1);
    prepare(tlas_,
            {.times = {time_ + milliseconds(433), time_ + milliseconds(433)}, .elements = 1, .shapes = 0});
    if (k == 600) before = tlas_.counts();
  }
  EXPECT_EQ(on_the_spot(since(before)), 0u);
  EXPECT_GE(since(before).ahead, 8u);
}

TEST_P(AheadTrees, AreMadeForALoopThatGoesOnWhereAnotherHasStopped) {
  for (int k = 0; k < 200; ++k) {
    tick(1, true);
    prepare(1);  // one is begun, and never asked for
  }
  time_ += milliseconds(2000);
  auto before = tlas_.counts();
  for (int k = 0; k < 1200; ++k) {
    tick(1, true);
    prepare(1);
    if (k == 400) before = tlas_.counts();
  }
  EXPECT_EQ(on_the_spot(since(before)), 0u);
  EXPECT_GE(since(before).ahead, 3u);
}

TEST_P(AheadTrees, AreWhatTheyWouldBeMadeAnew) {
  int looked_at = 0;
  const auto before = tlas_.counts();
  for (int k = 0; k < 700; ++k) {
    tick(static_cast<std::uint32_t>(random_.below(4)), true);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 47 == 0 && expect_as_made_anew(*view)) ++looked_at;
    if (HasFailure()) break;
  }
  EXPECT_GT(looked_at, 7);
  EXPECT_GE(since(before).ahead, 3u);
}

/// What was computed on and came to nothing is in no slot, not even where it was copied from one that had it.
TEST_P(AheadTrees, KeepNothingOfVersionsThatWereDiscarded) {
  int looked_at = 0;
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
    if (k % 31 == 0 && expect_as_made_anew(*view)) ++looked_at;
    if (HasFailure()) break;
  }
  EXPECT_GT(looked_at, 7);
  EXPECT_GE(since(before).ahead, 3u);
}

TEST_P(AheadTrees, AreLeftWhereSomebodyGoesMeanwhile) {
  int looked_at = 0;
  for (std::uint32_t k = 0; k < 400; ++k) {
    const std::uint32_t one = (k * 31) % GetParam();
    time_ += milliseconds(1);
    const bool goes = k % 40 == 39 && rows_.row(one) != nullptr;
    rows_.change(
        {&one, 1}, [&](std::uint32_t) { return goes ? std::nullopt : std::optional(anywhere()); }, time_);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 20 != 0) continue;
    accel::Tlas fresh = make_tlas(1);
    const auto beside = prepare(fresh, {.times = {time_, time_}});
    ASSERT_TRUE(beside.has_value());
    for (std::uint32_t i = 0; i < GetParam(); ++i) {
      if (rows_.row(i) == nullptr) continue;
      ASSERT_EQ(tlas_.place_of(view->slot, i), fresh.place_of(beside->slot, i));
    }
    ++looked_at;
  }
  EXPECT_EQ(looked_at, 20);
}

TEST_P(AheadTrees, AreOfNoUseWhereShapesChangeMeanwhile) {
  const auto before = tlas_.counts();
  for (std::uint64_t k = 0; k < 600; ++k) {
    tick(1, true);
    prepare(1, k / 20);
  }
  EXPECT_EQ(since(before).ahead, 0u);
  EXPECT_GE(on_the_spot(since(before)), 29u);
}

TEST_P(AheadTrees, AreNotMadeForLargeBatches) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 300; ++k) {
    tick(1, true);
    prepare(GetParam());
  }
  EXPECT_EQ(since(before).ahead, 0u);
}

/// A tree whose entities go their ways is built anew while another is in use: no batch waits for that.
TEST_P(AheadTrees, AreBuiltWhereATreeGoesBad) {
  for (const std::int64_t period_ms : {1, 10}) {
    send_off(30.0);
    const auto before = tlas_.counts();
    int looked_at = 0;
    for (std::int64_t k = 0; k < 2000 / period_ms; ++k) {
      tick(1, true, milliseconds(period_ms));
      const auto view = prepare(1);
      ASSERT_TRUE(view.has_value());
      if (k % 41 == 0 && expect_as_made_anew(*view)) ++looked_at;
      if (HasFailure()) break;
    }
    const auto counts = since(before);
    EXPECT_EQ(on_the_spot(counts), 0u);
    EXPECT_GE(counts.ahead, 8u);
    EXPECT_GE(counts.ahead_built, 2u);
    EXPECT_LT(counts.ahead_built, counts.ahead);
    EXPECT_GT(looked_at, 15 / period_ms);
  }
}

/// What such a tree costs is near what one costs that is built for the moment.
TEST_P(AheadTrees, ThatAreBuiltAreAsCheapAsOthers) {
  send_off(30.0);
  std::uint64_t built = 0;
  for (std::uint32_t k = 0; k < 4000 && built < 3; ++k) {
    tick(1, true);
    const auto before = tlas_.counts();
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (since(before).ahead_built == 0) continue;
    ++built;
    accel::Tlas fresh = make_tlas(1);
    const auto beside =
        prepare(fresh, {.times = {view->window_begin, view->window_end}, .elements = 1, .shapes = 0});
    ASSERT_TRUE(beside.has_value());
    EXPECT_LT(cost_of(tlas_, *view), 1.2 * cost_of(fresh, *beside));
  }
  EXPECT_EQ(built, 3u);
}

/// Another build takes the memory of one that is under way: that is given up.
TEST_P(AheadTrees, AreGivenUpWhereATreeIsBuiltMeanwhile) {
  send_off(30.0);
  const auto before = tlas_.counts();
  int looked_at = 0;
  for (std::uint32_t k = 0; k < 1500; ++k) {
    tick(1, true);
    const auto view = prepare(1);
    ASSERT_TRUE(view.has_value());
    if (k % 53 == 0 && expect_as_made_anew(*view)) ++looked_at;
    if (HasFailure()) break;
    if (k % 37 != 11 || k > 1000) continue;
    // For some time somebody else looks at another time, at which all stand elsewhere.
    const WorldTime then = time_ + milliseconds(3000 + 3000 * (k % 7));
    prepare(tlas_, {.times = {then, then}, .elements = GetParam(), .shapes = 0});
  }
  EXPECT_GT(looked_at, 20);
  EXPECT_GT(since(before).builds, 5u);
  EXPECT_GT(since(before).ahead_built, 0u);
}

/// A tree that knows nothing any more of where its entities are is built when the window ends. (A small one
/// is built ahead before it comes to that.)
class LargeAheadTrees : public AheadTrees {};

TEST_P(LargeAheadTrees, AreNotUsedWithATreeThatIsWorthNothing) {
  // All stand close together but the first two, who have a wide world between them.
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

INSTANTIATE_TEST_SUITE_P(Sizes, AheadTrees,
                         testing::ValuesIn(hil::tests::is_long() ? std::vector{600u, 2500u, 9000u}
                                                                 : std::vector{600u, 2500u}));
INSTANTIATE_TEST_SUITE_P(Sizes, LargeAheadTrees, testing::Values(2500u, 9000u));

}  // namespace
}  // namespace rtstdb::test
