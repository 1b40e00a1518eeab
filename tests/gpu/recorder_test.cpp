// A device executes recorded commands, in the order of the barriers.

#include <algorithm>
#include <random>

#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::gpu::test {
namespace {

class RecorderTest : public GpuTest {};
using RecorderDeathTest = RecorderTest;

TEST_F(RecorderTest, OrdersFillsCopiesAndDispatchesByBarriers) {
  constexpr std::uint32_t count = 4096;
  Buffer a = make_words(count, 0);
  Buffer b = make_words(count, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Bindings on_a = make_bindings(add, {&a});
  const Bindings on_b = make_bindings(add, {&b});
  const shared::AddArgs args{.first = 0, .count = count, .amount = 1};
  constexpr std::uint32_t rounds = 50;
  run([&](Recorder& recorder) {
    recorder.fill(a, 0, 4 * count, 1000);
    for (std::uint32_t i = 0; i < rounds; ++i) {
      recorder.barrier();
      recorder.dispatch(add, on_a, args, count / 64);
      recorder.barrier();
      recorder.copy(a, 0, b, 0, 4 * count);
      recorder.barrier();
      recorder.dispatch(add, on_b, args, count / 64);
      recorder.barrier();
      recorder.copy(b, 0, a, 0, 4 * count);
    }
  });
  for (const std::uint32_t word : a.host_as<std::uint32_t>())
    ASSERT_EQ(word, 1000 + 2 * rounds);
}

/// Random ranges, offsets and order.
TEST_F(RecorderTest, ExecutesRandomCommandsLikeTheHost) {
  constexpr std::uint32_t count = 512;
  std::mt19937 random(7);
  const auto below = [&random](std::uint32_t limit) { return static_cast<std::uint32_t>(random() % limit); };
  Buffer buffers[2] = {make_words(count, 0), make_words(count, 0)};
  std::vector<std::uint32_t> model[2] = {std::vector<std::uint32_t>(count),
                                         std::vector<std::uint32_t>(count)};
  const Pipeline add = make_pipeline(TestShader::add);
  const Bindings bindings[2] = {make_bindings(add, {&buffers[0]}), make_bindings(add, {&buffers[1]})};
  run([&](Recorder& recorder) {
    for (int step = 0; step < 500; ++step) {
      const std::uint32_t to = below(2);
      const std::uint32_t size = below(count + 1);
      const std::uint32_t first = below(count - size + 1);
      const std::uint32_t other_first = below(count - size + 1);
      const std::uint32_t word = below(1u << 31);
      const auto target = model[to].begin() + first;
      switch (below(3)) {
        case 0:
          recorder.fill(buffers[to], 4 * first, 4 * size, word);
          std::fill_n(target, size, word);
          break;
        case 1:
          recorder.copy(buffers[1 - to], 4 * other_first, buffers[to], 4 * first, 4 * size);
          std::copy_n(model[1 - to].begin() + other_first, size, target);
          break;
        default:
          recorder.dispatch(add, bindings[to], shared::AddArgs{.first = first, .count = size, .amount = word},
                            (size + 63) / 64);
          std::for_each_n(target, size, [word](std::uint32_t& w) { w += word; });
      }
      recorder.barrier();
    }
  });
  for (int i = 0; i < 2; ++i)
    EXPECT_TRUE(std::ranges::equal(buffers[i].host_as<std::uint32_t>(), model[i]));
}

TEST_F(RecorderTest, DispatchesEachGroupOnce) {
  const Pipeline count_groups = make_pipeline(TestShader::count_groups);
  EXPECT_EQ(count_groups.group_size(), 32u);
  for (const std::uint32_t groups : {0u, 1u, 7u, 1000u, 65535u}) {
    Buffer counter = make_words(1, 0);
    const Bindings bindings = make_bindings(count_groups, {&counter});
    run([&](Recorder& recorder) { recorder.dispatch(count_groups, bindings, {}, groups); });
    EXPECT_EQ(counter.host_as<std::uint32_t>()[0], groups * 32);
  }
}

TEST_F(RecorderTest, DispatchesTheNumberOfGroupsThatAKernelWrites) {
  Buffer counter = make_words(1, 0);
  Buffer counts = make_buffer({.name = "counts", .size_bytes = 64, .indirect = true});
  const Pipeline write = make_pipeline(TestShader::write_groups);
  const Pipeline count_groups = make_pipeline(TestShader::count_groups);
  const Bindings to_counts = make_bindings(write, {&counts});
  const Bindings to_counter = make_bindings(count_groups, {&counter});
  run([&](Recorder& recorder) {
    recorder.dispatch(write, to_counts, shared::GroupsArgs{.offset_words = 1, .groups = 13}, 1);
    recorder.dispatch(write, to_counts, shared::GroupsArgs{.offset_words = 4, .groups = 0}, 1);
    recorder.barrier();
    recorder.dispatch_indirect(count_groups, to_counter, {}, counts, 4);
    recorder.dispatch_indirect(count_groups, to_counter, {}, counts, 16);
  });
  EXPECT_EQ(counter.host_as<std::uint32_t>()[0], 13u * 32);
}

TEST_F(RecorderTest, IsSubmittedRepeatedlyAndRecordedAgain) {
  Buffer words = make_words(64, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Bindings bindings = make_bindings(add, {&words});
  Recorder recorder = make_recorder();
  Timeline timeline = make_timeline();
  const auto record = [&](std::uint32_t amount) {
    recorder.begin();
    recorder.dispatch(add, bindings, shared::AddArgs{.first = 0, .count = 64, .amount = amount}, 1);
    recorder.end();
  };
  const auto submit = [&] {
    const std::uint64_t number = timeline.submit(recorder);
    ASSERT_EQ(timeline.wait(number, test_timeout_ns), WaitResult::done);
  };
  record(1);
  submit();
  submit();
  submit();
  EXPECT_EQ(words.host_as<std::uint32_t>()[0], 3u);
  record(10);
  submit();
  EXPECT_EQ(words.host_as<std::uint32_t>()[63], 13u);
}

TEST_F(RecorderTest, MeasuresWorkByTimestamps) {
  Buffer words = make_words(64, 1);
  const Pipeline busy = make_pipeline(TestShader::stay_busy);
  const Bindings bindings = make_bindings(busy, {&words});
  Recorder recorder = make_recorder();
  Timeline timeline = make_timeline();
  // The minimum of several rounds, since other processes may use the processor.
  std::int64_t min_of_first = INT64_MAX, min_of_last = INT64_MAX;
  for (int round = 0; round < 6; ++round) {  // the first one also compiles
    recorder.begin();
    for (std::uint32_t slot = 0; slot < Recorder::max_timestamps; ++slot) {
      recorder.timestamp(slot);
      recorder.dispatch(busy, bindings, shared::CountArgs{.count = 100 + slot * 3000}, 1);
      recorder.barrier();
    }
    recorder.end();
    const std::uint64_t number = timeline.submit(recorder);
    ASSERT_EQ(timeline.wait(number, test_timeout_ns), WaitResult::done);
    min_of_first = std::min(min_of_first, timeline.elapsed_ns(recorder, 0, 1));
    min_of_last = std::min(min_of_last, timeline.elapsed_ns(recorder, 14, 15));
  }
  std::int64_t sum = 0;
  for (std::uint32_t slot = 0; slot + 1 < Recorder::max_timestamps; ++slot) {
    const std::int64_t step = timeline.elapsed_ns(recorder, slot, slot + 1);
    EXPECT_GE(step, 0);
    EXPECT_EQ(timeline.elapsed_ns(recorder, slot + 1, slot), -step);
    sum += step;
  }
  const std::int64_t whole = timeline.elapsed_ns(recorder, 0, Recorder::max_timestamps - 1);
  EXPECT_NEAR(static_cast<double>(sum), static_cast<double>(whole), 16.0);  // rounding of each step
  EXPECT_GT(min_of_last, min_of_first);
}

TEST_F(RecorderDeathTest, AbortsOnWrongArguments) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  Buffer words = make_words(64, 0);
  const Pipeline add = make_pipeline(TestShader::add);
  const Pipeline read = make_pipeline(TestShader::read_texels);
  const Bindings bindings = make_bindings(add, {&words});
  Recorder recorder = make_recorder();
  const shared::AddArgs args{};
  EXPECT_DEATH(recorder.dispatch(add, bindings, args, 1), "the recorder is not recording");
  EXPECT_DEATH(recorder.end(), "the recorder is not recording");
  recorder.begin();
  EXPECT_DEATH(recorder.begin(), "is recording already");
  EXPECT_DEATH(recorder.dispatch(add, bindings, shared::CountArgs{}, 1),
               "the push constants are not of the size");
  EXPECT_DEATH(recorder.dispatch(add, bindings, {}, 1), "the push constants are not of the size");
  EXPECT_DEATH(recorder.dispatch(read, bindings, shared::CountArgs{}, 1), "the bindings are not of the form");
  EXPECT_DEATH(recorder.dispatch(add, bindings, args, device().limits().max_groups + 1), "above max_groups");
  EXPECT_DEATH(recorder.dispatch_indirect(add, bindings, args, words, 0), "not for indirect dispatches");
  recorder.end();
}

TEST_F(RecorderDeathTest, AbortsBeyondTheEndOfABuffer) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const Buffer small = make_words(4, 0);
  const Buffer large = make_words(64, 0);
  Recorder recorder = make_recorder();
  recorder.begin();
  EXPECT_DEATH(recorder.copy(large, 0, small, 4, 16), "beyond (the|its) end");
  EXPECT_DEATH(recorder.copy(small, 4, large, 0, 16), "beyond (the|its) end");
  EXPECT_DEATH(recorder.copy(large, ~std::size_t{0}, small, 0, 16), "beyond (the|its) end");
  EXPECT_DEATH(recorder.fill(small, 16, 4, 0), "beyond (the|its) end");
  EXPECT_DEATH(recorder.fill(small, 2, 4, 0), "not a multiple of 4");
  EXPECT_DEATH(recorder.timestamp(Recorder::max_timestamps), "not below max_timestamps");
  recorder.timestamp(3);
  EXPECT_DEATH(recorder.timestamp(3), "has a timestamp already");
  recorder.end();
}

}  // namespace
}  // namespace rtstdb::gpu::test
