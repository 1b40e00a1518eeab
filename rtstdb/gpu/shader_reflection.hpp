#pragma once
// Reads stage, bindings, push constants, group size and capabilities of a shader from its SPIR-V, and
// compares them with the shader table.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rtstdb/gpu/shader.hpp"

namespace rtstdb::gpu {

struct ReflectedBinding {
  std::uint32_t set = 0;
  std::uint32_t binding = 0;
  char letter = '?';  ///< as in the table; '?' for a descriptor that the table has no letter for
};

struct ReflectedField {
  /// GLSL type such as "float" or "uvec2"; empty for types that shared structs do not allow
  std::string type;
  std::string name;
  std::size_t offset_bytes = 0;
};

struct ShaderReflection {
  ShaderStage stage = ShaderStage::compute;
  std::array<std::uint32_t, 3> group_size{};   ///< of a compute shader; else {0, 1, 1}
  std::vector<ReflectedBinding> bindings;      ///< ordered by set, then by binding
  std::vector<ReflectedField> push_constants;  ///< members of nested structs are listed in place
  std::vector<std::uint32_t> capabilities;
};

/// Empty unless the words are one well-formed compute shader with a fixed group size, vertex or fragment
/// shader.
std::optional<ShaderReflection> reflect_shader(std::span<const std::uint32_t> spirv);

/// Describes the first difference, naming both sides; empty when there is none.
std::optional<std::string> find_difference(const ShaderInfo& table, const ShaderReflection& code);

}  // namespace rtstdb::gpu
