// Callers compile with -Wmissing-field-initializers, which concerns designated initialisers too. The test is
// that this file compiles: each public struct can be initialised by some of its members. The others have
// defaults.

#include <gtest/gtest.h>

#include <rtstdb/database.hpp>
#include <rtstdb/durability.hpp>
#include <rtstdb/history.hpp>
#include <rtstdb/log.hpp>

#pragma GCC diagnostic error "-Wmissing-field-initializers"

namespace rtstdb {
namespace {

TEST(DesignatedInitialisers, OfOptions) {
  EXPECT_EQ((DatabaseOptions{.gpu = "0"}).max_entities, 4096u);
  EXPECT_EQ((DurabilityOptions{.mode = DurabilityMode::async}).directory, "");
  EXPECT_EQ((HistoryOptions{.directory = "x"}).gpu, "auto");
  EXPECT_EQ((HistoryOptions{.salvage = true}).from.kind, ReadAt::Kind::latest);
  EXPECT_EQ((GeometryOptions{.deforms = true}).retained_shapes, 2u);
  EXPECT_EQ((RayQueryOptions{.name = "q"}).capacity, 0u);
  EXPECT_EQ((RayQueryOptions{.capacity = 1}).name, "");
  EXPECT_EQ((RegionQueryOptions{.name = "q"}).ids_per_region, 64u);
  EXPECT_EQ((RegionQueryOptions{.capacity = 1}).name, "");
  EXPECT_EQ((NearestQueryOptions{.name = "q"}).k, 1u);
  EXPECT_EQ((NearestQueryOptions{.capacity = 1}).name, "");
  EXPECT_EQ((ConeQueryOptions{.name = "q"}).returns_per_cone, 1u);
  EXPECT_EQ((ConeQueryOptions{.capacity = 1}).name, "");
  EXPECT_EQ((OverlapQueryOptions{.name = "q"}).capacity, 0u);
  EXPECT_EQ((OverlapQueryOptions{.capacity = 1}).name, "");
  EXPECT_EQ((StandingOptions{.name = "q"}).ring_capacity, 1024u);
  EXPECT_EQ((StandingOptions{.ring_capacity = 2}).name, "");
  EXPECT_EQ((TransactionOptions{.max_writes = 1}).max_queries, 0u);
  EXPECT_EQ((ReservationOptions{.name = "r"}).period.count(), 0);
  EXPECT_EQ((ReservationOptions{.period = Nanoseconds(1)}).name, "");
  EXPECT_EQ((Terms{.importance = 1}).read_at.kind, ReadAt::Kind::latest);
  EXPECT_EQ((ReadAt{.version = 1}).kind, ReadAt::Kind::latest);
}

TEST(DesignatedInitialisers, OfQueries) {
  EXPECT_FALSE((Ray{.origin_m = {1, 2, 3}}).carrier.valid());
  EXPECT_FALSE((Region{.center_m = {1, 2, 3}}).carrier.valid());
  EXPECT_FALSE((Nearest{.point_m = {1, 2, 3}}).excluded.valid());
  EXPECT_FALSE((Nearest{.carrier = EntityId{1, 1}}).excluded.valid());
  EXPECT_FALSE((Overlap{.mask = 1}).entity.valid());
  EXPECT_FALSE((StandingRegion{.region = {}}).excluded.valid());
  EXPECT_FALSE((StandingRay{.ray = {}}).excluded.valid());
  EXPECT_EQ((StandingNearest{.point = {}}).k, 1u);
  EXPECT_FALSE((StandingNearest{.k = 2}).point.carrier.valid());
}

TEST(DesignatedInitialisers, OfRowsAndMeshes) {
  EXPECT_EQ((EntityRow{.geometry = GeometryId{0}}).mask, mask_all);
  EXPECT_FALSE((EntityRow{.mask = 1}).geometry.valid());
  EXPECT_EQ((EntityState{.written_by = 1}).row.mask, mask_all);
  EXPECT_EQ((EntityRow{.mask = 1}).material, MaterialId{});
  EXPECT_EQ((Material{.reflectance = 0.5}).retro_gain, 0.0);
  EXPECT_EQ((Material{.retro_gain = 2.0}).reflectance, 1.0);
  EXPECT_EQ((Motion{.p_world_m = {1, 2, 3}}).q_world.w, 1.0);
  EXPECT_EQ((Pose{.p_world_m = {1, 2, 3}}).q_world.w, 1.0);
  EXPECT_TRUE((TriangleMesh{.positions_m = {}}).triangles.empty());
  EXPECT_TRUE((TriangleMesh{.triangles = {}}).corner_colors.empty());
  EXPECT_FALSE((MeshFileReport{.materials_ignored = true}).textures_ignored);
  EXPECT_EQ((Bounds{.minimum_m = {1, 2, 3}}).maximum_m.x, 0.0f);
  EXPECT_EQ((EntityId{.index = 1}).generation, 0u);
  EXPECT_EQ((VersionInfo{.version = 1}).time, WorldTime{});
  EXPECT_EQ((Error{.code = ErrorCode::file}).message, "");
}

TEST(DesignatedInitialisers, OfResults) {
  EXPECT_EQ((Outcome{.partial = true}).bad_input.reason, BadInputReason::none);
  EXPECT_FALSE((BadInput{.element = 1}).entity.valid());
  EXPECT_FALSE((Conflict{.precondition = 1}).entity.valid());
  EXPECT_FALSE((RayHit{.lambda = 1.0f}).entity.valid());
  EXPECT_FALSE((Neighbor{.distance_m = 1.0f}).entity.valid());
  EXPECT_TRUE((RegionAnswer{.found = 1}).entities.empty());
  EXPECT_TRUE((NearestAnswer{.incomplete = true}).neighbors.empty());
  EXPECT_FALSE((EntityTriangle{.triangle = 1}).entity.valid());
  EXPECT_EQ((AnswerInfo{.elements = 1}).version, 0u);
  EXPECT_EQ((DeviceInfo{.software = true}).name, "");
  EXPECT_EQ((TransactionCounts{.submitted = 1}).committed, 0u);
  EXPECT_EQ((CostPredictions{.count = 1}).cost_class, "");
  EXPECT_TRUE((SchedulerCounts{.promised = 1}).predictions.empty());
  EXPECT_EQ((ReservationCounts{.kept = 1}).options.name, "");
  EXPECT_EQ((ShapeCounts{.refits = 1}).rebuilds, 0u);
  EXPECT_TRUE((Health{.device_losses = 1}).degraded.empty());
  EXPECT_EQ((Recovery{.found = true}).summary, "");
  EXPECT_EQ((Durability{.faults = 1}).last_fault, "");
  EXPECT_EQ((HistoryExtent{.commits = 1}).damage, "");
  EXPECT_EQ((LogFile{.bytes = 1}).damage, "");
  EXPECT_EQ((LogContents{.format = 1}).refusal, "");
  EXPECT_FALSE((LogWrite{.kind = LogWrite::Kind::remove}).state.id.valid());
  EXPECT_FALSE((LogShape{.positions_m = {}}).geometry.valid());
  EXPECT_FALSE((StandingEvent{.version = 1}).entity.valid());
  EXPECT_EQ((Progress{.version = 1}).until, WorldTime{});
  EXPECT_EQ((StandingCounts{.queries = 1}).events, 0u);
}

}  // namespace
}  // namespace rtstdb
