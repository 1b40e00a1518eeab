#pragma once
// What a compiled compute shader says about itself, read from its SPIR-V, and whether the shader table says
// the same.

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
  char letter = '?';  ///< as in the table; '?' for what the table has no letter for
};

struct ReflectedField {
  std::string type;  ///< as in GLSL: "float", "uvec2"; empty for what shared structs can not hold
  std::string name;
  std::size_t offset_bytes = 0;
};

struct ShaderReflection {
  std::array<std::uint32_t, 3> group_size{};
  std::vector<ReflectedBinding> bindings;      ///< by set, then binding
  std::vector<ReflectedField> push_constants;  ///< structs inside are laid flat
  std::vector<std::uint32_t> capabilities;
};

/// Empty when the words are not one well-formed compute shader with a fixed group size.
std::optional<ShaderReflection> reflect_shader(std::span<const std::uint32_t> spirv);

/// How the code differs from the table's line, both sides named; empty when it does not.
std::optional<std::string> find_difference(const ShaderInfo& table, const ShaderReflection& code);

}  // namespace rtstdb::gpu
