#pragma once
// nanoflann's KD-tree (package libnanoflann-dev) as the peer of the nearest entities.

#include <glm/ext/vector_float3.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>

namespace hil::bench {

class NanoflannTree {
 public:
  /// The points must outlive this object.
  explicit NanoflannTree(std::span<const glm::vec3> points_m);
  ~NanoflannTree();
  NanoflannTree(const NanoflannTree&) = delete;
  NanoflannTree& operator=(const NanoflannTree&) = delete;

  static std::string version();

  /// The k nearest points of query i, from index i * k on, nearest first: their indices and squared
  /// distances. There are at least k points.
  void nearest(std::span<const glm::vec3> queries_m, std::size_t k, std::span<std::uint32_t> numbers,
               std::span<float> squared_m2) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hil::bench
