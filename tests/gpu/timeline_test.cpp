// Submissions complete in the order of their numbers, and waits have timeouts.

#include <chrono>
#include <limits>
#include <thread>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

using SteadyClock = std::chrono::steady_clock;

/// Has work that takes long on each device: passes with barriers between them.
class TimelineTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    if (HasFatalFailure()) return;
    words_ = make_words(64, 1);
    busy_ = make_pipeline(TestShader::stay_busy);
    bindings_ = make_bindings(busy_, {&words_});
  }

  void record_work(Recorder& recorder, std::uint32_t passes) {
    recorder.begin();
    for (std::uint32_t i = 0; i < passes; ++i) {
      recorder.dispatch(busy_, bindings_, shared::CountArgs{.count = 60000}, 1);
      recorder.barrier();
    }
    recorder.end();
  }

 private:
  Buffer words_;
  Pipeline busy_;
  Bindings bindings_;
};
using TimelineDeathTest = TimelineTest;

TEST_F(TimelineTest, CompletesSubmissionsInTheOrderOfTheirNumbers) {
  Timeline timeline = make_timeline();
  std::vector<Recorder> recorders;
  for (int i = 0; i < 8; ++i)
    recorders.push_back(make_recorder());
  std::uint64_t last = 0;
  for (Recorder& recorder : recorders) {
    record_work(recorder, 3);
    const std::uint64_t number = timeline.submit(recorder);
    EXPECT_EQ(number, last + 1);
    last = number;
  }
  ASSERT_EQ(timeline.wait(last, test_timeout_ns), WaitResult::done);
  for (std::uint64_t number = 0; number <= last; ++number)
    EXPECT_EQ(timeline.wait(number, 0), WaitResult::done);
}

TEST_F(TimelineTest, EndsAWaitAtItsTimeout) {
  Timeline timeline = make_timeline();
  Recorder recorder = make_recorder();
  record_work(recorder, 400);
  const std::uint64_t number = timeline.submit(recorder);
  EXPECT_EQ(timeline.wait(number, 0), WaitResult::timeout);
  EXPECT_EQ(timeline.wait(number, -5), WaitResult::timeout);
  const auto start = SteadyClock::now();
  EXPECT_EQ(timeline.wait(number, 2'000'000), WaitResult::timeout);
  EXPECT_GE(SteadyClock::now() - start, std::chrono::microseconds(1900));
  EXPECT_EQ(timeline.wait(number, std::numeric_limits<std::int64_t>::max()), WaitResult::done);
  EXPECT_FALSE(device().lost());
}

TEST_F(TimelineTest, MakesWritesVisibleToLaterSubmissions) {
  Buffer words = make_words(64, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Bindings bindings = make_bindings(add, {&words});
  Timeline timeline = make_timeline();
  std::vector<Recorder> recorders;
  for (int i = 0; i < 100; ++i)
    recorders.push_back(make_recorder());
  std::uint64_t last = 0;
  for (Recorder& recorder : recorders) {  // without barriers and waits between them
    recorder.begin();
    recorder.dispatch(add, bindings, shared::AddArgs{.first = 0, .count = 64, .amount = 1}, 1);
    recorder.end();
    last = timeline.submit(recorder);
  }
  ASSERT_EQ(timeline.wait(last, test_timeout_ns), WaitResult::done);
  for (const std::uint32_t word : words.host_as<std::uint32_t>())
    ASSERT_EQ(word, 100u);
}

TEST_F(TimelineTest, SharesTheQueueWithOtherThreads) {
  const Pipeline add = make_pipeline(TestShader::add);
  Buffer words[2] = {make_words(64, 0), make_words(64, 0)};
  const Bindings bindings[2] = {make_bindings(add, {&words[0]}), make_bindings(add, {&words[1]})};
  Recorder recorders[2] = {make_recorder(), make_recorder()};
  Timeline timelines[2] = {make_timeline(), make_timeline()};
  constexpr std::uint32_t rounds = 500;
  const auto work = [&](int side) {
    for (std::uint32_t i = 0; i < rounds; ++i) {
      recorders[side].begin();
      recorders[side].dispatch(add, bindings[side], shared::AddArgs{.first = 0, .count = 64, .amount = 1}, 1);
      recorders[side].end();
      const std::uint64_t number = timelines[side].submit(recorders[side]);
      ASSERT_EQ(timelines[side].wait(number, test_timeout_ns), WaitResult::done);
    }
  };
  std::thread other(work, 1);
  work(0);
  other.join();
  for (Buffer& side : words)
    EXPECT_EQ(side.host_as<std::uint32_t>()[63], rounds);
}

TEST_F(TimelineTest, WaitsForTheWorkInDestructors) {
  Buffer words = make_words(64, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Bindings bindings = make_bindings(add, {&words});
  {
    Timeline timeline = make_timeline();
    Recorder recorder = make_recorder();
    record_work(recorder, 50);
    timeline.submit(recorder);
    Recorder last = make_recorder();
    last.begin();
    last.dispatch(add, bindings, shared::AddArgs{.first = 0, .count = 64, .amount = 9}, 1);
    last.end();
    timeline.submit(last);
  }
  EXPECT_EQ(words.host_as<std::uint32_t>()[0], 9u);
}

TEST_F(TimelineDeathTest, AbortsOnUseOfARecorderInFlight) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  Timeline timeline = make_timeline();
  Recorder recorder = make_recorder();
  EXPECT_DEATH(timeline.submit(recorder), "the recorder has no complete recording");
  const auto submit_long_work = [&] {
    record_work(recorder, 400);
    timeline.submit(recorder);
  };
  EXPECT_DEATH((submit_long_work(), recorder.begin()), "has not finished");
  EXPECT_DEATH((submit_long_work(), timeline.submit(recorder)), "has not finished");
}

TEST_F(TimelineDeathTest, AbortsOnAWaitForAnUnknownNumber) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  Timeline timeline = make_timeline();
  EXPECT_EQ(timeline.wait(0, 0), WaitResult::done);
  EXPECT_DEATH(timeline.wait(1, 0), "the number was never submitted");
}

TEST_F(TimelineDeathTest, AbortsOnATimestampThatWasNotRecorded) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  Timeline timeline = make_timeline();
  Recorder recorder = make_recorder();
  recorder.begin();
  recorder.timestamp(0);
  recorder.end();
  EXPECT_DEATH((void)timeline.elapsed_ns(recorder, 0, 0), "not submitted to this timeline");
  ASSERT_EQ(timeline.wait(timeline.submit(recorder), test_timeout_ns), WaitResult::done);
  EXPECT_EQ(timeline.elapsed_ns(recorder, 0, 0), 0);
  EXPECT_DEATH((void)timeline.elapsed_ns(recorder, 0, 1), "a slot has no timestamp");
}

}  // namespace
}  // namespace rtstdb::gpu::test
