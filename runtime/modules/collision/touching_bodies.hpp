#pragma once
// Which bodies touch a body: by their oriented bounds, or by the bodies themselves.
//
// Threads: prepare at setup; all else in the tick, without allocation.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

namespace hil::modules {

struct TouchingBodiesOptions {
  std::string name{};
  rtstdb::EntityId entity{};
  std::uint32_t mask = 0;  ///< of the bodies that count
  std::uint32_t max_hits = 1024;
  /// By their convex parts or their triangles. A body of which the query can not decide whether it touches
  /// counts as touching.
  bool by_bodies = false;
  /// by_bodies: how far ahead the time of the first impact is searched; 0: it is not.
  rtstdb::Nanoseconds impact_window{0};
};

/// Bodies that touch the body at an instant.
struct Touching {
  /// False: the search reached a limit, and other bodies may touch.
  bool is_known = true;
  std::uint32_t found = 0;  ///< bodies; may exceed those that are listed
  double depth_m = 0.0;     ///< by_bodies: of the deepest contact; 0 without one
};

/// by_bodies: the pairs of parts near the body that are searched, and the bodies in the impact window.
inline constexpr std::uint32_t max_part_pairs = 16384;
inline constexpr std::uint32_t max_impact_candidates = 1024;

class TouchingBodies {
 public:
  /// Errors: those of Database::prepare.
  static rtstdb::Result<std::unique_ptr<TouchingBodies>> prepare(rtstdb::Database& database,
                                                                 const TouchingBodiesOptions& options);

  /// Sets the instant, and adds the queries to a transaction that is being declared.
  void add_to(rtstdb::Transaction& transaction, rtstdb::WorldTime t) noexcept;
  /// Reads the answers of the last transaction, which was done. Appends the listed bodies to `entities`,
  /// which has capacity for max_hits.
  Touching take(std::vector<rtstdb::EntityId>& entities) const noexcept;
  /// by_bodies: the pair of the last answer with this body; null: none.
  const rtstdb::ContactPair* pair_with(rtstdb::EntityId other) const noexcept;
  /// With an impact window: the answer of the last transaction, which was done.
  const rtstdb::ImpactAnswer& first_impact() const noexcept;

 private:
  explicit TouchingBodies(const TouchingBodiesOptions& options) : options_(options) {}
  const TouchingBodiesOptions options_;
  std::unique_ptr<rtstdb::OverlapQuery> bounds_;  // or contacts_
  std::unique_ptr<rtstdb::ContactQuery> contacts_;
  std::unique_ptr<rtstdb::ImpactQuery> impacts_;
};

}  // namespace hil::modules
