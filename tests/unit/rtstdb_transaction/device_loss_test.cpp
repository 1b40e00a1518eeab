// The engine while its device is lost: which transactions fail, which wait, which are executed.

#include <gtest/gtest.h>

#include <semaphore>
#include <utility>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// A simulated executor whose device is lost in a run on request.
class LosableExecutor final : public query::Executor {
 public:
  query::RunReport run(const store::RowSource& rows, std::span<const query::Request> requests,
                       const store::TimeSpan& times, query::ExecutorCallbacks* callbacks) noexcept override {
    if (lost_) return {.status = query::RunStatus::device_lost};
    const query::RunReport report = inner.run(rows, requests, times, callbacks);
    if (lose_next_run.exchange(false)) lost_ = true;
    return lost_ ? query::RunReport{.status = query::RunStatus::device_lost} : report;
  }
  bool lost() const noexcept override { return lost_; }
  bool revive(query::ExecutorCallbacks* callbacks) noexcept override {
    ++revivals;
    if (callbacks != nullptr) callbacks->begin_wait();
    if (while_reviving) while_reviving();
    if (callbacks != nullptr) callbacks->end_wait();
    lost_ = stays_away;
    return !lost_;
  }
  Nanoseconds revival_takes() const noexcept override { return 100ms; }

  SimulatedExecutor inner;
  std::atomic<bool> lose_next_run{false};
  std::atomic<bool> stays_away{false};
  std::atomic<int> revivals{0};
  std::function<void()> while_reviving;

 private:
  bool lost_ = false;  // the engine thread alone
};

class DeviceLoss : public testing::Test {
 protected:
  std::unique_ptr<Transaction> make() { return engine_.make_transaction(options_for(8, 4, 2)); }
  Status execute(Transaction& transaction) {
    engine_.submit(transaction);
    return engine_.wait(transaction).status;
  }
  Status write(std::uint32_t mask) {
    const auto writer = make();
    writer->begin({});
    writer->create(row_of(mask));
    return execute(*writer);
  }
  std::size_t entities() { return engine_.snapshot(ReadAt::latest()).value().size(); }

  SimulatedClock clock_;
  LosableExecutor executor_;
  Engine engine_{engine_options(), executor_, clock_};
  SimulatedQuery query_{8, 1};
  SimulatedQuery other_query_{8, 2};
  std::unique_ptr<Transaction> first_ = make();
  std::unique_ptr<Transaction> second_ = make();
};

TEST_F(DeviceLoss, EndsTheRunningTransactionWithoutAVersion) {
  executor_.lose_next_run = true;
  first_->begin({});
  first_->create(row_of(1));
  first_->add_query(query_, 1);
  EXPECT_EQ(execute(*first_), Status::device_lost);
  EXPECT_EQ(entities(), 0u);
  EXPECT_FALSE(first_->created(0).valid());
  EXPECT_EQ(execute(begin_query(*second_, query_, {})), Status::committed);
  EXPECT_EQ(executor_.revivals, 1);
  EXPECT_EQ(engine_.counts().device_lost, 1u);
}

TEST_F(DeviceLoss, StartsARevivalWithoutFurtherTransactions) {
  executor_.lose_next_run = true;
  std::binary_semaphore revived{0};
  executor_.while_reviving = [&] { revived.release(); };
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
  EXPECT_TRUE(revived.try_acquire_for(30s));
}

TEST_F(DeviceLoss, DoesNotEndWaitingTransactions) {
  executor_.lose_next_run = true;
  executor_.inner.work = [&, first = true](const auto&, const auto&, const auto&) mutable {
    if (std::exchange(first, false))
      engine_.submit(begin_query(*second_, other_query_, terms(DeadlineClass::soft)));
    return query::RunReport{};
  };
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
  EXPECT_EQ(engine_.wait(*second_).status, Status::committed);
}

TEST_F(DeviceLoss, EndsFirmTransactionsThatAreDueBeforeTheRevival) {
  const auto due_before = make();
  const auto due_after = make();
  executor_.lose_next_run = true;
  Status during = Status::pending;
  std::binary_semaphore submitted{0};
  executor_.while_reviving = [&] {
    engine_.submit(begin_query(*due_after, other_query_, terms(DeadlineClass::firm, clock_.peek() + 200ms)));
    engine_.submit(begin_query(*due_before, query_, terms(DeadlineClass::firm, clock_.peek() + 99ms)));
    during = engine_.wait(*due_before).status;
    EXPECT_EQ(due_after->status(), Status::pending);
    submitted.release();
  };
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
  submitted.acquire();
  EXPECT_EQ(engine_.wait(*due_after).status, Status::committed);
  EXPECT_EQ(during, Status::device_lost);
  EXPECT_EQ(engine_.counts().firm_late_commits, 0u);
}

TEST_F(DeviceLoss, DoesNotDelayWrites) {
  executor_.lose_next_run = true;
  Status written = Status::pending;
  executor_.while_reviving = [&] { written = write(1); };
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
  EXPECT_EQ(execute(begin_query(*second_, query_, {})), Status::committed);
  EXPECT_EQ(written, Status::committed);
  EXPECT_EQ(entities(), 1u);
}

TEST_F(DeviceLoss, ThatPersistsEndsEachQueryAndNoWrite) {
  executor_.lose_next_run = true;
  executor_.stays_away = true;
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
    EXPECT_EQ(write(1), Status::committed);
  }
  EXPECT_EQ(entities(), 5u);
  EXPECT_GE(executor_.revivals, 5);
  executor_.stays_away = false;
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::committed);
}

/// The revival begins when the nested run and the preempted one have ended.
TEST_F(DeviceLoss, EndsNestedAndPreemptedRuns) {
  constexpr std::uint32_t large_count = 3 * unmeasured_chunk;
  SimulatedQuery large(large_count, 3);
  executor_.inner.chunk = [&](const store::RowSource&, const query::Request& request, std::uint32_t first,
                              std::uint32_t) {
    clock_.advance(500us);
    if (request.query == &large && first == 0) engine_.submit(begin_query(*second_, query_, soft_terms(1)));
    if (request.query == &query_) executor_.lose_next_run = true;
  };
  EXPECT_EQ(execute(begin_query(*first_, large, {}, large_count)), Status::device_lost);
  EXPECT_EQ(engine_.wait(*second_).status, Status::device_lost);
  executor_.inner.chunk = {};
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::committed);
  EXPECT_EQ(executor_.revivals, 1);
}

TEST_F(DeviceLoss, UnderAVirtualClockEndsNoWaitingTransaction) {
  clock_.virtual_time = true;
  executor_.lose_next_run = true;
  std::binary_semaphore submitted{0};
  executor_.while_reviving = [&] {
    engine_.submit(begin_query(*second_, other_query_, terms(DeadlineClass::firm, clock_.peek() + 1ns)));
    submitted.release();
  };
  EXPECT_EQ(execute(begin_query(*first_, query_, {})), Status::device_lost);
  submitted.acquire();
  EXPECT_EQ(engine_.wait(*second_).status, Status::committed);
}

}  // namespace
}  // namespace rtstdb::transaction::test
