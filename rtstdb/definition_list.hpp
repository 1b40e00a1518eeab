#pragma once
// The materials or the lights of a database by name, with their records in the log.
//
// Threads: any; knows and find_value take no lock and do not allocate.

#include <mutex>
#include <optional>
#include <span>
#include <string_view>

#include <rtstdb/result.hpp>

#include "rtstdb/log/record.hpp"
#include "rtstdb/store/definition_table.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb {

template <class Value>
class DefinitionList {
 public:
  using Id = store::DefinitionId<Value>;

  /// Those that exist in every database, and the recovered ones.
  explicit DefinitionList(std::span<const log::LoggedDefinition<Value>> recovered);

  /// Adds a valid value to a database that may be written. Errors: as Database::add_material; the error does
  /// not name the value.
  Result<Id> add(const Value& value, std::string_view name, transaction::Engine& engine);
  std::optional<Id> find(std::string_view name) const;

  std::uint32_t count() const noexcept { return table_.count(); }
  bool knows(Id id) const noexcept { return table_.knows(id); }
  std::optional<Value> find_value(Id id) const noexcept { return table_.find_value(id); }

 private:
  mutable std::mutex mutex_;
  store::DefinitionTable<Value> table_;
};

}  // namespace rtstdb
