// The size of chunks follows the time that the last ones took, whatever happens at preemption points.

#include "rtstdb/query/chunk_pace.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/executor_fixture.hpp"

namespace rtstdb::test {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr Nanoseconds chunk_time{500'000};
constexpr std::uint32_t max_rays = 65'536;

/// Twice, since two chunks are in flight.
void update_twice(query::ChunkPace& pace, const query::ChunkPace::Chunk& chunk) {
  for (int k = 0; k < 2; ++k)
    pace.update(chunk);
}

TEST(ChunkPace, MakesChunksSmallerThatTakeLonger) {
  query::ChunkPace pace(500'000);
  EXPECT_EQ(pace.relative_size(), 1.0);
  pace.update({500e3, 500e3});
  EXPECT_EQ(pace.relative_size(), 1.0);
  update_twice(pace, {500e3, 20e6});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 1.0 / 32.0) << "halved until it takes at most 1.5 times its time";
  update_twice(pace, {12.5e3, 500e3});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 1.0 / 40.0) << "as large as it should be";
  update_twice(pace, {12.5e3, 12.5e3});
  EXPECT_GT(pace.relative_size(), 0.75) << "doubled as long as it takes at most 1.5 times its time";
  update_twice(pace, {500e3, 1e3});
  EXPECT_LE(pace.relative_size(), 1.0) << "no larger than predicted";
}

TEST(ChunkPace, IgnoresTheTimeOfAChunkThatIsNoticedLate) {
  query::ChunkPace pace(500'000);
  for (int k = 0; k < 20; ++k) {
    pace.update({500e3, k % 2 == 0 ? 900e3 : 100e3, k % 2 != 0});
    EXPECT_EQ(pace.relative_size(), k == 0 ? 0.5 : 1.0);
  }
}

/// A chunk that completes while the host is busy does not make chunks smaller, and lets small ones grow
/// again.
TEST(ChunkPace, IgnoresTheTimeOfTheHost) {
  query::ChunkPace pace(500'000);
  for (int k = 0; k < 20; ++k) {
    pace.update({500e3, 5e6, true});
    EXPECT_EQ(pace.relative_size(), 1.0);
  }
  update_twice(pace, {500e3, 50e6});
  update_twice(pace, {5e3, 500e3});
  EXPECT_DOUBLE_EQ(pace.relative_size(), 0.01);
  for (int k = 0; k < 10; ++k) {
    pace.update({500e3 * pace.relative_size(), 5e6, true});
    EXPECT_DOUBLE_EQ(pace.relative_size(), std::min(0.02 * std::pow(2.0, k), 1.0));
  }
}

/// The first chunk is small if its elements may cost more than predicted; the next ones grow soon.
TEST(ChunkPace, MayBeginSmall) {
  query::ChunkPace pace(500'000);
  update_twice(pace, {500e3, 500e3});
  pace.begin_with(1.0 / 256.0);
  EXPECT_EQ(pace.relative_size(), 1.0 / 256.0);
  for (int k = 0; k < 12; ++k)
    pace.update({500e3 * pace.relative_size(), 80e3 + 500e3 * pace.relative_size()});
  EXPECT_GT(pace.relative_size(), 0.5);
  pace.begin_with(1.0 / 256.0);
  update_twice(pace, {500e3 / 256.0, 5e6});
  EXPECT_LT(pace.relative_size(), 1.0 / 256.0) << "more expensive than that";
  const double relative_size = pace.relative_size();
  pace.begin_with(0.5);
  EXPECT_EQ(pace.relative_size(), relative_size) << "begin_with never makes chunks larger";
}

/// The fraction of the time that dispatches take, each of `dispatch_ns`, for elements that take 100 chunks.
/// Predictions are too high by the factor `overestimate`.
double fraction_of_dispatches(double dispatch_ns, double chunk_ns, double overestimate) {
  query::ChunkPace pace(static_cast<std::int64_t>(chunk_ns));
  pace.begin_with(0.5);
  double total_ns = 0.0, dispatches_ns = 0.0, longest_ns = 0.0;
  for (double remaining_ns = 100.0 * chunk_ns; remaining_ns > 0.0;) {
    const double elements_ns = std::min(pace.relative_size() * chunk_ns / overestimate, remaining_ns);
    remaining_ns -= elements_ns;
    dispatches_ns += dispatch_ns;
    total_ns += dispatch_ns + elements_ns;
    longest_ns = std::max(longest_ns, dispatch_ns + elements_ns);
    pace.update({elements_ns * overestimate, dispatch_ns + elements_ns});
  }
  EXPECT_LT(longest_ns, std::max(4.0 * chunk_ns, 2.5e6)) << "a chunk is much longer than its time";
  return dispatches_ns / total_ns;
}

/// Also if predictions include the time of dispatches and are too high.
TEST(ChunkPace, SpendsTheTimeOfChunksOnElements) {
  for (const double chunk_ns : {200e3, 500e3, 5e6}) {
    for (const double dispatch_ns : {1e3, 80e3, 200e3, 400e3}) {
      for (const double overestimate : {1.0, 3.0, 30.0}) {
        EXPECT_LT(fraction_of_dispatches(dispatch_ns, chunk_ns, overestimate), 0.7)
            << chunk_ns << ' ' << dispatch_ns << ' ' << overestimate;
      }
    }
  }
}

class PacedRuns : public ExecutorTest {
 protected:
  void SetUp() override {
    ExecutorTest::SetUp();
    const GeometryId cheap_mesh = add(repeated_triangle(30)), expensive_mesh = add(repeated_triangle(1'000));
    states_ = {{.id = {0, 1}, .row = row_of(expensive_mesh, {0.0, 0.0, 5.0}), .written_by = 1}};
    for (std::uint32_t i = 1; i < 300; ++i) {
      states_.push_back(
          {.id = {i, 1}, .row = row_of(cheap_mesh, {1000.0 + 5.0 * i, 0.0, 0.0}), .written_by = 1});
    }
    large_ = prepare_rays(max_rays);
    small_ = prepare_rays(max_rays);
    Nanoseconds batch_time = Nanoseconds::max();
    for (int k = 0; k < 5; ++k)
      batch_time = std::min(batch_time, time_of(*large_, std::vector(max_rays, cheap()), 1, nullptr));
    per_chunk_ = static_cast<std::uint32_t>(chunk_time.count() * max_rays / batch_time.count());
  }
  static Ray cheap() { return ray_from({}, {0, 1, 0}); }
  static Ray expensive() { return ray_from({}, {0, 0, 1}); }
  Nanoseconds time_of(query::GpuRayQuery& query, std::span<const Ray> rays, Version version,
                      query::ExecutorCallbacks* callbacks) {
    const auto begin = SteadyClock::now();
    EXPECT_EQ(run_rays(query, rays, FixedRows(states_, version),
                       {.per_chunk = per_chunk_, .chunk_time = chunk_time}, callbacks),
              query::RunStatus::done);
    return SteadyClock::now() - begin;
  }

  std::vector<EntityState> states_;
  std::unique_ptr<query::GpuRayQuery> large_, small_;
  std::uint32_t per_chunk_ = max_rays;
};

/// A commit at a preemption point may take longer than a chunk.
TEST_F(PacedRuns, DoNotGetSmallerChunksForWorkOfTheHost) {
  const auto points_with = [&](std::chrono::microseconds work) {
    PreemptionPoints points([work] {
      const auto end = SteadyClock::now() + work;
      while (SteadyClock::now() < end) {
      }
    });
    time_of(*large_, std::vector(max_rays, cheap()), 1, &points);
    return points.count;
  };
  const int predicted = static_cast<int>(max_rays / per_chunk_);
  EXPECT_LT(points_with(std::chrono::microseconds(1'000)), 4 * predicted + 10);
  EXPECT_LT(points_with(std::chrono::microseconds(3'000)), 4 * predicted + 10);
}

/// Nested runs read more versions than there are slots, so that the run updates its slot after each
/// preemption point. Real time is the subject: the time that a nested run takes.
TEST_F(PacedRuns, GetSmallerChunksIfEachNeedsANewSlot) {
  std::vector<Ray> rays(max_rays, expensive());
  std::fill_n(rays.begin(), max_rays / 3, cheap());
  std::vector<Nanoseconds> nested_times;
  PreemptionPoints points([&] {
    for (Version other = 10; other < 16; ++other) {
      const Nanoseconds time = time_of(*small_, std::span(rays).first(8), other, nullptr);
      if (other == 10) nested_times.push_back(time);
    }
  });
  time_of(*large_, rays, 1, &points);
  std::ranges::sort(nested_times);
  ASSERT_GT(nested_times.size(), 20u);
  EXPECT_LT(nested_times[nested_times.size() / 2], std::chrono::milliseconds(5));
}

}  // namespace
}  // namespace rtstdb::test
