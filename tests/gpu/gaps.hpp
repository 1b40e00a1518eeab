#pragma once
// A run of the executor whose gaps a test fills, on a world that a test holds.

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::test {

/// Whatever the version, the same entities; one geometry deforms.
class OneWorld final : public store::RowSource {
 public:
  OneWorld(std::span<const EntityState> states, Version version, Version shape,
           std::span<const glm::vec3> positions_m)
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

/// Whoever runs in the gaps of a run.
class Gaps final : public query::ExecutorCallbacks {
 public:
  explicit Gaps(std::function<void()> in_each) : in_each_(std::move(in_each)) {}
  void begin_wait() noexcept override {}
  void end_wait() noexcept override {}
  bool preemption_requested() noexcept override { return awaited; }
  Continuation on_preemption_point() noexcept override {
    ++count;
    in_each_();
    return Continuation::go_on;
  }
  int count = 0;
  bool awaited = false;  ///< chunks that take longer than was thought are halted

 private:
  std::function<void()> in_each_;
};

}  // namespace rtstdb::test
