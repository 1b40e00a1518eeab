#include "bench/fields/builds.hpp"

#include <string>

#include "bench/fields/meshes.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

/// Signed like the field if the mesh is closed; the points are near the surface, as the vertices of bricks.
PreparedBatch<rtstdb::NearestQuery> prepare_near_points(OurWorld& world, const rtstdb::TriangleMesh& mesh,
                                                        std::uint32_t count, bool is_signed, double reach_m) {
  auto query = must(world.database().prepare(
      rtstdb::NearestQueryOptions{.name = "near", .capacity = count, .is_signed = is_signed}));
  Random random(48);
  for (rtstdb::Nearest& point : query->points()) {
    const glm::uvec3& triangle = mesh.triangles[random.next() % mesh.triangles.size()];
    point.point_m = mesh.positions_m[triangle.x] + random.in_box(glm::vec3(static_cast<float>(reach_m)));
  }
  return {world.database(), std::move(query), count};
}

std::vector<Figure> measure_mesh(const NamedMesh& named, const SuiteOptions& options) {
  const std::string name = "field_build_" + named.name;
  OurWorld world(1, 64);
  rtstdb::EntityRow row;
  row.geometry = world.add(named.mesh);
  world.create({&row, 1});
  rtstdb::FieldReport report;
  const auto build = [&] {
    report = *world.database().field(
        must(world.database().add_geometry(named.mesh, "field", {.field = rtstdb::FieldOptions{}})));
  };
  build();
  const bool is_signed = report.sign == rtstdb::FieldSign::winding;
  const std::uint32_t count = options.tiny ? 512 : 1u << 17;
  auto nearest = prepare_near_points(world, named.mesh, count, is_signed, report.cell_m);
  const int rounds = options.tiny ? 1 : 5;
  std::vector<double> ours, theirs;
  nearest.run();
  for (int round = 0; round < rounds; ++round) {
    build();
    ours.push_back(static_cast<double>(report.distances) / report.seconds * 1e-3);
    theirs.push_back(static_cast<double>(count) / seconds_of([&] { nearest.run(); }) * 1e-3);
  }
  const auto samples = static_cast<std::uint64_t>(rounds);
  const auto plain = [&](const char* what, double value, const char* unit) {
    return Figure{
        .name = name + what, .ours = value, .unit = unit, .peer = {}, .theirs = {}, .samples = samples};
  };
  return {Figure{.name = name,
                 .ours = median(ours),
                 .unit = "kdistance/s",
                 .peer = is_signed ? "signed nearest query" : "nearest query",
                 .theirs = median(theirs),
                 .better = Better::higher,
                 .samples = samples},
          plain("_seconds", report.seconds, "s"), plain("_bytes", static_cast<double>(report.bytes), "B"),
          plain("_error_p99", 1e6 * report.error_p99_m / diagonal_m(named.mesh), "ppm")};
}

}  // namespace

std::vector<Figure> measure_field_builds(const SuiteOptions& options) {
  std::vector<Figure> figures;
  for (const NamedMesh& mesh : field_meshes(options.tiny)) {
    for (Figure& figure : measure_mesh(mesh, options))
      figures.push_back(std::move(figure));
  }
  return figures;
}

}  // namespace hil::bench
