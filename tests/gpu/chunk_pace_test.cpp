// Chunks of a run follow what the last ones took, whatever is done in its gaps. On the executor itself, so
// that every gap is filled.

#include "rtstdb/query/chunk_pace.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/query/ray/ray_query.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/gaps.hpp"
#include "tests/gpu/gpu_test.hpp"
#include "tests/gpu/prepare_on.hpp"

namespace rtstdb::test {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr Nanoseconds chunk_time{500'000};
constexpr std::uint32_t most = 65'536;

/// Twice, since two chunks are under way.
void learn_twice(query::ChunkPace& pace, const query::ChunkPace::Chunk& chunk) {
  for (int k = 0; k < 2; ++k)
    pace.learn(chunk);
}

TEST(ChunkPace, ChunksAreSmallerWhereTheyTakeLonger) {
  query::ChunkPace pace(500'000);
  EXPECT_EQ(pace.relative_size(), 1.0);
  pace.learn({500e3, 500e3});
  EXPECT_EQ(pace.relative_size(), 1.0);
  learn_twice(pace, {500e3, 20e6});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 1.0 / 32.0) << "halved until it takes at most 1.5 times its time";
  learn_twice(pace, {12.5e3, 500e3});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 1.0 / 40.0) << "as large as it should be";
  learn_twice(pace, {12.5e3, 12.5e3});
  EXPECT_GT(pace.relative_size(), 0.75) << "doubled as long as it takes at most 1.5 times its time";
  learn_twice(pace, {500e3, 1e3});
  EXPECT_LE(pace.relative_size(), 1.0) << "no larger than predicted";
}

TEST(ChunkPace, AChunkThatIsSeenLateIsNoLonger) {
  query::ChunkPace pace(500'000);
  for (int k = 0; k < 20; ++k) {
    pace.learn({500e3, k % 2 == 0 ? 900e3 : 100e3, k % 2 != 0});
    EXPECT_EQ(pace.relative_size(), k == 0 ? 0.5 : 1.0);
  }
}

/// Time in which the host was busy does not make chunks smaller, and lets small ones grow again.
TEST(ChunkPace, TimeOfTheHostIsNotTheChunks) {
  query::ChunkPace pace(500'000);
  for (int k = 0; k < 20; ++k) {
    pace.learn({500e3, 5e6, true});
    EXPECT_EQ(pace.relative_size(), 1.0);
  }
  learn_twice(pace, {500e3, 50e6});
  learn_twice(pace, {5e3, 500e3});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 0.01);
  for (int k = 0; k < 10; ++k) {
    pace.learn({500e3 * pace.relative_size(), 5e6, true});
    EXPECT_DOUBLE_EQ(pace.relative_size(), std::min(0.02 * std::pow(2.0, k), 1.0));
  }
}

/// Where the first may cost more than was thought: few until they are seen, and soon as many as elsewhere.
TEST(ChunkPace, ItMayBeginSmall) {
  query::ChunkPace pace(500'000);
  learn_twice(pace, {500e3, 500e3});
  pace.begin_with(1.0 / 256.0);
  EXPECT_EQ(pace.relative_size(), 1.0 / 256.0);
  for (int k = 0; k < 12; ++k)
    pace.learn({500e3 * pace.relative_size(), 80e3 + 500e3 * pace.relative_size()});
  EXPECT_GT(pace.relative_size(), 0.5);
  pace.begin_with(1.0 / 256.0);
  learn_twice(pace, {500e3 / 256.0, 5e6});
  EXPECT_LT(pace.relative_size(), 1.0 / 256.0) << "dearer still";
  const double relative_size = pace.relative_size();
  pace.begin_with(0.5);
  EXPECT_EQ(pace.relative_size(), relative_size) << "never larger for it";
}

/// What a chunk takes however few are in it; the device's own time for all of them is 100 chunks of those
/// that are thought to be one.
double share_of_dispatches(double dispatch_ns, double chunk_ns, double thought_too_much) {
  query::ChunkPace pace(static_cast<std::int64_t>(chunk_ns));
  pace.begin_with(0.5);
  double took_ns = 0.0, by_dispatches_ns = 0.0, longest_ns = 0.0;
  for (double left_ns = 100.0 * chunk_ns; left_ns > 0.0;) {
    const double own_ns = std::min(pace.relative_size() * chunk_ns / thought_too_much, left_ns);
    left_ns -= own_ns;
    by_dispatches_ns += dispatch_ns;
    took_ns += dispatch_ns + own_ns;
    longest_ns = std::max(longest_ns, dispatch_ns + own_ns);
    pace.learn({own_ns * thought_too_much, dispatch_ns + own_ns});
  }
  EXPECT_LT(longest_ns, std::max(4.0 * chunk_ns, 2.5e6)) << "and still nobody waits long";
  return by_dispatches_ns / took_ns;
}

/// Also where what such batches took was learnt with their dispatches, so that elements are thought to be
/// dearer than they are.
TEST(ChunkPace, ChunksAreNotMostlyDispatches) {
  for (const double chunk_ns : {200e3, 500e3, 5e6}) {
    for (const double dispatch_ns : {1e3, 80e3, 200e3, 400e3}) {
      for (const double thought_too_much : {1.0, 3.0, 30.0}) {
        EXPECT_LT(share_of_dispatches(dispatch_ns, chunk_ns, thought_too_much), 0.7)
            << chunk_ns << ' ' << dispatch_ns << ' ' << thought_too_much;
      }
    }
  }
}

class PacedRuns : public testing::Test {
 protected:
  void SetUp() override {
    auto created = query::GpuExecutor::create(
        [](const std::vector<std::byte>&) { return gpu::Device::open(gpu::test::shared_device_options()); },
        {});
    ASSERT_TRUE(created.ok()) << created.error().message;
    executor_ = std::move(created).value();
    const auto low = executor_->add_geometry(std::make_shared<TriangleMesh>(repeated_triangle(30)), {});
    const auto high = executor_->add_geometry(std::make_shared<TriangleMesh>(repeated_triangle(1'000)), {});
    ASSERT_TRUE(low.ok() && high.ok());
    states_ = {{.id = {0, 1}, .row = row_of(high.value(), {0.0, 0.0, 5.0}), .written_by = 1}};
    for (std::uint32_t i = 1; i < 300; ++i) {
      states_.push_back(
          {.id = {i, 1}, .row = row_of(low.value(), {1000.0 + 5.0 * i, 0.0, 0.0}), .written_by = 1});
    }
    large_ = prepare();
    small_ = prepare();
    for (int k = 0; k < 5; ++k)
      whole_ = std::min(whole_, ask(*large_, std::vector(most, cheap()), world(1), nullptr));
    per_chunk_ = static_cast<std::uint32_t>(chunk_time.count() * most / whole_.count());
  }
  void TearDown() override {
    for (const std::string& message : executor_->device_health().validation_messages)
      ADD_FAILURE() << "validation layer: " << message;
  }
  static Ray cheap() { return ray_from({}, {0, 1, 0}); }
  static Ray costly() { return ray_from({}, {0, 0, 1}); }
  OneWorld world(Version version) const { return {states_, version, 0, {}}; }

  std::unique_ptr<query::GpuRayQuery> prepare() {
    auto made = prepare_on<query::GpuRayQuery>(*executor_, RayQueryOptions{.name = "rays", .capacity = most});
    EXPECT_TRUE(made.ok());
    return std::move(made).value();
  }
  /// What it took.
  Nanoseconds ask(query::GpuRayQuery& query, std::span<const Ray> rays, const store::RowSource& rows,
                  query::ExecutorCallbacks* callbacks) {
    std::ranges::copy(rays, query.rays().begin());
    const auto count = static_cast<std::uint32_t>(rays.size());
    store::TimeSpan times;
    EXPECT_FALSE(query.check(count, rows, times));
    const query::Request request{
        .query = &query, .count = count, .per_chunk = per_chunk_, .chunk_time = chunk_time};
    const auto begun = SteadyClock::now();
    EXPECT_EQ(executor_->run(rows, std::span(&request, 1), times, callbacks).status, query::RunStatus::done);
    const auto took = SteadyClock::now() - begun;
    query.publish_answers(count, count);
    return std::chrono::duration_cast<Nanoseconds>(took);
  }

  std::vector<EntityState> states_;
  std::unique_ptr<query::GpuExecutor> executor_;
  std::unique_ptr<query::GpuRayQuery> large_, small_;
  Nanoseconds whole_ = Nanoseconds::max();
  std::uint32_t per_chunk_ = most;
};

/// Others commit there, for longer than a chunk takes.
TEST_F(PacedRuns, WorkOfTheHostInGapsIsNotTheChunks) {
  const auto gaps_where = [&](std::chrono::microseconds each_takes) {
    Gaps gaps([each_takes] {
      const auto until = SteadyClock::now() + each_takes;
      while (SteadyClock::now() < until) {
      }
    });
    ask(*large_, std::vector(most, cheap()), world(1), &gaps);
    return gaps.count;
  };
  const int as_thought = static_cast<int>(most / per_chunk_);
  EXPECT_LT(gaps_where(std::chrono::microseconds(1'000)), 4 * as_thought + 10);
  EXPECT_LT(gaps_where(std::chrono::microseconds(3'000)), 4 * as_thought + 10);
}

/// More versions than there are slots: the run's own is made anew after each gap.
TEST_F(PacedRuns, ChunksAreSmallerWhereOthersTakeTheSlotInEachGap) {
  std::vector<Ray> rays(most, costly());
  std::fill_n(rays.begin(), most / 3, cheap());
  std::vector<Nanoseconds> waits;
  Gaps gaps([&] {
    for (Version other = 10; other < 16; ++other) {
      const Nanoseconds took = ask(*small_, std::span(rays).first(8), world(other), nullptr);
      if (other == 10) waits.push_back(took);
    }
  });
  ask(*large_, rays, world(1), &gaps);
  std::ranges::sort(waits);
  ASSERT_GT(waits.size(), 20u);
  EXPECT_LT(waits[waits.size() / 2], std::chrono::milliseconds(5));
}

}  // namespace
}  // namespace rtstdb::test
