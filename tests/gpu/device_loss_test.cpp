// The device is lost at any Vulkan call: committed versions stay, aborted transactions leave nothing, and the
// queries have the same answers again after the recovery.

#include "tests/gpu/device_loss.hpp"

#include <iostream>

#include "rtstdb/query/revival_pace.hpp"

namespace rtstdb::test {
namespace {

using gpu::test::FaultLoader;
using SteadyClock = std::chrono::steady_clock;
using DeviceLoss = DeviceLossTest;

/// A sample of calls; long_device_loss_test tests each call.
constexpr std::uint64_t stride = 8;

TEST_F(DeviceLoss, AtACallOfATransactionLeavesNoTrace) {
  lose_at_calls_of_each_kind(7 * stride);
}

TEST_F(DeviceLoss, DuringARecoveryIsRecoveredFrom) {
  lose_at_calls_of_recovery(97 * stride);
}

TEST(DeviceLossAtOpen, IsAnErrorWithoutLeaks) {
  lose_at_calls_while_a_database_opens(101 * stride);
}

TEST_F(DeviceLoss, WhileGeometryIsAddedIsRecoveredFrom) {
  lose_at_calls_while_geometry_is_added(97 * stride);
}

TEST_F(DeviceLoss, WhileQueriesArePreparedIsRecoveredFrom) {
  lose_at_calls_while_queries_are_prepared(211 * stride);
}

TEST_F(DeviceLoss, LeaksNoMemory) {
  const int devices = loader_.live_devices();
  const int allocations = loader_.live_allocations();
  for (int losses = 0; losses < 3; ++losses)
    lose_at(1, 0, ++round_);
  for (std::size_t kind = 0; kind < lost_.kinds().size(); ++kind)
    expect_same(kind, ++round_);
  EXPECT_EQ(loader_.live_devices(), devices);
  EXPECT_LE(loader_.live_allocations(), allocations);
}

TEST_F(DeviceLoss, KeepsTheElementsOfQueries) {
  const auto made = lost_.database().prepare(RayQueryOptions{.name = "kept", .capacity = 1000});
  ASSERT_TRUE(made.ok()) << made.error().message;
  RayQuery& query = *made.value();
  const std::span<Ray> rays = query.rays();
  for (std::size_t k = 0; k < rays.size(); ++k)
    rays[k].lambda_max = static_cast<float>(k);
  lose_at(1, 0, ++round_);
  EXPECT_EQ(query.rays().data(), rays.data());
  for (std::size_t k = 0; k < rays.size(); ++k)
    ASSERT_EQ(rays[k].lambda_max, static_cast<float>(k));
}

TEST_F(DeviceLoss, IsReportedByCalibrate) {
  const auto made = lost_.database().prepare(RayQueryOptions{.name = "calibrated", .capacity = 8});
  ASSERT_TRUE(made.ok()) << made.error().message;
  const auto transaction = lost_.database().make_transaction({.max_queries = 1});
  transaction->begin({});
  transaction->add_query(*made.value(), 8);
  loader_.lose_at_call(1);
  const auto lost = lost_.database().calibrate(*transaction);
  ASSERT_FALSE(lost.ok());
  EXPECT_EQ(lost.error().code, ErrorCode::device_lost);
  const auto repeated = lost_.database().calibrate(*transaction);
  EXPECT_TRUE(repeated.ok()) << repeated.error().message;
  expect_same_rows();
}

/// Transactions without queries go on.
TEST_F(DeviceLoss, WithoutRecoveryIsReportedAtOnceWhileWritesAreCommitted) {
  loader_.fail("vkCreateDevice", FaultLoader::device_lost, FaultLoader::for_ever);
  loader_.lose_at_call(1);
  EXPECT_EQ(lost_.execute(lost_.kinds()[0], ++round_).status, Status::device_lost);
  for (int k = 0; k < 20; ++k)
    EXPECT_EQ(lost_.execute(lost_.kinds()[0], round_).status, Status::device_lost);
  const Health health = lost_.database().health();
  EXPECT_TRUE(health.device_lost);
  EXPECT_EQ(health.device_losses, 1u);
  EXPECT_NE(health.device_loss.find("could not be opened again"), std::string::npos) << health.device_loss;
  for (DeviceLossWorld* world : {&lost_, &undisturbed_}) {
    const auto writer = world->database().make_transaction({.max_writes = 1});
    writer->begin({});
    writer->create({});
    EXPECT_EQ(world->database().execute(*writer).status, Status::committed);
  }
  const auto geometry = lost_.database().add_geometry(make_box({1.0, 1.0, 1.0}), "box");
  ASSERT_FALSE(geometry.ok());
  EXPECT_EQ(geometry.error().code, ErrorCode::device_lost);
  EXPECT_FALSE(lost_.database().prepare(RayQueryOptions{.name = "rays", .capacity = 1}).ok());
  expect_same_rows();
  loader_.fail("vkCreateDevice", 0, 0);
  expect_same(0, round_);
  EXPECT_FALSE(lost_.database().health().device_lost);
  // The refused geometry has no index.
  const auto added = lost_.database().add_geometry(make_box({1.0, 1.0, 1.0}), "box");
  const auto expected = undisturbed_.database().add_geometry(make_box({1.0, 1.0, 1.0}), "box");
  ASSERT_TRUE(added.ok() && expected.ok());
  EXPECT_EQ(added.value(), expected.value());
}

/// The device works, but some bindings to the larger pool fail.
TEST_F(DeviceLoss, IsAssumedIfBindingsToALargerPoolFail) {
  const TriangleMesh larger_than_the_pool = make_sphere(0.8, 6);
  bool added = false;
  int refused = 0;
  // A sample of the bindings: each failure is followed by queries of all kinds.
  for (int calls = 0; !added && !HasFailure(); calls += 5) {
    SCOPED_TRACE(testing::Message() << "after " << calls << " calls");
    loader_.fail("vkAllocateDescriptorSets", FaultLoader::out_of_device_memory, 1, calls);
    const auto result = lost_.database().add_geometry(larger_than_the_pool, "large");
    loader_.fail("vkAllocateDescriptorSets", 0, 0);
    added = result.ok();
    refused += added ? 0 : 1;
    if (!added) {
      EXPECT_EQ(result.error().code, ErrorCode::out_of_memory) << result.error().message;
    }
    // Twice, for both places of a deforming shape.
    for (std::size_t kind = 0; kind < 2 * lost_.kinds().size(); ++kind)
      expect_same(kind % lost_.kinds().size(), ++round_);
  }
  EXPECT_GT(refused, 0);
}

/// Within half a second, or half the time to open and query such a database: a busy machine or a sanitizer
/// makes both slow. Real time is the subject: how long a recovery takes.
TEST_F(DeviceLoss, IsFollowedByAnAnswerSoon) {
  const auto since = [](SteadyClock::time_point begun) { return SteadyClock::now() - begun; };
  auto begun = SteadyClock::now();
  DeviceLossWorld world(DeviceLossWorld::On::real_device, {.validation = Validation::on});
  world.set_up();
  ASSERT_EQ(world.execute(world.kinds()[0], ++round_).status, Status::committed);
  const auto opening = since(begun);
  auto recovery = SteadyClock::duration::max();
  for (int k = 0; k < 4; ++k) {
    loader_.lose_at_call(1);
    ASSERT_EQ(lost_.execute(lost_.kinds()[0], ++round_).status, Status::device_lost);
    loader_.lose_at_call(0);
    begun = SteadyClock::now();
    ASSERT_EQ(lost_.execute(lost_.kinds()[0], round_).status, Status::committed);
    recovery = std::min(recovery, since(begun));
  }
  const SteadyClock::duration bound =
      std::max<SteadyClock::duration>(std::chrono::milliseconds(500), opening / 2);
  EXPECT_LT(recovery, bound);
  const auto in_us = [](SteadyClock::duration duration) {
    return static_cast<int>(std::chrono::ceil<std::chrono::microseconds>(duration).count());
  };
  RecordProperty("recovery_us", in_us(recovery));
  RecordProperty("opening_us", in_us(opening));
  std::cout << "answered after " << in_us(recovery) / 1000 << " ms; opening and querying takes "
            << in_us(opening) / 1000 << " ms\n";
}

TEST(DeviceWithoutHostMemoryImport, GivesTheSameAnswers) {
  DeviceLossWorld copies(DeviceLossWorld::On::copying_device);
  DeviceLossWorld shares(DeviceLossWorld::On::real_device);
  for (DeviceLossWorld* world : {&copies, &shares})
    world->set_up();
  for (std::size_t kind = 0; kind < copies.kinds().size(); ++kind) {
    SCOPED_TRACE(copies.kinds()[kind].name);
    const auto round = static_cast<unsigned>(kind);
    EXPECT_EQ(copies.execute(copies.kinds()[kind], round).status,
              shares.execute(shares.kinds()[kind], round).status);
    EXPECT_EQ(copies.answers(copies.kinds()[kind]), shares.answers(shares.kinds()[kind]));
    EXPECT_FALSE(copies.answers(copies.kinds()[kind]).empty());
  }
}

TEST(RevivalPace, TriesAtOnceAndThenAfterLongerPauses) {
  using namespace std::chrono_literals;
  using query::RevivalPace;
  RevivalPace pace;
  RevivalPace::Time now{1h};
  pace.failed(now);
  EXPECT_TRUE(pace.may_try(now)) << "the device worked before";
  for (const auto pause : {100ms, 200ms, 400ms, 800ms, 1600ms, 3200ms, 6400ms, 10'000ms, 10'000ms}) {
    pace.failed(now);
    EXPECT_FALSE(pace.may_try(now + pause - 1ms));
    EXPECT_EQ(pace.left(now), pause);
    EXPECT_TRUE(pace.may_try(now + pause));
    now += pause;
  }
  pace.answered();
  pace.failed(now);
  EXPECT_TRUE(pace.may_try(now));
}

}  // namespace
}  // namespace rtstdb::test
