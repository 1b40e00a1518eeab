#pragma once
// An engine without a device, a follower, and the checks of its events.

#include <glm/gtc/quaternion.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/standing/follower.hpp"
#include "rtstdb/transaction/engine.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/no_queries.hpp"

namespace rtstdb::standing::test {

/// For events that depend on other threads, with a sanitizer too.
inline constexpr std::chrono::minutes event_limit{5};

inline WorldTime at_ns(std::int64_t ns) {
  return world_time_ns(ns);
}

class FollowedWorld {
 public:
  explicit FollowedWorld(const FollowerOptions& options = {.max_entities = 256},
                         std::uint32_t kept_changes = 4096);

  GeometryId add(const TriangleMesh& mesh, bool deforms = false);
  EntityId create(const EntityRow& row, std::int64_t ns);
  void update(EntityId id, const EntityRow& row, std::int64_t ns);
  void update_motion(EntityId id, const Motion& motion, std::int64_t ns);
  void remove(EntityId id, std::int64_t ns);
  /// Commits a version without effect, so that world time advances.
  void pass(std::int64_t ns);
  /// Declares and executes a transaction; fails the test unless it is committed.
  Outcome execute(const std::function<void(Transaction&)>& declare, std::int64_t ns);
  /// The entity of a create in the last transaction.
  EntityId created(std::uint32_t ordinal) const { return transaction_->created(ordinal); }

  std::unique_ptr<StandingQuery> watch(const StandingRegion& definition, const StandingOptions& options = {});
  std::unique_ptr<StandingQuery> watch(const StandingRay& definition, const StandingOptions& options = {});
  std::unique_ptr<StandingQuery> watch(const StandingNearest& definition,
                                       const StandingOptions& options = {});
  /// Waits until the query has been evaluated for the latest version.
  void catch_up(const StandingQuery& query);

  oracle::World rows();
  /// The entities in the region in the latest version, by the oracle.
  std::vector<EntityId> entities_in(const StandingRegion& definition);
  std::span<const TriangleMesh> meshes() const { return meshes_; }
  transaction::Engine& engine() { return engine_; }
  Follower& follower() { return *follower_; }

 private:
  transaction::MonotonicClock clock_;
  hil::tests::NoQueries device_;
  std::vector<TriangleMesh> meshes_;
  transaction::Engine engine_;
  std::unique_ptr<Follower> follower_;
  std::unique_ptr<Transaction> transaction_;
  EntityId written_by_pass_;
};

/// All pending events, after the latest version has been evaluated.
std::vector<StandingEvent> events_of(FollowedWorld& world, StandingQuery& query);

/// The members that follow from the events. Fails the test if events are inconsistent.
class Members {
 public:
  void take(std::span<const StandingEvent> events);
  void take(const StandingEvent& event);
  bool holds(EntityId id) const;
  const std::vector<EntityId>& all() const { return members_; }  ///< ascending
  /// The list of members is complete, and all losses are reported.
  bool complete(const StandingQuery& query) const { return complete_ && reported_lost_ == query.lost(); }
  std::uint64_t reported_lost() const { return reported_lost_; }

 private:
  std::vector<EntityId> members_;
  bool complete_ = false;
  std::uint64_t reported_lost_ = 0;
};

EntityRow row_of(GeometryId geometry, const glm::dvec3& p_world_m = glm::dvec3(0.0),
                 const glm::dvec3& v_world_mps = glm::dvec3(0.0));

/// Random position within 20 m and velocity within 20 m/s, in the plane z = 0.
EntityRow random_row_in_plane(std::mt19937& random, GeometryId geometry);

/// Random numbers and vectors.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : random_(seed) {}
  double from(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
  }
  std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(random_() % end); }
  bool one_in(std::uint32_t n) { return below(n) == 0; }
  glm::dvec3 vector(double size) { return {from(-size, size), from(-size, size), from(-size, size)}; }
  glm::dquat orientation() {
    return glm::normalize(glm::dquat(from(-1, 1), from(-1, 1), from(-1, 1), from(-1, 1) + 0.01));
  }

 private:
  std::mt19937 random_;
};

}  // namespace rtstdb::standing::test
