// Rows of older versions, compared with a list of all changes; and the number of steps to find one.

#include "rtstdb/store/change_history.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <vector>

namespace rtstdb::store::test {
namespace {

EntityState state_of(std::uint32_t index, Version version) {
  EntityState state;
  state.id = {index, 1};
  state.written_by = version;
  return state;
}

/// A history, and a reference that lists the writer of each row in each version.
class CheckedHistory {
 public:
  CheckedHistory(std::uint32_t entities, std::uint32_t retained) : history_(entities, retained) {
    for (std::uint32_t index = 0; index < entities; ++index)
      current_.push_back(state_of(index, 0));
    writers_.push_back(std::vector<Version>(entities, 0));
  }
  void change(std::uint32_t index) {
    const Version version = writers_.size();
    history_.record(version, index, current_[index]);
    current_[index] = state_of(index, version);
    writers_.push_back(writers_.back());
    writers_.back()[index] = version;
  }
  void expect_rows() const {
    for (Version version = history_.oldest_kept(); version < writers_.size(); ++version)
      for (std::uint32_t index = 0; index < current_.size(); ++index)
        ASSERT_EQ(history_.state_at(version, index, current_[index]).written_by, writers_[version][index])
            << "version " << version << " index " << index << " of " << writers_.size();
  }

 private:
  ChangeHistory history_;
  std::vector<EntityState> current_;
  std::vector<std::vector<Version>> writers_;
};

TEST(ChangeHistoryTest, FindsEachRowOfEachKeptVersion) {
  for (const std::uint32_t retained : {1u, 2u, 17u, 100u, 1'000u, 5'000u}) {
    std::mt19937 random(retained);
    CheckedHistory history(3, retained);
    // One row changes often, one sometimes, one rarely. For a while the first one does not change.
    for (int i = 0; i < 2'500; ++i) {
      const std::uint32_t one = random() % 200 == 0 ? 2 : random() % 20 == 0 ? 1 : 0;
      history.change(i > 1'000 && i < 1'600 ? std::max(one, 1u) : one);
      if (i % 499 == 0) history.expect_rows();
    }
    history.expect_rows();
  }
}

/// The number of steps grows with the logarithm of the number of newer changes: a linear search needs a
/// thousand times as many after 60,000 changes. Two times of one run are compared, so the machine does not
/// matter.
TEST(ChangeHistoryTest, FindsARowAfterManyChangesInFewSteps) {
  constexpr std::uint32_t changes = 60'000;
  ChangeHistory history(1, changes);
  EntityState current = state_of(0, 0);
  for (Version version = 1; version <= changes; ++version) {
    history.record(version, 0, current);
    current = state_of(0, version);
  }
  const auto fastest = [&](Version from) {
    auto shortest = std::chrono::nanoseconds::max();
    for (int round = 0; round < 20; ++round) {
      const auto begin = std::chrono::steady_clock::now();
      for (Version version = from; version < from + 60; ++version)
        EXPECT_EQ(history.state_at(version, 0, current).written_by, version);
      shortest = std::min(shortest, std::chrono::steady_clock::now() - begin);
    }
    return shortest;
  };
  EXPECT_LT(fastest(0), 50 * fastest(changes - 60));
}

}  // namespace
}  // namespace rtstdb::store::test
