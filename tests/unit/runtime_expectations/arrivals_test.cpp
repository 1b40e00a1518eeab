// Requests and replies that are judged frame by frame, since a tick latches only the newest frame.

#include "runtime/expectations/arrivals.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/idle_device.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

/// Two inputs that keep their samples, and a third one that does not.
class CounterDevice final : public tests::IdleDevice {
 public:
  CounterDevice() : IdleDevice("counters") {}
  void receive(std::size_t input, double value, std::int64_t time_ns) {
    kept_[input].push_back({value, time_ns, true});
  }
  void lose(std::uint64_t count) { lost_ += count; }

  bool keep_arrivals(std::size_t input) override { return input < 2; }
  bool next_arrival(std::size_t input, io::Sample& sample) noexcept override {
    if (taken_[input] == kept_[input].size()) return false;
    sample = kept_[input][taken_[input]++];
    return true;
  }
  std::uint64_t lost_arrivals() const noexcept override { return lost_; }

 private:
  std::array<std::vector<io::Sample>, 2> kept_;
  std::array<std::size_t, 2> taken_{};
  std::uint64_t lost_ = 0;
};

class FramesOfATick : public Expectations {
 protected:
  static constexpr std::size_t request_input = 0, reply_input = 1, plain_input = 2;

  FramesOfATick() {
    arrivals_.keep(device_, request_input, request_);
    arrivals_.keep(device_, reply_input, reply_);
  }

  void tick(const std::vector<Judge*>& judges, std::int64_t time_ns) {
    const std::span<const Arrival> arrived = arrivals_.collect();
    for (Judge* const judge : judges)
      judge->check(table_, arrived, time_ns);
  }
  static void expect_answered(const Judge& judge, const std::vector<std::int64_t>& took_ns) {
    const auto result = judge.result({1'000 * ms, 1, ms});
    EXPECT_EQ(result.result, report::ExpectationResult::held) << result.detail;
    EXPECT_EQ(judge.response_times(1'000 * ms)->samples_ns, took_ns) << result.detail;
    EXPECT_EQ(judge.response_times(1'000 * ms)->unanswered, 0U);
  }

  CounterDevice device_;
};

TEST_F(FramesOfATick, RepliesOfOneTickAreMatchedToTheirRequests) {
  const auto judge = responses(50 * ms);
  device_.receive(request_input, 1, 0);
  tick({judge.get()}, 0);
  device_.receive(request_input, 2, 10 * ms);
  tick({judge.get()}, 10 * ms);
  device_.receive(reply_input, 1, 30 * ms);
  device_.receive(reply_input, 2, 31 * ms);
  tick({judge.get()}, 40 * ms);
  expect_answered(*judge, {30 * ms, 21 * ms});
}

TEST_F(FramesOfATick, RequestsAndRepliesOfOneTickAreMatched) {
  const auto judge = responses(50 * ms);
  device_.receive(request_input, 1, 0);
  device_.receive(reply_input, 1, ms);
  device_.receive(request_input, 2, 2 * ms);
  device_.receive(reply_input, 2, 5 * ms);
  tick({judge.get()}, 10 * ms);
  expect_answered(*judge, {ms, 3 * ms});
}

/// A sending thread reports a frame after it was sent, so the tick may see the reply first.
TEST_F(FramesOfATick, ReplyMayBeKnownBeforeItsRequest) {
  const auto judge = responses(50 * ms);
  device_.receive(reply_input, 7, 3 * ms);
  tick({judge.get()}, 4 * ms);
  device_.receive(request_input, 7, 2 * ms);
  tick({judge.get()}, 5 * ms);
  expect_answered(*judge, {ms});
}

TEST_F(FramesOfATick, ReplyAnswersOneEarlierRequest) {
  const auto judge = responses(50 * ms);
  device_.receive(reply_input, 7, 3 * ms);
  tick({judge.get()}, 4 * ms);
  device_.receive(request_input, 7, 4 * ms);  // later than the reply
  device_.receive(request_input, 7, 2 * ms);
  tick({judge.get()}, 5 * ms);
  device_.receive(request_input, 7, ms);  // the reply has been used
  tick({judge.get()}, 6 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{ms}));
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 2U);
}

TEST_F(FramesOfATick, EveryExpectationSeesEveryFrame) {
  const auto first = responses(50 * ms);
  const auto second = responses(50 * ms);
  arrivals_.keep(device_, request_input, request_);  // named by both
  device_.receive(request_input, 1, 0);
  device_.receive(reply_input, 1, ms);
  tick({first.get(), second.get()}, 2 * ms);
  expect_answered(*first, {ms});
  expect_answered(*second, {ms});
}

TEST_F(FramesOfATick, LatchedValuesAreNotJudgedAgain) {
  const auto judge = responses(50 * ms);
  table_.write(request_, 1, 0);
  device_.receive(request_input, 1, 0);
  device_.receive(reply_input, 1, ms);
  tick({judge.get()}, 2 * ms);
  table_.write(reply_, 1, ms);
  tick({judge.get()}, 3 * ms);
  expect_answered(*judge, {ms});
}

TEST_F(FramesOfATick, FramesBeforeTheFirstTickAreIgnored) {
  const auto judge = responses(50 * ms);
  device_.receive(request_input, 1, -5 * ms);
  device_.lose(3);
  arrivals_.begin();
  device_.receive(request_input, 2, 0);
  device_.receive(reply_input, 2, ms);
  tick({judge.get()}, 2 * ms);
  expect_answered(*judge, {ms});
}

TEST_F(FramesOfATick, LostFramesLeaveTheExpectationUnchecked) {
  const auto judge = responses(50 * ms);
  device_.receive(request_input, 1, 0);
  device_.receive(reply_input, 1, ms);
  device_.lose(3);
  tick({judge.get()}, 2 * ms);
  EXPECT_EQ(arrivals_.lost(), 3U) << "of one device, whatever the number of its inputs";
  expect(*judge, {1'000 * ms, 1, ms}, report::ExpectationResult::not_checked,
         {"can not be judged, 3 samples were lost"});
}

TEST_F(FramesOfATick, ManyFramesAreTakenWithoutAllocation) {
  const auto judge = responses(50 * ms);
  for (int i = 0; i < 20'000; ++i)
    device_.receive(request_input, i, i);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  const std::size_t first = arrivals_.collect().size();
  const std::size_t second = arrivals_.collect().size();
  const std::size_t third = arrivals_.collect().size();
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(first + second + third, 20'000U);
  EXPECT_GT(third, 0U) << "one call takes a bounded number of samples";
}

TEST_F(FramesOfATick, InputsWithoutSamplesAreNotKept) {
  const auto speed = table_.add({.name = "plc.speed", .unit = "", .writer = "plc"});
  arrivals_.keep(device_, plain_input, speed);
  EXPECT_FALSE(arrivals_.keeps(speed));
  EXPECT_TRUE(arrivals_.keeps(reply_));
}

}  // namespace
}  // namespace hil::expectations
