#pragma once
// Versions of rows for tests that prepare a TLAS without a database.

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "rtstdb/query/executor.hpp"

namespace rtstdb::test {

/// Has the rows of the newest version. A version may be discarded: changed_between then names its rows too,
/// as the store does.
class VersionRows final : public store::RowSource {
 public:
  explicit VersionRows(std::uint32_t max_entities)
      : states_(max_entities), changed_by_(max_entities, 0), changed_before_(max_entities, 0) {}
  /// The next version, from `time` on, with the rows that `make` returns.
  void next(const std::function<std::optional<EntityRow>(std::uint32_t)>& make, WorldTime time) {
    ++version_;
    time_ = time;
    for (std::uint32_t i = 0; i < states_.size(); ++i)
      write(i, make(i));
  }
  /// The next version, from `time` on, in which these rows change.
  void change(std::span<const std::uint32_t> indices,
              const std::function<std::optional<EntityRow>(std::uint32_t)>& make, WorldTime time) {
    ++version_;
    time_ = time;
    for (const std::uint32_t i : indices)
      write(i, make(i));
  }

  /// Discards the newest version; its number is not used again.
  void discard(std::span<const std::uint32_t> indices,
               const std::function<std::optional<EntityRow>(std::uint32_t)>& before) {
    for (const std::uint32_t i : indices) {
      const Version changed_by = std::exchange(changed_before_[i], 0);
      write(i, before(i));
      changed_by_[i] = changed_by;
    }
    discarded_.emplace(version_, std::vector(indices.begin(), indices.end()));
  }

  Version version() const noexcept override { return version_; }
  WorldTime time() const noexcept override { return time_; }
  std::uint32_t index_limit() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  const EntityState* row(std::uint32_t index) const noexcept override {
    return states_[index] ? &*states_[index] : nullptr;
  }
  bool changed_between(Version other, std::vector<std::uint32_t>& indices) const noexcept override {
    for (std::uint32_t i = 0; i < states_.size(); ++i)
      if (changed_by_[i] > other) indices.push_back(i);
    if (const auto discarded = discarded_.find(other); discarded != discarded_.end()) {
      for (const std::uint32_t i : discarded->second)
        if (changed_by_[i] <= other) indices.push_back(i);
    }
    return true;
  }
  store::Shape shape(GeometryId /*geometry*/) const noexcept override { return {}; }

 private:
  void write(std::uint32_t index, const std::optional<EntityRow>& row) {
    states_[index].reset();
    changed_before_[index] = std::exchange(changed_by_[index], version_);
    if (row) states_[index] = EntityState{.id = {index, 1}, .row = *row, .written_by = version_};
  }

  std::vector<std::optional<EntityState>> states_;
  std::vector<Version> changed_by_, changed_before_;
  std::map<Version, std::vector<std::uint32_t>> discarded_;
  Version version_ = 0;
  WorldTime time_{};
};

}  // namespace rtstdb::test
