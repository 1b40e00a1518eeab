#pragma once
// FCL (package libfcl-dev) as the peer of contacts: convex bodies in pairs, and its dynamic tree of boxes.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/geometry.hpp>

namespace hil::bench {

std::string fcl_version();

/// What FCL finds of a pair.
struct PeerContact {
  bool touches = false;
  double distance_m = 0.0;  ///< negative: depth
};

/// Convex bodies at poses. Scale is 1.
class FclPairs {
 public:
  /// Bodies 2 i and 2 i + 1 are pair i. `meshes`: by geometry index; closed and convex.
  FclPairs(std::span<const rtstdb::TriangleMesh> meshes, std::span<const rtstdb::EntityRow> rows);
  ~FclPairs();
  FclPairs(const FclPairs&) = delete;
  FclPairs& operator=(const FclPairs&) = delete;

  /// One contact with its depth of each pair that touches, else the distance. Two threads.
  void find(std::vector<PeerContact>& contacts) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Boxes that move, in FCL's dynamic tree.
class FclTree {
 public:
  FclTree(const rtstdb::Bounds& bounds, std::span<const rtstdb::EntityRow> rows);
  ~FclTree();
  FclTree(const FclTree&) = delete;
  FclTree& operator=(const FclTree&) = delete;

  /// Moves all bodies to the time and counts the pairs whose oriented boxes overlap.
  std::size_t overlapping_pairs(rtstdb::WorldTime t);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
