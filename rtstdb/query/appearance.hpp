#pragma once
// What the rows' materials and lights stand for: a port, so that image queries need not know the database.
//
// Threads: any. Values never change; their numbers only grow.

#include <cstdint>
#include <optional>

#include <rtstdb/entity.hpp>
#include <rtstdb/light.hpp>
#include <rtstdb/material.hpp>

namespace rtstdb::query {

class Appearance {
 public:
  virtual ~Appearance() = default;
  /// The default material included.
  virtual std::uint32_t materials() const noexcept = 0;
  virtual std::optional<Material> material(MaterialId id) const noexcept = 0;
  virtual std::optional<Light> light(LightId id) const noexcept = 0;
};

/// Of a world without materials and lights of its own.
class DefaultAppearance final : public Appearance {
 public:
  std::uint32_t materials() const noexcept override { return 1; }
  std::optional<Material> material(MaterialId id) const noexcept override {
    return id == MaterialId{} ? std::optional(Material{}) : std::nullopt;
  }
  std::optional<Light> light(LightId /*id*/) const noexcept override { return std::nullopt; }
};

}  // namespace rtstdb::query
