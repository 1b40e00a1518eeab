#pragma once
// Fixture of tests that run queries on an executor without a database, and act at each preemption point.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/query/ray/ray_query.hpp"
#include "tests/gpu/gpu_fixture.hpp"

namespace rtstdb::test {

/// Has the same entities in each version, and one shape for all geometries.
class FixedRows final : public store::RowSource {
 public:
  explicit FixedRows(std::span<const EntityState> states, Version version = 1, Version shape = 0,
                     std::span<const glm::vec3> positions_m = {})
      : states_(states), version_(version), shape_{shape, positions_m} {}
  Version version() const noexcept override { return version_; }
  WorldTime time() const noexcept override { return {}; }
  std::uint32_t index_limit() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  const EntityState* row(std::uint32_t index) const noexcept override { return &states_[index]; }
  bool changed_between(Version, std::vector<std::uint32_t>&) const noexcept override { return true; }
  store::Shape shape(GeometryId) const noexcept override { return shape_; }

 private:
  std::span<const EntityState> states_;
  Version version_;
  store::Shape shape_;
};

/// Calls a function at each preemption point of a run.
class PreemptionPoints final : public query::ExecutorCallbacks {
 public:
  explicit PreemptionPoints(std::function<void()> at_each = [] {}) : at_each_(std::move(at_each)) {}
  void begin_wait() noexcept override {}
  void end_wait() noexcept override {}
  bool preemption_requested() noexcept override { return requested; }
  Continuation on_preemption_point() noexcept override {
    ++count;
    at_each_();
    return continuation;
  }
  int count = 0;
  bool requested = false;  ///< halts chunks that take longer than predicted
  Continuation continuation = Continuation::go_on;

 private:
  std::function<void()> at_each_;
};

class ExecutorTest : public testing::Test {
 protected:
  void SetUp() override { open({}); }
  void TearDown() override {
    for (const std::string& message : executor_->device_health().validation_messages)
      ADD_FAILURE() << "validation layer: " << message;
  }
  void open(const DatabaseOptions& options) {
    auto created = query::GpuExecutor::create(
        [](const std::vector<std::byte>&) { return gpu::Device::open(gpu::test::shared_device_options()); },
        options);
    ASSERT_TRUE(created.ok()) << created.error().message;
    executor_ = std::move(created).value();
  }
  GeometryId add(const TriangleMesh& mesh, const GeometryOptions& options = {}) {
    const auto added = executor_->add_geometry(std::make_shared<TriangleMesh>(mesh), options);
    EXPECT_TRUE(added.ok());
    return added ? added.value() : GeometryId{};
  }
  std::unique_ptr<query::GpuRayQuery> prepare_rays(std::uint32_t capacity) {
    const RayQueryOptions options{.name = "rays", .capacity = capacity};
    auto made = executor_->prepare(&options);
    if (!made) {
      ADD_FAILURE() << made.error().message;
      return nullptr;
    }
    return std::unique_ptr<query::GpuRayQuery>(static_cast<query::GpuRayQuery*>(made.value().release()));
  }
  /// Runs one query; `request` has its chunk size and chunk time.
  query::RunStatus run_rays(query::GpuRayQuery& query, std::span<const Ray> rays,
                            const store::RowSource& rows, query::Request request,
                            query::ExecutorCallbacks* callbacks = nullptr) {
    std::ranges::copy(rays, query.rays().begin());
    request.query = &query;
    request.count = static_cast<std::uint32_t>(rays.size());
    store::TimeSpan times;
    EXPECT_FALSE(query.check(request.count, rows, times));
    const query::RunStatus status = executor_->run(rows, std::span(&request, 1), times, callbacks).status;
    query.publish_answers(request.count, request.count);
    return status;
  }

  std::unique_ptr<query::GpuExecutor> executor_;
};

}  // namespace rtstdb::test
