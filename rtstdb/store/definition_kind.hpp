#pragma once
// What distinguishes the kinds of definitions. A definition is a material or a light: it is registered once,
// named by rows, and never changes. The table, the list and the log treat both kinds alike.
//
// Threads: constants.

#include <cstdint>

#include <rtstdb/entity.hpp>
#include <rtstdb/light.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb::store {

template <class Value>
struct DefinitionKind;

template <>
struct DefinitionKind<Material> {
  using Id = MaterialId;
  static constexpr std::uint32_t capacity = max_materials;
  /// The index of the first one that is added; those below exist in every database and have no names.
  static constexpr std::uint32_t first_added = 1;
  static constexpr const char* too_many =
      "a database has at most 4096 materials, the default material included";
};
static_assert(max_materials == 4096);

template <>
struct DefinitionKind<Light> {
  using Id = LightId;
  static constexpr std::uint32_t capacity = max_lights;
  static constexpr std::uint32_t first_added = 0;
  static constexpr const char* too_many = "a database has at most 4096 lights";
};
static_assert(max_lights == 4096);

template <class Value>
using DefinitionId = typename DefinitionKind<Value>::Id;

}  // namespace rtstdb::store
