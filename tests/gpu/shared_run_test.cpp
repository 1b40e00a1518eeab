// Small readers that share a run, whose searches take longer than all that was known of them: each goes on alone, and whoever is cancelled
// or has a deadline takes nobody with him.

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <thread>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t asked = 16;

class SharedRuns : public DatabaseTest {
 protected:
  struct Reader {
    std::unique_ptr<RayQuery> query;
    std::unique_ptr<Transaction> transaction;
  };
  void SetUp() override {
    open({.chunk = Nanoseconds(1'000'000)});
    create(row_of(add(pile(400'000)), {0.0, 0.0, 5.0}));
    before_them_ = prepare_rays(RayMode::closest, false, many);
    std::ranges::fill(before_them_->rays(), past());
    for (Reader& reader : readers_) {
      reader.query = prepare_rays(RayMode::closest, false, asked);
      reader.transaction = database().make_transaction({.max_queries = 1});
    }
  }
  static Ray past() { return ray_from({}, {0, 1, -1}); }
  static Ray through() { return ray_from({}, {0, 0, 1}); }

  void submit(Reader& reader, const Ray& ray, const Terms& terms) {
    std::ranges::fill(reader.query->rays(), ray);
    reader.transaction->begin(terms);
    reader.transaction->ask(*reader.query, asked);
    database().submit(*reader.transaction);
  }
  /// Both are taken for cheap, wait behind a large batch, and begin together. The second has no deadline.
  void ask_both(const Terms& of_first) {
    for (int k = 0; k < 12; ++k) {
      for (Reader& reader : readers_) {
        submit(reader, past(), {});
        ASSERT_TRUE(database().wait(*reader.transaction).done());
      }
    }
    const auto batch = database().make_transaction({.max_queries = 1});
    Terms urgent;
    urgent.importance = 1;
    batch->begin(urgent);
    batch->ask(*before_them_, many);
    database().submit(*batch);
    submit(readers_[0], through(), of_first);
    submit(readers_[1], through(), {});
    EXPECT_TRUE(database().wait(*batch).done());
  }
  static std::ptrdiff_t hits(const Reader& reader) {
    return std::ranges::count(reader.query->hits(), HitStatus::hit, &RayHit::status);
  }
  void expect_the_other_is_answered(int turn) {
    const Outcome& outcome = database().wait(*readers_[1].transaction);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome) << " in turn " << turn;
    EXPECT_EQ(hits(readers_[1]), asked);
    EXPECT_EQ(readers_[1].query->answer_info().missing, 0u);
  }
  static Terms due_in(DeadlineClass deadline_class, std::chrono::milliseconds time) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch() + time;
    return {.deadline_class = deadline_class,
            .deadline = clock_time_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()),
            .read_at = {}};
  }

  static constexpr std::uint32_t many = 100'000;
  std::unique_ptr<RayQuery> before_them_;
  std::array<Reader, 2> readers_;
};

TEST_F(SharedRuns, AreLeftByWhoeverTakesLonger) {
  for (int turn = 0; turn < 3; ++turn) {
    ask_both({});
    EXPECT_EQ(database().wait(*readers_[0].transaction).status, Status::committed);
    EXPECT_EQ(hits(readers_[0]), asked);
    expect_the_other_is_answered(turn);
  }
}

TEST_F(SharedRuns, GoOnWhereOneIsCancelled) {
  for (int turn = 0; turn < 4; ++turn) {
    ask_both({});
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    database().cancel(*readers_[0].transaction);
    const Outcome& outcome = database().wait(*readers_[0].transaction);
    EXPECT_TRUE(outcome.status == Status::cancelled || hits(readers_[0]) == asked) << describe(outcome);
    expect_the_other_is_answered(turn);
  }
}

/// At some time between the first dispatch and the last.
TEST_F(SharedRuns, GoOnWhereOneIsFirm) {
  for (int ms = 20; ms <= 120; ms += 20) {
    ask_both(due_in(DeadlineClass::firm, std::chrono::milliseconds(ms)));
    const Outcome& outcome = database().wait(*readers_[0].transaction);
    EXPECT_TRUE(!outcome.done() || hits(readers_[0]) == asked) << describe(outcome);
    expect_the_other_is_answered(ms);
  }
}

TEST_F(SharedRuns, GoOnWhereOneMayBePartial) {
  auto partial =
      database().prepare(RayQueryOptions{.name = "partial", .capacity = asked, .late = LatePolicy::partial});
  ASSERT_TRUE(partial.ok());
  readers_[0].query = std::move(partial).value();
  for (int ms = 20; ms <= 120; ms += 20) {
    ask_both(due_in(DeadlineClass::soft, std::chrono::milliseconds(ms)));
    const Outcome& outcome = database().wait(*readers_[0].transaction);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    const bool lacks_some = hits(readers_[0]) < asked;
    EXPECT_EQ(outcome.partial, lacks_some) << describe(outcome);
    EXPECT_EQ(outcome.truncated, lacks_some) << describe(outcome);
    expect_the_other_is_answered(ms);
  }
}

}  // namespace
}  // namespace rtstdb::test
