#pragma once
// Versions of rows for tests that prepare a TLAS without a database.

#include <functional>
#include <numeric>
#include <optional>
#include <vector>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::test {

/// From version to version every row may differ.
class VersionRows final : public query::RowSource {
 public:
  explicit VersionRows(std::uint32_t most) : states_(most) {}
  /// The next version, from `time` on: every row as `make` has it, or none.
  void next(const std::function<std::optional<EntityRow>(std::uint32_t)>& make, WorldTime time) {
    ++version_;
    time_ = time;
    for (std::uint32_t i = 0; i < states_.size(); ++i) {
      states_[i].reset();
      if (const auto row = make(i))
        states_[i] = EntityState{.id = {i, 1}, .row = *row, .written_by = version_};
    }
  }

  Version version() const noexcept override { return version_; }
  WorldTime time() const noexcept override { return time_; }
  std::uint32_t index_limit() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  const EntityState* row(std::uint32_t index) const noexcept override {
    return states_[index] ? &*states_[index] : nullptr;
  }
  bool changed_between(Version, std::vector<std::uint32_t>& indices) const noexcept override {
    indices.resize(states_.size());
    std::iota(indices.begin(), indices.end(), 0u);
    return true;
  }
  query::Shape shape(GeometryId /*geometry*/) const noexcept override { return {}; }

 private:
  std::vector<std::optional<EntityState>> states_;
  Version version_ = 0;
  WorldTime time_{};
};

}  // namespace rtstdb::test
