// Searches that go on through many dispatches while others ask, in each gap, for what would take their
// structures: another slot of the same version, other shapes of what deforms, another of few slots. On the
// executor itself, so that every gap is one of those.

#include <algorithm>
#include <functional>
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

constexpr std::uint32_t max_rays = 300;

class PausedInCompany : public testing::Test {
 protected:
  void SetUp() override { open({}); }
  void open(const DatabaseOptions& options) {
    queries_.clear();
    auto created = query::GpuExecutor::create(
        [](const std::vector<std::byte>&) { return gpu::Device::open(gpu::test::shared_device_options()); },
        options);
    ASSERT_TRUE(created.ok()) << created.error().message;
    executor_ = std::move(created).value();
    ball_ = make_sphere(1.0, 2);
    GeometryOptions deforming;
    deforming.deforms = true;
    const auto high = executor_->add_geometry(std::make_shared<TriangleMesh>(repeated_triangle(20'000)), {});
    const auto ball = executor_->add_geometry(std::make_shared<TriangleMesh>(ball_), deforming);
    ASSERT_TRUE(high.ok() && ball.ok());
    states_ = {{.id = {0, 1}, .row = row_of(high.value(), {0.0, 0.0, 5.0}), .written_by = 1},
               {.id = {1, 1}, .row = row_of(ball.value(), {0.0, 100.0, 0.0}), .written_by = 1}};
  }
  void TearDown() override {
    const Health health = executor_->device_health();
    for (const std::string& message : health.validation_messages)
      ADD_FAILURE() << "validation layer: " << message;
  }
  OneWorld world(Version shape) const { return {states_, 10 + shape, shape, ball_.positions_m}; }

  query::GpuRayQuery& prepare() {
    auto made =
        prepare_on<query::GpuRayQuery>(*executor_, RayQueryOptions{.name = "rays", .capacity = max_rays});
    EXPECT_TRUE(made.ok());
    queries_.push_back(std::move(made).value());
    return *queries_.back();
  }
  query::RunStatus ask(query::GpuRayQuery& query, std::span<const Ray> rays, const store::RowSource& rows,
                       query::ExecutorCallbacks* callbacks = nullptr) {
    std::ranges::copy(rays, query.rays().begin());
    const auto count = static_cast<std::uint32_t>(rays.size());
    store::TimeSpan times;
    EXPECT_FALSE(query.check(count, rows, times));
    const query::Request request{.query = &query, .count = count, .per_chunk = 64};
    const query::RunStatus status = executor_->run(rows, std::span(&request, 1), times, callbacks).status;
    query.publish_answers(count, count);
    return status;
  }
  /// One that pauses twenty times.
  static Ray through_the_pile(WorldTime t = {}) { return ray_from({}, {0, 0, 1}, t); }
  static Ray past_it(WorldTime t = {}) { return ray_from({}, {0, 0, -1}, t); }
  /// The gaps that the same search has where nothing happens in them.
  int gaps_alone(query::GpuRayQuery& query, std::span<const Ray> rays, const store::RowSource& rows) {
    Gaps gaps([] {});
    EXPECT_EQ(ask(query, rays, rows, &gaps), query::RunStatus::done);
    EXPECT_GT(gaps.count, 20);
    return gaps.count;
  }
  void expect_hits(const query::GpuRayQuery& query, std::size_t count) {
    const auto hits = query.hits().first(count);
    EXPECT_EQ(std::ranges::count(hits, HitStatus::hit, &RayHit::status), static_cast<std::ptrdiff_t>(count));
    EXPECT_TRUE(std::ranges::all_of(hits, [](const RayHit& hit) { return hit.lambda == 5.0f; }));
  }

  TriangleMesh ball_;
  std::vector<EntityState> states_;
  std::unique_ptr<query::GpuExecutor> executor_;
  std::vector<std::unique_ptr<query::GpuRayQuery>> queries_;
};

TEST_F(PausedInCompany, SlotsOfTheSameVersionStandBeforeTheirs) {
  query::GpuRayQuery& small = prepare();
  query::GpuRayQuery& large = prepare();
  const OneWorld rows = world(0);
  const auto touch = [&](double first_s, double last_s) {
    ask(small, std::vector{past_it(at_s(first_s)), past_it(at_s(last_s))}, rows);
  };
  for (const double t_s : {10.0, 20.0, 30.0})
    touch(t_s, t_s);
  const std::vector<Ray> rays(40, through_the_pile(at_s(40.0)));
  const int alone = gaps_alone(large, rays, rows);
  for (const double t_s : {30.0, 20.0, 10.0})
    touch(t_s, t_s);
  double longer_s = 0.1;
  int gap = 0;
  Gaps gaps([&] {
    // Before the searches begin it would be theirs.
    if (++gap > 5) touch(40.0, 40.0 + (longer_s = longer_s < 0.9 ? longer_s + 0.01 : 0.1));
  });
  EXPECT_EQ(ask(large, rays, rows, &gaps), query::RunStatus::done);
  expect_hits(large, rays.size());
  EXPECT_EQ(gaps.count, alone) << "searches began again";
}

TEST_F(PausedInCompany, OthersAskForOtherShapes) {
  query::GpuRayQuery& small = prepare();
  query::GpuRayQuery& large = prepare();
  const std::vector<Ray> rays(40, through_the_pile());
  const int alone = gaps_alone(large, rays, world(3));
  Gaps gaps([&] {
    for (const Version shape : {1, 2})
      ask(small, std::vector{past_it()}, world(shape));
  });
  EXPECT_EQ(ask(large, rays, world(3), &gaps), query::RunStatus::done);
  expect_hits(large, rays.size());
  EXPECT_EQ(gaps.count, alone) << "searches began again";
}

/// A large world has two slots.
TEST_F(PausedInCompany, OthersAskAtOtherTimesOfALargeWorld) {
  open({.max_entities = (1u << 17) + 1});
  query::GpuRayQuery& small = prepare();
  query::GpuRayQuery& large = prepare();
  const std::vector<Ray> rays(40, through_the_pile());
  const int alone = gaps_alone(large, rays, world(0));
  Gaps gaps([&] {
    for (const double t_s : {10.0, 20.0})
      ask(small, std::vector{past_it(at_s(t_s))}, world(0));
  });
  EXPECT_EQ(ask(large, rays, world(0), &gaps), query::RunStatus::done);
  expect_hits(large, rays.size());
  EXPECT_EQ(gaps.count, alone) << "searches began again";
}

/// In a gap of another such search, which has the one place that can be kept: then the inner one's shape
/// goes, whenever somebody asks for a third.
class Thefts : public PausedInCompany {
 protected:
  struct Seen {
    query::RunStatus status = query::RunStatus::done;
    std::size_t hits = 0, incomplete = 0;
  };
  /// The inner search, of so many rays, is robbed in those of its gaps.
  Seen rob(std::size_t ray_count, const std::function<bool(int gap)>& robs) {
    query::GpuRayQuery& outer = prepare();
    query::GpuRayQuery& inner = prepare();
    query::GpuRayQuery& small = prepare();
    const std::vector<Ray> outer_rays(40, through_the_pile());
    const std::vector<Ray> inner_rays(ray_count, through_the_pile());
    Seen seen;
    bool ran = false;
    Gaps gaps([&] {
      // Within the passes that ask again.
      if (gaps_before_ != 5 || ran) {
        ++gaps_before_;
        return;
      }
      ran = true;
      Gaps thefts([&] {
        if (robs(theft_gap_++)) ask(small, std::vector{past_it()}, world(3));
      });
      seen.status = ask(inner, inner_rays, world(2), &thefts);
      const auto hits = inner.hits().first(ray_count);
      seen.hits = static_cast<std::size_t>(std::ranges::count(hits, HitStatus::hit, &RayHit::status));
      seen.incomplete =
          static_cast<std::size_t>(std::ranges::count(hits, HitStatus::incomplete, &RayHit::status));
    });
    EXPECT_EQ(ask(outer, outer_rays, world(1), &gaps), query::RunStatus::done);
    EXPECT_TRUE(ran);
    expect_hits(outer, outer_rays.size());
    return seen;
  }
  int gaps_before_ = 0, theft_gap_ = 0;
};

TEST_F(Thefts, WithoutEndLeaveSearchesIncompleteAndSaySo) {
  const Seen seen = rob(40, [](int) { return true; });
  EXPECT_EQ(seen.status, query::RunStatus::truncated);
  EXPECT_EQ(seen.incomplete, 40u);
}

/// More rays than are asked again at a time: thefts in some passes of the first, and in as many of the
/// others, are no reason to give up any.
TEST_F(Thefts, NowAndThenAreMadeUpFor) {
  constexpr int passes = 24,
                robbed = 11;  // each that is not robbed makes a thousand of 20,000 rounds, and some more
  const int at_a_time = static_cast<int>(std::max(prepare().min_retry_batch(), 8u));
  const auto gaps_of_a_pass = [&](int rays) { return (rays + at_a_time - 1) / at_a_time; };
  const int of_the_first = gaps_of_a_pass(256), of_the_others = gaps_of_a_pass(max_rays - 256);
  const int behind_the_first = 4 + of_the_first * (robbed + passes + 2);
  int thefts_from_others = 0;
  const Seen seen = rob(max_rays, [&](int gap) {
    const int of_others = gap - behind_the_first - of_the_others;
    const bool from_others = of_others >= 0 && of_others < robbed * of_the_others;
    thefts_from_others += from_others ? 1 : 0;
    return from_others || (gap >= 4 + of_the_first && gap < 4 + of_the_first * (robbed + 1));
  });
  EXPECT_EQ(seen.status, query::RunStatus::done);
  EXPECT_EQ(seen.hits, max_rays);
  EXPECT_EQ(thefts_from_others, robbed * of_the_others);
}

}  // namespace
}  // namespace rtstdb::test
