#pragma once
// A part of a run's recorded history that can be queried. Results equal those that a module would have got at
// that time: they come from the same rows by the same queries.
//
// Frames and units: world, metres, unless an entity carries the query; nanoseconds of run time. Threads: one,
// not in real time: reads the log, opens a device, allocates and blocks. All functions throw HistoryError,
// with Kind::question and the database's reason for what the database refuses.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/world/beam_query.hpp>
#include <rtstdb/database.hpp>

#include "runtime/history/run_history.hpp"
#include "runtime/modules/still_image.hpp"

namespace hil::history {

/// The time of a query, and the time up to which the world is known then.
struct Instant {
  std::int64_t time_ns = 0;
  /// Extrapolates the world from what was known at this earlier time; empty: from `time_ns` itself.
  std::optional<std::int64_t> known_at_ns = std::nullopt;
  std::int64_t known_ns() const noexcept { return known_at_ns.value_or(time_ns); }
};

struct Body {
  rtstdb::EntityState state;  ///< the row that is valid
  rtstdb::Pose pose;          ///< at that instant
};

struct Near {
  glm::dvec3 from_world_m{0.0};             ///< origin of the distances
  std::vector<rtstdb::Neighbor> neighbors;  ///< in ascending order of distance
  std::uint32_t found = 0;  ///< number of entities within the radius; may exceed the number listed
  bool incomplete = false;
};

/// A return that the scanner detected.
struct Return {
  std::uint32_t ordinal = 0;  ///< in its beam; returns that were not detected count too
  modules::BeamReturn beam_return;
  modules::Detection detection;
  glm::dvec3 p_world_m{0.0};  ///< on the beam's axis, at the measured range
};

struct Beam {
  std::uint32_t column = 0, row = 0;
  std::int64_t time_ns = 0;
  bool incomplete = false;        ///< the device's limits cut the search short
  std::vector<Return> returns{};  ///< the nearest first
};

struct Sweep {
  std::int64_t begin_ns = 0, end_ns = 0;
  bool whole = true;        ///< false: the run ended during the sweep
  std::vector<Beam> beams;  ///< in the order of time
};

class Past {
 public:
  /// Reads the history of the world between two times.
  Past(const RunHistory& history, std::int64_t from_ns, std::int64_t to_ns, const std::string& gpu);

  const rtstdb::DeviceInfo& device() const noexcept { return database_->device(); }

  /// By ascending index.
  std::vector<Body> bodies(const Instant& instant) const;

  /// Entities whose surfaces lie within the radius of a point of the entity (in its frame; by default the
  /// centre of its bounds), without the entity itself. Lists the max_neighbors nearest.
  Near near(const Instant& instant, rtstdb::EntityId entity, const std::optional<glm::dvec3>& point_m,
            double radius_m, std::uint32_t mask);

  /// All entities in the region, whose time is set to the instant's.
  std::vector<rtstdb::EntityId> in_region(const Instant& instant, rtstdb::Region region,
                                          rtstdb::RegionLevel level);

  /// The nearest hits first, at most `hits` (up to max_hits_per_ray). The time of `ray` is set to the
  /// instant's.
  std::vector<rtstdb::RayHit> along(const Instant& instant, rtstdb::Ray ray, std::uint32_t hits);

  /// The image whose exposure begins at the instant, as the run's camera took it, or would have.
  modules::StillImage image(const modules::RecordedCamera& camera, const Instant& instant);

  /// The sweep of the run's scanner at a time, as the scanner measured it, or would have if it had been in
  /// time. The beams of each step meet the world as it was when the step began, including all writes of that
  /// instant. A sweep ends early where the history ends.
  Sweep scan(const modules::RecordedScanner& scanner, std::int64_t time_ns);
  /// Begin and end of that sweep; before the first sweep, those of the first one.
  static std::pair<std::int64_t, std::int64_t> sweep_at(const modules::RecordedScanner& scanner,
                                                        std::int64_t time_ns);

 private:
  /// Those of the run, for beams of ConeMode::fast.
  void build_fields();
  rtstdb::EntityState row_of(const Instant& instant, rtstdb::EntityId entity) const;
  template <class Query>
  const rtstdb::Outcome& run_query(const rtstdb::ReadAt& read_at, Query& query, std::uint32_t count);
  const rtstdb::Outcome& execute();
  /// The beam of a sweep, with the answers of its query.
  Beam measure(const modules::RecordedScanner& scanner, const modules::RecordedScanner::Beam& beam,
               std::int64_t sweep_begin_ns, const rtstdb::Motion& carrier, const modules::BeamQuery& query,
               std::uint32_t index) const;

  const RunHistory& history_;
  std::int64_t to_ns_;
  std::unique_ptr<rtstdb::Database> database_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

}  // namespace hil::history
