#include "rtstdb/field/field_build.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/splitmix64.hpp"

namespace rtstdb::field {
namespace {

constexpr std::uint32_t points_per_comparison = 4096;
constexpr std::uint64_t points_seed = 48;
/// Larger than every distance; its square is finite.
constexpr float everywhere_m = 1e18f;
/// Cells of bricks along the diagonal in the first attempt: few, so that it takes little time, and enough for
/// smooth geometry.
constexpr double first_cells_per_diagonal = 20.0;
constexpr double default_error_per_diagonal = 1.0 / 500.0;

std::string in_metres(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.3g m", value);
  return text;
}

double diagonal_m(const Bounds& box) noexcept {
  return glm::distance(glm::dvec3(box.minimum_m), glm::dvec3(box.maximum_m));
}

FieldSign chosen_sign(FieldSign sign, bool is_closed) noexcept {
  if (sign != FieldSign::automatic) return sign;
  return is_closed ? FieldSign::winding : FieldSign::none;
}

glm::uvec3 brick_vertex(std::uint32_t number) noexcept {
  return {number % brick_vertices, number / brick_vertices % brick_vertices,
          number / brick_vertices / brick_vertices};
}

}  // namespace

Result<void> check_field_options(const FieldOptions& options) {
  const auto refuse = [](const char* name, double value) {
    char text[80];
    std::snprintf(text, sizeof text, "field: %s is %.9g m; 0 or a positive length is allowed", name, value);
    return Error{ErrorCode::bad_input, text};
  };
  if (!(options.error_m >= 0.0 && std::isfinite(options.error_m))) return refuse("error_m", options.error_m);
  if (!(options.cell_m >= 0.0 && std::isfinite(options.cell_m))) return refuse("cell_m", options.cell_m);
  if (options.error_m > 0.0 && options.cell_m > 0.0) {
    return Error{ErrorCode::bad_input, "field: error_m is " + in_metres(options.error_m) + " and cell_m is " +
                                           in_metres(options.cell_m) + "; only one of them may be given"};
  }
  if (options.max_bytes > max_field_bytes) {
    return Error{ErrorCode::bad_input, "field: max_bytes is " + std::to_string(options.max_bytes) +
                                           "; at most " + std::to_string(max_field_bytes) + " are allowed"};
  }
  if (options.sign > FieldSign::none) {
    return Error{ErrorCode::bad_input, "field: sign is " + std::to_string(static_cast<int>(options.sign)) +
                                           "; 0 to " + std::to_string(static_cast<int>(FieldSign::none)) +
                                           " are allowed"};
  }
  return {};
}

Result<FieldBuild> FieldBuild::begin(const Bounds& box, bool is_closed, const FieldOptions& options) {
  const FieldSign sign = chosen_sign(options.sign, is_closed);
  if (sign == FieldSign::winding && !is_closed) {
    return Error{ErrorCode::bad_input,
                 "field: sign winding needs a closed geometry, and this one has edges without a partner;"
                 " ray_ratio and none are possible"};
  }
  FieldBuild build(box, sign, options);
  const double first_m = diagonal_m(box) / first_cells_per_diagonal;
  if (auto begun = build.begin_attempt(options.cell_m > 0.0 ? options.cell_m : first_m); !begun)
    return begun.error();
  return build;
}

FieldBuild::FieldBuild(const Bounds& box, FieldSign sign, const FieldOptions& options)
    : box_(box),
      options_(options),
      sign_(sign),
      default_error_m_(default_error_per_diagonal * diagonal_m(box)) {
  field_.is_signed = sign_ != FieldSign::none;
  field_.report.sign = sign_;
}

Result<void> FieldBuild::begin_attempt(double cell_m) {
  field_.grid = grid_around(box_, cell_m * brick_cells);
  ++field_.report.attempts;
  if (auto fits = check_memory(0); !fits) return fits;
  field_.bricks_of_cells.assign(field_.grid.cell_count(), shared::field_none);
  field_.coarse.assign(field_.grid.vertex_count(), {});
  field_.bricks.clear();
  cells_of_bricks_.clear();
  return begin_pass(Pass::coarse);
}

Result<void> FieldBuild::check_memory(std::uint64_t bricks) const {
  const std::uint64_t bytes = memory_bytes(field_.grid, bricks);
  if (bytes <= options_.max_bytes) return {};
  std::string why = "a field with cells of " +
                    in_metres(static_cast<double>(field_.grid.cell_m) / brick_cells) + " needs " +
                    (bricks == 0 ? "more than " : "") + std::to_string(bytes) + " bytes, and max_bytes is " +
                    std::to_string(options_.max_bytes);
  if (reached_m_ > 0.0) {
    why += "; larger cells had an error of " + in_metres(reached_m_) + " where " + in_metres(wanted_m()) +
           " is wanted";
  }
  return Error{ErrorCode::capacity, why};
}

Result<void> FieldBuild::begin_pass(Pass pass) {
  pass_ = pass;
  named_ = taken_ = 0;
  const std::uint64_t bricks = cells_of_bricks_.size();
  SplitMix64 random(points_seed);
  const auto point_in = [&](std::uint32_t cell) {
    return field_.grid.point(glm::dvec3(field_.grid.cell(cell)) +
                             glm::dvec3(random.uniform(), random.uniform(), random.uniform()));
  };
  switch (pass) {
    case Pass::coarse:
      count_ = static_cast<std::uint32_t>(field_.grid.vertex_count());
      break;
    case Pass::centers:
      count_ = static_cast<std::uint32_t>(field_.grid.cell_count());
      break;
    case Pass::bricks:
      if (auto fits = check_memory(bricks); !fits) return fits;
      count_ = static_cast<std::uint32_t>(bricks * vertices_per_brick);
      field_.bricks.assign(count_, {});
      break;
    case Pass::near_points:
    case Pass::all_points: {
      const std::uint64_t cells = pass == Pass::near_points ? bricks : field_.grid.cell_count();
      random_points_m_.clear();
      errors_m_.clear();
      for (std::uint32_t i = 0; i < points_per_comparison; ++i) {
        const auto cell = static_cast<std::uint32_t>(random.uniform() * static_cast<double>(cells));
        random_points_m_.push_back(point_in(pass == Pass::near_points ? cells_of_bricks_[cell] : cell));
      }
      count_ = points_per_comparison;
      break;
    }
    case Pass::complete:
      count_ = 0;
      break;
  }
  return {};
}

shared::FieldPoint FieldBuild::point(std::uint32_t number) const noexcept {
  const Grid& grid = field_.grid;
  switch (pass_) {
    case Pass::coarse:
      return {grid.point(glm::dvec3(grid.vertex(number))), everywhere_m};
    case Pass::centers: {
      // A cell needs a brick if a part of the surface lies in it, or within a cell of a brick from it.
      const float half_diagonal = 0.8661f;
      return {grid.point(glm::dvec3(grid.cell(number)) + 0.5),
              grid.cell_m * (half_diagonal + 1.0f / brick_cells)};
    }
    case Pass::bricks: {
      const glm::uvec3 cell = grid.cell(cells_of_bricks_[number / vertices_per_brick]);
      const glm::uvec3 vertex = brick_vertex(number % vertices_per_brick);
      return {grid.point(glm::dvec3(cell) + glm::dvec3(vertex) / static_cast<double>(brick_cells)),
              everywhere_m};
    }
    default:
      return {random_points_m_[number], everywhere_m};
  }
}

std::size_t FieldBuild::next(std::span<shared::FieldPoint> points) {
  if (pass_ == Pass::complete) return 0;
  RTSTDB_ASSERT(named_ == taken_ && !points.empty(),
                "the samples of the last points are missing, or there is no space for a point");
  const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(points.size(), count_ - named_));
  for (std::uint32_t i = 0; i < count; ++i)
    points[i] = point(named_ + i);
  named_ += count;
  return count;
}

bool FieldBuild::needs_sign() const noexcept {
  return field_.is_signed && (pass_ == Pass::coarse || pass_ == Pass::bricks);
}

void FieldBuild::take_one(std::uint32_t number, const shared::FieldSample& sample) {
  switch (pass_) {
    case Pass::coarse:
      field_.coarse[number] = make_vertex(sample.distance_m, sample.gradient);
      return;
    case Pass::centers:
      if (std::abs(sample.distance_m) > point(number).radius_m) return;
      field_.bricks_of_cells[number] = static_cast<std::uint32_t>(cells_of_bricks_.size());
      cells_of_bricks_.push_back(number);
      return;
    case Pass::bricks:
      field_.bricks[number] = make_vertex(sample.distance_m, sample.gradient);
      return;
    default:
      errors_m_.push_back(std::abs(std::abs(field_.distance_m(glm::dvec3(random_points_m_[number]))) -
                                   std::abs(static_cast<double>(sample.distance_m))));
      return;
  }
}

Result<void> FieldBuild::take(std::span<const shared::FieldSample> samples) {
  RTSTDB_ASSERT(samples.size() == named_ - taken_, "the number of samples is not that of the last points");
  for (const shared::FieldSample& sample : samples)
    take_one(taken_++, sample);
  field_.report.distances += samples.size();
  return taken_ == count_ ? end_pass() : Result<void>();
}

Result<void> FieldBuild::end_pass() {
  switch (pass_) {
    case Pass::coarse:
      return begin_pass(Pass::centers);
    case Pass::centers:
      return begin_pass(Pass::bricks);
    case Pass::bricks:
      return begin_pass(Pass::near_points);
    case Pass::near_points: {
      std::ranges::sort(errors_m_);
      const auto quantile = [&](std::size_t percent) {
        return errors_m_[(errors_m_.size() - 1) * percent / 100];
      };
      field_.report.error_p50_m = quantile(50);
      field_.report.error_p99_m = quantile(99);
      field_.report.error_max_m = quantile(100);
      return begin_pass(Pass::all_points);
    }
    default:
      field_.report.grid_error_max_m = std::ranges::max(errors_m_);
      return end_attempt();
  }
}

Result<void> FieldBuild::end_attempt() {
  FieldReport& report = field_.report;
  report.cell_m = static_cast<double>(field_.grid.cell_m) / brick_cells;
  report.coarse_cells = field_.grid.cell_count();
  report.bricks = cells_of_bricks_.size();
  report.bytes = memory_bytes(field_.grid, report.bricks);
  if (options_.cell_m > 0.0 || report.error_p99_m <= wanted_m()) return begin_pass(Pass::complete);
  reached_m_ = report.error_p99_m;
  // The error is of first order in the edge of the cells at sharp edges, of third order on smooth surfaces.
  const double finer_m = report.cell_m * std::clamp(0.9 * wanted_m() / reached_m_, 0.4, 0.8);
  const Grid finer = grid_around(box_, finer_m * brick_cells);
  if (!(finer.cell_m < field_.grid.cell_m)) {
    return Error{ErrorCode::bad_input, "a field with an error of " + in_metres(wanted_m()) +
                                           " is not possible: the smallest cells that single precision"
                                           " separates have an error of " +
                                           in_metres(reached_m_)};
  }
  return begin_attempt(finer_m);
}

FieldProgress FieldBuild::progress() const noexcept {
  const std::uint64_t bricks = cells_of_bricks_.size() * vertices_per_brick + 2 * points_per_comparison;
  std::uint64_t left = count_ - taken_;
  if (pass_ == Pass::coarse) left += field_.grid.cell_count() + bricks;
  if (pass_ == Pass::centers) left += bricks;
  if (pass_ == Pass::bricks) left += 2 * points_per_comparison;
  if (pass_ == Pass::near_points) left += points_per_comparison;
  return {field_.report.distances, field_.report.distances + left};
}

}  // namespace rtstdb::field
