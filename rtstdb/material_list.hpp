#pragma once
// The materials of a database by name, with their records in the log.
//
// Threads: any; knows and find_value take no lock and do not allocate.

#include <mutex>
#include <optional>
#include <span>
#include <string_view>

#include <rtstdb/material.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/record.hpp"
#include "rtstdb/store/material_table.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb {

class MaterialList {
 public:
  /// The default material and the recovered ones.
  explicit MaterialList(std::span<const log::LoggedMaterial> recovered);

  /// Database::add_material, of a database that may be written. The error does not name the material.
  Result<MaterialId> add(const Material& material, std::string_view name, transaction::Engine& engine);
  std::optional<MaterialId> find(std::string_view name) const;

  bool knows(MaterialId id) const noexcept { return table_.knows(id); }
  std::optional<Material> find_value(MaterialId id) const noexcept { return table_.find_value(id); }

 private:
  mutable std::mutex mutex_;
  store::MaterialTable table_;
};

}  // namespace rtstdb
