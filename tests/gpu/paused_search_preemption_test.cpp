// Searches that pause and resume over many dispatches, while nested runs at each preemption point need the
// structures that the searches use: another slot of the same version, other shapes of deforming geometry, the
// few slots of a large world.

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/executor_fixture.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t max_rays = 300;

class PausedSearches : public ExecutorTest {
 protected:
  void SetUp() override { open({}); }
  void open(const DatabaseOptions& options) {
    queries_.clear();
    ExecutorTest::open(options);
    ball_ = make_sphere(1.0, 2);
    const GeometryId dense = add(repeated_triangle(20'000)), ball = add(ball_, {.deforms = true});
    states_ = {{.id = {0, 1}, .row = row_of(dense, {0.0, 0.0, 5.0}), .written_by = 1},
               {.id = {1, 1}, .row = row_of(ball, {0.0, 100.0, 0.0}), .written_by = 1}};
  }
  FixedRows world(Version shape) const { return FixedRows(states_, 10 + shape, shape, ball_.positions_m); }
  query::GpuRayQuery& prepare() { return *queries_.emplace_back(prepare_rays(max_rays)); }
  query::RunStatus run(query::GpuRayQuery& query, std::span<const Ray> rays, const store::RowSource& rows,
                       query::ExecutorCallbacks* callbacks = nullptr) {
    return run_rays(query, rays, rows, {.per_chunk = 64}, callbacks);
  }
  /// Pauses twenty times.
  static Ray long_ray(WorldTime t = {}) { return ray_from({}, {0, 0, 1}, t); }
  static Ray short_ray(WorldTime t = {}) { return ray_from({}, {0, 0, -1}, t); }
  void expect_hits(const query::GpuRayQuery& query, std::size_t count) {
    const auto hits = query.hits().first(count);
    EXPECT_EQ(std::ranges::count(hits, HitStatus::hit, &RayHit::status), static_cast<std::ptrdiff_t>(count));
    EXPECT_TRUE(std::ranges::all_of(hits, [](const RayHit& hit) { return hit.lambda == 5.0f; }));
  }
  /// Expects as many preemption points with `nested` at each as without: no search begins again.
  void expect_no_restart(
      const store::RowSource& rows, WorldTime t, const std::function<void(int point)>& nested,
      const std::function<void()>& between = [] {}) {
    query::GpuRayQuery& query = prepare();
    const std::vector<Ray> rays(40, long_ray(t));
    PreemptionPoints alone;
    EXPECT_EQ(run(query, rays, rows, &alone), query::RunStatus::done);
    EXPECT_GT(alone.count, 20);
    between();
    int point = 0;
    PreemptionPoints points([&] { nested(++point); });
    EXPECT_EQ(run(query, rays, rows, &points), query::RunStatus::done);
    expect_hits(query, rays.size());
    EXPECT_EQ(points.count, alone.count);
  }

  TriangleMesh ball_;
  std::vector<EntityState> states_;
  std::vector<std::unique_ptr<query::GpuRayQuery>> queries_;
};

TEST_F(PausedSearches, KeepTheirSlotWhileNestedRunsUseOthersOfTheVersion) {
  query::GpuRayQuery& small = prepare();
  const FixedRows rows = world(0);
  const auto use_slot = [&](double first_s, double last_s) {
    run(small, std::vector{short_ray(at_s(first_s)), short_ray(at_s(last_s))}, rows);
  };
  for (const double t_s : {10.0, 20.0, 30.0})
    use_slot(t_s, t_s);
  double longer_s = 0.1;
  expect_no_restart(
      rows, at_s(40.0),
      [&](int point) {
        // Before the searches begin, it would be their slot.
        if (point > 5) use_slot(40.0, 40.0 + (longer_s = longer_s < 0.9 ? longer_s + 0.01 : 0.1));
      },
      [&] {
        for (const double t_s : {30.0, 20.0, 10.0})
          use_slot(t_s, t_s);
      });
}

TEST_F(PausedSearches, KeepTheirShapesWhileNestedRunsUseOthers) {
  query::GpuRayQuery& small = prepare();
  expect_no_restart(world(3), {}, [&](int) {
    for (const Version shape : {1, 2})
      run(small, std::vector{short_ray()}, world(shape));
  });
}

/// A large world has two slots.
TEST_F(PausedSearches, KeepTheirSlotOfALargeWorld) {
  open({.max_entities = (1u << 17) + 1});
  query::GpuRayQuery& small = prepare();
  expect_no_restart(world(0), {}, [&](int) {
    for (const double t_s : {10.0, 20.0})
      run(small, std::vector{short_ray(at_s(t_s))}, world(0));
  });
}

/// A paused search inside the preemption point of another one, which holds the one place of a shape that can
/// be kept: a nested run with a third shape replaces the shape of the inner search, which has to begin again.
class RestartedSearches : public PausedSearches {
 protected:
  struct InnerResult {
    query::RunStatus status = query::RunStatus::done;
    std::size_t hits = 0, incomplete = 0;
  };
  /// Replaces the shape of the inner search at its preemption points for which `replaces` returns true.
  InnerResult run_inner(std::size_t ray_count, const std::function<bool(int point)>& replaces) {
    query::GpuRayQuery& outer = prepare();
    query::GpuRayQuery& inner = prepare();
    query::GpuRayQuery& small = prepare();
    const std::vector<Ray> outer_rays(40, long_ray());
    const std::vector<Ray> inner_rays(ray_count, long_ray());
    InnerResult result;
    bool ran = false;
    PreemptionPoints points([&] {
      // Within the retry passes.
      if (outer_points_ != 5 || ran) {
        ++outer_points_;
        return;
      }
      ran = true;
      PreemptionPoints inner_points([&] {
        if (replaces(inner_point_++)) run(small, std::vector{short_ray()}, world(3));
      });
      result.status = run(inner, inner_rays, world(2), &inner_points);
      const auto hits = inner.hits().first(ray_count);
      result.hits = static_cast<std::size_t>(std::ranges::count(hits, HitStatus::hit, &RayHit::status));
      result.incomplete =
          static_cast<std::size_t>(std::ranges::count(hits, HitStatus::incomplete, &RayHit::status));
    });
    EXPECT_EQ(run(outer, outer_rays, world(1), &points), query::RunStatus::done);
    EXPECT_TRUE(ran);
    expect_hits(outer, outer_rays.size());
    return result;
  }
  int outer_points_ = 0, inner_point_ = 0;
};

TEST_F(RestartedSearches, AreIncompleteIfTheyRestartAtEachPoint) {
  const InnerResult result = run_inner(40, [](int) { return true; });
  EXPECT_EQ(result.status, query::RunStatus::truncated);
  EXPECT_EQ(result.incomplete, 40u);
}

/// More rays than one window of retries holds, with restarts in some passes of the first and of the second
/// window.
TEST_F(RestartedSearches, AreCompleteAfterSomeRestarts) {
  constexpr int passes = 24,
                restarted = 11;  // each other pass makes a thousand of 20,000 rounds
  const int per_pass = static_cast<int>(std::max(prepare().min_retry_batch(), 8u));
  const auto points_of_a_pass = [&](int rays) { return (rays + per_pass - 1) / per_pass; };
  const int in_first_window = points_of_a_pass(256), in_second_window = points_of_a_pass(max_rays - 256);
  const int end_of_first_window = 4 + in_first_window * (restarted + passes + 2);
  int restarts_in_second_window = 0;
  const InnerResult result = run_inner(max_rays, [&](int point) {
    const int offset = point - end_of_first_window - in_second_window;
    const bool in_second = offset >= 0 && offset < restarted * in_second_window;
    restarts_in_second_window += in_second ? 1 : 0;
    return in_second || (point >= 4 + in_first_window && point < 4 + in_first_window * (restarted + 1));
  });
  EXPECT_EQ(result.status, query::RunStatus::done);
  EXPECT_EQ(result.hits, max_rays);
  EXPECT_EQ(restarts_in_second_window, restarted * in_second_window);
}

}  // namespace
}  // namespace rtstdb::test
