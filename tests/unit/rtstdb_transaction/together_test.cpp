// Small readers that are ready together share a run: who does, and that each keeps an outcome of its own.

#include <gtest/gtest.h>

#include "simulated.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// A run costs 50 us and 1 us, or `each`, for each element. While a first one is held, others gather.
class Together : public testing::Test {
 protected:
  Together() {
    world_.executor.work = [this](const auto&, std::span<const query::Request> requests, const auto&) {
      Nanoseconds cost = 50us;
      std::vector<int> labels;
      for (const query::Request& request : requests) {
        cost += each * request.count;
        labels.push_back(dynamic_cast<SimulatedQuery&>(*request.query).label);
      }
      world_.clock.advance(cost);
      runs_.push_back(labels);
      if (held_) {
        held_ = false;
        gate_.pass();
      } else if (in_run) {
        in_run();
      }
      return query::RunReport{.status = truncated_ ? query::RunStatus::truncated : query::RunStatus::done,
                              .gpu_ns = 1000};
    };
    // Until it is known.
    for (std::uint32_t k = 0; k < 2 * scheduler::CostModel::min_samples; ++k) {
      ask(*holder_, holder_query_, {}, 10 * (1 + k % 4));
      world_.execute(*holder_);
    }
    for (int k = 0; k < count; ++k) {
      queries_.push_back(std::make_unique<SimulatedQuery>(1000, k));
      readers_.push_back(world_.make());
    }
  }
  static void ask(Transaction& transaction, SimulatedQuery& query, const Terms& given,
                  std::uint32_t elements) {
    transaction.begin(given);
    transaction.add_query(query, elements);
  }
  /// Submits them while another one runs; `runs_` then has theirs alone.
  void gather(const std::function<void()>& submit) {
    held_ = true;
    ask(*holder_, holder_query_, terms(DeadlineClass::soft, ClockTime::max(), 7), 10);
    world_.engine.submit(*holder_);
    gate_.wait_until_somebody_stands_there();
    submit();
    gate_.open();
    for (const auto& reader : readers_) {
      if (reader->status() != Status::idle) world_.engine.wait(*reader);
    }
    world_.engine.wait(*holder_);
    runs_.erase(runs_.begin(), runs_.end() - static_cast<std::ptrdiff_t>(runs_.size() - before_));
    before_ = 0;
  }
  void submit(int k, const Terms& given = {}, std::uint32_t elements = 20) {
    if (before_ == 0) before_ = runs_.size();
    ask(*readers_[static_cast<std::size_t>(k)], *queries_[static_cast<std::size_t>(k)], given, elements);
    world_.engine.submit(*readers_[static_cast<std::size_t>(k)]);
  }
  const Outcome& outcome(int k) const { return readers_[static_cast<std::size_t>(k)]->outcome(); }
  Transaction& reader(int k) { return *readers_[static_cast<std::size_t>(k)]; }
  using Runs = std::vector<std::vector<int>>;

  static constexpr int count = 20;
  World world_;
  EntityId entity_ = world_.create(1);
  Gate gate_;
  bool held_ = false, truncated_ = false;
  Nanoseconds each = 1us;
  std::function<void()> in_run;
  Runs runs_;
  std::size_t before_ = 0;
  SimulatedQuery holder_query_{1000, 100};
  std::unique_ptr<Transaction> holder_ = world_.make();
  std::vector<std::unique_ptr<SimulatedQuery>> queries_;
  std::vector<std::unique_ptr<Transaction>> readers_;
};

TEST_F(Together, ReadersShareARunAndItsCost) {
  gather([&] {
    for (int k = 0; k < 4; ++k)
      submit(k, {}, 10 + 20 * static_cast<std::uint32_t>(k));
  });
  EXPECT_EQ(runs_, (Runs{{0, 1, 2, 3}}));
  Nanoseconds sum{0};
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(outcome(k).status, Status::committed);
    EXPECT_EQ(outcome(k).shared_with, 3u);
    EXPECT_EQ(outcome(k).version, 1u);
    EXPECT_EQ(queries_[static_cast<std::size_t>(k)]->answer_info().elements,
              10u + 20u * static_cast<unsigned>(k));
    sum += outcome(k).actual_cost;
    EXPECT_TRUE(k == 0 || outcome(k).actual_cost > outcome(k - 1).actual_cost);
  }
  EXPECT_NEAR(static_cast<double>(sum.count()), 50e3 + 160e3, 10.0);
  EXPECT_NEAR(static_cast<double>(outcome(0).actual_cost.count()), 210e3 * 60 / 360, 3e3)
      << "by what each was predicted to take alone";
}

TEST_F(Together, NoMoreThanAChunkAndSixteen) {
  gather([&] {
    for (int k = 0; k < 5; ++k)
      submit(k, {}, 350);  // 400 us each
  });
  EXPECT_EQ(runs_, (Runs{{0, 1}, {2, 3}, {4}}));
  EXPECT_EQ(outcome(4).shared_with, 0u);
  gather([&] {
    for (int k = 0; k < count; ++k)
      submit(k, {}, 1);
  });
  ASSERT_EQ(runs_.size(), 2u);
  EXPECT_EQ(runs_[0].size(), 16u);
}

TEST_F(Together, WhoFollowsInTheOrderAndReadsTheSame) {
  gather([&] {
    submit(0);
    submit(1, {.read_at = ReadAt::pinned(1)});  // that is the latest
    reader(2).begin({});
    reader(2).update(entity_, row_of(2));
    world_.engine.submit(reader(2));
    submit(3);
    submit(4, {.read_at = ReadAt::pinned(1)});
    submit(5);
  });
  EXPECT_EQ(runs_, (Runs{{0, 1}, {3}, {4}, {5}}));
  EXPECT_EQ(outcome(3).version, 2u);
  EXPECT_EQ(outcome(4).version, 1u);
}

TEST_F(Together, WhatIsWrongWithOneIsItsOwn) {
  const auto far = world_.engine.latest().time + 500ms;
  gather([&] {
    submit(0);
    queries_[1]->rays()[3].t = world_time_ns(-1);
    submit(1);
    reader(2).begin({});
    reader(2).expect_exists({9, 9});
    reader(2).add_query(*queries_[2], 20);
    world_.engine.submit(reader(2));
    queries_[3]->rays()[3].t = far;
    submit(3);
    reader(4).begin({});
    reader(4).read(entity_);
    reader(4).add_query(*queries_[4], 0);
    world_.engine.submit(reader(4));
    submit(5);
  });
  EXPECT_EQ(runs_, (Runs{{0, 4, 5}, {3}})) << "whose times lie far from the others' goes alone";
  EXPECT_EQ(outcome(1).status, Status::bad_input);
  EXPECT_EQ(outcome(1).bad_input.element, 3u);
  EXPECT_EQ(outcome(1).bad_query, 0);
  EXPECT_EQ(outcome(2).status, Status::conflict);
  EXPECT_EQ(outcome(3).status, Status::committed);
  EXPECT_EQ(outcome(3).shared_with, 0u);
  ASSERT_NE(reader(4).state(0), nullptr);
  EXPECT_EQ(reader(4).state(0)->row.material, 1u);
  EXPECT_EQ(outcome(5).shared_with, 2u);
}

TEST_F(Together, WhoIsLeftAloneHasTheWholeCost) {
  world_.clock.per_reading_ns = 300;
  gather([&] {
    submit(0);
    reader(1).begin({});
    reader(1).expect_exists({9, 9});
    reader(1).add_query(*queries_[1], 20);
    world_.engine.submit(reader(1));
  });
  EXPECT_EQ(outcome(1).status, Status::conflict);
  EXPECT_EQ(outcome(0).status, Status::committed);
  EXPECT_EQ(outcome(0).shared_with, 0u);
  EXPECT_EQ(outcome(0).actual_cost, outcome(0).published - outcome(0).started - outcome(0).interrupted);
}

TEST_F(Together, DeadlinesCancelAndTruncationAreEachOnesOwn) {
  truncated_ = true;
  queries_[3]->is_truncated = true;
  in_run = [&] {
    world_.clock.advance(2ms);
    world_.engine.cancel(reader(1));
  };
  const ClockTime now = world_.clock.peek();
  gather([&] {
    submit(0, terms(DeadlineClass::firm, now + 2ms));
    submit(2, terms(DeadlineClass::soft, now + 2ms));
    submit(1, terms(DeadlineClass::firm, now + 9ms));
    submit(3);
  });
  EXPECT_EQ(runs_, (Runs{{0, 2, 1, 3}}));
  EXPECT_EQ(outcome(0).status, Status::missed);
  EXPECT_GT(outcome(0).lateness, 0ns);
  EXPECT_EQ(outcome(1).status, Status::cancelled);
  EXPECT_EQ(outcome(2).status, Status::late);
  EXPECT_FALSE(outcome(2).truncated);
  EXPECT_EQ(outcome(3).status, Status::truncated);
  EXPECT_EQ(world_.engine.counts().firm_late_commits, 0u);
}

TEST_F(Together, NobodyIsMadeLateByOthers) {
  const ClockTime now = world_.clock.peek();
  gather([&] {
    submit(0, terms(DeadlineClass::soft, now + 60us + 400us), 300);  // 350 us alone
    submit(1, {}, 300);
  });
  EXPECT_EQ(runs_, (Runs{{0}, {1}}));
  EXPECT_EQ(outcome(0).status, Status::committed);
}

TEST_F(Together, CostsAreLearnedFromThoseThatRunAlone) {
  for (int round = 0; round < 200; ++round) {
    gather([&] {
      for (int k = 0; k < 8; ++k)
        submit(k);
    });
    ASSERT_EQ(runs_.size(), 1u);
  }
  const Outcome alone = [&] {
    ask(reader(0), *queries_[0], {}, 20);
    return world_.execute(reader(0));
  }();
  EXPECT_NEAR(static_cast<double>(alone.predicted_cost.count()), 70e3, 1e3);
  const SchedulerCounts counts = world_.engine.scheduler_counts();
  EXPECT_NEAR(counts.predictions.at(0).median, 1.0, 0.05);
}

/// Else they would share at the old price for ever, and nobody would learn better.
TEST_F(Together, OneThatTakesLongerThanWasPromisedTeachesThat) {
  Nanoseconds from_now_on = 1us;
  const auto round = [&] {
    gather([&] {
      each = from_now_on;
      for (int k = 0; k < 8; ++k)
        submit(k);
    });
  };
  round();
  ASSERT_EQ(runs_.size(), 1u);
  from_now_on = 50us;
  round();
  EXPECT_EQ(runs_.size(), 1u) << "nobody could know";
  round();
  EXPECT_EQ(runs_.size(), 8u);
  for (int k = 0; k < 30; ++k)
    round();
  EXPECT_EQ(runs_.size(), 8u);
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(static_cast<double>(outcome(k).predicted_cost.count()), 1'050e3, 100e3);
    EXPECT_EQ(outcome(k).status, Status::committed);
  }
}

TEST_F(Together, WhatIsNotMeasuredGoesAlone) {
  SimulatedQuery unknown(10, 7, query::QueryKind::nearest);
  const auto other = world_.make();
  gather([&] {
    submit(0);
    other->begin({});
    other->add_query(unknown, 10);
    world_.engine.submit(*other);
    submit(1);
  });
  world_.engine.wait(*other);
  EXPECT_EQ(runs_, (Runs{{0}, {7}, {1}}));
}

}  // namespace
}  // namespace rtstdb::transaction::test
