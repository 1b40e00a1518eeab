#include "runtime/modules/laser_scanner/object_list.hpp"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/allocation_guard.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t millisecond_ns = 1'000'000;
constexpr glm::dvec3 origin(0.0);

rtstdb::EntityId body(std::uint32_t index) {
  return {.index = index, .generation = 1};
}

ObjectList::Options options() {
  return {
      .max_open = 8, .max_objects = 4, .gap_columns = 3, .min_hits = 3, .keep_ns = 1'000 * millisecond_ns};
}

/// A body that is seen at one instant: a cluster of five points, one metre wide along y.
void see(ObjectList& list, std::uint32_t index, const glm::dvec3& center_m, std::uint32_t column,
         std::int64_t time_ns, const glm::dvec3& v_mps = glm::dvec3(0.0)) {
  for (const double y : {-0.5, -0.25, 0.0, 0.25, 0.5})
    list.add(body(index), column, time_ns, center_m + glm::dvec3(0.0, y, 0.0), v_mps);
}

std::size_t valid_slots(const ObjectList& list) {
  std::size_t count = 0;
  for (const ScannedObject& slot : list.slots())
    count += slot.entity.valid() ? 1 : 0;
  return count;
}

TEST(ObjectList, SeparatesBodies) {
  ObjectList list(options());
  see(list, 7, {10.0, 3.0, 0.5}, 100, 0);
  see(list, 9, {20.0, -3.0, 0.5}, 101, 0);
  list.end_sweep(0, origin);
  ASSERT_EQ(valid_slots(list), 2U);
  EXPECT_EQ(list.slots()[0].entity, body(7));
  EXPECT_NEAR(glm::distance(list.slots()[0].center_m, glm::dvec3(10.0, 3.0, 0.5)), 0.0, 1e-12);
  EXPECT_EQ(list.slots()[0].hits, 5U);
  EXPECT_EQ(list.slots()[1].entity, body(9));
  EXPECT_NEAR(glm::distance(list.slots()[1].center_m, glm::dvec3(20.0, -3.0, 0.5)), 0.0, 1e-12);
}

/// A box that drives while the beam crosses it: the points are spread over 300 ms, in which it moves by more
/// than its length.
TEST(ObjectList, UndoesTheDistortionOfASlowSweep) {
  for (const double speed_mps : {15.0, -15.0, 2.0}) {
    for (const double heading_rad : {0.0, 0.7, 1.5707963, 2.9}) {
      ObjectList list(options());
      const glm::dvec3 ahead(std::cos(heading_rad), std::sin(heading_rad), 0.0);
      const glm::dvec3 across(-ahead.y, ahead.x, 0.0);
      const glm::dvec3 v_mps = ahead * speed_mps;
      const glm::dvec3 start_m(30.0, 12.0, 0.0);
      for (int i = 0; i <= 100; ++i) {
        const std::int64_t time_ns = 3 * i * millisecond_ns;
        const glm::dvec3 center_m = start_m + v_mps * (0.003 * i);
        const double along = -2.25 + 0.045 * i;
        list.add(body(1), 100 + static_cast<std::uint32_t>(i), time_ns,
                 center_m + ahead * along + across * 0.9, v_mps);
        list.add(body(1), 100 + static_cast<std::uint32_t>(i), time_ns,
                 center_m + ahead * along - across * 0.9, v_mps);
      }
      const std::int64_t end_ns = 400 * millisecond_ns;
      list.end_sweep(end_ns, origin);
      const ScannedObject& object = list.slots()[0];
      ASSERT_TRUE(object.entity.valid());
      EXPECT_NEAR(object.length_m, 4.5, 1e-9);
      EXPECT_EQ(object.time_ns, end_ns);
      EXPECT_NEAR(glm::distance(object.center_m, start_m + v_mps * 0.4), 0.0, 1e-9);
      EXPECT_NEAR(glm::distance(object.velocity_mps, v_mps), 0.0, 1e-12);
    }
  }
}

TEST(ObjectList, LengthOfAStandingBodyIsThatOfItsLongerSide) {
  ObjectList list(options());
  for (const double x : {0.0, 2.0})
    for (const double y : {0.0, 5.0})
      list.add(body(1), 10, 0, {x, y, 0.0}, {0.0, 0.0, 0.0});
  list.end_sweep(0, origin);
  EXPECT_DOUBLE_EQ(list.slots()[0].length_m, 5.0);
}

TEST(ObjectList, ClosesAnObjectWhenTheSweepIsMoreThanTheGapBeyondIt) {
  ObjectList list(options());
  see(list, 1, {10.0, 0.0, 0.0}, 100, 0);
  list.advance(103, millisecond_ns, origin);
  EXPECT_EQ(valid_slots(list), 0U);
  list.advance(104, 2 * millisecond_ns, origin);
  ASSERT_EQ(valid_slots(list), 1U);
  EXPECT_EQ(list.slots()[0].time_ns, 2 * millisecond_ns);
}

TEST(ObjectList, KeepsAnObjectWholeAcrossAGapOfTheLimit) {
  ObjectList list(options());
  const glm::dvec3 still(0.0);
  list.add(body(1), 100, 0, {10.0, 2.0, 0.0}, still);
  list.add(body(1), 100, 0, {10.0, 1.5, 0.0}, still);
  list.advance(103, 0, origin);  // behind a pole
  list.add(body(1), 103, 0, {10.0, -2.0, 0.0}, still);
  list.advance(110, 0, origin);
  ASSERT_EQ(valid_slots(list), 1U);
  EXPECT_DOUBLE_EQ(list.slots()[0].length_m, 4.0);
}

TEST(ObjectList, IgnoresBodiesWithTooFewHits) {
  ObjectList list(options());
  list.add(body(1), 100, 0, {10.0, 0.0, 0.0}, origin);
  list.add(body(1), 100, 0, {10.0, 0.1, 0.0}, origin);
  list.end_sweep(0, origin);
  EXPECT_EQ(valid_slots(list), 0U);
}

TEST(ObjectList, KeepsTheSlotOfABodyFromSweepToSweep) {
  ObjectList list(options());
  see(list, 1, {40.0, 0.0, 0.0}, 10, 0);
  see(list, 2, {20.0, 0.0, 0.0}, 20, 0);
  list.end_sweep(0, origin);
  // In the opposite order, nearer, and after a third body.
  const std::int64_t next_ns = 500 * millisecond_ns;
  see(list, 3, {5.0, 0.0, 0.0}, 5, next_ns);
  see(list, 2, {10.0, 0.0, 0.0}, 10, next_ns);
  see(list, 1, {30.0, 0.0, 0.0}, 20, next_ns);
  list.end_sweep(next_ns, origin);
  EXPECT_EQ(list.slots()[0].entity, body(1));
  EXPECT_DOUBLE_EQ(list.slots()[0].center_m.x, 30.0);
  EXPECT_EQ(list.slots()[1].entity, body(2));
  EXPECT_DOUBLE_EQ(list.slots()[1].center_m.x, 10.0);
  EXPECT_EQ(list.slots()[2].entity, body(3));
}

TEST(ObjectList, KeepsTheBodiesNearestToTheSensor) {
  ObjectList::Options small = options();
  small.max_objects = 2;
  for (const glm::dvec3& sensor_m : {origin, glm::dvec3(60.0, 0.0, 0.0)}) {
    ObjectList list(small);
    see(list, 1, {30.0, 0.0, 0.0}, 10, 0);
    see(list, 2, {10.0, 0.0, 0.0}, 20, 0);
    see(list, 3, {20.0, 0.0, 0.0}, 30, 0);
    see(list, 4, {50.0, 0.0, 0.0}, 40, 0);
    list.end_sweep(0, sensor_m);
    std::set<std::uint32_t> kept;
    for (const ScannedObject& slot : list.slots())
      kept.insert(slot.entity.index);
    EXPECT_EQ(kept, sensor_m.x == 0.0 ? (std::set<std::uint32_t>{2, 3}) : (std::set<std::uint32_t>{1, 4}));
  }
}

TEST(ObjectList, ForgetsBodiesThatAreNotSeenAgain) {
  ObjectList list(options());
  see(list, 1, {10.0, 0.0, 0.0}, 10, 0);
  see(list, 2, {20.0, 0.0, 0.0}, 20, 0);
  list.end_sweep(0, origin);
  see(list, 2, {20.0, 0.0, 0.0}, 20, 600 * millisecond_ns);
  list.end_sweep(600 * millisecond_ns, origin);
  list.forget(1'000 * millisecond_ns);  // exactly keep_ns after it was seen
  EXPECT_EQ(valid_slots(list), 2U);
  list.forget(1'001 * millisecond_ns);
  ASSERT_EQ(valid_slots(list), 1U);
  EXPECT_EQ(list.slots()[1].entity, body(2));
  // The free slot is used again.
  see(list, 5, {10.0, 0.0, 0.0}, 10, 1'100 * millisecond_ns);
  list.end_sweep(1'100 * millisecond_ns, origin);
  EXPECT_EQ(list.slots()[0].entity, body(5));
}

TEST(ObjectList, TreatsAReusedEntityIndexAsAnotherBody) {
  ObjectList list(options());
  see(list, 1, {10.0, 0.0, 0.0}, 10, 0);
  for (const double y : {-0.5, 0.0, 0.5})
    list.add({.index = 1, .generation = 2}, 20, 0, {30.0, y, 0.0}, origin);
  list.end_sweep(0, origin);
  EXPECT_EQ(valid_slots(list), 2U);
}

TEST(ObjectList, CountsTheHitsThatItIgnores) {
  ObjectList::Options narrow = options();
  narrow.max_open = 2;
  ObjectList list(narrow);
  for (std::uint32_t i = 0; i < 3; ++i)
    see(list, i, {10.0 + i, 0.0, 0.0}, 10, 0);
  EXPECT_EQ(list.ignored_hits(), 5U);
  list.end_sweep(0, origin);
  EXPECT_EQ(valid_slots(list), 2U);
  // Closed objects do not count.
  see(list, 2, {12.0, 0.0, 0.0}, 10, 0);
  list.end_sweep(0, origin);
  EXPECT_EQ(list.ignored_hits(), 5U);
  EXPECT_EQ(valid_slots(list), 3U);
}

TEST(ObjectList, DoesNotAllocateAfterConstruction) {
  ObjectList list(options());
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::uint32_t sweep = 0; sweep < 20; ++sweep) {
    const std::int64_t time_ns = sweep * 300 * millisecond_ns;
    for (std::uint32_t i = 0; i < 12; ++i) {
      see(list, i + sweep % 3, {10.0 + i, 0.0, 0.0}, 10 * i, time_ns);
      list.advance(10 * i, time_ns, origin);
    }
    list.end_sweep(time_ns, origin);
    list.forget(time_ns);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::modules
