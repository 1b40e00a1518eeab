#pragma once
// A simulated database for tests of the log: a store with random commits, its state at each version, the
// recorder, and the source of checkpoints.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "rtstdb/log/recorder.hpp"
#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/ring.hpp"
#include "rtstdb/log/world_source.hpp"
#include "rtstdb/log/writer.hpp"
#include "rtstdb/store/store.hpp"

namespace rtstdb::log::test {

/// The state of a version, for comparison.
struct Image {
  VersionInfo latest;
  std::map<std::uint32_t, EntityState> rows;
  std::map<std::uint32_t, std::uint32_t> generations;  ///< only those that are not 0
  std::map<std::uint32_t, std::pair<Version, std::vector<glm::vec3>>> shapes;
};
bool operator==(const Image& a, const Image& b);
Image image_of(const World& world);
/// The state of a version as text lines, for comparison with the verifier in Python.
std::string text_of(const World& world);

inline constexpr std::uint32_t live_entities = 12;

/// The states that existed; survives simulated crashes.
struct History {
  std::map<Version, Image> images;
  std::set<Version> valid;  ///< published and not discarded
  void forget_after(Version version);
  /// The newest valid version up to a version.
  Version newest_valid(Version up_to) const;
  /// The newest valid version whose time is not after `time`.
  Version newest_at(WorldTime time) const;
};

class LiveWorld final : public WorldSource {
 public:
  LiveWorld(std::uint64_t seed, History& history, std::size_t ring_bytes);
  /// Continues from a recovered world.
  LiveWorld(std::uint64_t seed, History& history, std::size_t ring_bytes, const Recovered& recovered);

  Ring& ring() { return ring_; }
  Recorder& recorder() { return recorder_; }
  Version latest() const { return store_.latest().version; }
  const store::Store& store() const { return store_; }

  /// A random commit, recorded when it is published.
  void commit();
  /// A commit that moves one entity, at the time of the latest version. At least one entity must exist.
  void commit_move();
  /// As a late firm transaction in sync mode: recorded, then discarded; calls `between` in between.
  void commit_and_discard(const std::function<void()>& between = [] {});
  /// Adds a geometry with its file; false: the disk fails or the ring is full.
  bool add_geometry(Disk& disk, std::uint64_t database_id, std::uint64_t file);
  /// Adds a material or a light; false: there are eight, or the ring is full.
  bool add_material();
  bool add_light();

  /// From now on, about half of the commits are collected until the recorder's flush.
  void collect_some_commits() { collects_some_ = true; }
  /// From now on, this many of a thousand slices report that the version is no longer kept.
  void lose_slices_per_mille(std::uint32_t chance) { lost_slices_ = chance; }

  std::optional<WorldHead> begin(Version not_before) override;
  bool rows(std::uint32_t first, std::span<EntityState> states) override;
  bool shape(GeometryId geometry, Shape& shape) override;
  void end() noexcept override {}

 private:
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }
  void keep_shapes(const LoggedGeometry& geometry, std::span<const glm::vec3> positions_m, Version version);
  store::WriteSet random_set();
  void commit(store::WriteSet set);
  EntityRow random_row();
  glm::dvec3 random_color() { return {0.1 * below(11), 0.1 * below(11), 0.5}; }
  /// The entity's row with some words of its motion changed.
  EntityRow moved(EntityId entity);
  void record(const store::WriteSet& set, bool may_collect);
  Image image() const;
  bool slice_is_lost() { return below(1000) < lost_slices_; }

  std::mt19937_64 random_;
  History& history_;
  std::vector<LoggedGeometry> geometries_;
  std::vector<LoggedMaterial> materials_;
  std::vector<LoggedLight> lights_;
  std::map<std::uint32_t, std::vector<glm::vec3>> shapes_to_write_;  // memory of the shapes of a staged set
  std::map<std::uint32_t, std::size_t> positions_of_;
  store::Store store_;
  std::vector<std::uint32_t> generations_;
  Version next_version_ = 1;
  Ring ring_;
  Recorder recorder_;
  std::uint32_t lost_slices_ = 0;
  bool collects_some_ = false;

  Image checkpoint_;
};

/// Executes the writer's steps until nothing is left to do.
inline void write_all(Writer& writer) {
  while (writer.step(0).worked) {
  }
}

}  // namespace rtstdb::log::test
