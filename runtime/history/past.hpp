#pragma once
// A stretch of a run's history with questions asked of it. Answers are those that a module would have got then: from the same rows, by
// the same queries.
//
// Frames and units: world, metres, unless an entity carries the question; nanoseconds of run time. Threads: one; setup: reads the log,
// opens a device, allocates and blocks. All throw HistoryError: `question` for what the database refuses, with its words.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/history/run_history.hpp"

namespace hil::history {

/// What is asked about, and what is known then.
struct Instant {
  std::int64_t time_ns = 0;
  /// The world as it was known at an earlier time, moved on from there; empty: at `time_ns` itself.
  std::optional<std::int64_t> known_at_ns = std::nullopt;
  std::int64_t known_ns() const noexcept { return known_at_ns.value_or(time_ns); }
};

struct Body {
  rtstdb::EntityState state;  ///< the row that holds
  rtstdb::Pose pose;          ///< of the instant
};

struct Near {
  glm::dvec3 from_world_m{0.0};             ///< where the distances are measured from
  std::vector<rtstdb::Neighbor> neighbors;  ///< the nearest first
  std::uint32_t found = 0;                  ///< of all that lie within the radius; more than are listed
  bool incomplete = false;
};

struct Beam {
  std::uint32_t column = 0, row = 0;
  std::int64_t time_ns = 0;
  rtstdb::RayHit hit;
  glm::dvec3 p_world_m{0.0};  ///< of a hit
};

struct Sweep {
  std::int64_t begin_ns = 0, end_ns = 0;
  bool whole = true;        ///< else the run ended in it
  std::vector<Beam> beams;  ///< in the order of time
};

class Past {
 public:
  /// Knows the world from one time to another.
  Past(const RunHistory& history, std::int64_t from_ns, std::int64_t to_ns, const std::string& gpu);

  const rtstdb::DeviceInfo& device() const noexcept { return database_->device(); }

  /// By ascending index.
  std::vector<Body> bodies(const Instant& instant) const;

  /// Bodies whose surfaces lie within the radius of a point of the entity: in its frame, or the centre of its bounds. Itself apart. The
  /// max_neighbors nearest are listed.
  Near near(const Instant& instant, rtstdb::EntityId entity, const std::optional<glm::dvec3>& point_m,
            double radius_m, std::uint32_t mask);

  /// `region.t` is set from the instant. Nothing is left out.
  std::vector<rtstdb::EntityId> in_region(const Instant& instant, rtstdb::Region region,
                                          rtstdb::RegionLevel level);

  /// `ray.t` is set from the instant. The nearest hits first, at most `hits` (up to max_hits_per_ray).
  std::vector<rtstdb::RayHit> along(const Instant& instant, rtstdb::Ray ray, std::uint32_t hits);

  /// The sweep that is under way at a time, as the run's scanner shot it, or would have where it was late: each step's beams on the world as
  /// it was when the step began, all that was written at that instant included. A sweep that the stretch ends in ends with it.
  Sweep scan(const modules::ScannerRecord& scanner, std::int64_t time_ns);
  /// When that sweep begins and ends. Before the first one: that one.
  static std::pair<std::int64_t, std::int64_t> sweep_at(const modules::ScannerRecord& scanner,
                                                        std::int64_t time_ns);

 private:
  rtstdb::EntityState row_of(const Instant& instant, rtstdb::EntityId entity) const;
  template <class Query>
  const rtstdb::Outcome& ask(const rtstdb::ReadAt& read_at, Query& query, std::uint32_t count);

  const RunHistory& history_;
  std::int64_t to_ns_;
  std::unique_ptr<rtstdb::Database> database_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

}  // namespace hil::history
