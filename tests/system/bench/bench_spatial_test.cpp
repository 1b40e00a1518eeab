// How the spatial benchmark compares answers, and its program in tiny mode.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/spatial/embree_tree.hpp"
#include "bench/spatial/our_tree.hpp"
#include "bench/spatial/ray_agreement.hpp"
#include "tests/support/bench_program.hpp"

namespace hil::bench {
namespace {

/// In z = 0; rays come from above.
const rtstdb::TriangleMesh triangle{{{0.0f, 0.0f, 0.0f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}},
                                    {{0, 1, 2}}};

double doubt_at(double x_m, double y_m) {
  return lambda_doubt(triangle, 0, {{x_m, y_m, 2.0}, {0.0, 0.0, -1.0}}, 1e-3);
}

TEST(RayAgreement, IsInDoubtAtEdgesOnly) {
  EXPECT_LT(doubt_at(0.3, 0.3), 1e-12);
  EXPECT_LT(doubt_at(0.0011, 0.3), 1e-12);
  EXPECT_TRUE(std::isinf(doubt_at(0.0009, 0.3)));
  EXPECT_TRUE(std::isinf(doubt_at(0.3, -0.1)));
  // At a flat angle a shifted ray has another lambda.
  const double flat = lambda_doubt(triangle, 0, {{0.3, 0.3, 0.1}, {0.01, 0.0, -0.1}}, 1e-3);
  EXPECT_NEAR(flat, 1e-3 / std::sqrt(1.01), 1e-9);
}

class ComparedRays : public testing::Test {
 protected:
  ComparedRays() : ours_(100), theirs_(100) {
    for (std::size_t i = 0; i < 50; ++i) {
      ours_[i].status = rtstdb::HitStatus::hit;
      ours_[i].lambda = 2.0f;
      theirs_[i].lambda = 2.0f;
    }
  }
  void judge(double doubt) {
    const Agreement agreement{"rays", 1e-6, [=](std::size_t, const JudgedHit&, double) { return doubt; }};
    demand_same_closest(agreement, ours_, theirs_);
  }
  std::vector<rtstdb::RayHit> ours_;
  std::vector<PeerHit> theirs_;
};

TEST_F(ComparedRays, AcceptEqualAnswers) {
  theirs_[3].lambda = 2.0001f;
  EXPECT_NO_THROW(judge(0.0));
}

TEST_F(ComparedRays, RejectUnexplainedDifferences) {
  theirs_[3].lambda = 2.001f;
  EXPECT_THROW(judge(0.0), std::runtime_error);
  theirs_[3] = PeerHit{};
  EXPECT_THROW(judge(1e9), std::runtime_error);
}

TEST_F(ComparedRays, RejectTooManyExplainedDifferences) {
  theirs_[3].lambda = 2.001f;
  EXPECT_THROW(judge(1.0), std::runtime_error);
}

TEST_F(ComparedRays, RejectBatchesWithoutHits) {
  ours_.assign(100, {});
  theirs_.assign(100, {});
  EXPECT_THROW(judge(0.0), std::runtime_error);
}

/// Three triangles at each corner of a cube: the best tree is a root with eight leaves.
TEST(TreeCosts, OfEightClustersAreThoseOfARootWithEightLeaves) {
  rtstdb::TriangleMesh mesh;
  for (std::uint32_t cluster = 0; cluster < 8; ++cluster) {
    const glm::vec3 at = 10.0f * glm::vec3(cluster & 1, cluster >> 1 & 1, cluster >> 2);
    const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
    for (const glm::vec3& corner :
         {glm::vec3(0, 0, 0), glm::vec3(1, 1, 0), glm::vec3(0, 1, 1), glm::vec3(1, 0, 1)})
      mesh.positions_m.push_back(at + corner);
    for (const glm::uvec3& corners : {glm::uvec3(0, 1, 2), glm::uvec3(0, 1, 3), glm::uvec3(1, 2, 3)})
      mesh.triangles.push_back(corners + first);
  }
  const double cost = 1.0 + 8 * 3 * 0.3 * (1.0 * 1.0) / (11.0 * 11.0);
  EXPECT_NEAR(embree_tree_cost(mesh, EmbreeQuality::medium), cost, 1e-6);
  EXPECT_NEAR(embree_tree_cost(mesh, EmbreeQuality::high), cost, 1e-6);
  // In quanta of 1/16 m: up to an eighth more along each axis.
  EXPECT_GT(our_tree_cost(mesh), cost);
  EXPECT_LT(our_tree_cost(mesh), 1.0 + 1.125 * 1.125 * (cost - 1.0));
}

constexpr Expected expected_figures[] = {
    {"ray_closest_coherent", "Mray/s", "Embree 3"},
    {"ray_closest_coherent_device", "Mray/s", ""},
    {"ray_closest_incoherent", "Mray/s", "Embree 3"},
    {"ray_closest_incoherent_device", "Mray/s", ""},
    {"ray_any_incoherent", "Mray/s", "Embree 3"},
    {"ray_any_incoherent_device", "Mray/s", ""},
    {"ray_moving_instances", "Mray/s", "Embree 3"},
    {"ray_moving_instances_device", "Mray/s", ""},
    {"ray_moving_instances_scan", "Mray/s", "Embree 3"},
    {"ray_moving_instances_scan_device", "Mray/s", ""},
    {"nearest_triangle_k1", "kquery/s", "Embree 3"},
    {"nearest_triangle_k1_device", "kquery/s", ""},
    {"nearest_entity_k8", "kquery/s", "nanoflann 1"},
    {"nearest_entity_k8_device", "kquery/s", ""},
    {"region_box_entities", "kquery/s", "Boost.Geometry 1"},
    {"region_box_entities_device", "kquery/s", ""},
    {"region_box_triangles", "kquery/s", "Boost.Geometry 1"},
    {"region_box_triangles_device", "kquery/s", ""},
    {"tlas_rebuild_10k", "ms", "Embree 3"},
    {"tlas_rebuild_10k_device", "ms", ""},
    {"tlas_rebuild_100k", "ms", "Embree 3"},
    {"tlas_rebuild_100k_device", "ms", ""},
    {"tlas_refit_10k", "ms", "Embree 3"},
    {"tlas_refit_10k_device", "ms", ""},
    {"blas_build_bunny", "ms", "Embree 3"},
    {"blas_refit_bunny", "ms", "Embree 3"},
    {"blas_refit_bunny_device", "ms", ""},
    {"latency_small_query_p50", "us", ""},
    {"latency_small_query_p99", "us", ""},
    {"latency_small_update_query_p50", "us", ""},
    {"latency_small_update_query_p99", "us", ""},
    {"bytes_per_triangle", "B", "Embree 3"},
    {"bytes_per_entity", "B", "Embree 3"},
    {"blas_sah_cost_bunny", "cost", "Embree 3"},
    {"blas_sah_cost_bunny_split", "cost", "Embree 3"},
    {"blas_sah_cost_body", "cost", "Embree 3"},
    {"blas_sah_cost_body_split", "cost", "Embree 3"},
    {"blas_sah_cost_soup", "cost", "Embree 3"},
    {"blas_sah_cost_soup_split", "cost", "Embree 3"},
};

TEST(BenchSpatial, PrintsOneJsonLinePerFigureInTinyMode) {
  expect_figures(run_program(HIL_BENCH_SPATIAL " --tiny --json"), expected_figures);
}

TEST(BenchSpatial, EndsIfProcessorsCanNotBeKeptAwake) {
  const Output output = run_program(HIL_BENCH_SPATIAL " --tiny --json --awake memory");
  const int file = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  if (file >= 0) {
    close(file);
    EXPECT_EQ(output.exit_code, 0) << output.text;
    EXPECT_NE(output.text.find("; processors kept awake\""), std::string::npos) << output.text;
  } else {
    EXPECT_EQ(output.exit_code, 1) << output.text;
    EXPECT_NE(output.text.find("hil-bench-spatial: /dev/cpu_dma_latency refused"), std::string::npos)
        << output.text;
  }
}

TEST(BenchSpatial, RefusesAnUnknownArgumentWithTheKnownOnes) {
  const Output output = run_program(HIL_BENCH_SPATIAL " --fast");
  EXPECT_EQ(output.exit_code, 2);
  EXPECT_NE(output.text.find("unknown argument '--fast'; known: --json, --tiny, --awake, rays"),
            std::string::npos)
      << output.text;
}

}  // namespace
}  // namespace hil::bench
