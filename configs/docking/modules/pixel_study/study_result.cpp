#include "configs/docking/modules/pixel_study/study_result.hpp"

#include <cmath>
#include <numbers>

#include <hil/numbers.hpp>

namespace hil::modules {
namespace {

using contribution::Mark;
using contribution::not_known;

contribution::Column number_column(const char* title, const char* unit, int decimals) {
  return {.title = title, .numeric = true, .unit = unit, .decimals = decimals};
}

}  // namespace

StudyResult::StudyResult(const StudyOptions& options, const PixelGrid& grid)
    : options_(options), grid_(grid), results_(options.distances_m.size() * options.methods.size()) {}

bool StudyResult::tiles(const PixelMethod& method) const noexcept {
  // Angles of a scenario are rounded.
  constexpr double rounding = 0.999;
  return method.beam_rad >= rounding * std::numbers::sqrt2 * grid_.pitch_rad();
}

double StudyResult::equation_2_m(const PixelMethod& method) const noexcept {
  if (method.is_beam()) return 0.0;
  return equation_2_distance_m(grid_, options_.reflector_m, method.samples_per_axis);
}

std::uint32_t StudyResult::missed_by_tiling_beams() const noexcept {
  std::uint32_t missed = 0;
  for (std::size_t m = 0; m < options_.methods.size(); ++m) {
    for (std::size_t d = 0; d < options_.distances_m.size(); ++d)
      missed += tiles(options_.methods[m]) && at(d, m).complete && !detects(d, m) ? 1 : 0;
  }
  return missed;
}

std::uint32_t StudyResult::detected_by_rays_beyond(double factor) const noexcept {
  std::uint32_t detected = 0;
  for (std::size_t m = 0; m < options_.methods.size(); ++m) {
    const PixelMethod& method = options_.methods[m];
    for (std::size_t d = 0; d < options_.distances_m.size(); ++d) {
      const bool is_beyond = !method.is_beam() && options_.distances_m[d] > factor * equation_2_m(method);
      detected += is_beyond && at(d, m).complete && detects(d, m) ? 1 : 0;
    }
  }
  return detected;
}

contribution::Table StudyResult::table() const {
  contribution::Table table;
  table.columns = {number_column("Distance", "m", 0),
                   {.title = "Pixel"},
                   number_column("Equation 2", "m", 1),
                   number_column("Shifts with a detection", "", 0),
                   {.title = "Detected"},
                   number_column("Time of a port pixel", "µs", 2),
                   number_column("Time of a frame", "s", 2)};
  for (std::size_t d = 0; d < options_.distances_m.size(); ++d) {
    for (std::size_t m = 0; m < options_.methods.size(); ++m) {
      const PixelMethod& method = options_.methods[m];
      const MethodResult& result = at(d, m);
      if (!result.complete) continue;
      const bool detected = detects(d, m);
      table.rows.push_back({{.number = options_.distances_m[d]},
                            {.text = name_of(method)},
                            {.number = method.is_beam() ? not_known : equation_2_m(method)},
                            {.number = static_cast<double>(result.detections)},
                            {.text = detected ? "✓ yes" : "✗ no", .mark = detected ? Mark::good : Mark::bad},
                            {.number = 1e-3 * result.port.ns_per_pixel()},
                            {.number = result.frame_s()}});
    }
  }
  return table;
}

contribution::Plot StudyResult::detection_plot() const {
  contribution::Plot plot{
      .title = "Shifts with a detection",
      .caption =
          "How often each method detects the reflector, by distance. Equation 2 gives the distance "
          "beyond which a number of rays may miss it.",
      .x = {.quantity = "distance", .unit = "m", .logarithmic = true},
      .y = {.quantity = "share of the shifts", .unit = "%"},
      .series = {}};
  for (std::size_t m = 0; m < options_.methods.size(); ++m) {
    contribution::Series series{.name = name_of(options_.methods[m]), .points = {}};
    for (std::size_t d = 0; d < options_.distances_m.size(); ++d) {
      if (at(d, m).complete)
        series.points.push_back({options_.distances_m[d], 100.0 * at(d, m).detections / options_.shifts});
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

contribution::Plot StudyResult::time_plot() const {
  contribution::Plot plot{.title = "Time of a frame",
                          .caption = "Wall-clock time of all pixels, by distance.",
                          .x = {.quantity = "distance", .unit = "m", .logarithmic = true},
                          .y = {.quantity = "time", .unit = "s", .logarithmic = true},
                          .series = {}};
  for (std::size_t m = 0; m < options_.methods.size(); ++m) {
    contribution::Series series{.name = name_of(options_.methods[m]), .points = {}};
    for (std::size_t d = 0; d < options_.distances_m.size(); ++d) {
      if (at(d, m).complete) series.points.push_back({options_.distances_m[d], at(d, m).frame_s()});
    }
    plot.series.push_back(std::move(series));
  }
  return plot;
}

contribution::Section StudyResult::section(const std::string& module) const {
  const std::string reflector_mm = config::format_number(1e3 * options_.reflector_m);
  return {.name = module,
          .title = "Rays and beams in pixels",
          .text = "A sensor of " + std::to_string(options_.pixels) + " × " + std::to_string(options_.pixels) +
                  " pixels looks at a retro-reflector of " + reflector_mm +
                  " mm. A method detects it when the intensity in at least one pixel is above the threshold "
                  "in " +
                  std::to_string(options_.needed_shifts) + " of " + std::to_string(options_.shifts) +
                  " random shifts of the pixels. Equation 2 gives the distance at which the reflector is two "
                  "rays wide. With more than " +
                  std::to_string(options_.all_pixels_up_to_samples) +
                  " rays in a pixel, all pixels that can see the port were traced, and " +
                  config::format_number(100.0 * options_.share_beside_port) +
                  " % of the others, from which the time of a frame is estimated. Times are wall-clock "
                  "times.",
          .pictures = {},
          .plots = {detection_plot(), time_plot()},
          .tables = {table()}};
}

}  // namespace hil::modules
