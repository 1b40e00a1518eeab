#pragma once
// The world for the log's checkpoints: a copy of one version, which the engine thread makes slice by slice
// between transactions, so that a transaction waits for one slice at most. When commits push the version out
// of the history while it is copied, the copy begins again with the latest version and larger slices; the
// last attempt copies all in one step.
//
// Threads: add by the engine's, attach in setup, all else by the log's.

#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "rtstdb/log/world_source.hpp"
#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::transaction {

class WorldCopy final : public log::WorldSource {
 public:
  explicit WorldCopy(std::uint32_t max_entities) : copying_(max_entities) {}

  /// Sets who does the copying. Before the first call of begin.
  void attach(JobTaker* taker) noexcept { taker_ = taker; }
  /// A geometry with this number of positions was recovered, or its record has been put.
  void add(const log::LoggedGeometry& geometry, std::size_t positions);
  std::vector<log::LoggedGeometry> geometries() const;
  /// A material or a light was recovered, or its record has been put.
  void add(const log::LoggedMaterial& material);
  void add(const log::LoggedLight& light);

  /// Whether the engine thread is making a copy.
  bool under_way() const noexcept { return copying_.given && !copying_.is_done(); }

  std::optional<log::WorldHead> begin(Version not_before) override;
  bool rows(std::uint32_t first, std::span<EntityState> states) override;
  bool shape(GeometryId geometry, Shape& shape) override;
  void end() noexcept override;

 private:
  class Copying final : public EngineJob {
   public:
    explicit Copying(std::uint32_t entities) : max_entities(entities) {}
    bool step(const store::Store& store) noexcept override;

    const std::uint32_t max_entities;
    bool given = false;
    std::atomic<std::size_t> geometries_known{0}, materials_known{0}, lights_known{0};  ///< by now
    // Allocated before the job is given, since steps must not allocate.
    std::vector<log::LoggedGeometry> geometries;
    std::vector<log::LoggedMaterial> materials;
    std::vector<log::LoggedLight> lights;
    std::vector<EntityState> states;  ///< by index; without an entity as WorldSource::rows says
    std::vector<Shape> shapes;        ///< by geometry; no positions where it does not deform
    // The result.
    bool outdated = false;  ///< a geometry, a material or a light was added after the allocation
    VersionInfo version;
    Version next_version = 1;
    std::uint32_t index_limit = 0;

   private:
    bool restart(const store::Store& store) noexcept;
    bool still_kept(const store::Store& store) const noexcept;
    void copy_shape(const store::Snapshot& snapshot, std::size_t geometry) noexcept;

    friend class WorldCopy;
    int attempts_ = 0;
    std::uint32_t next_index_ = 0;
    std::size_t next_shape_ = 0;
  };
  void allocate();

  struct Known {
    log::LoggedGeometry logged;
    std::size_t positions = 0;
  };
  mutable std::mutex known_mutex_;
  std::vector<Known> known_;                          // by index
  std::vector<log::LoggedMaterial> known_materials_;  // likewise
  std::vector<log::LoggedLight> known_lights_;        // likewise
  JobTaker* taker_ = nullptr;
  Copying copying_;
};

}  // namespace rtstdb::transaction
