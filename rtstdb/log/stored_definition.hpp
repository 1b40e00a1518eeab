#pragma once
// Encodes and decodes a definition, a material or a light (definition_kind.hpp), in records and checkpoints
// (format.hpp). Decoding trusts nothing (record.hpp).

#include <cstddef>
#include <string>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/store/definition_kind.hpp"

namespace rtstdb::log {

template <class Value>
struct LoggedDefinition {
  store::DefinitionId<Value> id;  ///< not one that exists in every database
  std::string name;               ///< at most max_name_bytes
  Value value;
};
using LoggedMaterial = LoggedDefinition<Material>;
using LoggedLight = LoggedDefinition<Light>;

// For materials and lights.
template <class Value>
std::size_t stored_definition_bytes(const LoggedDefinition<Value>& definition) noexcept;
template <class Value>
void put_definition(ByteWriter& writer, const LoggedDefinition<Value>& definition) noexcept;
/// Returns a description of the fault, or null.
template <class Value>
[[nodiscard]] const char* get_definition(ByteReader& reader, LoggedDefinition<Value>& definition);

/// Accept the index of every material and light that a database can have.
[[nodiscard]] const char* check_material_index(std::uint32_t index) noexcept;
[[nodiscard]] const char* check_light_index(std::uint32_t index) noexcept;

}  // namespace rtstdb::log
