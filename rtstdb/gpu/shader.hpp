#pragma once
// The table of all shaders. shaders/table.def holds one line per kernel variant:
//     SHADER(ray_any_moving, "query/ray/ray.comp", "RAY_ANY RAY_MOVING", 64, RayArgs, "TFTFTFSSTS")
// Its columns: the name; the source below shaders/; the macros that the source is compiled with, NAME or
// NAME=value; local_size_x, or 0 for a vertex or fragment shader (its source ends in .vert or .frag); the
// struct of the push constants (shaders/shared) or NoArgs; one letter per binding in order: S storage
// buffer, T uniform texel buffer of uvec4, F of vec4, I storage texel buffer of uvec4. The build compiles,
// validates and embeds every line. Device::create_pipeline checks that the SPIR-V agrees with the table.

#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>

#include "shaders/shared/interop.h"

namespace rtstdb::gpu {

enum class ShaderId : std::uint16_t {
#define SHADER(name, source, defines, group_size, args, bindings) name,
#include "shaders/table.def"
#undef SHADER
  count
};

enum class ShaderStage : std::uint8_t { compute, vertex, fragment };

struct ShaderInfo {
  std::string_view name;
  std::string_view source;
  std::string_view defines;  ///< between blanks
  std::uint32_t group_size = 0;
  std::span<const shared::Field> push_constants;  ///< fields of the argument struct; empty: NoArgs
  std::uint32_t push_constant_bytes = 0;
  std::string_view bindings;
  std::span<const std::uint32_t> spirv;

  constexpr ShaderStage stage() const noexcept {
    return source.ends_with(".vert")   ? ShaderStage::vertex
           : source.ends_with(".frag") ? ShaderStage::fragment
                                       : ShaderStage::compute;
  }
};

/// Marks a shader without push constants in the table.
struct NoArgs {};

/// Makes the entry of one line of the table. `Args` is a shared struct or NoArgs.
template <class Args>
constexpr ShaderInfo make_shader_info(std::string_view name, std::string_view source,
                                      std::string_view defines, std::uint32_t group_size,
                                      std::string_view bindings, std::span<const std::uint32_t> spirv) {
  if constexpr (std::is_same_v<Args, NoArgs>) {
    return {name, source, defines, group_size, {}, 0, bindings, spirv};
  } else {
    static_assert(sizeof(Args) <= 128, "every device has room for 128 bytes of push constants, not for more");
    return {name, source, defines, group_size, shared::Layout<Args>::fields, sizeof(Args), bindings, spirv};
  }
}

/// The table's entry of a shader.
const ShaderInfo& shader_info(ShaderId shader) noexcept;

}  // namespace rtstdb::gpu
