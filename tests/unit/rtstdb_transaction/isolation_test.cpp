// Many threads at once: one serial order, no half of anything.

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

constexpr int submitters = 8;

void in_parallel(const std::function<void(int)>& work) {
  std::vector<std::thread> threads;
  threads.reserve(submitters);
  for (int k = 0; k < submitters; ++k)
    threads.emplace_back([&, k] { work(k); });
  for (std::thread& thread : threads)
    thread.join();
}

/// Pairs of entities that hold one number between them, in material and in position.
class CanaryPairs : public testing::Test {
 protected:
  static constexpr std::uint32_t pairs = 8;

  void SetUp() override {
    world_.executor.work = [this](const store::RowSource& rows, const auto&, const auto&) {
      for (std::uint32_t pair = 0; pair < pairs; ++pair)
        look(rows, pair);
      return query::RunReport{};
    };
    const auto fill = world_.make(2 * pairs);
    fill->begin({});
    for (std::uint32_t k = 0; k < 2 * pairs; ++k)
      fill->create(canary(0));
    ASSERT_EQ(world_.execute(*fill).status, Status::committed);
  }

  static EntityRow canary(std::uint32_t number) {
    EntityRow row = row_of(number);
    row.motion.p_world_m.x = number;
    return row;
  }

  void look(const store::RowSource& rows, std::uint32_t pair) {
    const EntityState* a = rows.row(2 * pair);
    const EntityState* b = rows.row(2 * pair + 1);
    ++looked_;
    if (a == nullptr && b == nullptr) return;
    if (a == nullptr || b == nullptr || a->row.material != b->row.material ||
        a->written_by != b->written_by || a->row.motion.p_world_m != b->row.motion.p_world_m) {
      ++halves_;
    }
  }

  World world_{engine_options(64, 64, 256)};
  std::uint64_t looked_ = 0;  ///< the engine thread alone, until all is done
  std::uint64_t halves_ = 0;
};

TEST_F(CanaryPairs, NeverShowHalf) {
  std::atomic<std::uint64_t> read_old{0};
  in_parallel([&](int thread) {
    std::mt19937 random(static_cast<unsigned>(thread));
    const auto transaction = world_.make(4);
    SimulatedQuery query(1);
    for (std::uint32_t round = 1; round <= 3000; ++round) {
      const auto pair = static_cast<std::uint32_t>(random() % pairs);
      const std::uint32_t number = round * submitters + static_cast<std::uint32_t>(thread);
      Terms given = terms(random() % 3 == 0 ? DeadlineClass::firm : DeadlineClass::soft,
                          world_.clock.peek() + Nanoseconds(random() % 10), 0);
      const VersionInfo latest = world_.engine.latest();
      if (random() % 2 == 0)
        given.read_at = ReadAt::pinned(latest.version - random() % std::min<Version>(latest.version, 60));
      transaction->begin(given);
      if (thread < submitters / 2) {  // writers: move a pair; some also ask, some are missed
        transaction->update({2 * pair, 1}, canary(number));
        transaction->update({2 * pair + 1, 1}, canary(number));
        if (random() % 2 == 0) transaction->add_query(query, 1);
        if (random() % 4 == 0) world_.clock.advance(Nanoseconds(5));
      } else {  // readers, of the latest or an older version
        transaction->add_query(query, 1);
      }
      world_.execute(*transaction);
      if (given.read_at.kind == ReadAt::Kind::version && transaction->outcome().done()) ++read_old;
    }
  });
  EXPECT_EQ(halves_, 0u);
  EXPECT_GT(looked_, 10000u);
  EXPECT_GT(read_old, 1000u);
}

TEST_F(CanaryPairs, AHalfWouldBeSeen) {
  const auto transaction = world_.make();
  SimulatedQuery query(1);
  transaction->begin({});
  transaction->update({0, 1}, canary(5));
  transaction->add_query(query, 1);
  world_.execute(*transaction);
  EXPECT_EQ(halves_, 1u);
}

/// Read, add one, write on condition that nobody wrote meanwhile: no increment may be lost.
TEST(Conflicts, GuardedIncrementsAddUp) {
  constexpr std::uint32_t rounds = 400;
  World world;
  const EntityId counter = world.create(0);
  std::atomic<std::uint64_t> conflicts{0};
  in_parallel([&](int) {
    const auto transaction = world.make();
    for (std::uint32_t done = 0; done < rounds;) {
      const auto states = world.engine.snapshot(ReadAt::latest());
      const EntityState& seen = states.value()[0];
      transaction->begin({});
      transaction->expect_written_by(counter, seen.written_by);
      transaction->update(counter, row_of(seen.row.material + 1));
      const Status status = world.execute(*transaction).status;
      ASSERT_TRUE(status == Status::committed || status == Status::conflict);
      done += status == Status::committed ? 1 : 0;
      conflicts += status == Status::conflict ? 1u : 0u;
    }
  });
  EXPECT_EQ(world.material(counter), submitters * rounds);
  EXPECT_EQ(world.engine.counts().conflicts, conflicts);
}

/// Every committed write made its own version, in one order that all threads agree on.
TEST(SerialOrder, VersionsAreDenseUniqueAndInOrderForEachThread) {
  constexpr std::uint32_t rounds = 2000;
  World world(engine_options(64, 64, 1u << 16));
  for (int k = 0; k < submitters; ++k)
    world.create(0);
  std::vector<std::vector<Version>> made(submitters);
  in_parallel([&](int thread) {
    const auto transaction = world.make();
    for (std::uint32_t round = 1; round <= rounds; ++round) {
      transaction->begin({});
      transaction->update({static_cast<std::uint32_t>(thread), 1}, row_of(round));
      made[static_cast<std::size_t>(thread)].push_back(world.execute(*transaction).version);
      ASSERT_GE(world.engine.latest().version, made[static_cast<std::size_t>(thread)].back())
          << "published before told";
    }
  });
  std::map<Version, std::pair<std::uint32_t, std::uint32_t>> history;  // version -> entity, number
  for (std::uint32_t thread = 0; thread < submitters; ++thread) {
    for (std::uint32_t round = 0; round < rounds; ++round)
      history[made[thread][round]] = {thread, round + 1};
    EXPECT_TRUE(std::is_sorted(made[thread].begin(), made[thread].end()));
  }
  ASSERT_EQ(history.size(), submitters * rounds);
  EXPECT_EQ(history.begin()->first, submitters + 1u);
  EXPECT_EQ(history.rbegin()->first, submitters * rounds + submitters);

  // Versions read back hold what the history says that they hold.
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
