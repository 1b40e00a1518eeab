// The order of versions under concurrent submission. tests/long/serial_history_test.cpp checks isolation.

#include <gtest/gtest.h>

#include <map>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

TEST(SerialOrder, VersionsAreDenseUniqueAndInOrderForEachThread) {
  constexpr int submitters = 8;
  constexpr std::uint32_t rounds = 2000;
  World world(engine_options(64, 64, 1u << 16));
  for (int k = 0; k < submitters; ++k)
    world.create(0);
  std::vector<std::vector<Version>> made(submitters);
  const auto submit_all = [&](int thread) {
    const auto transaction = world.make();
    for (std::uint32_t round = 1; round <= rounds; ++round) {
      transaction->begin({});
      transaction->update({static_cast<std::uint32_t>(thread), 1}, row_of(round));
      made[static_cast<std::size_t>(thread)].push_back(world.execute(*transaction).version);
      ASSERT_GE(world.engine.latest().version, made[static_cast<std::size_t>(thread)].back())
          << "published before wait() returns";
    }
  };
  std::vector<std::thread> threads;
  for (int thread = 0; thread < submitters; ++thread)
    threads.emplace_back(submit_all, thread);
  for (std::thread& thread : threads)
    thread.join();
  std::map<Version, std::pair<std::uint32_t, std::uint32_t>> history;  // version -> entity, number
  for (std::uint32_t thread = 0; thread < submitters; ++thread) {
    for (std::uint32_t round = 0; round < rounds; ++round)
      history[made[thread][round]] = {thread, round + 1};
    EXPECT_TRUE(std::is_sorted(made[thread].begin(), made[thread].end()));
  }
  ASSERT_EQ(history.size(), submitters * rounds);
  EXPECT_EQ(history.begin()->first, submitters + 1u);
  EXPECT_EQ(history.rbegin()->first, submitters * rounds + submitters);

  // A pinned snapshot holds what the history up to that version wrote.
  std::vector<std::uint32_t> numbers(submitters, 0);
  for (const auto& [version, write] : history) {
    numbers[write.first] = write.second;
    if (version % 97 != 0) continue;
    const auto states = world.engine.snapshot(ReadAt::pinned(version));
    ASSERT_TRUE(states.ok());
    for (std::uint32_t k = 0; k < submitters; ++k)
      ASSERT_EQ(states.value()[k].row.material, numbers[k]);
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
