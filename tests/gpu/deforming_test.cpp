// Deforming geometry: which shape each version has, refusals, aborted updates, and queries of other threads
// while shapes are committed.

#include <glm/geometric.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "tests/gpu/deforming_fixture.hpp"
#include "tests/gpu/stepping_clock.hpp"

namespace rtstdb::test {
namespace {

TEST_F(DeformingGeometry, HasTheShapeOfEachVersion) {
  const TriangleMesh box = make_box({2.0, 2.0, 2.0});
  const GeometryId geometry = add_deforming(box, {.retained_shapes = 3});
  create(row_of(geometry));
  const Version first = database().latest().version;
  EXPECT_EQ(lambda(), 9.0f);
  const Version second = committed(geometry, scaled(box, glm::vec3(2.0f)));
  const Version third = committed(geometry, scaled(box, glm::vec3(3.0f)));
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(lambda(), 7.0f);
    EXPECT_EQ(lambda(ReadAt::pinned(second)), 8.0f);
    EXPECT_EQ(lambda(ReadAt::pinned(first)), 9.0f);
  }
  EXPECT_EQ(database().geometry(geometry)->positions_m, scaled(box, glm::vec3(3.0f)));
  EXPECT_EQ(database().geometry(geometry, ReadAt::pinned(second)).value().positions_m,
            scaled(box, glm::vec3(2.0f)));
  EXPECT_EQ(database().geometry(geometry, ReadAt::pinned(first)).value().positions_m, box.positions_m);

  // The fourth shape replaces the first.
  const Version fourth = committed(geometry, scaled(box, glm::vec3(4.0f)));
  const Outcome refused = outcome_of_a_ray(ReadAt::pinned(first));
  EXPECT_EQ(refused.status, Status::bad_input);
  EXPECT_EQ(refused.bad_input.reason, BadInputReason::snapshot_too_old);
  EXPECT_EQ(refused.bad_input.values[0], static_cast<double>(first));
  EXPECT_EQ(refused.bad_input.values[1], static_cast<double>(second));
  EXPECT_FALSE(database().geometry(geometry, ReadAt::pinned(first)).ok());
  EXPECT_TRUE(database().snapshot(ReadAt::pinned(first)).ok()) << "rows are kept longer than shapes";
  EXPECT_EQ(execute([](Transaction&) {}, {}, ReadAt::pinned(first)).status, Status::committed);
  EXPECT_EQ(lambda(ReadAt::pinned(second)), 8.0f);
  EXPECT_EQ(lambda(ReadAt::pinned(fourth)), 6.0f);
  EXPECT_EQ(lambda(ReadAt::pinned(third)), 7.0f);
  // A version without a new shape has the last one.
  create(row_of(geometry, {0.0, 100.0, 0.0}));
  EXPECT_EQ(lambda(ReadAt::pinned(fourth + 1)), 6.0f);
}

TEST_F(DeformingGeometry, HasTheNewShapeInTheSameTransactionAndTheOldOneIfItAborts) {
  const TriangleMesh box = make_box({2.0, 2.0, 2.0});
  const GeometryId geometry = add_deforming(box);
  const EntityId body = create(row_of(geometry));
  const Version first = database().latest().version;
  const auto query = prepare_rays();
  query->rays()[0] = along_x();
  const auto transaction = make(1);
  transaction->begin(terms_at({}));
  transaction->update_geometry(geometry, scaled(box, glm::vec3(2.0f)));
  transaction->update_geometry(geometry, scaled(box, glm::vec3(3.0f)));  // replaces the first
  transaction->add_query(*query, 1);
  ASSERT_EQ(database().execute(*transaction).status, Status::committed);
  EXPECT_EQ(query->hits()[0].lambda, 7.0f);
  EXPECT_EQ(lambda(), 7.0f);
  EXPECT_EQ(lambda(ReadAt::pinned(first)), 9.0f) << "a version has one shape, however often it was written";

  // By a precondition, a row, or a query.
  const auto expect_aborted = [&](Status status, const std::function<void(Transaction&)>& declare) {
    const auto aborted = database().make_transaction({.max_writes = 2,
                                                      .max_preconditions = 1,
                                                      .max_queries = 1,
                                                      .max_geometry_updates = 1,
                                                      .max_positions = 64});
    aborted->begin(terms_at({}));
    aborted->update_geometry(geometry, scaled(box, glm::vec3(5.0f)));
    declare(*aborted);
    EXPECT_EQ(database().execute(*aborted).status, status);
    EXPECT_EQ(lambda(), 7.0f);
    EXPECT_EQ(lambda(ReadAt::pinned(first)), 9.0f);
    EXPECT_EQ(database().geometry(geometry)->positions_m, scaled(box, glm::vec3(3.0f)));
  };
  expect_aborted(Status::conflict, [&](Transaction& t) { t.expect_written_by(body, 77); });
  expect_aborted(Status::bad_input, [&](Transaction& t) { t.remove({99, 1}); });
  expect_aborted(Status::bad_input, [&](Transaction& t) {
    query->rays()[0].direction = glm::vec3(0.0f);
    t.add_query(*query, 1);
  });
}

TEST_F(DeformingGeometry, HasNothingOfTheShapeOfAMissedTransaction) {
  const SteppingClock clock;
  open({.clock = &clock});
  const TriangleMesh box = make_box({2.0, 2.0, 2.0});
  const GeometryId geometry = add_deforming(box);
  create(row_of(geometry));
  const Version first = database().latest().version;
  const Version second = committed(geometry, scaled(box, glm::vec3(2.0f)));
  const auto query = prepare_rays();
  query->rays()[0] = along_x();
  int computed_and_missed = 0;
  for (std::int64_t readings = 1; readings <= 8; ++readings) {
    const auto transaction = make(1);
    Terms terms;
    terms.deadline_class = DeadlineClass::firm;
    terms.deadline = clock.after_readings(readings);
    transaction->begin(terms);
    transaction->update_geometry(geometry, scaled(box, glm::vec3(5.0f)));
    transaction->add_query(*query, 1);
    const Outcome& outcome = database().execute(*transaction);
    if (outcome.status != Status::missed) {
      EXPECT_EQ(outcome.status, Status::committed);
      EXPECT_EQ(lambda(), 5.0f);
      EXPECT_EQ(lambda(ReadAt::pinned(second)), 8.0f);
      break;
    }
    computed_and_missed += outcome.computed != ClockTime{} ? 1 : 0;
    EXPECT_EQ(lambda(), 8.0f) << "after the deadline of " << readings << " readings";
    EXPECT_EQ(lambda(ReadAt::pinned(second)), 8.0f);
    EXPECT_EQ(lambda(ReadAt::pinned(first)), 9.0f);
  }
  EXPECT_GT(computed_and_missed, 0) << "no transaction missed its deadline after its queries ran";
}

TEST_F(DeformingGeometry, RefusesBadShapes) {
  const TriangleMesh box = make_box({2.0, 2.0, 2.0});
  const GeometryId still = add(box);
  const GeometryId geometry = add_deforming(box);
  create(row_of(geometry));
  const Version before = database().latest().version;
  const std::size_t count = box.positions_m.size();
  const auto refused = [&](BadInputReason reason, GeometryId id, const Positions& positions,
                           const std::array<double, 4>& values, const char* part) {
    const auto transaction = database().make_transaction(
        {.max_writes = 1, .max_geometry_updates = 2, .max_positions = static_cast<std::uint32_t>(2 * count)});
    transaction->begin(terms_at({}));
    transaction->create(row_of(geometry));
    transaction->update_geometry(geometry, scaled(box, glm::vec3(3.0f)));
    transaction->update_geometry(id, positions);
    const Outcome outcome = database().execute(*transaction);
    EXPECT_EQ(outcome.status, Status::bad_input);
    EXPECT_EQ(outcome.bad_input.reason, reason);
    EXPECT_TRUE(outcome.bad_input.in_geometry_update);
    EXPECT_EQ(outcome.bad_input.element, 1u);
    for (std::size_t i = 0; i < 4; ++i) {
      const double value = outcome.bad_input.values[i];
      EXPECT_TRUE(value == values[i] || (std::isnan(value) && std::isnan(values[i]))) << i << ": " << value;
    }
    EXPECT_NE(describe(outcome).find(part), std::string::npos) << describe(outcome);
    EXPECT_NE(describe(outcome).find("geometry update 1"), std::string::npos) << describe(outcome);
    EXPECT_EQ(database().latest().version, before);
    EXPECT_EQ(lambda(), 9.0f);
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with_position = [&](std::size_t i, const glm::vec3& p) {
    Positions positions = box.positions_m;
    positions[i] = p;
    return positions;
  };
  refused(BadInputReason::unknown_geometry, GeometryId{55}, box.positions_m, {55, 0, 0, 0}, "geometry 55");
  refused(BadInputReason::unknown_geometry, GeometryId{}, box.positions_m, {4294967295.0, 0, 0, 0},
          "does not exist");
  refused(BadInputReason::geometry_does_not_deform, still, box.positions_m, {0, 0, 0, 0},
          "as one that deforms");
  Positions few = box.positions_m;
  few.pop_back();
  refused(BadInputReason::wrong_position_count, geometry, few,
          {static_cast<double>(count - 1), static_cast<double>(count), 0, 0}, "positions are given");
  refused(BadInputReason::wrong_position_count, geometry, {}, {0, static_cast<double>(count), 0, 0},
          "0 positions are given");
  refused(BadInputReason::wrong_position_count, geometry, Positions(10 * count),
          {static_cast<double>(10 * count), static_cast<double>(count), 0, 0}, "positions are given");
  refused(BadInputReason::not_finite, geometry, with_position(3, {1.0f, NAN, 2.0f}), {1.0, nan, 2.0, 3.0},
          "position 3 is (1, nan, 2)");
  refused(BadInputReason::not_finite, geometry, with_position(count - 1, {-INFINITY, 0.0f, 0.0f}),
          {-INFINITY, 0.0, 0.0, static_cast<double>(count - 1)}, "not finite");
  refused(BadInputReason::out_of_limits, geometry, with_position(0, {0.0f, 0.0f, 2e5f}), {0.0, 0.0, 2e5, 0.0},
          "beyond the limit of 100000 m");

  // More positions than the transaction has capacity for.
  const auto small = database().make_transaction(
      {.max_geometry_updates = 2, .max_positions = static_cast<std::uint32_t>(2 * count - 1)});
  small->begin(terms_at({}));
  small->update_geometry(geometry, box.positions_m);
  small->update_geometry(geometry, box.positions_m);
  const Outcome outcome = database().execute(*small);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::too_many_positions);
  EXPECT_EQ(outcome.bad_input.element, 1u);
  EXPECT_EQ(outcome.bad_input.values[0], static_cast<double>(count));
  EXPECT_EQ(outcome.bad_input.values[1], static_cast<double>(count - 1));
  EXPECT_NE(describe(outcome).find("room for"), std::string::npos) << describe(outcome);

  for (const GeometryOptions& options : {GeometryOptions{.deforms = true, .retained_shapes = 0},
                                         GeometryOptions{.deforms = true, .retained_shapes = 257},
                                         GeometryOptions{.deforms = true, .rebuild_growth = 0.9f},
                                         GeometryOptions{.deforms = true, .rebuild_growth = NAN}}) {
    const auto added = database().add_geometry(box, "box", options);
    ASSERT_FALSE(added.ok());
    EXPECT_EQ(added.error().code, ErrorCode::bad_input);
    EXPECT_NE(added.error().message.find("'box'"), std::string::npos) << added.error().message;
  }
}

TEST_F(DeformingGeometry, ObeysTheRulesOfWrites) {
  const TriangleMesh triangle{{{0, -1, -1}, {0, 1, -1}, {0, 0, 2}}, {{0, 1, 2}}};
  const GeometryId geometry = add_deforming(triangle);
  create(row_of(geometry), at_s(1.0));
  const Version before = database().latest().version;
  Positions positions = triangle.positions_m;
  for (glm::vec3& p : positions)
    p.x = -4.0f;
  EXPECT_EQ(update(geometry, positions, at_s(0.5)).bad_input.reason, BadInputReason::world_time_goes_back);
  EXPECT_EQ(committed(geometry, positions, at_s(2.0)), before + 1);
  EXPECT_EQ(database().latest().time, at_s(2.0));
  EXPECT_EQ(trace(along_x(at_s(2.0))).lambda, 6.0f);
  EXPECT_EQ(trace(along_x(at_s(1.0)), ReadAt::as_of(at_s(1.5))).lambda, 10.0f);
  // Without area it is not hit.
  committed(geometry, Positions(3, glm::vec3(1.0f)), at_s(3.0));
  EXPECT_EQ(trace(along_x(at_s(3.0))).status, HitStatus::miss);
  committed(geometry, positions, at_s(4.0));
  EXPECT_EQ(trace(along_x(at_s(4.0))).lambda, 6.0f);
}

TEST_F(DeformingGeometry, HasSignedDistancesWhileItIsClosed) {
  // A tetrahedron whose faces have corners of their own, and one whose faces share them.
  const glm::vec3 corner[] = {{-1, -1, -1}, {1, 1, -1}, {1, -1, 1}, {-1, 1, 1}};
  const glm::uvec3 faces[] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  TriangleMesh separate;
  for (const glm::uvec3& face : faces) {
    const auto first = static_cast<std::uint32_t>(separate.positions_m.size());
    for (int i = 0; i < 3; ++i)
      separate.positions_m.push_back(corner[face[i]]);
    separate.triangles.emplace_back(first, first + 1, first + 2);
  }
  const TriangleMesh shared{{std::begin(corner), std::end(corner)}, {std::begin(faces), std::end(faces)}};
  const NearestQueryOptions options{
      .name = "sign", .capacity = 1, .target = NearestTarget::triangle, .k = 1, .is_signed = true};
  const auto query = prepare(options);
  const auto judged = [&](GeometryId geometry, const Positions& positions) {
    committed(geometry, positions);
    query->points()[0].point_m = {0.1f, 0.05f, 0.02f};
    EXPECT_EQ(run(*query, 1).status, Status::committed);
    judge(world(), query->points(), query->answers(), options);
    return query->answers()[0].neighbors[0].distance_m;
  };
  const GeometryId first = add_deforming(separate);
  const EntityId body = create(row_of(first));
  EXPECT_LT(judged(first, separate.positions_m), 0.0f);
  EXPECT_LT(judged(first, scaled(separate, glm::vec3(2.0f, 1.0f, 3.0f))), 0.0f);
  Positions opened = separate.positions_m;
  opened[4] += glm::vec3(0.01f);
  EXPECT_GT(judged(first, opened), 0.0f) << "an open surface has no inside";
  EXPECT_LT(judged(first, scaled(separate, glm::vec3(0.5f))), 0.0f) << "it is closed again";
  remove(body, {});
  const GeometryId second = add_deforming(shared);
  create(row_of(second));
  Positions bent = shared.positions_m;
  bent[1] += glm::vec3(0.3f);
  EXPECT_LT(judged(second, bent), 0.0f) << "shared corners can not separate";
}

/// Each query of another thread has the shape of its version, as a whole.
TEST_F(DeformingGeometry, HasOneShapeForQueriesOfOtherThreads) {
  const TriangleMesh sphere = make_sphere(1.0, 3);
  const GeometryId geometry = add_deforming(sphere, {.retained_shapes = max_retained_shapes});
  create(row_of(geometry));
  const auto size_in = [](Version version) { return 1.0f + 0.01f * static_cast<float>(version % 100); };
  const Version first = committed(geometry, scaled(sphere, glm::vec3(size_in(2))));
  ASSERT_EQ(first, 2u);
  std::atomic<bool> done = false;
  std::atomic<int> answered = 0, too_old = 0, wrong = 0;
  const auto query_until_done = [&](bool pinned) {
    const auto query = prepare_rays(RayMode::closest, false, 64);
    const auto transaction = database().make_transaction({.max_queries = 1});
    while (!done.load()) {
      Terms terms;
      const Version latest = database().latest().version;
      if (pinned) terms.read_at = ReadAt::pinned(latest > 20 ? latest - 10 : latest);
      transaction->begin(terms);
      for (std::uint32_t i = 0; i < 64; ++i) {
        const float angle = 0.1f * static_cast<float>(i);
        const glm::vec3 outwards =
            glm::normalize(glm::vec3(std::cos(angle), std::sin(angle), 0.3f * std::sin(2.0f * angle)));
        query->rays()[i] = ray_from(10.0f * outwards, -outwards);
      }
      transaction->add_query(*query, 64);
      const Outcome& outcome = database().execute(*transaction);
      if (outcome.status == Status::bad_input) {
        ++too_old;
        continue;
      }
      ++answered;
      // On the sphere of that version; its facets are within 2 %.
      const double size = size_in(outcome.version);
      for (const RayHit& hit : query->hits().first(64)) {
        const double radius = 10.0 - static_cast<double>(hit.lambda);
        const bool right = hit.status == HitStatus::hit && radius <= size + 1e-4 && radius >= 0.98 * size;
        wrong += right ? 0 : 1;
      }
    }
  };
  std::thread newest([&] { query_until_done(false); });
  std::thread pinned([&] { query_until_done(true); });
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  Version version = first;
  for (; (answered < 200 || version < 300) && std::chrono::steady_clock::now() < end; ++version)
    EXPECT_EQ(committed(geometry, scaled(sphere, glm::vec3(size_in(version + 1)))), version + 1);
  done = true;
  newest.join();
  pinned.join();
  EXPECT_GE(answered, 200);
  EXPECT_EQ(wrong, 0);
  EXPECT_LT(too_old, answered / 2) << "shapes are kept for less time than a query takes";
}

/// Few changed rows are a patch of a slot, but not if a shape differs too. The newest shape is the same in
/// both versions here.
TEST_F(DeformingGeometry, PreventsPatchesOfSlotsWithOtherShapes) {
  const TriangleMesh box = make_box({2.0, 2.0, 2.0});
  const GeometryId first = add_deforming(box, {.retained_shapes = 8});
  const GeometryId second = add_deforming(box, {.retained_shapes = 8});
  std::vector<EntityRow> rows{row_of(first), row_of(second, {0.0, 50.0, 0.0})};
  for (int i = 0; i < 30; ++i)
    rows.push_back(row_of(second, {100.0 + 5.0 * i, 100.0, 0.0}));
  const auto ids = create(rows, at_s(0.0));
  const Version before = committed(second, scaled(box, glm::vec3(1.5f)), at_s(0.0));
  const Version after = committed(first, scaled(box, glm::vec3(3.0f)), at_s(0.0));
  const auto query = prepare_rays(RayMode::closest, false, 1);
  const auto lambda = [&](double t_s, const ReadAt& at) {
    const Ray ray = along_x(at_s(t_s));
    return trace(*query, {&ray, 1}, at)[0].lambda;
  };
  EXPECT_FLOAT_EQ(lambda(0.0, ReadAt::pinned(after)), 7.0f);
  EXPECT_FLOAT_EQ(lambda(0.3, ReadAt::pinned(before)), 9.0f);
  update_motion(ids[5], row_of(second, {500.0, 0.0, 0.0}).motion, at_s(0.0));
  EXPECT_FLOAT_EQ(lambda(0.4, {}), 7.0f);
}

}  // namespace
}  // namespace rtstdb::test
