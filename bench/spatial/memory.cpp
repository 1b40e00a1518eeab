#include "bench/spatial/memory.hpp"

#include "bench/spatial/embree_hit.hpp"
#include "bench/spatial/embree_instances.hpp"
#include "bench/spatial/embree_scene.hpp"
#include "bench/spatial/our_structures.hpp"
#include "bench/spatial/scene.hpp"

namespace hil::bench {
namespace {

constexpr std::int64_t window_ns = 100'000'000;

Figure bytes_figure(const std::string& name, std::size_t ours, std::size_t theirs, std::size_t things) {
  const auto each = [&](std::size_t bytes) {
    return static_cast<double>(bytes) / static_cast<double>(things);
  };
  return {name, each(ours), "B", embree_version(), each(theirs), Better::lower, 1};
}

}  // namespace

std::vector<Figure> measure_memory(const SuiteOptions& options) {
  const rtstdb::TriangleMesh mesh = options.tiny ? lumpy_body(33, 32, 1) : lumpy_body(257, 256, 1);
  const MovingBodies bodies = moving_bodies(options.tiny ? 100 : 10'000, 50.0f, 3);
  const EmbreeScene their_mesh(mesh);
  const EmbreeInstances their_bodies(bodies.meshes, bodies.rows,
                                     {rtstdb::world_time_ns(0), rtstdb::world_time_ns(window_ns)});
  return {bytes_figure("bytes_per_triangle", our_mesh_bytes(mesh), their_mesh.bytes(), mesh.triangles.size()),
          bytes_figure("bytes_per_entity", our_version_bytes(static_cast<std::uint32_t>(bodies.rows.size())),
                       their_bodies.bytes(), bodies.rows.size())};
}

}  // namespace hil::bench
