// Random contacts of concave bodies: every answer of the GPU against the oracle's.

#include <algorithm>
#include <mutex>
#include <ostream>
#include <string>
#include <vector>

#include "rtstdb/oracle/contact_surface.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/support/concave_meshes.hpp"
#include "tests/support/parallel.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

enum class Bodies { tori, fingers_in_bowl, gears, mixed, open };

struct SurfaceCase {
  const char* name;
  Bodies bodies;
  std::size_t pairs;
  double min_apart_m, max_apart_m;  ///< of the bodies' origins
};

std::ostream& operator<<(std::ostream& out, const SurfaceCase& test_case) {
  return out << test_case.name;
}

/// A search may end at a local maximum of the depth: of these bodies at least this share of the truth.
constexpr double local_depth_share = 0.7;

/// Counts of the pairs of a batch.
struct SurfaceTally {
  std::size_t contacts = 0;
  std::size_t certain = 0;  ///< contacts that no noise and no error of a depth can undo
  std::size_t missed = 0;   ///< of these, answered as another status
  std::size_t undecided = 0;
  std::size_t too_close = 0;
  std::vector<std::string> wrong{};

  SurfaceTally& operator+=(SurfaceTally other) {
    contacts += other.contacts;
    certain += other.certain;
    missed += other.missed;
    undecided += other.undecided;
    too_close += other.too_close;
    wrong.insert(wrong.end(), other.wrong.begin(), other.wrong.end());
    return *this;
  }
};

SurfaceTally judge_one(const oracle::World& world, const ContactSearch& search, const ContactAnswer& answer) {
  SurfaceTally tally;
  const oracle::SurfacePair pair(world, search.first, search.second, search.t);
  const oracle::SurfaceTruth truth = oracle::surface_truth(pair);
  tally.contacts = truth.is_contact;
  tally.certain = truth.is_certain_contact();
  const std::string name =
      "entities " + std::to_string(search.first.index) + " and " + std::to_string(search.second.index) + ": ";
  if (answer.pairs.size() != 1) {
    tally.wrong.push_back(name + std::to_string(answer.pairs.size()) + " pairs");
    return tally;
  }
  const ContactPair& found = answer.pairs[0];
  tally.undecided = found.status == PairStatus::undecided;
  const bool is_apart = found.status == PairStatus::separate || found.status == PairStatus::near;
  if (truth.is_certain_contact() && is_apart) {
    tally.missed = 1;
    return tally;
  }
  const oracle::Judgement judgement = oracle::judge_surface_pair(pair, truth, search, found);
  if (judgement.verdict == oracle::Verdict::differs) tally.wrong.push_back(name + judgement.reason);
  const double depth_m = -static_cast<double>(found.distance_m);
  if (found.status == PairStatus::contact &&
      depth_m < local_depth_share * truth.min_depth_m - truth.depth_tolerance_m())
    tally.wrong.push_back(name + "a depth of " + std::to_string(depth_m) + " m instead of " +
                          std::to_string(truth.min_depth_m) + " m");
  tally.too_close = judgement.verdict == oracle::Verdict::too_close;
  return tally;
}

/// On all processors.
SurfaceTally judge_pairs(const oracle::World& world, std::span<const ContactSearch> searches,
                         std::span<const ContactAnswer> answers) {
  SurfaceTally tally;
  std::mutex mutex;
  for_each_in_parallel(searches.size(), [&](std::size_t i) {
    SurfaceTally judged = judge_one(world, searches[i], answers[i]);
    const std::lock_guard lock(mutex);
    tally += std::move(judged);
  });
  return tally;
}

class RandomSurfaces : public DatabaseTest, public testing::WithParamInterface<SurfaceCase> {
 protected:
  static constexpr std::uint32_t pairs_per_batch = 250;

  /// The first and second bodies of pairs: of each shape one with a distance field and one without.
  void add_shapes(Bodies bodies) {
    firsts_.clear();
    seconds_.clear();
    switch (bodies) {
      case Bodies::tori:
        add_both(firsts_, make_torus(1.0, 0.25, 20));
        add_both(firsts_, make_torus(0.8, 0.4, 16));
        seconds_ = firsts_;
        break;
      case Bodies::fingers_in_bowl:
        add_both(firsts_, make_fingers(3, 0.12, 0.9, 0.3, 12));
        add_both(firsts_, make_fingers(4, 0.08, 1.1, 0.2, 16));
        add_both(seconds_, make_bowl(1.0, 0.85, 32));
        break;
      case Bodies::gears:
        add_both(firsts_, make_gear(1.0, 0.8, 0.3, 0.4, 16));
        add_both(firsts_, make_gear(0.8, 0.55, 0.4, 0.7, 9));
        seconds_ = firsts_;
        break;
      case Bodies::mixed:
        add_both(firsts_, make_l_shape(1.2, 0.4, 0.6));
        add_both(firsts_, make_bowl(1.0, 0.7, 24));
        add_both(firsts_, make_hollow_sphere(1.0, 0.7, 2));
        add_both(seconds_, make_sphere(0.6, 3));
        add_both(seconds_, make_box({0.6, 0.5, 0.9}));
        add_both(seconds_, make_wavy_sheet(1.4, 0.15, 12));
        seconds_.push_back(added(make_torus(0.7, 0.25, 16), {.deforms = true}));
        break;
      case Bodies::open:
        firsts_.push_back(added(make_wavy_sheet(2.0, 0.2, 14), {}));
        firsts_.push_back(added(make_sphere(0.9, 2), {.deforms = true}));
        seconds_ = firsts_;
        break;
    }
  }

  std::vector<ContactSearch> make_pairs(Random& random) {
    std::vector<EntityRow> rows;
    const auto body_of = [&](const std::vector<GeometryId>& shapes, const glm::dvec3& p_m) {
      EntityRow row = row_of(shapes[random.below(shapes.size())], p_m);
      row.scale = {random.magnitude(0.6, 1.7), random.magnitude(0.6, 1.7), random.magnitude(0.6, 1.7)};
      if (random.one_in(3)) row.scale = glm::dvec3(1.0);
      row.motion.q_world = random.orientation();
      row.motion.v_world_mps = random.vector();
      row.motion.w_world_radps = random.vector();
      return row;
    };
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i) {
      const glm::dvec3 p_m(100u * glm::uvec3(i % 25, i / 25, 10));
      rows.push_back(body_of(firsts_, p_m));
      rows.push_back(body_of(seconds_, p_m));
      rows.back().motion.p_world_m +=
          random.uniform(GetParam().min_apart_m, GetParam().max_apart_m) * random.direction();
      if (random.one_in(2)) std::swap(rows[rows.size() - 1], rows[rows.size() - 2]);
    }
    const std::vector<EntityId> entities = create(rows);
    std::vector<ContactSearch> searches;
    for (std::uint32_t i = 0; i < pairs_per_batch; ++i) {
      ContactSearch& search = searches.emplace_back();
      search.first = entities[2 * i];
      search.second = entities[2 * i + 1];
      search.t = at_s(0.1 * random.uniform(0.0, 1.0));
      if (random.one_in(4)) search.margin_m = static_cast<float>(random.magnitude(0.01, 0.5));
    }
    return searches;
  }

 private:
  GeometryId added(const TriangleMesh& mesh, const GeometryOptions& options) {
    const auto geometry = database().add_geometry(mesh, "shape" + std::to_string(count_++), options);
    EXPECT_TRUE(geometry.ok()) << (geometry.ok() ? "" : geometry.error().message);
    return geometry.ok() ? geometry.value() : GeometryId{};
  }
  void add_both(std::vector<GeometryId>& shapes, const TriangleMesh& mesh) {
    shapes.push_back(added(mesh, {}));
    GeometryOptions with_field;
    with_field.field.emplace();
    shapes.push_back(added(mesh, with_field));
  }

  std::vector<GeometryId> firsts_, seconds_;
  std::size_t count_ = 0;
};

TEST_P(RandomSurfaces, AgreeWithTheOracle) {
  const std::size_t pairs = hil::tests::rounds(GetParam().pairs, 40 * GetParam().pairs);
  SurfaceTally tally;
  std::size_t judged = 0;
  for (std::size_t batch = 0; judged < pairs && tally.wrong.empty() && !HasFailure(); ++batch) {
    open({.max_entities = 2 * pairs_per_batch});
    add_shapes(GetParam().bodies);
    Random random(490 + batch);
    std::vector<ContactSearch> searches = make_pairs(random);
    searches.resize(std::min<std::size_t>(searches.size(), pairs - judged));
    const ContactQueryOptions options{.name = "surfaces",
                                      .capacity = pairs_per_batch,
                                      .pairs_per_search = 1,
                                      .max_candidates = 16 * pairs_per_batch,
                                      .max_bodies = 1,
                                      .max_surface_triangles = 1u << 19};
    const auto query = prepare(options);
    ASSERT_NE(query, nullptr);
    std::ranges::copy(searches, query->searches().begin());
    const Outcome outcome = run(*query, searches.size());
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    tally += judge_pairs(world(), searches, query->answers());
    judged += searches.size();
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(tally.wrong.size(), 5); ++i)
    ADD_FAILURE() << tally.wrong[i];
  EXPECT_TRUE(tally.wrong.empty()) << tally.wrong.size() << " of " << judged << " answers";
  // The few pairs of a run with a sanitizer do not have these shares.
  if (judged >= 100) {
    EXPECT_GE(10 * tally.contacts, 3 * judged);
    EXPECT_GE(10 * (judged - tally.contacts), judged);
    EXPECT_GE(4 * tally.certain, judged);
  }
  EXPECT_LE(1000 * tally.missed, tally.certain);
  EXPECT_LE(50 * tally.too_close, judged);
  EXPECT_LE(200 * tally.undecided, judged);
  RecordProperty("contacts", static_cast<int>(tally.contacts));
  RecordProperty("certain", static_cast<int>(tally.certain));
}

constexpr SurfaceCase surface_cases[] = {
    {"torus_through_torus", Bodies::tori, 250, 0.2, 2.6},
    {"fingers_in_bowl", Bodies::fingers_in_bowl, 200, 0.0, 1.3},
    {"gear_in_gear", Bodies::gears, 200, 0.2, 2.2},
    {"mixed", Bodies::mixed, 250, 0.1, 1.6},
    {"without_inside", Bodies::open, 100, 0.2, 3.0},
};

INSTANTIATE_TEST_SUITE_P(Bodies, RandomSurfaces, testing::ValuesIn(surface_cases),
                         [](const auto& of_case) { return std::string(of_case.param.name); });

}  // namespace
}  // namespace rtstdb::test
