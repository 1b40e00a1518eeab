#include <array>
#include <type_traits>

#include <rtstdb/result.hpp>

#include "rtstdb/gpu/shader.hpp"
#include "shaders_generated/all_shared.h"

namespace rtstdb::gpu {
namespace {

#include "shaders_generated/words.inc"

/// Stands in the table where a shader has no push constants.
struct NoArgs {};

/// Every device has room for this many bytes; more would be a limit of its own.
constexpr std::size_t max_push_constant_bytes = 128;

template <class Args>
constexpr ShaderInfo describe(std::string_view name, std::string_view source, std::uint32_t group_size,
                              std::string_view bindings, std::span<const std::uint32_t> spirv) {
  static_assert(std::is_same_v<Args, NoArgs> || sizeof(Args) <= max_push_constant_bytes,
                "push constants are limited to 128 bytes");
  if constexpr (std::is_same_v<Args, NoArgs>) {
    return {name, source, group_size, {}, 0, bindings, spirv};
  } else {
    return {name, source, group_size, shared::Layout<Args>::fields, sizeof(Args), bindings, spirv};
  }
}

/// Every line of the table; in a function of its own so that the names of shared structs need no prefix.
const ShaderInfo& table_line(std::size_t index) noexcept {
  using namespace shared;  // NOLINT(google-build-using-namespace): the table names structs without a prefix
  static constexpr ShaderInfo end{};
  static constexpr std::array table{
#define SHADER(name, source, group_size, args, bindings) \
  describe<args>(#name, source, group_size, bindings, name##_words),
#include "shaders/table.def"
#undef SHADER
      end};
  return table[index];
}

}  // namespace

const ShaderInfo& shader_info(ShaderId shader) noexcept {
  RTSTDB_ASSERT(shader < ShaderId::count);
  return table_line(static_cast<std::size_t>(shader));
}

}  // namespace rtstdb::gpu
