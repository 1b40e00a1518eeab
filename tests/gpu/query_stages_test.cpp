// Queries with several stages, each over its own places: on the executor, with a query that notes the parts
// that it is to record and has no kernel.

#include <vector>

#include "tests/gpu/executor_fixture.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t element_count = 640;

/// Stage 0 searches the elements and leaves the first two incomplete, which a retry completes; stage 1 has no
/// places; stage 2 has `last_places`.
class StagedQuery final : public query::GpuQuery {
 public:
  explicit StagedQuery(std::uint32_t last_places)
      : GpuQuery(element_count, LatePolicy::discard), last_places_(last_places) {}
  ~StagedQuery() override { leave(); }

  query::CostClass cost_class() const noexcept override { return query::CostClass::nearest; }
  std::optional<BadInput> check(std::uint32_t /*count*/, const store::RowSource& rows,
                                store::TimeSpan& times) const noexcept override {
    times = {rows.time(), rows.time()};
    return std::nullopt;
  }
  void record(const query::BatchPart& part, const query::Recording& /*recording*/) noexcept override {
    recorded.push_back(part);
  }

  std::vector<query::BatchPart> recorded, unpacked;
  std::vector<std::uint32_t> answered_before_stage_2;

 private:
  query::DeviceNeeds device_needs(const gpu::DeviceLimits& /*limits*/) override { return {}; }
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId /*shader*/, std::uint32_t /*slot*/,
                                                const accel::GeometryPool& /*pool*/,
                                                const accel::Tlas& /*tlas*/) const override {
    return {};
  }
  void unpack(const query::BatchPart& part, const accel::TlasView& /*view*/) noexcept override {
    unpacked.push_back(part);
    if (part.stage == 0 && !part.is_retry && part.range.first == 0) {
      note_incomplete(0);
      note_incomplete(1);
    }
  }
  bool is_incomplete(std::uint32_t /*place*/) const noexcept override { return false; }
  void mark_incomplete(std::uint32_t /*place*/) noexcept override {}
  std::uint32_t stages() const noexcept override { return 3; }
  std::uint32_t begin_stage(std::uint32_t stage, const query::BatchWorld& /*world*/) noexcept override {
    if (stage == 2) answered_before_stage_2.push_back(answered());
    return stage == 2 ? last_places_ : 0;
  }

  const std::uint32_t last_places_;
};

/// Expects each place of a stage once and in order. Returns the number of parts.
std::size_t expect_covered(const std::vector<query::BatchPart>& parts, std::uint32_t stage, bool is_retry,
                           std::uint32_t places) {
  std::uint32_t next = 0;
  std::size_t count = 0;
  for (const query::BatchPart& part : parts) {
    if (part.stage != stage || part.is_retry != is_retry) continue;
    EXPECT_EQ(part.range.first, next);
    next = part.range.end;
    ++count;
  }
  EXPECT_EQ(next, places);
  return count;
}

class QueryStages : public ExecutorTest {
 protected:
  query::RunStatus run(StagedQuery& query, query::ExecutorCallbacks* callbacks) {
    const FixedRows rows({});
    store::TimeSpan times;
    EXPECT_FALSE(query.check(element_count, rows, times));
    const query::Request request{
        .query = &query, .count = element_count, .per_chunk = 64, .chunk_time = Nanoseconds(1'000'000'000)};
    return executor_->run(rows, std::span(&request, 1), times, callbacks).status;
  }
};

TEST_F(QueryStages, RunInOrderWithPreemptionPointsBetween) {
  StagedQuery query(200);
  std::vector<std::uint32_t> stage_at_point;
  PreemptionPoints points([&] { stage_at_point.push_back(query.stage()); });
  EXPECT_EQ(run(query, &points), query::RunStatus::done);
  EXPECT_GT(expect_covered(query.recorded, 0, false, element_count), 1u);
  expect_covered(query.recorded, 0, true, 2);
  EXPECT_GT(expect_covered(query.recorded, 2, false, 200), 1u);
  expect_covered(query.unpacked, 0, false, element_count);
  expect_covered(query.unpacked, 0, true, 2);
  expect_covered(query.unpacked, 2, false, 200);
  EXPECT_TRUE(std::ranges::is_sorted(query.unpacked, {}, &query::BatchPart::stage));
  EXPECT_TRUE(std::ranges::count(stage_at_point, 0u) > 0 && std::ranges::count(stage_at_point, 2u) > 0);
  EXPECT_EQ(query.answered_before_stage_2, std::vector{0u});
  EXPECT_EQ(query.answered(), element_count);
}

TEST_F(QueryStages, CompleteABatchIfTheLastOneHasNoPlaces) {
  StagedQuery query(0);
  EXPECT_EQ(run(query, nullptr), query::RunStatus::done);
  expect_covered(query.recorded, 0, false, element_count);
  expect_covered(query.recorded, 2, false, 0);
  EXPECT_EQ(query.answered(), element_count);
}

TEST_F(QueryStages, LeaveABatchWithoutAnswersIfTheRunEndsBetweenThem) {
  StagedQuery query(200);
  PreemptionPoints points([&] {
    if (query.stage() == 2) points.continuation = PreemptionPoints::Continuation::finish_in_flight;
  });
  EXPECT_EQ(run(query, &points), query::RunStatus::partial);
  EXPECT_EQ(query.answered(), 0u);
}

}  // namespace
}  // namespace rtstdb::test
