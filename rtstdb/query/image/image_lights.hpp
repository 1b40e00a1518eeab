#pragma once
// The lights of a version as the device gets them: the lights that rows name, and the surfaces of entities
// whose material emits light.
//
// Real-time mode takes the light of a surface from zones (emitter_zones.hpp), which are made once for a
// mesh and a scale.
//
// Threads: the engine thread. collect does not allocate.

#include <glm/ext/quaternion_float.hpp>

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/image.hpp>

#include "rtstdb/query/appearance.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "rtstdb/query/image/emitter_zones.hpp"
#include "shaders/shared/image.h"

namespace rtstdb::query {

/// Triangles of the meshes of all emitting entities; several entities with one mesh share them.
inline constexpr std::uint32_t max_emitter_triangles = 1u << 16;

class ImageLights {
 public:
  /// `fixed`: beside the lights of each version. `zones`: of a surface; 0: they are not wanted.
  ImageLights(std::span<const FixedLight> fixed, std::uint32_t zones);

  /// For max_lights_per_image lights, max_emitter_triangles triangles, and the zones of max_lights_per_image
  /// surfaces. They keep what collect has written.
  struct Buffers {
    std::span<shared::LightRecord> lights;
    std::span<shared::EmitterTriangle> triangles;
    std::span<shared::EmitterZone> zones;
    std::span<shared::EmitterPoint> points;
  };
  /// Writes the lights of the version. Lights that no camera admits are left out; `mask`: of all cameras.
  /// `max_maps`: shadow maps of an image; always the same.
  void collect(const BatchWorld& world, std::uint32_t mask, const Buffers& buffers,
               std::uint32_t max_maps) noexcept;
  /// Forgets what is in the buffers, since they are new.
  void forget() noexcept {
    known_ = false;
    zone_sets_.clear();
  }

  /// Lights are skies, then directional ones, then others, then surfaces by entity index.
  struct Counts {
    std::uint32_t skies = 0, suns_end = 0, emitters_from = 0, all = 0;
    std::uint32_t mapped_end = 0;  // those with shadow maps follow the skies
    std::uint32_t maps = 0;        // of an image
    /// Real-time mode: of the lights without shadow maps.
    std::uint32_t points(std::uint32_t per_emitter) const noexcept {
      return emitters_from - mapped_end + (all - emitters_from) * per_emitter;
    }
  };
  const Counts& counts() const noexcept { return counts_; }
  /// Which light and which of its maps a shadow map of an image is.
  struct MapOfLight {
    std::uint32_t light = 0, face = 0;
  };
  MapOfLight map(std::uint32_t index) const noexcept;
  /// Not all lights fit.
  bool overflow() const noexcept { return overflow_; }

 private:
  /// The range of a mesh in the buffer of triangles.
  struct Mesh {
    GeometryId geometry;
    std::uint32_t first = 0, count = 0;
  };

  void assign_maps(std::uint32_t max_maps) noexcept;
  void add_light(const Light& light, std::uint32_t entity, std::uint32_t mask, const glm::quat& q) noexcept;
  void add_emitter(const EntityState& state, const Material& material, const BatchWorld& world,
                   std::span<shared::EmitterTriangle> triangles) noexcept;
  const Mesh* mesh_of(GeometryId geometry, const BatchWorld& world,
                      std::span<shared::EmitterTriangle> triangles) noexcept;
  /// The zones of a scaled mesh; set k has those from k * zones_per_surface_.
  struct ZoneSet {
    GeometryId geometry;
    glm::dvec3 scale;
    Version version = 0;   // that wrote the shape, if the geometry deforms
    bool is_used = false;  // by the version that was collected last
  };
  void assign_zones(const BatchWorld& world, const Buffers& buffers) noexcept;
  bool use_zone_set(shared::LightRecord& light, const ZoneSet& key) noexcept;

  std::span<const FixedLight> fixed_;
  bool known_ = false;
  Version version_ = 0;
  std::uint32_t mask_ = 0;
  std::vector<bool> emits_;  // by material
  std::vector<shared::LightRecord> records_;
  std::vector<Mesh> meshes_;
  std::uint32_t zones_per_surface_ = 0;
  EmitterZones divider_;
  std::vector<ZoneSet> zone_sets_;
  std::uint32_t used_triangles_ = 0;
  Counts counts_;
  bool overflow_ = false;
};

}  // namespace rtstdb::query
