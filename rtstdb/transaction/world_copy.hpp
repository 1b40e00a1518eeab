#pragma once
// Where the log's checkpoints get the world from: a copy of one version, made by the engine's thread slice by slice between
// transactions, so that they wait for one slice at most. Where commits overtake the version while it is copied, it begins again
// with the newest and larger slices; the last attempt takes all at once.
//
// Threads: the log's asks; `step` and `add` are the engine's.

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

  /// Before it is asked. Outlives this, or is let go.
  void attach(JobTaker* taker) noexcept { taker_ = taker; }
  /// A geometry whose record has been put, or that was there from the start, with so many positions.
  void add(const log::LoggedGeometry& geometry, std::size_t positions);
  std::vector<log::LoggedGeometry> geometries() const;

  /// Whether the engine's thread has a copy to make.
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
    std::atomic<std::size_t> geometries_there{0};  ///< by now
    // Made ready before it is given, since steps must not allocate.
    std::vector<log::LoggedGeometry> geometries;
    std::vector<EntityState> states;  ///< by index; dead ones as WorldSource::rows says
    std::vector<Shape> shapes;        ///< by geometry; no positions for one that does not deform
    // What it has come to.
    bool outdated = false;  ///< a geometry has come since it was made ready
    VersionInfo version;
    Version next_version = 1;
    std::uint32_t index_limit = 0;

   private:
    bool begin_again(const store::Store& store) noexcept;
    bool still_kept(const store::Store& store) const noexcept;
    void copy_shape(const store::Snapshot& snapshot, std::size_t geometry) noexcept;

    friend class WorldCopy;
    int attempts_ = 0;
    std::uint32_t next_index_ = 0;
    std::size_t next_shape_ = 0;
  };
  void make_ready();

  struct Known {
    log::LoggedGeometry logged;
    std::size_t positions = 0;
  };
  mutable std::mutex known_mutex_;
  std::vector<Known> known_;  // by index
  JobTaker* taker_ = nullptr;
  Copying copying_;
};

}  // namespace rtstdb::transaction
