// The slot for the next window, made a part with each batch: none waits for a refit of all, and nobody can tell.

#include <algorithm>
#include <cmath>

#include "shaders/shared/entity.h"
#include "tests/gpu/ticking_trees.hpp"

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
  /// Whether the slot is what one made for this version alone is, if their instants are written down from one epoch.
  bool expect_as_made_anew(const accel::TlasView& view) {
    accel::Tlas fresh = make_tlas(1);
    const auto beside = prepare(fresh, {.times = {time_, time_}});
    if (!beside || beside->epoch != view.epoch) return false;
    EXPECT_EQ(instance_words(tlas_, view), instance_words(fresh, *beside));
    for (std::uint32_t i = 0; i < GetParam(); ++i) {
      EXPECT_EQ(view.identities[i].id, beside->identities[i].id);
      EXPECT_EQ(view.identities[i].material, beside->identities[i].material);
      EXPECT_EQ(tlas_.place_of(view.slot, i), fresh.place_of(beside->slot, i));
    }
    return true;
  }
};

TEST_P(AheadTrees, NoBatchOfALoopWaitsForARefit) {
  for (const std::int64_t period_ms : {1, 5, 10, 20}) {
    const auto before = tlas_.counts();
    for (std::int64_t k = 0; k < 1500 / period_ms; ++k) {
      tick(1, true, milliseconds(period_ms));
      prepare(1);
    }
    const auto counts = since(before);
    EXPECT_EQ(counts.builds + counts.refits, 0u) << "at " << period_ms << " ms";
    EXPECT_GE(counts.ahead, 5u) << "at " << period_ms << " ms";
  }
}

TEST_P(AheadTrees, WhereNothingChangesEither) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 1000; ++k) {
    time_ += milliseconds(1);  // of the same version
    prepare(1);
  }
  EXPECT_EQ(since(before).builds + since(before).refits, 0u);
  EXPECT_GE(since(before).ahead, 4u);
}

TEST_P(AheadTrees, ALoopWithAsMuchTimeAsARefitTakesHasItMade) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 20; ++k) {
    tick(1, true, milliseconds(100));
    prepare(1);
  }
  EXPECT_EQ(since(before).ahead, 0u);
  EXPECT_GT(since(before).builds + since(before).refits, 4u);
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
  EXPECT_EQ(since(before).builds + since(before).refits, 0u);
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
  EXPECT_EQ(since(before).builds + since(before).refits, 0u);
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
  EXPECT_GE(since(before).builds + since(before).refits, 29u);
}

TEST_P(AheadTrees, AreNotMadeForLargeBatches) {
  const auto before = tlas_.counts();
  for (int k = 0; k < 300; ++k) {
    tick(1, true);
    prepare(GetParam());
  }
  EXPECT_EQ(since(before).ahead, 0u);
}

/// A tree whose entities have gone elsewhere meanwhile is built when the window ends.
TEST_P(AheadTrees, AreNotUsedWithATreeThatHasGoneBad) {
  const auto before = tlas_.counts();
  const std::uint32_t in_all = GetParam() / 16;
  std::uint32_t next = 0;
  for (int k = 0; k < 3000 && since(before).builds == 0; ++k) {
    time_ += milliseconds(1);
    std::vector<std::uint32_t> some;
    for (std::uint32_t i = 0; i < std::max(in_all / 250, 1u); ++i)
      some.push_back(next++ % GetParam());
    rows_.change(
        some, [&](std::uint32_t) { return std::optional(row_of({0}, 400.0 * random_.vector())); }, time_);
    prepare(1);
  }
  EXPECT_GT(since(before).builds, 0u);
}

INSTANTIATE_TEST_SUITE_P(Sizes, AheadTrees, testing::Values(2500u, 9000u));

}  // namespace
}  // namespace rtstdb::test
