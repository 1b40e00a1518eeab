#include "rtstdb/material_list.hpp"

#include <string>

#include "rtstdb/geometry/row_check.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log_space.hpp"

namespace rtstdb {

MaterialList::MaterialList(std::span<const log::LoggedMaterial> recovered) {
  for (const log::LoggedMaterial& material : recovered) {
    table_.prepare(material.material, material.name);
    table_.publish();
  }
}

Result<MaterialId> MaterialList::add(const Material& material, std::string_view name,
                                     transaction::Engine& engine) {
  if (auto valid = validate_material(material); !valid) return valid.error();
  if (engine.log() != nullptr && name.size() > log::max_name_bytes)
    return Error{ErrorCode::bad_input, "the name has " + std::to_string(name.size()) +
                                           " bytes; the log allows at most " +
                                           std::to_string(log::max_name_bytes)};
  const std::lock_guard lock(mutex_);
  if (table_.is_full())
    return Error{ErrorCode::capacity, "a database has at most " + std::to_string(max_materials) +
                                          " materials, the default material included"};
  const MaterialId id = table_.prepare(material, name);
  std::optional<log::LoggedMaterial> logged;
  if (engine.log() != nullptr) logged = {id, std::string(name), material};
  bool added = false;
  const auto add_on_engine = [&] {
    if (logged && !engine.log()->has_space_for(*logged)) return;
    if (logged) engine.log()->record_material(*logged);
    table_.publish();
    added = true;
  };
  if (auto called = call_until(engine, add_on_engine, [&] { return added; }); !called) return called.error();
  return id;
}

std::optional<MaterialId> MaterialList::find(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  return table_.find(name);
}

}  // namespace rtstdb
