#include <array>

#include <rtstdb/result.hpp>

#include "rtstdb/gpu/shader.hpp"
#include "shaders_generated/all_shared.h"

namespace rtstdb::gpu {
namespace {

#include "shaders_generated/words.inc"

/// A function of its own, so that its using-directive for shared structs stays local.
const ShaderInfo& table_line(std::size_t index) noexcept {
  using namespace shared;  // NOLINT(google-build-using-namespace): the table names structs without a prefix
  static constexpr ShaderInfo end{};
  static constexpr std::array table{
#define SHADER(name, source, defines, group_size, args, bindings) \
  make_shader_info<args>(#name, source, defines, group_size, bindings, name##_words),
#include "shaders/table.def"
#undef SHADER
      end};
  return table[index];
}

}  // namespace

const ShaderInfo& shader_info(ShaderId shader) noexcept {
  RTSTDB_ASSERT(shader < ShaderId::count, "the shader is not in the table");
  return table_line(static_cast<std::size_t>(shader));
}

}  // namespace rtstdb::gpu
