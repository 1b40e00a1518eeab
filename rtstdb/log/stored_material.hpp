#pragma once
// Encodes and decodes a material in records and checkpoints (format.hpp). Decoding trusts nothing
// (record.hpp).

#include <cstddef>
#include <string>

#include <rtstdb/entity.hpp>
#include <rtstdb/material.hpp>

#include "rtstdb/log/bytes.hpp"

namespace rtstdb::log {

struct LoggedMaterial {
  MaterialId id;     ///< not that of the default material
  std::string name;  ///< at most max_name_bytes
  Material material;
};

std::size_t stored_material_bytes(const LoggedMaterial& material) noexcept;
void put_material(ByteWriter& writer, const LoggedMaterial& material) noexcept;
/// Returns a description of the fault, or null.
[[nodiscard]] const char* get_material(ByteReader& reader, LoggedMaterial& material);
/// Accepts the index of every material that a database can have.
[[nodiscard]] const char* check_material_index(std::uint32_t index) noexcept;

}  // namespace rtstdb::log
