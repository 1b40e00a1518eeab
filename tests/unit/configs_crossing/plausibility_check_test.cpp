// The braking controller's check of its object list: a list that nothing updates any more is frozen.

#include "configs/crossing/aeb_controller/plausibility_check.hpp"

#include <gtest/gtest.h>

#include "configs/crossing/aeb_controller/controller.hpp"

namespace hil::crossing::aeb {
namespace {

constexpr std::int64_t frozen_after_ns = 200'000'000;
constexpr std::int64_t list_period_ns = 10'000'000;

/// Far behind the front, so that it is in no conflict.
ObjectReport harmless(double age_s) {
  return {true, -30.0, 5.0, 0.0, 0.0, 4.5, age_s};
}

TEST(PlausibilityCheck, ListIsFrozenWhenNoObjectChanges) {
  PlausibilityCheck check(frozen_after_ns);
  const ObjectReport frozen = harmless(0.3);
  for (std::int64_t now = 0; now < frozen_after_ns; now += list_period_ns)
    ASSERT_FALSE(check.is_frozen(now, false, std::span(&frozen, 1))) << now;
  EXPECT_TRUE(check.is_frozen(frozen_after_ns, false, std::span(&frozen, 1)));
  const ObjectReport older = harmless(0.31);
  EXPECT_FALSE(check.is_frozen(frozen_after_ns + list_period_ns, false, std::span(&older, 1)));
}

TEST(PlausibilityCheck, ListIsLiveWhileOneObjectChanges) {
  PlausibilityCheck check(frozen_after_ns);
  for (std::int64_t list = 0; list < 100; ++list) {
    const ObjectReport objects[] = {harmless(0.3), harmless(0.01 * static_cast<double>(list % 2))};
    ASSERT_FALSE(check.is_frozen(list * list_period_ns, false, objects)) << list;
  }
}

TEST(PlausibilityCheck, ListWithoutValidObjectsIsNotJudged) {
  PlausibilityCheck check(frozen_after_ns);
  const ObjectReport invalid{};
  EXPECT_FALSE(check.is_frozen(0, false, std::span(&invalid, 1)));
  EXPECT_FALSE(check.is_frozen(10 * frozen_after_ns, false, std::span(&invalid, 1)));
  EXPECT_FALSE(check.is_frozen(20 * frozen_after_ns, false, {}));
}

TEST(PlausibilityCheck, AtRestNoListBecomesFrozen) {
  PlausibilityCheck check(frozen_after_ns);
  const ObjectReport frozen = harmless(0.3);
  EXPECT_FALSE(check.is_frozen(0, true, std::span(&frozen, 1)));
  EXPECT_FALSE(check.is_frozen(5 * frozen_after_ns, true, std::span(&frozen, 1)));
  EXPECT_FALSE(check.is_frozen(6 * frozen_after_ns - 1, false, std::span(&frozen, 1)));
  EXPECT_TRUE(check.is_frozen(6 * frozen_after_ns, false, std::span(&frozen, 1)));
  EXPECT_TRUE(check.is_frozen(7 * frozen_after_ns, true, std::span(&frozen, 1))) << "it remains frozen";
}

/// The deceleration after lists that repeat one harmless object for `duration_ns`.
double deceleration_after(Controller& controller, std::int64_t begin_ns, std::int64_t duration_ns,
                          double speed_mps) {
  const ObjectReport frozen = harmless(0.3);
  double deceleration_mps2 = 0.0;
  for (std::int64_t now = begin_ns; now <= begin_ns + duration_ns; now += list_period_ns) {
    controller.ego_status(now, {speed_mps, 0.0});
    deceleration_mps2 = controller.object_list(now, std::span(&frozen, 1)).deceleration_mps2;
  }
  return deceleration_mps2;
}

TEST(Controller, StopsTheCarWhileTheListIsFrozen) {
  const Parameters parameters;
  Controller controller;
  EXPECT_EQ(deceleration_after(controller, 0, frozen_after_ns - list_period_ns, 10.0), 0.0);
  EXPECT_EQ(deceleration_after(controller, frozen_after_ns, 0, 10.0), parameters.frozen_deceleration_mps2);
  EXPECT_EQ(deceleration_after(controller, 2'000'000'000, 2'000'000'000, 0.0),
            parameters.frozen_deceleration_mps2)
      << "at rest";
  const ObjectReport live = harmless(0.31);
  controller.ego_status(4'010'000'000, {0.0, 0.0});
  EXPECT_EQ(controller.object_list(4'010'000'000, std::span(&live, 1)).deceleration_mps2, 0.0);
}

TEST(Controller, ReleasesASecondAfterTheListIsLiveAgain) {
  const Parameters parameters;
  Controller controller;
  ASSERT_GT(deceleration_after(controller, 0, frozen_after_ns, 10.0), 0.0);
  const auto live_at = [&](std::int64_t now) {
    const ObjectReport live = harmless(1e-9 * static_cast<double>(now));
    controller.ego_status(now, {9.0, 0.0});
    return controller.object_list(now, std::span(&live, 1)).deceleration_mps2;
  };
  EXPECT_GT(live_at(frozen_after_ns + parameters.release_after_ns - 1), 0.0);
  EXPECT_EQ(live_at(frozen_after_ns + parameters.release_after_ns), 0.0);
}

TEST(Controller, WithoutTheCheckBelievesTheList) {
  Parameters parameters;
  parameters.checks_plausibility = false;
  Controller controller(parameters);
  EXPECT_EQ(deceleration_after(controller, 0, 5'000'000'000, 10.0), 0.0);
}

}  // namespace
}  // namespace hil::crossing::aeb
