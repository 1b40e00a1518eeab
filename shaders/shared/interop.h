// Defines every struct that host and GPU share. A struct is a list of fields, from which macros generate the
// C++ struct, the GLSL struct, the checks of size and offsets, and the probe shader that echoes every field.
//
//     #define RTSTDB_FIELDS_Foo(F) F(vec3, origin_m) F(float, lambda_min)
//     RTSTDB_STRUCT(Foo)
//
// The layout is GLSL scalar layout: every scalar, vector and matrix is aligned to its component. Fields are
// float, int, uint, vec2..4, ivec2..4, uvec2..4.
#ifndef RTSTDB_SHARED_INTEROP_H
#define RTSTDB_SHARED_INTEROP_H

#ifdef __cplusplus
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <glm/ext/vector_float2.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_float4.hpp>
#include <glm/ext/vector_int2.hpp>
#include <glm/ext/vector_int3.hpp>
#include <glm/ext/vector_int4.hpp>
#include <glm/ext/vector_uint2.hpp>
#include <glm/ext/vector_uint3.hpp>
#include <glm/ext/vector_uint4.hpp>
namespace rtstdb::shared {
using uint = std::uint32_t;
using glm::ivec2;
using glm::ivec3;
using glm::ivec4;
using glm::uvec2;
using glm::uvec3;
using glm::uvec4;
using glm::vec2;
using glm::vec3;
using glm::vec4;

/// One field of a shared struct as the C++ compiler placed it.
struct Field {
  std::string_view type;
  std::string_view name;
  std::size_t offset_bytes;
  std::size_t size_bytes;
};

/// Layout<Foo>::fields: the fields of a shared struct, in order.
template <class Struct>
struct Layout;

/// Scalar layout of 4-byte components has no padding: each field begins where the previous one ends.
template <std::size_t count>
constexpr bool has_scalar_layout(const std::array<Field, count>& fields, std::size_t size_bytes,
                                 std::size_t alignment) {
  std::size_t next = 0;
  for (const Field& field : fields) {
    if (field.offset_bytes != next) return false;
    next += field.size_bytes;
  }
  return next == size_bytes && alignment == sizeof(std::uint32_t);
}
}  // namespace rtstdb::shared
#define RTSTDB_DECLARE_FIELD(type, name) type name;
#define RTSTDB_DESCRIBE_FIELD(type, name) Field{#type, #name, offsetof(Struct, name), sizeof(type)},
#define RTSTDB_STRUCT(name)                                                                          \
  namespace rtstdb::shared {                                                                         \
  struct name {                                                                                      \
    RTSTDB_FIELDS_##name(RTSTDB_DECLARE_FIELD)                                                       \
  };                                                                                                 \
  template <>                                                                                        \
  struct Layout<name> {                                                                              \
    using Struct = name;                                                                             \
    static constexpr std::array fields{RTSTDB_FIELDS_##name(RTSTDB_DESCRIBE_FIELD)};                 \
    static_assert(has_scalar_layout(fields, sizeof(Struct), alignof(Struct)),                        \
                  #name " is laid out differently on the GPU");                                      \
  };                                                                                                 \
  }
#define RTSTDB_CONSTANT(name, value)             \
  namespace rtstdb::shared {                     \
  inline constexpr std::uint32_t name = (value); \
  }
#else
#define RTSTDB_DECLARE_FIELD(type, name) type name;
#define RTSTDB_STRUCT(name) struct name { RTSTDB_FIELDS_##name(RTSTDB_DECLARE_FIELD) };
#define RTSTDB_CONSTANT(name, value) const uint name = value;
#endif

#endif
