// Rays at bodies that are far longer, or farther away, than they are thick. Up to max_distance_per_thickness
// each ray at the middle of a needle hits; beyond, the oracle has to explain each miss by rounding.

#include <rtstdb/limits.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class Needles : public DatabaseTest {
 protected:
  struct Needle {
    double offset_m = 0.0;  ///< from the world's origin
    double length_m = 1.0;
    double distance_m = 1.0;  ///< of the rays' origins
    double thickness_m = 1.0;
    double largest_m() const { return std::max({offset_m, length_m, distance_m}); }
  };
  struct Counts {
    int hit = 0, missed = 0;  ///< of the rays that hit in the oracle
    Tally tally;
  };

  Counts trace_needle(const Needle& needle) {
    if (!cube_.valid()) cube_ = add(make_box({1.0, 1.0, 1.0}));
    Random random(5);
    EntityRow row = row_of(cube_, needle.offset_m * random.direction());
    row.scale = {needle.length_m, needle.thickness_m, needle.thickness_m};
    row.motion.q_world = random.orientation();
    const EntityId entity = create(row);
    const oracle::World truth = world();
    const glm::dvec3 axis = row.motion.q_world * glm::dvec3(1.0, 0.0, 0.0);
    std::vector<Ray> rays;
    for (int k = 0; k < 1000; ++k) {
      const glm::dvec3 to_m = row.motion.p_world_m + axis * needle.length_m * random.uniform(-0.45, 0.45);
      const glm::dvec3 aside = glm::normalize(glm::cross(axis, random.direction()));
      const glm::dvec3 from_m = to_m + needle.distance_m * aside;
      rays.push_back(ray_from(from_m, to_m - from_m));
    }
    const auto hits = trace(rays);
    Counts counts;
    for (std::size_t k = 0; k < rays.size(); ++k) {
      if (oracle::trace(truth, rays[k]).status != HitStatus::hit) continue;
      ++(hits[k].status == HitStatus::hit ? counts.hit : counts.missed);
    }
    counts.tally = judge(truth, rays, hits);
    remove(entity, {});
    return counts;
  }

  GeometryId cube_;
};

TEST_F(Needles, AreHitUpToTheDocumentedRatio) {
  const std::vector<Needle> needles{
      {0.0, 1e4, 1.0, 1e-2},   {0.0, 1e4, 1e4, 1e-2},    {1000.0, 1e4, 1e4, 1e-2},
      {0.0, 100.0, 1e4, 1e-2}, {0.0, 100.0, 1.0, 1e-4},  {0.0, 1.0, 100.0, 1e-4},
      {0.0, 1.0, 1.0, 1e-6},   {1000.0, 1.0, 1.0, 1e-3}, {100.0, 100.0, 1.0, 1e-4}};
  for (const Needle& needle : needles) {
    SCOPED_TRACE("length " + std::to_string(needle.length_m) + ", distance " +
                 std::to_string(needle.distance_m) + ", offset " + std::to_string(needle.offset_m));
    ASSERT_NEAR(needle.largest_m() / needle.thickness_m, max_distance_per_thickness, 1.0);
    const Counts counts = trace_needle(needle);
    EXPECT_EQ(counts.hit, 1000);
    EXPECT_EQ(counts.missed, 0);
  }
}

/// `judge` fails the test for each miss that rounding does not explain.
TEST_F(Needles, AreMissedByRoundingAloneBeyondThatRatio) {
  const Counts counts = trace_needle({0.0, 1e4, 1e4, 1e-4});
  EXPECT_GT(counts.missed, 100);
  EXPECT_GT(counts.tally.too_close, 100u);
}

}  // namespace
}  // namespace rtstdb::test
