#pragma once
// The materials or the lights of a database. Adding is for setup; reading neither locks nor allocates.
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

#include <rtstdb/result.hpp>

#include "rtstdb/store/definition_kind.hpp"

namespace rtstdb::store {

template <class Value>
class DefinitionTable {
 public:
  using Kind = DefinitionKind<Value>;
  using Id = DefinitionId<Value>;

  /// Contains those that exist in every database.
  DefinitionTable() : values_(std::make_unique<Value[]>(Kind::capacity)), names_(Kind::first_added) {}

  bool is_full() const noexcept { return count() == Kind::capacity; }
  /// Writes the next value, which readers do not see yet, and returns its id. A second call before publish
  /// replaces it. Misuse: the table is full.
  Id prepare(const Value& value, std::string_view name) {
    const std::uint32_t index = count();
    RTSTDB_ASSERT(index < Kind::capacity, "the table is full");
    names_.resize(index);
    names_.emplace_back(name);
    values_[index] = value;
    return {index};
  }
  /// From now on readers see the prepared value.
  void publish() noexcept { count_.fetch_add(1, std::memory_order_release); }

  std::uint32_t count() const noexcept { return count_.load(std::memory_order_acquire); }
  bool knows(Id id) const noexcept { return id.index < count(); }
  std::optional<Value> find_value(Id id) const noexcept {
    return knows(id) ? std::optional(values_[id.index]) : std::nullopt;
  }
  /// The last added value of that name that readers see.
  std::optional<Id> find(std::string_view name) const {
    for (std::uint32_t index = count(); index-- > Kind::first_added;)
      if (names_[index] == name) return Id{index};
    return std::nullopt;
  }

 private:
  std::unique_ptr<Value[]> values_;  // by index; the whole capacity, so that readers need no lock
  std::vector<std::string> names_;   // by index
  std::atomic<std::uint32_t> count_{Kind::first_added};
};

}  // namespace rtstdb::store
