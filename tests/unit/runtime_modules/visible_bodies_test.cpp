// The bodies in an image, from planes of identities and depths that are written by hand.

#include "runtime/modules/camera/visible_bodies.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/allocation_guard.hpp"

namespace hil::modules {
namespace {

constexpr float far = std::numeric_limits<float>::infinity();

/// A letter is a body, '.' is nothing.
std::vector<rtstdb::EntityId> plane(const std::string& letters) {
  std::vector<rtstdb::EntityId> entities;
  for (const char letter : letters)
    entities.push_back(letter == '.' ? rtstdb::EntityId{}
                                     : rtstdb::EntityId{static_cast<std::uint32_t>(letter - 'a'), 1});
  return entities;
}

void expect_body(const VisibleBody& body, char letter, std::array<std::uint32_t, 4> box, float depth_m,
                 std::uint32_t pixels) {
  EXPECT_EQ(body.entity.index, static_cast<std::uint32_t>(letter - 'a'));
  EXPECT_EQ((std::array{body.x_min, body.y_min, body.x_max, body.y_max}), box) << letter;
  EXPECT_EQ(body.depth_m, depth_m) << letter;
  EXPECT_EQ(body.pixels, pixels) << letter;
}

TEST(VisibleBodies, HaveTheirBoxesDepthsAndPixels) {
  const auto entities = plane(
      "....bb"
      ".aaabb"
      ".a.cca"
      "......");
  const std::vector<float> depth_m{far, far,  far,  far,  7.0f, 7.5f,  //
                                   far, 3.0f, 3.0f, 3.5f, 6.5f, 7.0f,  //
                                   far, 2.5f, far,  3.0f, 2.5f, 9.0f,  //
                                   far, far,  far,  far,  far,  far};
  VisibleBodies bodies;
  bodies.find(6, entities, depth_m);
  const auto found = bodies.nearest_first();
  ASSERT_EQ(found.size(), 3U);
  expect_body(found[0], 'a', {1, 1, 6, 3}, 2.5f, 5);  // equal depths: the lower index first
  expect_body(found[1], 'c', {3, 2, 5, 3}, 2.5f, 2);
  expect_body(found[2], 'b', {4, 0, 6, 2}, 6.5f, 4);
  EXPECT_EQ(bodies.ignored_pixels(), 0U);
}

TEST(VisibleBodies, OfAnEmptyImageAreNone) {
  VisibleBodies bodies;
  bodies.find(2, plane("ab"), std::vector{1.0f, 2.0f});
  bodies.find(2, plane("...."), std::vector<float>(4, far));
  EXPECT_TRUE(bodies.nearest_first().empty());
}

TEST(VisibleBodies, FurtherOnesAreIgnoredAndCounted) {
  constexpr std::uint32_t all = VisibleBodies::max_bodies + 3;
  std::vector<rtstdb::EntityId> entities;
  std::vector<float> depth_m;
  for (std::uint32_t i = 0; i < all; ++i) {
    entities.push_back({i * 4096, 1});  // hashes of such indices collide most
    depth_m.push_back(static_cast<float>(all - i));
  }
  VisibleBodies bodies;
  allocation_guard::reset();
  allocation_guard::enter_tick();
  bodies.find(all, entities, depth_m);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  ASSERT_EQ(bodies.nearest_first().size(), VisibleBodies::max_bodies);
  EXPECT_EQ(bodies.nearest_first()[0].entity.index, (VisibleBodies::max_bodies - 1) * 4096);
  EXPECT_EQ(bodies.ignored_pixels(), 3U);
}

}  // namespace
}  // namespace hil::modules
