#include "bench/spatial/boost_tree.hpp"

#include <boost/geometry/geometries/box.hpp>
#include <boost/geometry/geometries/point.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>
#include <boost/version.hpp>

#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

namespace index = boost::geometry::index;
using Point = boost::geometry::model::point<float, 3, boost::geometry::cs::cartesian>;
using Box = boost::geometry::model::box<Point>;
using Entry = std::pair<Box, std::uint32_t>;
using Tree = index::rtree<Entry, index::rstar<16>>;

constexpr std::size_t queries_per_chunk = 64;

Box as_boost(const rtstdb::Bounds& box) {
  return {{box.minimum_m.x, box.minimum_m.y, box.minimum_m.z},
          {box.maximum_m.x, box.maximum_m.y, box.maximum_m.z}};
}

Tree packed(std::span<const rtstdb::Bounds> boxes) {
  std::vector<Entry> entries;
  entries.reserve(boxes.size());
  for (const rtstdb::Bounds& box : boxes)
    entries.emplace_back(as_boost(box), static_cast<std::uint32_t>(entries.size()));
  return Tree(entries);  // from a range: packed
}

}  // namespace

struct BoostTree::Impl {
  explicit Impl(std::span<const rtstdb::Bounds> boxes) : tree(packed(boxes)) {}
  Tree tree;
};

BoostTree::BoostTree(std::span<const rtstdb::Bounds> boxes) : impl_(std::make_unique<Impl>(boxes)) {}

BoostTree::~BoostTree() = default;

std::string BoostTree::version() {
  return "Boost.Geometry " + std::to_string(BOOST_VERSION / 100'000) + "." +
         std::to_string(BOOST_VERSION / 100 % 1000);
}

/// `wanted(query, id)` makes the final decision about a candidate.
template <class Wanted>
void BoostTree::query(std::span<const rtstdb::Bounds> queries, PeerRegions& answers, Wanted wanted) const {
  over_chunks(queries.size(), queries_per_chunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t* const ids = answers.ids.data() + i * answers.ids_per_query;
      std::uint32_t found = 0;
      const auto take = [&](const Entry& entry) {
        if (!wanted(i, entry.second)) return;
        if (found < answers.ids_per_query) ids[found] = entry.second;
        ++found;
      };
      impl_->tree.query(index::intersects(as_boost(queries[i])), boost::make_function_output_iterator(take));
      answers.counts[i] = found;
    }
  });
}

void BoostTree::intersecting(std::span<const rtstdb::Bounds> queries, PeerRegions& answers) const {
  query(queries, answers, [](std::size_t, std::uint32_t) { return true; });
}

void BoostTree::touching(std::span<const rtstdb::Bounds> queries, std::span<const Corners> triangles,
                         PeerRegions& answers) const {
  query(queries, answers,
        [&](std::size_t i, std::uint32_t id) { return touches(queries[i], triangles[id]); });
}

}  // namespace hil::bench
