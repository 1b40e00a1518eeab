#include "rtstdb/geometry/closed_mesh.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>

#include "rtstdb/geometry/welded_corners.hpp"

namespace rtstdb {
namespace {

/// The exclusive or of both halves of the product, which depends on all bits of both factors.
std::uint64_t folded(std::uint64_t a, std::uint64_t b) noexcept {
  __extension__ using Wide = unsigned __int128;
  const Wide product = static_cast<Wide>(a) * b;
  return static_cast<std::uint64_t>(product) ^ static_cast<std::uint64_t>(product >> 64);
}

/// Hash of a position.
std::uint64_t hash_of(const glm::vec3& p) noexcept {
  const Place place = place_of(p);
  return folded((std::uint64_t{place[0]} << 32 | place[1]) ^ 0x9E3779B97F4A7C15u,
                place[2] ^ 0xD1B54A32D192ED03u);
}

/// Zero if each edge has as many triangles in one direction as in the other.
class Balance {
 public:
  /// Antisymmetric in the ends: an edge and its reverse cancel.
  void add(std::uint64_t from, std::uint64_t to) noexcept { sum_ += of_order(from, to) - of_order(to, from); }
  bool is_even() const noexcept { return sum_ == 0; }

 private:
  static std::uint64_t of_order(std::uint64_t first, std::uint64_t second) noexcept {
    return folded(first ^ 0xBF58476D1CE4E5B9u, second ^ 0x94D049BB133111EBu);
  }

  std::uint64_t sum_ = 0;
};

/// An edge, directed from its lower to its higher end or back.
struct Edge {
  std::uint32_t low = 0, high = 0;
  bool back = false;
  bool same_ends(const Edge& other) const noexcept { return low == other.low && high == other.high; }
};

std::vector<Edge> edges_of(std::span<const glm::uvec3> triangles, std::span<const std::uint32_t> first) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const glm::uvec3& triangle : triangles) {
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t from = first[triangle[i]];
      const std::uint32_t to = first[triangle[(i + 1) % 3]];
      if (from != to) edges.push_back({std::min(from, to), std::max(from, to), to < from});
    }
  }
  std::ranges::sort(edges, {}, [](const Edge& edge) { return std::pair(edge.low, edge.high); });
  return edges;
}

}  // namespace

bool is_closed(const MeshView& mesh) noexcept {
  Balance balance;
  for (const glm::uvec3& triangle : mesh.triangles) {
    const std::uint64_t corners[] = {hash_of(mesh.positions_m[triangle.x]),
                                     hash_of(mesh.positions_m[triangle.y]),
                                     hash_of(mesh.positions_m[triangle.z])};
    for (int i = 0; i < 3; ++i)
      balance.add(corners[i], corners[(i + 1) % 3]);
  }
  return balance.is_even();
}

ClosedShapes::ClosedShapes(const MeshView& mesh) {
  const std::vector<std::uint32_t> first = first_at_place(mesh.positions_m);
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] != i) together_.emplace_back(first[i], i);
  }
  const std::vector<Edge> edges = edges_of(mesh.triangles, first);
  for (std::size_t i = 0; i < edges.size();) {
    const Edge& edge = edges[i];
    int forth = 0;
    for (; i < edges.size() && edges[i].same_ends(edge); ++i)
      forth += edges[i].back ? -1 : 1;
    for (int k = 0; k < std::abs(forth); ++k)
      unpaired_.push_back(forth > 0 ? glm::uvec2(edge.low, edge.high) : glm::uvec2(edge.high, edge.low));
  }
}

bool ClosedShapes::is_closed(const MeshView& mesh) const noexcept {
  const std::span p = mesh.positions_m;
  for (const glm::uvec2& corners : together_)
    if (p[corners.x] != p[corners.y]) return rtstdb::is_closed(mesh);
  Balance balance;
  for (const glm::uvec2& edge : unpaired_)
    balance.add(hash_of(p[edge.x]), hash_of(p[edge.y]));
  return balance.is_even();
}

}  // namespace rtstdb
