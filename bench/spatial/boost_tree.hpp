#pragma once
// Boost.Geometry's R*-tree (package libboost-dev) as the peer of regions.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "bench/spatial/triangle_box.hpp"

namespace hil::bench {

/// The ids of query i begin at index i * ids_per_query.
struct PeerRegions {
  PeerRegions(std::size_t queries, std::size_t max_ids)
      : ids_per_query(max_ids), ids(queries * max_ids), counts(queries) {}
  std::size_t ids_per_query;
  std::vector<std::uint32_t> ids;
  std::vector<std::uint32_t> counts;  ///< all that were found, also when they did not fit
};

class BoostTree {
 public:
  /// Built by packing; an id is the box's index in the span.
  explicit BoostTree(std::span<const rtstdb::Bounds> boxes);
  ~BoostTree();
  BoostTree(const BoostTree&) = delete;
  BoostTree& operator=(const BoostTree&) = delete;

  static std::string version();

  /// Touching boxes count. Ids have no order.
  void intersecting(std::span<const rtstdb::Bounds> queries, PeerRegions& answers) const;
  /// Only the boxes whose triangle itself touches. `triangles`: by id.
  void touching(std::span<const rtstdb::Bounds> queries, std::span<const Corners> triangles,
                PeerRegions& answers) const;

 private:
  template <class Wanted>
  void query(std::span<const rtstdb::Bounds> queries, PeerRegions& answers, Wanted wanted) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
