#include "bench/fields/memory.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "bench/fields/meshes.hpp"
#include "bench/spatial/our_world.hpp"
#include "bench/spatial/scene.hpp"
#include "bench/spatial/side_by_side.hpp"
#include "rtstdb/field/stored_field.hpp"

namespace hil::bench {
namespace {

using rtstdb::field::Cell;

constexpr double wanted_error_per_diagonal = 1.0 / 500.0;

glm::dvec3 corner(std::size_t k) {
  return {static_cast<double>(k & 1), static_cast<double>(k >> 1 & 1), static_cast<double>(k >> 2)};
}

/// Blends what `value(k, from)` gives at the point for vertex k; `from`: from the vertex to the point.
template <class ValueOf>
double blended(const Cell& cell, const ValueOf& value) {
  double sum = 0.0;
  for (std::size_t k = 0; k < 8; ++k) {
    const glm::dvec3 parts = glm::mix(1.0 - cell.at, cell.at, corner(k));
    sum += parts.x * parts.y * parts.z * value(k, cell.edge_m * (cell.at - corner(k)));
  }
  return sum;
}

/// The 99th percentiles of the errors, in metres.
struct Errors {
  double ours_m = 0.0, planes_m = 0.0, order_0_m = 0.0;
};

/// The distances of a mesh by nearest queries, signed where it is closed.
class Distances {
 public:
  explicit Distances(const rtstdb::TriangleMesh& mesh) : mesh_(mesh), world_(1) {
    rtstdb::EntityRow row;
    row.geometry = world_.add(mesh);
    world_.create({&row, 1});
    query_ = must(world_.database().prepare(
        rtstdb::NearestQueryOptions{.name = "distances", .capacity = capacity, .is_signed = true}));
    transaction_ = world_.database().make_transaction({.max_queries = 1});
  }

  std::vector<rtstdb::Neighbor> at(std::span<const glm::vec3> points_m) {
    std::vector<rtstdb::Neighbor> neighbors;
    while (!points_m.empty()) {
      const std::size_t count = std::min<std::size_t>(points_m.size(), capacity);
      for (std::size_t i = 0; i < count; ++i)
        query_->points()[i].point_m = points_m[i];
      transaction_->begin({});
      transaction_->add_query(*query_, static_cast<std::uint32_t>(count));
      const rtstdb::Outcome& outcome = world_.database().execute(*transaction_);
      if (outcome.status != rtstdb::Status::committed) throw std::runtime_error(rtstdb::describe(outcome));
      for (const rtstdb::NearestAnswer& answer : query_->answers())
        neighbors.push_back(answer.neighbors.front());
      points_m = points_m.subspan(count);
    }
    return neighbors;
  }

  Errors errors(double cell_m, std::size_t count) {
    Random random(48);
    std::vector<glm::vec3> points_m, vertices_m;
    const float reach_m = static_cast<float>(2.0 * cell_m);
    for (std::size_t i = 0; i < count; ++i) {
      const glm::uvec3& triangle = mesh_.triangles[random.next() % mesh_.triangles.size()];
      float u = random.between(0.0f, 1.0f), v = random.between(0.0f, 1.0f);
      if (u + v > 1.0f) {
        u = 1.0f - u;
        v = 1.0f - v;
      }
      const glm::vec3& a = mesh_.positions_m[triangle.x];
      points_m.push_back(a + u * (mesh_.positions_m[triangle.y] - a) +
                         v * (mesh_.positions_m[triangle.z] - a) + random.in_box(glm::vec3(reach_m)));
      const glm::dvec3 low = cell_m * glm::floor(glm::dvec3(points_m.back()) / cell_m);
      for (std::size_t k = 0; k < 8; ++k)
        vertices_m.emplace_back(low + cell_m * corner(k));
    }
    const auto truth = at(points_m);
    const auto vertices = at(vertices_m);
    std::vector<double> ours, planes, order_0;
    for (std::size_t i = 0; i < count; ++i) {
      Cell cell;
      cell.edge_m = cell_m;
      const glm::dvec3 low = cell_m * glm::floor(glm::dvec3(points_m[i]) / cell_m);
      cell.at = glm::clamp((glm::dvec3(points_m[i]) - low) / cell_m, 0.0, 1.0);
      for (std::size_t k = 0; k < 8; ++k) {
        const rtstdb::Neighbor& vertex = vertices[8 * i + k];
        const auto distance_m = static_cast<double>(vertex.distance_m);
        cell.distances_m[k] = distance_m;
        const glm::dvec3 away = glm::dvec3(vertices_m[8 * i + k]) - glm::dvec3(vertex.p_world_m);
        cell.gradients[k] = distance_m == 0.0 ? glm::dvec3(0.0, 0.0, 1.0) : away / distance_m;
      }
      const double truth_m = std::abs(static_cast<double>(truth[i].distance_m));
      const auto error_m = [&](double distance_m) { return std::abs(std::abs(distance_m) - truth_m); };
      ours.push_back(error_m(rtstdb::field::blended_distance_m(cell, false)));
      planes.push_back(error_m(blended(cell, [&](std::size_t k, const glm::dvec3& from) {
        return cell.distances_m[k] + glm::dot(cell.gradients[k], from);
      })));
      order_0.push_back(
          error_m(blended(cell, [&](std::size_t k, const glm::dvec3&) { return cell.distances_m[k]; })));
    }
    return {quantile(ours, 0.99), quantile(planes, 0.99), quantile(order_0, 0.99)};
  }

 private:
  static constexpr std::uint32_t capacity = 1u << 14;

  const rtstdb::TriangleMesh& mesh_;
  OurWorld world_;
  std::unique_ptr<rtstdb::NearestQuery> query_;
  std::unique_ptr<rtstdb::Transaction> transaction_;
};

/// Cells along the diagonal at which the error falls to the wanted one; empty: never.
class CellsNeeded {
 public:
  void add(double cells, double error_per_diagonal) {
    if (!needed_ && error_per_diagonal <= wanted_error_per_diagonal) {
      needed_ = cells;
      if (cells_before_ > 0.0) {
        const double share = std::log(error_before_ / wanted_error_per_diagonal) /
                             std::log(error_before_ / std::max(error_per_diagonal, 1e-12));
        needed_ = cells_before_ * std::pow(cells / cells_before_, share);
      }
    }
    cells_before_ = cells;
    error_before_ = error_per_diagonal;
  }
  std::optional<double> needed() const { return needed_; }

 private:
  std::optional<double> needed_;
  double cells_before_ = 0.0, error_before_ = 0.0;
};

void measure_mesh(const NamedMesh& named, const SuiteOptions& options, std::vector<Figure>& figures) {
  const double diagonal = diagonal_m(named.mesh);
  Distances distances(named.mesh);
  CellsNeeded ours, order_0;
  const std::size_t count = options.tiny ? 200 : 20'000;
  for (int cells = 8; cells <= (options.tiny ? 16 : 512); cells *= 2) {
    const Errors errors = distances.errors(diagonal / cells, count);
    ours.add(cells, errors.ours_m / diagonal);
    order_0.add(cells, errors.order_0_m / diagonal);
    const std::string name = "field_error_" + named.name + "_" + std::to_string(cells);
    const auto figure = [&](const std::string& of, const char* peer, double theirs_m) {
      return Figure{.name = of,
                    .ours = 1e6 * errors.ours_m / diagonal,
                    .unit = "ppm",
                    .peer = peer,
                    .theirs = 1e6 * theirs_m / diagonal,
                    .samples = count};
    };
    figures.push_back(figure(name, "order 0, half the memory", errors.order_0_m));
    figures.push_back(figure(name + "_planes", "blended planes", errors.planes_m));
  }
  if (!ours.needed() || !order_0.needed()) return;
  // Bricks grow with the square of the cells along the diagonal.
  const auto squared = [](double cells) { return cells * cells; };
  figures.push_back({.name = "field_memory_" + named.name,
                     .ours = 8.0 * squared(*ours.needed()),
                     .unit = "B per squared diagonal and cell layer",
                     .peer = "order 0, four bytes a vertex",
                     .theirs = 4.0 * squared(*order_0.needed()),
                     .samples = count});
}

}  // namespace

std::vector<Figure> measure_field_memory(const SuiteOptions& options) {
  std::vector<Figure> figures;
  for (const NamedMesh& mesh : field_meshes(options.tiny))
    measure_mesh(mesh, options, figures);
  return figures;
}

}  // namespace hil::bench
