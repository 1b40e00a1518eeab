// The comparison of a ray's first hits accepts right answers and rejects each kind of wrong one.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

/// Boxes of a metre at 2 m and at 4 m; the ray crosses both.
class CompareFirstHits : public testing::Test {
 protected:
  CompareFirstHits() { place_boxes({2.0, 0.0, 0.0}, {4.0, 0.0, 0.0}); }
  /// By the boxes' centres.
  void place_boxes(const glm::dvec3& near_m, const glm::dvec3& far_m) {
    const TriangleMesh box = make_box({1.0, 1.0, 1.0});
    const TriangleMesh* const meshes[] = {&box};
    std::vector<EntityState> entities(2);
    for (std::uint32_t i = 0; i < 2; ++i) {
      entities[i].id = {i, 1};
      entities[i].row.geometry = {0};
      entities[i].row.motion.p_world_m = i == 0 ? near_m : far_m;
    }
    world_ = std::make_unique<World>(entities, meshes);
    ray_.origin_m = {0.0f, 0.2f, 0.1f};
    truth_ = trace_all(*world_, ray_);
    hits_.clear();
    for (const RayTruth& hit : truth_) {
      hits_.push_back({.status = HitStatus::hit,
                       .lambda = static_cast<float>(hit.lambda),
                       .u = static_cast<float>(hit.u),
                       .v = static_cast<float>(hit.v),
                       .entity = hit.entity,
                       .mask = mask_all,
                       .triangle = hit.triangle,
                       .front_face = hit.front_face,
                       .n_world = hit.n_world});
    }
  }
  Judgement judge(std::span<const RayHit> hits) const {
    return compare_first(*world_, ray_, false, truth_, hits);
  }

  std::unique_ptr<World> world_;
  Ray ray_;
  std::vector<RayTruth> truth_;
  std::vector<RayHit> hits_;
};

TEST_F(CompareFirstHits, AcceptsRightAnswers) {
  ASSERT_EQ(hits_.size(), 4u);
  EXPECT_EQ(judge(hits_).verdict, Verdict::agrees);
  EXPECT_EQ(judge(std::span(hits_).first(2)).verdict, Verdict::agrees) << "the list holds two";
  hits_.resize(6);
  EXPECT_EQ(judge(hits_).verdict, Verdict::agrees) << "followed by misses";
}

TEST_F(CompareFirstHits, RejectsWrongAnswers) {
  using Hits = std::vector<RayHit>;
  const struct {
    const char* what;
    const char* reason;
    void (*tamper)(Hits&);
  } cases[] = {
      {"a hit is missing", "no hit of entity 0", [](Hits& hits) { hits.erase(hits.begin() + 1); }},
      {"the last hit is missing", "no hit of entity 1", [](Hits& hits) { hits.back() = {}; }},
      {"a hit is repeated", "is hit twice", [](Hits& hits) { hits[1] = hits[0]; }},
      {"wrong order", "not in order", [](Hits& hits) { std::swap(hits[1], hits[2]); }},
      {"a hit after a miss", "behind a miss", [](Hits& hits) { hits[1] = {}; }},
      {"another triangle", "", [](Hits& hits) { hits[1].triangle = hits[1].triangle == 0 ? 1 : 0; }}};
  for (const auto& one : cases) {
    SCOPED_TRACE(one.what);
    Hits hits = hits_;
    one.tamper(hits);
    const Judgement judgement = judge(hits);
    EXPECT_EQ(judgement.verdict, Verdict::differs);
    EXPECT_NE(judgement.reason.find(one.reason), std::string::npos) << judgement.reason;
  }
}

/// Close behind another surface, at the edge between two triangles: each of the two is right.
TEST_F(CompareFirstHits, AcceptsEitherTriangleAtAnEdge) {
  const auto at_an_edge = [&] {
    return truth_.size() == 4 && truth_[1].entity.index == 1 &&
           truth_[1].edge_distance_m < 0.1 * truth_[1].noise_m && truth_[0].edge_distance_m > 0.01;
  };
  place_boxes({2.0, 0.0, 0.0}, {2.0001, 0.100000001, 0.0});  // one diagonal of its face, or the other
  if (!at_an_edge()) place_boxes({2.0, 0.0, 0.0}, {2.0001, 0.300000001, 0.0});
  ASSERT_TRUE(at_an_edge());
  hits_[1].triangle ^= 1u;
  EXPECT_EQ(judge(hits_).verdict, Verdict::too_close) << judge(hits_).reason;
}

}  // namespace
}  // namespace rtstdb::oracle
