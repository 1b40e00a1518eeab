// The judge of a ray's first hits: what is right passes, and each way of being wrong is caught.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

/// Boxes of a metre at 2 m and at 4 m; the ray crosses both.
class FirstHitsJudged : public testing::Test {
 protected:
  FirstHitsJudged() { stand({2.0, 0.0, 0.0}, {4.0, 0.0, 0.0}); }
  /// Where the boxes' centres are.
  void stand(const glm::dvec3& near_m, const glm::dvec3& far_m) {
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
  void expect_caught(const std::string& words) const {
    const Judgement judgement = judge(hits_);
    EXPECT_EQ(judgement.verdict, Verdict::differs);
    EXPECT_NE(judgement.reason.find(words), std::string::npos) << judgement.reason;
  }

  std::unique_ptr<World> world_;
  Ray ray_;
  std::vector<RayTruth> truth_;
  std::vector<RayHit> hits_;
};

TEST_F(FirstHitsJudged, WhatIsRightPasses) {
  ASSERT_EQ(hits_.size(), 4u);
  EXPECT_EQ(judge(hits_).verdict, Verdict::agrees);
  EXPECT_EQ(judge(std::span(hits_).first(2)).verdict, Verdict::agrees) << "there was room for two";
  hits_.resize(6);
  EXPECT_EQ(judge(hits_).verdict, Verdict::agrees) << "misses behind";
}

TEST_F(FirstHitsJudged, AMissingHitIsCaught) {
  hits_.erase(hits_.begin() + 1);
  expect_caught("no hit of entity 0");
}

TEST_F(FirstHitsJudged, AMissingLastHitIsCaught) {
  hits_.back() = {};
  expect_caught("no hit of entity 1");
}

TEST_F(FirstHitsJudged, AHitThatIsThereTwiceIsCaught) {
  hits_[1] = hits_[0];
  expect_caught("is hit twice");
}

TEST_F(FirstHitsJudged, DisorderIsCaught) {
  std::swap(hits_[1], hits_[2]);
  expect_caught("not in order");
}

TEST_F(FirstHitsJudged, AHitBehindAMissIsCaught) {
  hits_[1] = {};
  expect_caught("behind a miss");
}

TEST_F(FirstHitsJudged, AHitThatIsNotThereIsCaught) {
  hits_[1].triangle = hits_[1].triangle == 0 ? 1 : 0;
  EXPECT_EQ(judge(hits_).verdict, Verdict::differs);
}

/// Close behind another surface, by the edge between two triangles: either is right.
TEST_F(FirstHitsJudged, ANeighbourBehindAnotherHitIsRight) {
  const auto by_an_edge = [&] {
    return truth_.size() == 4 && truth_[1].entity.index == 1 &&
           truth_[1].edge_distance_m < 0.1 * truth_[1].noise_m && truth_[0].edge_distance_m > 0.01;
  };
  stand({2.0, 0.0, 0.0}, {2.0001, 0.100000001, 0.0});  // one diagonal of its face, or the other
  if (!by_an_edge()) stand({2.0, 0.0, 0.0}, {2.0001, 0.300000001, 0.0});
  ASSERT_TRUE(by_an_edge());
  hits_[1].triangle ^= 1u;
  EXPECT_EQ(judge(hits_).verdict, Verdict::too_close) << judge(hits_).reason;
}

}  // namespace
}  // namespace rtstdb::oracle
