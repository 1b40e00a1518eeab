// The schedulability test of reservations, compared with simulations that share no code with it.

#include "rtstdb/scheduler/reserved_demand.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <random>

namespace rtstdb::scheduler {
namespace {

using namespace std::chrono_literals;

struct Job {
  std::int64_t deadline = 0, left = 0;
};

/// Simulates earliest deadline first in single steps of time; each job is preemptible at any step. All
/// demands have their first release at time 0.
bool all_in_time_if_preemptible(const std::vector<Demand>& demands, std::int64_t until) {
  std::vector<Job> jobs;
  for (std::int64_t now = 0; now < until; ++now) {
    for (const Demand& demand : demands) {
      if (now % demand.period.count() == 0)
        jobs.push_back({now + demand.deadline.count(), demand.budget.count()});
    }
    const auto first = std::ranges::min_element(jobs, {}, &Job::deadline);
    if (first == jobs.end()) continue;
    if (first->deadline <= now) return false;
    if (--first->left == 0) jobs.erase(first);
  }
  return std::ranges::none_of(jobs, [&](const Job& job) { return job.deadline <= until; });
}

std::vector<Demand> random_demands(std::mt19937& random, std::int64_t longest_period) {
  std::vector<Demand> demands(1 + random() % 4);
  for (Demand& demand : demands) {
    const auto period = static_cast<std::int64_t>(2 + random() % (longest_period - 1));
    const auto deadline = static_cast<std::int64_t>(1 + random() % (random() % 4 == 0 ? 2 * period : period));
    const std::int64_t budget = 1 + static_cast<std::int64_t>(random() % 8) * std::min(deadline, period) / 14;
    demand = {Nanoseconds(period), Nanoseconds(deadline), Nanoseconds(std::min(budget, deadline)), 0ns};
  }
  return demands;
}

TEST(ReservedDemand, IsExactIfEverythingIsPreemptible) {
  std::mt19937 random(1);
  int kept = 0;
  int refused = 0;
  for (int round = 0; round < 6000; ++round) {
    const auto demands = random_demands(random, 12);
    const auto shortfall = first_shortfall(demands, 0ns, 1.0);
    if (shortfall && shortfall->kind != Shortfall::Kind::within_length) {
      // At full utilization the test refuses without an answer.
      EXPECT_GE(shortfall->utilization, 1.0 - 1e-9);
      continue;
    }
    std::int64_t hyperperiod = 1;
    std::int64_t longest = 0;
    for (const Demand& demand : demands) {
      hyperperiod = std::lcm(hyperperiod, demand.period.count());
      longest = std::max(longest, demand.deadline.count());
    }
    ASSERT_EQ(all_in_time_if_preemptible(demands, 2 * hyperperiod + longest), !shortfall)
        << "round " << round;
    (shortfall ? refused : kept)++;
  }
  EXPECT_GT(kept, 300);
  EXPECT_GT(refused, 300);
}

/// Simulates non-preemptible pieces: of other work, which is always ready, and of the demands' jobs. Jobs
/// come with their period or later. The part of each `lost_every` steps that `share` leaves is lost.
class NonPreemptible {
 public:
  NonPreemptible(const std::vector<Demand>& demands, std::int64_t piece, double share, unsigned seed)
      : demands_(demands),
        piece_(piece),
        lost_((1.0 - share) * lost_every),
        random_(seed),
        next_(demands.size(), 0) {
    for (std::int64_t& next : next_)
      next = static_cast<std::int64_t>(random_() % 100);
  }

  bool all_in_time(std::int64_t until) {
    while (now_ < until) {
      release_jobs();
      const auto first =
          std::ranges::min_element(jobs_, {}, [](const DemandJob& one) { return one.job.deadline; });
      if (first == jobs_.end()) {
        pass(piece_ > 0 ? 1 + static_cast<std::int64_t>(random_() % piece_) : 1);
        continue;
      }
      const std::int64_t job_piece = std::max<std::int64_t>(1, demands_[first->demand].piece.count());
      const std::int64_t spent = std::min(first->job.left, job_piece);
      pass(spent);
      first->job.left -= spent;
      if (first->job.left > 0) continue;
      if (now_ > first->job.deadline) return false;
      jobs_.erase(first);
    }
    return true;
  }

 private:
  static constexpr int lost_every = 40;
  struct DemandJob {
    Job job;
    std::size_t demand = 0;
  };

  void release_jobs() {
    for (std::size_t k = 0; k < demands_.size(); ++k) {
      if (next_[k] > now_) continue;
      // The release was at next_[k], within the last piece.
      jobs_.push_back({{next_[k] + demands_[k].deadline.count(), demands_[k].budget.count()}, k});
      next_[k] +=
          demands_[k].period.count() + (random_() % 2 == 0 ? 0 : static_cast<std::int64_t>(random_() % 30));
    }
  }
  void pass(std::int64_t time) {
    for (; time > 0; --time, ++now_) {
      if (now_ % lost_every == 0) now_ += static_cast<std::int64_t>(lost_);
    }
  }

  const std::vector<Demand>& demands_;
  std::int64_t piece_;
  double lost_;
  std::mt19937 random_;
  std::int64_t now_ = 1;
  std::vector<std::int64_t> next_;
  std::vector<DemandJob> jobs_;
};

TEST(ReservedDemand, HoldsWithNonPreemptiblePieces) {
  std::mt19937 random(2);
  int kept = 0;
  int refused = 0;
  int kept_without_pieces = 0;
  for (unsigned round = 0; round < 4000; ++round) {
    auto demands = random_demands(random, 300);
    for (Demand& demand : demands)
      demand.piece = Nanoseconds(random() % 3 == 0 ? demand.budget.count() : 1);
    const auto piece = static_cast<std::int64_t>(random() % 20);
    if (first_shortfall(demands, Nanoseconds(piece), 1.0)) {
      ++refused;
      for (Demand& demand : demands)
        demand.piece = 0ns;
      kept_without_pieces += !first_shortfall(demands, 0ns, 1.0);
      continue;
    }
    ++kept;
    ASSERT_TRUE(NonPreemptible(demands, piece, 1.0, round).all_in_time(20'000)) << "round " << round;
  }
  EXPECT_GT(kept, 300);
  EXPECT_GT(refused, 300);
  EXPECT_GT(kept_without_pieces, 30) << "or pieces do not matter";
}

TEST(ReservedDemand, TheShareCoversLostTime) {
  std::mt19937 random(3);
  int kept = 0;
  for (unsigned round = 0; round < 2000; ++round) {
    auto demands = random_demands(random, 900);
    // Lost time comes in pieces of 8 steps.
    const auto piece = static_cast<std::int64_t>(8 + random() % 20);
    if (first_shortfall(demands, Nanoseconds(piece + 8), 0.8)) continue;
    ++kept;
    ASSERT_TRUE(NonPreemptible(demands, piece, 0.8, round).all_in_time(20'000)) << "round " << round;
  }
  EXPECT_GT(kept, 100);
}

TEST(ReservedDemand, NamesTheDemandOfAShortfall) {
  const std::vector<Demand> demands{{10ms, 5ms, 2ms, 1ms}, {20ms, 8ms, 4ms, 3ms}};
  EXPECT_FALSE(first_shortfall(demands, 1ms, 1.0));
  const auto shortfall = first_shortfall(demands, 3ms, 1.0);
  ASSERT_TRUE(shortfall);
  EXPECT_EQ(shortfall->kind, Shortfall::Kind::within_length);
  EXPECT_EQ(shortfall->length, 8ms);
  EXPECT_EQ(shortfall->demanded, (std::vector<Nanoseconds>{2ms, 4ms}));
  EXPECT_EQ(shortfall->piece, 3ms);
  const auto earlier = first_shortfall(demands, 1ms, 0.9);
  ASSERT_TRUE(earlier);
  EXPECT_EQ(earlier->length, 5ms);
  EXPECT_EQ(earlier->demanded, (std::vector<Nanoseconds>{2ms, 0ms}));
  EXPECT_EQ(earlier->piece, 3ms) << "of the second demand, whose job may be running";
  const auto overloaded = first_shortfall(demands, 0ns, 0.4);
  ASSERT_TRUE(overloaded);
  EXPECT_EQ(overloaded->kind, Shortfall::Kind::utilization);
  EXPECT_DOUBLE_EQ(overloaded->utilization, 0.4);
  const std::vector<Demand> close{{1us, 1us, 999ns, 0ns}, {1h, 1ms, 1ns, 0ns}};
  EXPECT_TRUE(first_shortfall(close, 0ns, 0.999 + 1e-9));
}

}  // namespace
}  // namespace rtstdb::scheduler
