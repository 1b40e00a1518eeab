#include <algorithm>
#include <array>

#include "rtstdb/gpu/shader_reflection.hpp"

namespace rtstdb::gpu {
namespace {

/// The SPIR-V capabilities that required_features.cpp enables: Shader, Float64, Int64, SampledBuffer,
/// ImageBuffer, ImageQuery, subgroup basic, vote, arithmetic, ballot and shuffle,
/// PhysicalStorageBufferAddresses.
constexpr std::array<std::uint32_t, 12> granted_capabilities{1, 10, 11, 46, 47, 50, 61, 62, 63, 64, 65, 5347};

std::string sentence(const ShaderInfo& table, const std::string& of_table, const std::string& of_code) {
  return "shader " + std::string(table.name) + " (" + std::string(table.source) + "): the table says " +
         of_table + ", the code says " + of_code;
}

/// The letters of bindings 0, 1, 2 and so on. For any other numbering a text that no table contains.
std::string letters_of(const ShaderReflection& code) {
  std::string letters;
  for (std::uint32_t i = 0; i < code.bindings.size(); ++i) {
    const ReflectedBinding& b = code.bindings[i];
    if (b.set != 0 || b.binding != i) {
      return letters + " then set " + std::to_string(b.set) + " binding " + std::to_string(b.binding);
    }
    letters.push_back(b.letter);
  }
  return letters;
}

std::string text_of(std::string_view type, std::string_view name, std::size_t offset) {
  return std::string(type.empty() ? "(no shared type)" : type) + " " + std::string(name) + " at byte " +
         std::to_string(offset);
}

std::optional<std::string> push_constant_difference(const ShaderInfo& table, const ShaderReflection& code) {
  const std::size_t count = std::max(table.push_constants.size(), code.push_constants.size());
  for (std::size_t i = 0; i < count; ++i) {
    std::string of_table = "no push constant " + std::to_string(i);
    std::string of_code = of_table;
    if (i < table.push_constants.size()) {
      const shared::Field& field = table.push_constants[i];
      of_table = text_of(field.type, field.name, field.offset_bytes);
    }
    if (i < code.push_constants.size()) {
      const ReflectedField& field = code.push_constants[i];
      of_code = text_of(field.type, field.name, field.offset_bytes);
    }
    if (of_table != of_code) return sentence(table, of_table, of_code);
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> find_difference(const ShaderInfo& table, const ShaderReflection& code) {
  if (code.stage != table.stage()) return sentence(table, "the stage of its source's name", "another stage");
  const auto [x, y, z] = code.group_size;
  if (x != table.group_size || y != 1 || z != 1) {
    return sentence(table, "group size " + std::to_string(table.group_size) + "x1x1",
                    std::to_string(x) + "x" + std::to_string(y) + "x" + std::to_string(z));
  }
  if (const std::string letters = letters_of(code); letters != table.bindings) {
    return sentence(table, "bindings \"" + std::string(table.bindings) + "\"", "\"" + letters + "\"");
  }
  for (const std::uint32_t capability : code.capabilities) {
    if (std::find(granted_capabilities.begin(), granted_capabilities.end(), capability) ==
        granted_capabilities.end()) {
      return sentence(table, "nothing of SPIR-V capability " + std::to_string(capability), "it needs it");
    }
  }
  return push_constant_difference(table, code);
}

}  // namespace rtstdb::gpu
