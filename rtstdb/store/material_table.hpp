#pragma once
// The materials of a database. Adding is for setup; reading neither locks nor allocates.
//
// Threads: prepare and find by any thread, one at a time (the caller's lock); publish by the engine thread;
// find_value, knows and count by any thread at any time.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb::store {

class MaterialTable {
 public:
  /// Contains the default material, which has no name.
  MaterialTable() : values_(std::make_unique<Material[]>(max_materials)), names_(1) {}

  bool is_full() const noexcept { return count() == max_materials; }
  /// Writes the next material, which readers do not see yet, and returns its id. A second call before publish
  /// replaces it. Misuse: the table is full.
  MaterialId prepare(const Material& material, std::string_view name) {
    const std::uint32_t index = count();
    RTSTDB_ASSERT(index < max_materials);
    names_.resize(index);
    names_.emplace_back(name);
    values_[index] = material;
    return {index};
  }
  /// From now on readers see the prepared material.
  void publish() noexcept { count_.fetch_add(1, std::memory_order_release); }

  std::uint32_t count() const noexcept { return count_.load(std::memory_order_acquire); }
  bool knows(MaterialId id) const noexcept { return id.index < count(); }
  std::optional<Material> find_value(MaterialId id) const noexcept {
    return knows(id) ? std::optional(values_[id.index]) : std::nullopt;
  }
  /// The last material of that name that readers see.
  std::optional<MaterialId> find(std::string_view name) const {
    for (std::uint32_t index = count(); index-- > 1;)
      if (names_[index] == name) return MaterialId{index};
    return std::nullopt;
  }

 private:
  std::unique_ptr<Material[]> values_;  // by index; max_materials, so that readers need no lock
  std::vector<std::string> names_;      // by index
  std::atomic<std::uint32_t> count_{1};
};

}  // namespace rtstdb::store
