// The precision that contact.hpp promises, for pairs of convex bodies of all shapes and sizes: status, bounds
// of the distance, normal and points against the oracle, and the share of pairs that stay undecided.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/oracle/contact_pair.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

enum class BodyShape : std::uint8_t { hull, needle, plate, prism, box, repeated, nearly_coplanar };
constexpr std::size_t body_shapes = 7;

using Points = std::vector<glm::dvec3>;

Points in_ball(Random& random, std::size_t count) {
  Points points;
  for (std::size_t i = 0; i < count; ++i)
    points.push_back((random.one_in(2) ? 1.0 : random.uniform(0.5, 1.0)) * random.direction());
  return points;
}

/// The corners of a body of about unit radius.
Points corners_of(Random& random, BodyShape shape) {
  const std::size_t corners = random.one_in(50) ? 100 + random.below(925) : 4 + random.below(97);
  const double thin = random.magnitude(1e-4, 0.1);
  Points points;
  switch (shape) {
    case BodyShape::hull:
      return in_ball(random, corners);
    case BodyShape::needle:
      points = in_ball(random, std::min<std::size_t>(corners, 60));
      for (glm::dvec3& p : points)
        p *= glm::dvec3(1.0, thin, thin * random.uniform(0.5, 1.0));
      return points;
    case BodyShape::plate:
      points = in_ball(random, std::min<std::size_t>(corners, 60));
      for (glm::dvec3& p : points)
        p.z *= thin;
      return points;
    case BodyShape::prism: {
      const std::size_t sides = 3 + random.below(14);
      const double radius = random.magnitude(0.01, 1.0), height = random.magnitude(0.01, 1.0);
      for (std::size_t i = 0; i < sides; ++i) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(sides);
        for (const double side : {-1.0, 1.0})
          points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), side * height);
      }
      return points;
    }
    case BodyShape::box: {
      const glm::dvec3 half(1.0, random.magnitude(0.05, 1.0), random.magnitude(0.05, 1.0));
      for (unsigned i = 0; i < 8; ++i)
        points.push_back(half *
                         glm::dvec3((i & 1u) != 0 ? 1 : -1, (i & 2u) != 0 ? 1 : -1, (i & 4u) != 0 ? 1 : -1));
      return points;
    }
    case BodyShape::repeated:
      points = in_ball(random, std::min<std::size_t>(corners, 50));
      points.insert(points.end(), points.begin(),
                    points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2));
      return points;
    case BodyShape::nearly_coplanar:
      for (std::size_t i = 3 + random.below(30); i > 0; --i) {
        const double angle = random.uniform(0.0, 6.28), radius = std::sqrt(random.uniform(0.0, 1.0));
        points.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                            1e-6 * random.uniform(-1.0, 1.0));
      }
      for (int i = 0; i < 3; ++i)
        points.emplace_back(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5),
                            random.magnitude(0.01, 1.0));
      return points;
  }
  return points;
}

constexpr std::array ratios{1.0, 10.0, 100.0, 1e4};
constexpr double far_away_m = 9e4;

class ContactPrecision : public DatabaseTest {
 protected:
  static constexpr std::uint32_t pairs_per_batch = 1000;
  static constexpr std::size_t geometries = 140;

  struct Geometry {
    GeometryId id;
    std::vector<glm::vec3> corners_m;
    BodyShape shape{};
  };
  struct Pair {
    EntityRow first, second;
    float margin_m = 0.0f;
    double ratio = 0.0;
    double smaller_m = 0.0;  ///< diagonal of the smaller body
  };

  void add_geometries(Random& random) {
    geometries_.clear();
    while (geometries_.size() < geometries) {
      const auto shape = static_cast<BodyShape>(geometries_.size() % body_shapes);
      Points points = corners_of(random, shape);
      const glm::dquat q = random.one_in(3) ? glm::dquat(1.0, 0.0, 0.0, 0.0) : random.orientation();
      const glm::dvec3 offset_m =
          random.one_in(4) ? random.magnitude(0.1, 3.0) * random.direction() : glm::dvec3(0.0);
      std::vector<glm::vec3> placed;
      for (const glm::dvec3& p : points)
        placed.emplace_back(q * p + offset_m);
      const auto mesh = make_hull(placed);
      if (!mesh) continue;  // too thin
      geometries_.push_back({add(mesh.value()), mesh.value().positions_m, shape});
      ASSERT_TRUE(database().geometry_info(geometries_.back().id)->convex);
    }
  }

  /// A body whose size is about that many metres; mostly of uniform scale.
  EntityRow body(Random& random, const Geometry& geometry, double size_m) {
    EntityRow row = row_of(geometry.id, {0.0, 0.0, 0.0});
    row.scale = glm::dvec3(size_m);
    if (random.one_in(3))
      row.scale *=
          glm::dvec3(random.magnitude(0.5, 2.0), random.magnitude(0.5, 2.0), random.magnitude(0.5, 2.0));
    if (!random.one_in(3)) row.motion.q_world = random.orientation();
    return row;
  }

  static Points corners_in_world(const EntityRow& row, const Geometry& geometry) {
    Points corners_m;
    for (const glm::vec3& p : geometry.corners_m)
      corners_m.push_back(row.motion.p_world_m + row.motion.q_world * (row.scale * glm::dvec3(p)));
    return corners_m;
  }

  static double diagonal_m(const EntityRow& row, const Geometry& geometry) {
    glm::vec3 minimum_m = geometry.corners_m[0], maximum_m = minimum_m;
    for (const glm::vec3& p : geometry.corners_m) {
      minimum_m = glm::min(minimum_m, p);
      maximum_m = glm::max(maximum_m, p);
    }
    return glm::length(row.scale * glm::dvec3(maximum_m - minimum_m));
  }

  /// The normal of a face that three corners of the body span, or of an edge of each body.
  static glm::dvec3 feature_normal(Random& random, const Points& first, const Points& second) {
    const auto of = [&](const Points& points) { return points[random.below(points.size())]; };
    const glm::dvec3 a = of(second);
    const glm::dvec3 n = random.one_in(2) ? glm::cross(of(second) - a, of(second) - a)
                                          : glm::cross(of(second) - a, of(first) - of(first));
    return glm::length(n) > 1e-12 ? glm::normalize(n) : random.direction();
  }

  /// Bodies of which the first is beyond the second by a gap along some direction; where it is negative,
  /// their depth is at most minus the gap.
  Pair random_pair(Random& random) {
    Pair pair;
    const Geometry& first = geometries_[random.below(geometries)];
    const Geometry& second = geometries_[random.below(geometries)];
    pair.ratio = ratios[random.below(ratios.size())];
    const double size_m = random.magnitude(0.3, 3.0) / std::sqrt(pair.ratio);
    const bool first_is_larger = random.one_in(2);
    pair.first = body(random, first, first_is_larger ? size_m * pair.ratio : size_m);
    pair.second = body(random, second, first_is_larger ? size_m : size_m * pair.ratio);
    pair.smaller_m = std::min(diagonal_m(pair.first, first), diagonal_m(pair.second, second));
    const Points of_first = corners_in_world(pair.first, first);
    const Points of_second = corners_in_world(pair.second, second);
    const glm::dvec3 n = random.one_in(3) ? random.direction() : feature_normal(random, of_first, of_second);
    const auto along = [&](const glm::dvec3& p) { return glm::dot(p, n); };
    const glm::dvec3 lowest = *std::ranges::min_element(of_first, {}, along);
    const glm::dvec3 highest = *std::ranges::max_element(of_second, {}, along);
    const double share = random.one_in(10) ? random.magnitude(0.1, 3.0) : random.magnitude(1e-3, 0.1);
    const double gap_m = (random.one_in(2) ? 1.0 : -1.0) * share * pair.smaller_m;
    pair.first.motion.p_world_m = highest - lowest + gap_m * n;
    // 100 km away where both bodies fit into the limits.
    if (random.one_in(4) && glm::length(pair.first.motion.p_world_m) < 1e5 - far_away_m)
      for (EntityRow* row : {&pair.first, &pair.second})
        row->motion.p_world_m += glm::dvec3(far_away_m, -far_away_m, far_away_m);
    if (random.one_in(2)) pair.margin_m = static_cast<float>(random.magnitude(1e-3, 0.1) * pair.smaller_m);
    return pair;
  }

  std::vector<Geometry> geometries_;
};

TEST_F(ContactPrecision, RandomPairsAgreeWithTheOracle) {
  struct Count {
    std::size_t pairs = 0, undecided = 0, contacts = 0, near = 0;
  };
  std::array<Count, ratios.size()> counts{};
  const std::uint64_t batches = hil::tests::rounds(10, 1000);
  std::size_t failures = 0;
  for (std::uint64_t batch = 0; batch < batches && failures < 10; ++batch) {
    SCOPED_TRACE(testing::Message() << "batch " << batch);
    Random random(500 + batch);
    open({.max_entities = 2 * pairs_per_batch});
    ASSERT_NO_FATAL_FAILURE(add_geometries(random));
    std::vector<Pair> pairs;
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i) {
      pairs.push_back(random_pair(random));
      rows.insert(rows.end(), {pairs.back().first, pairs.back().second});
    }
    const std::vector<EntityId> entities = create(rows);
    const auto query = prepare(ContactQueryOptions{
        .name = "pairs", .capacity = pairs_per_batch, .pairs_per_search = 1, .max_bodies = 1});
    ASSERT_NE(query, nullptr);
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i)
      query->searches()[i] = {
          .first = entities[2 * i], .second = entities[2 * i + 1], .margin_m = pairs[i].margin_m};
    const Outcome outcome = run(*query, pairs_per_batch);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    const oracle::World oracle_world = world();
    for (std::uint32_t i = 0; i < pairs_per_batch && failures < 10; ++i) {
      const ContactPair& answer = query->answers()[i].pairs[0];
      const oracle::PosedPair posed = oracle::posed_pair(oracle_world, answer.first, answer.second, {});
      const oracle::PairTruth truth = oracle::pair_truth(posed);
      const oracle::Judgement judgement = oracle::judge_pair(posed, truth, query->searches()[i], answer);
      if (judgement.verdict == oracle::Verdict::differs) {
        ++failures;
        ADD_FAILURE() << "pair " << i << " of ratio " << pairs[i].ratio << ", status "
                      << to_string(answer.status) << ", distance " << truth.distance_m << " m, smaller body "
                      << pairs[i].smaller_m << " m: " << judgement.reason;
      }
      const auto margin_m = static_cast<double>(pairs[i].margin_m);
      const double from_threshold_m =
          std::min(std::abs(truth.distance_m), std::abs(truth.distance_m - margin_m));
      if (from_threshold_m < std::max(8.0 * truth.ulp_m, 1e-3 * pairs[i].smaller_m)) continue;
      const auto ratio = static_cast<std::size_t>(std::ranges::find(ratios, pairs[i].ratio) - ratios.begin());
      ++counts[ratio].pairs;
      counts[ratio].undecided += answer.status == PairStatus::undecided ? 1 : 0;
      counts[ratio].contacts += answer.status == PairStatus::contact ? 1 : 0;
      counts[ratio].near += answer.status == PairStatus::near ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    SCOPED_TRACE(testing::Message() << "ratio " << ratios[i] << ": " << counts[i].undecided << " of "
                                    << counts[i].pairs << " undecided");
    EXPECT_LT(1000 * counts[i].undecided, std::max<std::size_t>(counts[i].pairs, 1));
    EXPECT_GT(counts[i].contacts, counts[i].pairs / 5);
    EXPECT_GT(counts[i].near, counts[i].pairs / 50);
  }
}

}  // namespace
}  // namespace rtstdb::test
