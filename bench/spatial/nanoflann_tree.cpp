#include "bench/spatial/nanoflann_tree.hpp"

#include <nanoflann.hpp>

#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

constexpr std::size_t queries_per_chunk = 1024;

/// Names required by nanoflann.
struct Cloud {
  std::span<const glm::vec3> points_m;
  std::size_t kdtree_get_point_count() const { return points_m.size(); }
  float kdtree_get_pt(std::size_t number, std::size_t axis) const {
    return points_m[number][static_cast<glm::vec3::length_type>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;  // nanoflann works it out
  }
};

using Tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3, std::uint32_t>;

}  // namespace

struct NanoflannTree::Impl {
  explicit Impl(std::span<const glm::vec3> points_m) : cloud{points_m}, tree(3, cloud) {}
  Cloud cloud;
  Tree tree;
};

NanoflannTree::NanoflannTree(std::span<const glm::vec3> points_m) : impl_(std::make_unique<Impl>(points_m)) {}

NanoflannTree::~NanoflannTree() = default;

std::string NanoflannTree::version() {
  constexpr unsigned number = NANOFLANN_VERSION;  // 0xMNP
  return "nanoflann " + std::to_string(number >> 8U) + "." + std::to_string(number >> 4U & 15U) + "." +
         std::to_string(number & 15U);
}

void NanoflannTree::nearest(std::span<const glm::vec3> queries_m, std::size_t k,
                            std::span<std::uint32_t> numbers, std::span<float> squared_m2) const {
  over_chunks(queries_m.size(), queries_per_chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      impl_->tree.knnSearch(&queries_m[i].x, k, numbers.data() + i * k, squared_m2.data() + i * k);
  });
}

}  // namespace hil::bench
