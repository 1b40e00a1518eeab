// Requests and replies that are judged frame by frame, since a tick latches only the newest frame.

#include "runtime/expectations/arrivals.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_expectations/arriving_device.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class FramesOfATick : public Expectations {
 protected:
  static constexpr std::size_t request_input = 0, reply_input = 1;

  FramesOfATick() {
    arrivals_.keep(device_, links_, request_);
    arrivals_.keep(device_, links_, reply_);
  }

  static void expect_answered(const Judge& judge, const std::vector<std::int64_t>& took_ns) {
    const auto result = judge.result({1'000 * ms, 1, ms});
    EXPECT_EQ(result.result, report::ExpectationResult::held) << result.detail;
    EXPECT_EQ(judge.response_times(1'000 * ms)->samples_ns, took_ns) << result.detail;
    EXPECT_EQ(judge.response_times(1'000 * ms)->unanswered, 0U);
  }

  const signals::SignalId plain_ = table_.add({.name = "plc.speed", .unit = "", .writer = "plc"});
  const signals::Links links_{
      .inputs = {request_, reply_, plain_}, .outputs = {}, .connected = {}, .fresh = {}};
  ArrivingDevice device_{2};  // keeps two inputs of three
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
  arrivals_.keep(device_, links_, request_);  // named by both
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
         {"can not be judged, 3 frames were lost"});
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
  EXPECT_GT(third, 0U) << "one call takes a bounded number of frames";
}

TEST_F(FramesOfATick, InputsWithoutSamplesAreNotKept) {
  arrivals_.keep(device_, links_, plain_);
  EXPECT_FALSE(arrivals_.keeps(plain_));
  EXPECT_TRUE(arrivals_.keeps(reply_));
}

TEST_F(FramesOfATick, ReplyBeforeItsRequestWithOneStampIsNone) {
  const auto judge = responses(9 * ms);
  device_.receive(reply_input, 7, 3 * ms);
  device_.receive(request_input, 7, 3 * ms);
  tick({judge.get()}, 4 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->unanswered, 1U);
  device_.receive(request_input, 8, 20 * ms);
  device_.receive(reply_input, 8, 20 * ms);
  tick({judge.get()}, 21 * ms);
  EXPECT_EQ(judge->response_times(1'000 * ms)->samples_ns, (std::vector<std::int64_t>{0}));
}

TEST_F(FramesOfATick, RequestsBeforeTheWindowAreMatchedButNotJudged) {
  config::WindowSection window{.place = {}, .from_ns = 100 * ms, .to_ns = {}, .after = {}, .until = {}};
  const auto judge = windowed(
      Response{
          .request = {"bus.Header.Counter", {}}, .reply = {"bus.Command.AnswerTo", {}}, .within_ns = 20 * ms},
      window);
  // Replies are 40 ms late, and the counter comes again every 40 ms: each looks like the answer to the next.
  for (int i = 0; i < 40; ++i) {
    if (i >= 4) device_.receive(reply_input, i % 4, i * 10 * ms);
    device_.receive(request_input, i % 4, i * 10 * ms);
    tick({judge.get()}, i * 10 * ms);
  }
  const auto result = judge->result({400 * ms, 400, ms});
  EXPECT_EQ(result.result, Result::failed) << result.detail;
  EXPECT_NE(result.detail.find("slowest 40.00 ms"), std::string::npos) << result.detail;
}

TEST_F(FramesOfATick, ComeInOneReceiveOrderOverAllDevices) {
  ArrivingDevice other(1);
  const signals::Links links{.inputs = {speed_}, .outputs = {}, .connected = {}, .fresh = {}};
  arrivals_.keep(other, links, speed_);
  other.receive(0, 1, 2 * ms);
  other.receive(0, 2, 5 * ms);
  device_.receive(request_input, 10, ms);
  device_.receive({{request_input, 11}, {reply_input, 12}}, 5 * ms);
  device_.receive(request_input, 13, 9 * ms);
  std::vector<double> first_values;
  for (const Arrival& arrival : arrivals_.collect())
    first_values.push_back(arrival.values.front().value);
  EXPECT_EQ(first_values, (std::vector<double>{10, 1, 11, 2, 13})) << "at one stamp, by device";
}

}  // namespace
}  // namespace hil::expectations
