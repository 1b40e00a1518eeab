// Small readers that share a run, whose searches take longer than all that was known of them: each goes on alone, and whoever is cancelled
// or has a deadline takes nobody with him.

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <thread>

#include "tests/gpu/dense_meshes.hpp"

namespace rtstdb::test {
namespace {

using std::chrono::milliseconds;
constexpr std::uint32_t rays_each = 16;

class SharedRuns : public DatabaseTest {
 protected:
  struct Reader {
    std::unique_ptr<RayQuery> query;
    std::unique_ptr<Transaction> transaction;
  };
  void SetUp() override {
    open({.chunk = milliseconds(20)});  // what is promised for them all is less
    create(row_of(add(pile(400'000)), {0.0, 0.0, 5.0}));
    box_ = row_of(add(make_box({1.0, 1.0, 1.0})), {0.0, 100.0, 0.0});
    written_ = create(box_);
    before_them_ = prepare_rays(RayMode::closest, false, many);
    std::ranges::fill(before_them_->rays(), past());
    batch_ = database().make_transaction({.max_writes = 1, .max_queries = 1});
    for (int k = 0; k < 20; ++k) {
      submit_batch();
      ASSERT_TRUE(database().wait(*batch_).done());
    }
  }
  static Ray past() { return ray_from({}, {0, 1, -1}); }
  static Ray through() { return ray_from({}, {0, 0, 1}); }

  void submit(Reader& reader, const Ray& ray, const Terms& terms) {
    std::ranges::fill(reader.query->rays(), ray);
    reader.transaction->begin(terms);
    reader.transaction->add_query(*reader.query, rays_each);
    database().submit(*reader.transaction);
  }
  /// It writes, and shares with nobody.
  void submit_batch() {
    Terms urgent;
    urgent.importance = 1;
    batch_->begin(urgent);
    batch_->update(written_, box_);
    batch_->add_query(*before_them_, many);
    database().submit(*batch_);
  }
  /// Prepared anew, for what it was asked before tells what a query will cost.
  void prepare_readers(LatePolicy of_first) {
    for (Reader& reader : readers_) {
      const bool first = &reader == &first_;
      auto made = database().prepare(RayQueryOptions{
          .name = "reader", .capacity = rays_each, .late = first ? of_first : LatePolicy::discard});
      ASSERT_TRUE(made.ok());
      reader = {std::move(made).value(), database().make_transaction({.max_queries = 1})};
    }
    for (int k = 0; k < 12; ++k) {
      for (Reader& reader : readers_) {
        submit(reader, past(), {});
        ASSERT_TRUE(database().wait(*reader.transaction).done());
      }
    }
  }
  /// All are taken for cheap, wait behind a batch, and begin together; the last one is answered by then and tells that they did. Some turns
  /// in which they do not are no turns.
  void in_turns(
      LatePolicy of_first, const std::function<Terms()>& terms_of_first, const std::function<void()>& expect,
      const std::function<void()>& meanwhile = [] {}) {
    int turns = 0;
    for (int tries = 0; turns < 2 && tries < 20; ++tries) {
      prepare_readers(of_first);
      submit_batch();
      submit(first_, through(), terms_of_first());
      submit(second_, through(), {});
      submit(last_, past(), {});
      meanwhile();
      const Outcome& of_last = database().wait(*last_.transaction);
      EXPECT_EQ(of_last.status, Status::committed) << describe(of_last);
      const bool together = of_last.shared_with == 2;
      turns += together ? 1 : 0;
      if (together) expect();
      for (const Reader& reader : readers_)
        database().wait(*reader.transaction);
      EXPECT_TRUE(database().wait(*batch_).done());
    }
    EXPECT_EQ(turns, 2) << "they seldom share";
  }
  static std::ptrdiff_t hits(const Reader& reader) {
    return std::ranges::count(reader.query->hits(), HitStatus::hit, &RayHit::status);
  }
  void expect_the_second_is_answered() {
    const Outcome& outcome = database().wait(*second_.transaction);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_EQ(hits(second_), rays_each);
    EXPECT_EQ(second_.query->answer_info().missing, 0u);
  }
  /// Later than the first dispatch and sooner than the last.
  static Terms due_within(DeadlineClass deadline_class) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch() + milliseconds(60);
    return {.deadline_class = deadline_class,
            .deadline = clock_time_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()),
            .read_at = {}};
  }
  static Terms no_deadline() { return {}; }

  static constexpr std::uint32_t many = 20'000;
  std::unique_ptr<RayQuery> before_them_;
  std::unique_ptr<Transaction> batch_;
  EntityRow box_;
  EntityId written_;
  std::array<Reader, 3> readers_;
  Reader &first_ = readers_[0], &second_ = readers_[1], &last_ = readers_[2];
};

TEST_F(SharedRuns, AreLeftByWhoeverTakesLonger) {
  in_turns(LatePolicy::discard, no_deadline, [&] {
    EXPECT_EQ(database().wait(*first_.transaction).status, Status::committed);
    EXPECT_EQ(hits(first_), rays_each);
    expect_the_second_is_answered();
  });
}

TEST_F(SharedRuns, GoOnWhereOneIsCancelled) {
  in_turns(
      LatePolicy::discard, no_deadline,
      [&] {
        const Outcome& outcome = database().wait(*first_.transaction);
        EXPECT_TRUE(outcome.status == Status::cancelled || hits(first_) == rays_each) << describe(outcome);
        expect_the_second_is_answered();
      },
      [&] {
        std::this_thread::sleep_for(milliseconds(40));
        database().cancel(*first_.transaction);
      });
}

TEST_F(SharedRuns, GoOnWhereOneIsFirm) {
  in_turns(
      LatePolicy::discard, [] { return due_within(DeadlineClass::firm); },
      [&] {
        const Outcome& outcome = database().wait(*first_.transaction);
        EXPECT_TRUE(!outcome.done() || hits(first_) == rays_each) << describe(outcome);
        expect_the_second_is_answered();
      });
}

TEST_F(SharedRuns, GoOnWhereOneMayBePartial) {
  in_turns(
      LatePolicy::partial, [] { return due_within(DeadlineClass::soft); },
      [&] {
        const Outcome& outcome = database().wait(*first_.transaction);
        EXPECT_TRUE(outcome.done()) << describe(outcome);
        const bool lacks_some = hits(first_) < rays_each;
        EXPECT_EQ(outcome.partial, lacks_some) << describe(outcome);
        EXPECT_EQ(outcome.truncated, lacks_some) << describe(outcome);
        EXPECT_EQ(first_.query->answer_info().missing, rays_each - hits(first_));
        expect_the_second_is_answered();
      });
}

}  // namespace
}  // namespace rtstdb::test
