// Bad input is refused with its place and values; the transaction has no other effect.

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr double nan_d = std::numeric_limits<double>::quiet_NaN();
constexpr float infinity_f = std::numeric_limits<float>::infinity();

class Refusals : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    box_ = add(make_box({2.0, 2.0, 2.0}));
    body_ = create(row_of(box_, {11.0, 0.0, 0.0}), at_s(10.0));
    rays_ = prepare_rays(RayMode::closest, false, 8);
    regions_ = prepare(RegionQueryOptions{.name = "r", .capacity = 8, .ids_per_region = 8});
    nearest_ = prepare(NearestQueryOptions{.name = "n", .capacity = 8, .k = 4});
    overlaps_ = prepare(OverlapQueryOptions{.name = "o", .capacity = 8, .ids_per_entity = 8});
  }
  void destroy_queries() {
    rays_.reset();
    regions_.reset();
    nearest_.reset();
    overlaps_.reset();
  }
  void TearDown() override {
    expect_no_effect();
    destroy_queries();
    DatabaseTest::TearDown();
  }
  void expect_no_effect() {
    EXPECT_EQ(database().latest().version, 1u);
    const RayHit hit = trace(good_ray());
    EXPECT_EQ(hit.entity, body_);
    EXPECT_EQ(hit.lambda, 10.0f);
  }
  Ray good_ray() const { return ray_from({}, {1, 0, 0}, at_s(10.0)); }

  /// Runs the query as the second one of a transaction that also writes.
  template <class Query>
  void expect_query_refused(Query& query, BadInputReason reason, const std::vector<double>& values) {
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          transaction.update(body_, row_of(box_, {500.0, 0.0, 0.0}));
          transaction.add_query(*overlaps_, 0);
          transaction.add_query(query, 3);
        },
        at_s(10.0));
    EXPECT_EQ(outcome.status, Status::bad_input);
    EXPECT_EQ(outcome.bad_input.reason, reason) << describe(outcome);
    EXPECT_EQ(outcome.bad_query, 1);
    EXPECT_EQ(outcome.bad_input.element, reason == BadInputReason::window_too_long ? 0u : 2u);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isnan(values[i])) {
        EXPECT_TRUE(std::isnan(outcome.bad_input.values[i])) << i;
      } else {
        EXPECT_DOUBLE_EQ(outcome.bad_input.values[i], values[i]) << i;
      }
    }
    expect_no_effect();
  }
  /// Spoils the third element.
  template <class Query, class Element>
  void expect_element_refused(Query& query, std::span<Element> elements, const Element& good,
                              const std::function<void(Element&)>& spoil, BadInputReason reason,
                              const std::vector<double>& values) {
    std::ranges::fill(elements, good);
    spoil(elements[2]);
    expect_query_refused(query, reason, values);
  }
  void expect_ray_refused(const std::function<void(Ray&)>& spoil, BadInputReason reason,
                          const std::vector<double>& values = {}) {
    expect_element_refused(*rays_, rays_->rays(), good_ray(), spoil, reason, values);
  }
  void expect_region_refused(const std::function<void(Region&)>& spoil, BadInputReason reason,
                             const std::vector<double>& values = {}) {
    expect_element_refused(*regions_, regions_->regions(), Region{.t = at_s(10.0)}, spoil, reason, values);
  }
  void expect_point_refused(const std::function<void(Nearest&)>& spoil, BadInputReason reason,
                            const std::vector<double>& values = {}) {
    expect_element_refused(*nearest_, nearest_->points(), Nearest{.t = at_s(10.0)}, spoil, reason, values);
  }

  GeometryId box_;
  EntityId body_;
  std::unique_ptr<RayQuery> rays_;
  std::unique_ptr<RegionQuery> regions_;
  std::unique_ptr<NearestQuery> nearest_;
  std::unique_ptr<OverlapQuery> overlaps_;
};

TEST_F(Refusals, OfRays) {
  using enum BadInputReason;
  expect_ray_refused([](Ray& ray) { ray.origin_m.y = nan_f; }, not_finite, {0.0, nan_d, 0.0});
  expect_ray_refused([](Ray& ray) { ray.origin_m.z = infinity_f; }, not_finite);
  expect_ray_refused([](Ray& ray) { ray.origin_m.x = 2e5f; }, out_of_limits, {2e5, 0.0, 0.0});
  expect_ray_refused([](Ray& ray) { ray.direction = {1.0f, nan_f, 2.0f}; }, not_finite, {1.0, nan_d, 2.0});
  expect_ray_refused([](Ray& ray) { ray.direction.z = -infinity_f; }, not_finite);
  expect_ray_refused([](Ray& ray) { ray.direction = {}; }, bad_ray, {0.0, 0.0, 0.0});
  expect_ray_refused([](Ray& ray) { ray.direction = {0.0f, 1e-20f, 0.0f}; }, bad_ray);
  expect_ray_refused([](Ray& ray) { ray.direction = {0.0f, 1e20f, 0.0f}; }, bad_ray);
  expect_ray_refused([](Ray& ray) { ray.lambda_min = -1.0f; }, bad_lambda_range, {-1.0});
  expect_ray_refused([](Ray& ray) { ray.lambda_min = nan_f; }, bad_lambda_range, {nan_d});
  expect_ray_refused([](Ray& ray) { ray.lambda_max = nan_f; }, bad_lambda_range);
  expect_ray_refused([](Ray& ray) { ray.lambda_min = ray.lambda_max = infinity_f; }, bad_lambda_range);
  expect_ray_refused(
      [](Ray& ray) {
        ray.lambda_min = 2.0f;
        ray.lambda_max = 1.0f;
      },
      bad_lambda_range, {2.0, 1.0});
}

TEST_F(Refusals, OfTimesThatTheVersionDoesNotCover) {
  using enum BadInputReason;
  expect_ray_refused([](Ray& ray) { ray.t = at_s(10.0) - Nanoseconds(1); }, time_not_covered,
                     {9.999999999, 10.0});
  expect_ray_refused([](Ray& ray) { ray.t = WorldTime::min(); }, time_not_covered);
  expect_ray_refused([](Ray& ray) { ray.t = WorldTime::max(); }, time_not_covered);
  expect_region_refused([](Region& region) { region.t = at_s(9.0); }, time_not_covered, {9.0, 10.0});
  expect_ray_refused([](Ray& ray) { ray.t = at_s(11.0) + Nanoseconds(1); }, window_too_long,
                     {10.0, 11.000000001, 1.0});
  expect_ray_refused([](Ray& ray) { ray.t = world_time_ns(max_world_time_ns); }, window_too_long);
}

TEST_F(Refusals, AcceptTheLatestTime) {
  Ray ray = good_ray();
  ray.t = world_time_ns(max_world_time_ns);
  EXPECT_EQ(trace(ray).lambda, 10.0f);
}

/// Several threads check so many rays.
TEST_F(Refusals, NameTheFirstBadOneOfManyRays) {
  constexpr std::uint32_t count = 100'000;
  const auto many = prepare_rays(RayMode::closest, false, count);
  const auto rays = many->rays();
  std::ranges::fill(rays, good_ray());
  rays[99'999].origin_m.x = 2e5f;
  EXPECT_EQ(run(*many, count).bad_input.element, 99'999u);
  rays[70'001].origin_m.y = 3e5f;
  EXPECT_EQ(run(*many, count).bad_input.element, 70'001u);
  rays[12'346].origin_m.y = nan_f;
  rays[12'345].t = at_s(9.5);
  for (int k = 0; k < 20; ++k) {
    const Outcome outcome = run(*many, count);
    ASSERT_EQ(outcome.status, Status::bad_input);
    EXPECT_EQ(outcome.bad_input.reason, BadInputReason::time_not_covered);
    EXPECT_EQ(outcome.bad_input.element, 12'345u);
  }
  rays[0].carrier = {.index = 700, .generation = 1};
  const Outcome outcome = run(*many, count);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::unknown_entity);
  EXPECT_EQ(outcome.bad_input.element, 0u);
}

/// A carrier or another time of one ray counts, whichever thread checks it.
TEST_F(Refusals, SeeTheCarrierAndTimeOfOneOfManyRays) {
  constexpr std::uint32_t count = 100'000;
  const auto many = prepare_rays(RayMode::closest, false, count);
  for (const std::uint32_t i : {0u, 50'000u, 99'999u}) {
    std::vector<Ray> rays(count, good_ray());
    rays[i].origin_m = {-11.0f, 0.0f, 0.0f};
    rays[i].carrier = body_;
    rays[i].direction = {-1.0f, 0.0f, 0.0f};
    auto hits = trace(*many, rays);
    EXPECT_EQ(hits[i].status, HitStatus::miss)
        << "in the carrier's frame it begins at the world's origin and leads away";
    EXPECT_EQ(std::ranges::count(hits, 10.0f, &RayHit::lambda), count - 1);
    rays[i] = good_ray();
    rays[i].t = at_s(11.5);
    std::ranges::copy(rays, many->rays().begin());
    const Outcome outcome = run(*many, count);
    EXPECT_EQ(outcome.bad_input.reason, BadInputReason::window_too_long);
    EXPECT_DOUBLE_EQ(outcome.bad_input.values[1], 11.5);
  }
}

TEST_F(Refusals, OfEntitiesThatDoNotExist) {
  using enum BadInputReason;
  const EntityId unknown_ids[] = {{body_.index, body_.generation + 1}, {77, 1}, {4'000'000'000u, 1}};
  for (const EntityId unknown : unknown_ids) {
    expect_ray_refused([&](Ray& ray) { ray.carrier = unknown; }, unknown_entity);
    expect_region_refused([&](Region& region) { region.carrier = unknown; }, unknown_entity);
    expect_point_refused([&](Nearest& point) { point.carrier = unknown; }, unknown_entity);
    expect_point_refused([&](Nearest& point) { point.excluded = unknown; }, unknown_entity);
    for (Overlap& overlap : overlaps_->overlaps())
      overlap = {.entity = body_, .t = at_s(10.0)};
    overlaps_->overlaps()[1].entity = unknown;
    const Outcome outcome = run(*overlaps_, 2);
    EXPECT_EQ(outcome.bad_input.reason, unknown_entity);
    EXPECT_EQ(outcome.bad_input.entity, unknown);
    EXPECT_EQ(outcome.bad_input.element, 1u);
  }
}

TEST_F(Refusals, OfRegions) {
  using enum BadInputReason;
  expect_region_refused([](Region& region) { region.shape = static_cast<RegionShape>(7); },
                        unknown_region_kind, {7.0, 0.0});
  expect_region_refused([](Region& region) { region.test = static_cast<RegionTest>(2); }, unknown_region_kind,
                        {0.0, 2.0});
  expect_region_refused([](Region& region) { region.center_m.x = nan_f; }, not_finite, {nan_d, 0.0, 0.0});
  expect_region_refused([](Region& region) { region.center_m.x = -1e6f; }, out_of_limits, {-1e6});
  expect_region_refused(
      [](Region& region) {
        region.half_extent_m = {1.0f, -1.0f, 2.0f};
      },
      bad_region, {1.0, -1.0, 2.0});
  expect_region_refused([](Region& region) { region.half_extent_m.z = nan_f; }, not_finite);
  expect_region_refused([](Region& region) { region.q = {0.0f, 0.0f, 0.0f, 0.0f}; }, bad_region);
  expect_region_refused([](Region& region) { region.q = {nan_f, 0.0f, 0.0f, 0.0f}; }, bad_region, {nan_d});
  expect_region_refused(
      [](Region& region) {
        region.shape = RegionShape::sphere;
        region.half_extent_m.x = -0.5f;
      },
      bad_region, {-0.5});
  const auto expect_frustum_refused = [&](const glm::vec3& half_extent_m, float near_m) {
    expect_region_refused(
        [&](Region& region) {
          region.shape = RegionShape::frustum;
          region.half_extent_m = half_extent_m;
          region.near_m = near_m;
        },
        bad_region, {half_extent_m.x, half_extent_m.y, half_extent_m.z, near_m});
  };
  expect_frustum_refused({0.0f, 1.0f, 1.0f}, 0.0f);
  expect_frustum_refused({1.0f, 1.0f, 1.0f}, 1.5f);
  expect_frustum_refused({1.0f, 1.0f, 1.0f}, -0.5f);
  expect_frustum_refused({1.0f, 1.0f, 1.0f}, nan_f);
  expect_frustum_refused({1e-38f, 10.0f, 1.0f}, 0.0f);
  expect_frustum_refused({1e-13f, 1.0f, 101.0f}, 0.0f);
}

/// With the largest slopes the frustum is nearly a plane.
TEST_F(Refusals, AcceptTheWidestFrustum) {
  for (Region& region : regions_->regions()) {
    region = {};
    region.shape = RegionShape::frustum;
    region.t = at_s(10.0);
    region.half_extent_m = {1e-11f, 9'999.0f, 9'999.0f};
  }
  regions_->regions()[0].center_m = {10.5f, 300.0f, -20.0f};
  regions_->regions()[1].center_m = {9.0f, 300.0f, -20.0f};
  regions_->regions()[2].center_m = {12.5f, 300.0f, -20.0f};
  ASSERT_TRUE(run(*regions_, 3).done());
  EXPECT_EQ(regions_->answers()[0].found, 1u);
  EXPECT_EQ(regions_->answers()[1].found, 0u);
  EXPECT_EQ(regions_->answers()[2].found, 0u);
}

TEST_F(Refusals, OfOptionsThatAreNoEnumerators) {
  const auto expect_refused = [&](const auto& options, const char* option) {
    const auto query = database().prepare(options);
    ASSERT_FALSE(query.ok()) << option;
    EXPECT_EQ(query.error().code, ErrorCode::bad_input);
    EXPECT_EQ(query.error().message,
              "query 'q' has the " + std::string(option) + ", which is none of the enumerators");
  };
  constexpr auto late = static_cast<LatePolicy>(3);
  expect_refused(RayQueryOptions{.name = "q", .capacity = 1, .mode = static_cast<RayMode>(3)}, "mode 3");
  expect_refused(RayQueryOptions{.name = "q", .capacity = 1, .faces = static_cast<Faces>(3)}, "faces 3");
  expect_refused(RegionQueryOptions{.name = "q", .capacity = 1, .level = static_cast<RegionLevel>(3)},
                 "level 3");
  expect_refused(NearestQueryOptions{.name = "q", .capacity = 1, .target = static_cast<NearestTarget>(4)},
                 "target 4");
  for (const AnyQueryOptions& options : one_option_per_kind()) {
    std::visit(
        [&](auto of_kind) {
          of_kind.name = "q";
          expect_refused(of_kind, "late policy 3");
        },
        with(options, 1, late));
  }
}

TEST_F(Refusals, OfPoints) {
  using enum BadInputReason;
  expect_point_refused([](Nearest& point) { point.point_m.z = nan_f; }, not_finite, {0.0, 0.0, nan_d});
  expect_point_refused([](Nearest& point) { point.point_m.x = -infinity_f; }, not_finite);
  expect_point_refused([](Nearest& point) { point.point_m.y = 1.5e5f; }, out_of_limits, {0.0, 1.5e5, 0.0});
  expect_point_refused([](Nearest& point) { point.radius_m = nan_f; }, bad_nearest, {nan_d});
  expect_point_refused([](Nearest& point) { point.radius_m = -0.5f; }, bad_nearest, {-0.5});
  expect_point_refused([](Nearest& point) { point.radius_m = -infinity_f; }, bad_nearest);
  expect_point_refused([](Nearest& point) { point.t = at_s(9.5); }, time_not_covered, {9.5, 10.0});
  expect_point_refused([](Nearest& point) { point.t = at_s(11.5); }, window_too_long, {10.0, 11.5, 1.0});
}

/// With its value and the allowed ones.
TEST_F(Refusals, NameTheField) {
  const auto ray = [&](const std::function<void(Ray&)>& spoil) {
    rays_->rays()[0] = good_ray();
    spoil(rays_->rays()[0]);
    return describe(run(*rays_, 1));
  };
  const auto region = [&](const std::function<void(Region&)>& spoil) {
    regions_->regions()[0] = {.half_extent_m = {1.0f, 1.0f, 1.0f}, .t = at_s(10.0)};
    spoil(regions_->regions()[0]);
    return describe(run(*regions_, 1));
  };
  const auto expect = [](const std::string& sentence, const std::string& reason) {
    EXPECT_EQ(sentence, "bad_input: " + reason + ", in element 0 of query 0; nothing was done");
  };
  expect(ray([](Ray& one) { one.origin_m.y = 2e5f; }), "origin_m.y is 200000; it must be -100000 to 100000");
  expect(ray([](Ray& one) { one.direction.z = infinity_f; }), "direction.z is inf; it must be finite");
  expect(ray([](Ray& one) { one.direction = {}; }),
         "direction is (0, 0, 0); its largest component must be 1e-15 to 1e15");
  expect(ray([](Ray& one) { one.lambda_min = -1.0f; }),
         "lambda_min is -1 and lambda_max 1e+30; lambda_min must be finite and 0 or above, and lambda_max "
         "not below "
         "it");
  expect(region([](Region& one) { one.half_extent_m.y = -1.0f; }),
         "half_extent_m.y is -1; it must be 0 or above");
  expect(region([](Region& one) { one.center_m.x = nan_f; }), "center_m.x is nan; it must be finite");
  expect(region([](Region& one) {
           one.q = {0.0f, 0.0f, 0.0f, 0.0f};
         }),
         "the length of q is 0; it must be 1e-06 to 1000000");
  expect(region([](Region& one) { one.shape = static_cast<RegionShape>(7); }),
         "shape is 7 and test 0; they must be 0 to 2 and 0 to 1");
  expect(region([](Region& one) {
           one.shape = RegionShape::frustum;
           one.near_m = 1.5f;
         }),
         "near_m of a frustum is 1.5; it must be 0 to 1");
  expect(region([](Region& one) {
           one.shape = RegionShape::frustum;
           one.half_extent_m.x = 0.0f;
         }),
         "half_extent_m.x of a frustum is 0; it must be above 0");
  nearest_->points()[0] = {.radius_m = -0.5f, .t = at_s(10.0)};
  expect(describe(run(*nearest_, 1)), "radius_m is -0.5; it must be 0 or above");
}

TEST_F(Refusals, OfNearestQueries) {
  const auto expect_refused = [&](const NearestQueryOptions& options, ErrorCode code, const char* word) {
    const auto query = database().prepare(options);
    ASSERT_FALSE(query.ok());
    EXPECT_EQ(query.error().code, code) << query.error().message;
    EXPECT_NE(query.error().message.find(word), std::string::npos) << query.error().message;
  };
  using enum ErrorCode;
  expect_refused({.name = "none", .capacity = 8, .k = 0}, capacity, "0 neighbors");
  expect_refused({.name = "many", .capacity = 8, .k = max_neighbors + 1}, capacity, "33 neighbors");
  expect_refused({.name = "empty", .capacity = 0}, capacity, "0 points");
  expect_refused({.name = "large", .capacity = max_points_per_query + 1}, capacity, "1048577 points");
  for (const NearestTarget target : {NearestTarget::center, NearestTarget::bounds})
    expect_refused({.name = "unsigned", .capacity = 8, .target = target, .is_signed = true}, bad_input,
                   "sign");
}

/// Each number is within its limit, but no device binds 17 GB of ids or 34 GB of triangles.
TEST_F(Refusals, OfAnswersThatAreTooLargeForTheDevice) {
  for (const RegionLevel level : {RegionLevel::bounds, RegionLevel::triangle}) {
    const auto query = database().prepare(RegionQueryOptions{.name = "vast",
                                                             .capacity = max_regions_per_query,
                                                             .level = level,
                                                             .ids_per_region = max_ids_per_region});
    ASSERT_FALSE(query);
    EXPECT_TRUE(query.error().code == ErrorCode::capacity || query.error().code == ErrorCode::out_of_memory);
    EXPECT_NE(query.error().message.find("vast"), std::string::npos) << query.error().message;
  }
}

TEST_F(Refusals, OfRows) {
  using enum BadInputReason;
  const auto expect_refused = [&](const std::function<void(EntityRow&)>& spoil, BadInputReason reason) {
    EntityRow row = row_of(box_, {3.0, 0.0, 0.0});
    spoil(row);
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          transaction.update(body_, row_of(box_, {500.0, 0.0, 0.0}));
          transaction.create(row);
        },
        at_s(10.0));
    EXPECT_EQ(outcome.status, Status::bad_input);
    EXPECT_EQ(outcome.bad_input.reason, reason) << describe(outcome);
    EXPECT_EQ(outcome.bad_input.element, 1u);
    EXPECT_EQ(outcome.bad_query, -1);
    expect_no_effect();
  };
  expect_refused([](EntityRow& row) { row.motion.p_world_m.x = nan_d; }, not_finite);
  expect_refused([](EntityRow& row) { row.motion.q_world = {0.0, 0.0, 0.0, 0.0}; }, zero_quaternion);
  expect_refused([](EntityRow& row) { row.motion.q_world.x = nan_d; }, not_finite);
  expect_refused([](EntityRow& row) { row.motion.p_world_m.z = 1.1e5; }, out_of_limits);
  expect_refused([](EntityRow& row) { row.scale.y = 0.0; }, out_of_limits);
  expect_refused([](EntityRow& row) { row.scale.y = -1.0; }, out_of_limits);
  expect_refused([](EntityRow& row) { row.geometry = {1}; }, unknown_geometry);
  expect_refused([](EntityRow& row) { row.material = {max_materials}; }, unknown_material);
  expect_refused([](EntityRow& row) { row.light = {0}; }, unknown_light);
}

TEST_F(Refusals, OfOverlapsOfAnEntityWithoutGeometry) {
  destroy_queries();
  open({});
  box_ = add(make_box({2.0, 2.0, 2.0}));
  const auto ids = create(std::vector{row_of(box_, {11.0, 0.0, 0.0}), EntityRow{}}, at_s(10.0));
  body_ = ids[0];
  const auto overlaps = prepare(OverlapQueryOptions{.name = "o", .capacity = 1, .ids_per_entity = 8});
  overlaps->overlaps()[0] = {.entity = ids[1], .t = at_s(10.0)};
  const Outcome outcome = run(*overlaps, 1);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::no_geometry);
  EXPECT_EQ(outcome.bad_input.entity, ids[1]);
}

}  // namespace
}  // namespace rtstdb::test
