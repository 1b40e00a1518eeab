#include "runtime/modules/laser_scanner/sweep_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace hil::modules {
namespace {

/// The number of colours in a picture.
constexpr std::size_t colours = 8;

contribution::Picture front_view(std::string title, std::string caption) {
  return {.title = std::move(title),
          .caption = std::move(caption),
          .subject = contribution::no_subject,
          .right = {0.0, -1.0}};  // from the scanner, right is -y
}

contribution::Picture by_body(const std::vector<SweepView::Point>& points,
                              const std::function<std::string(rtstdb::EntityId)>& name_of) {
  contribution::Picture picture = front_view(
      "By body", "Detected returns as seen from behind the scanner, in metres to the right and up.");
  std::vector<rtstdb::EntityId> bodies;
  for (const SweepView::Point& point : points) {
    const auto known = std::ranges::find(bodies, point.entity);
    const auto number = static_cast<std::uint32_t>(known - bodies.begin());
    if (known == bodies.end()) {
      bodies.push_back(point.entity);
      picture.entities.push_back(name_of(point.entity));
    }
    picture.points.push_back(point.sensor);
    picture.points.back().entity = number;
  }
  return picture;
}

/// The colour of a point shows how many decades its intensity is below that of the brightest one.
contribution::Picture by_intensity(const std::vector<SweepView::Point>& points) {
  contribution::Picture picture =
      front_view("By intensity", "The same returns, coloured by the decade of their intensity.");
  const double brightest =
      std::ranges::max_element(points, {}, &SweepView::Point::intensity_per_m2)->intensity_per_m2;
  const double top = std::ceil(std::log10(brightest));
  for (std::size_t decade = 0; decade < colours; ++decade) {
    char name[64];
    const bool is_last = decade + 1 == colours;
    std::snprintf(name, sizeof name, is_last ? "below 1e%.0f 1/m²" : "above 1e%.0f 1/m²",
                  top - static_cast<double>(decade) - (is_last ? 0.0 : 1.0));
    picture.entities.emplace_back(name);
  }
  for (const SweepView::Point& point : points) {
    const double decade = std::floor(top - std::log10(point.intensity_per_m2));
    picture.points.push_back(point.sensor);
    picture.points.back().entity = static_cast<std::uint32_t>(std::clamp(decade, 0.0, colours - 1.0));
  }
  return picture;
}

}  // namespace

SweepView::SweepView(std::uint64_t beams) : every_((beams + max_points - 1) / max_points) {
  points_.reserve(max_points + 1);
  last_.reserve(max_points + 1);
}

void SweepView::begin_sweep() noexcept {
  points_.swap(last_);
  points_.clear();
}

std::vector<contribution::SensorPoint> SweepView::map_points() const {
  std::vector<contribution::SensorPoint> points;
  for (const Point& point : shown())
    points.push_back(point.world);
  return points;
}

void SweepView::contribute(const std::string& scanner,
                           const std::function<std::string(rtstdb::EntityId)>& name_of,
                           contribution::Contribution& report) const {
  if (shown().empty()) return;
  contribution::Section bodies{.name = scanner + "_bodies",
                               .title = "Bodies that " + scanner + " detects",
                               .text = "The last complete sweep of " + scanner + "."};
  bodies.pictures.push_back(by_body(shown(), name_of));
  contribution::Section intensities{.name = scanner + "_intensity",
                                    .title = "Intensities that " + scanner + " measures"};
  intensities.pictures.push_back(by_intensity(shown()));
  report.sections.push_back(std::move(bodies));
  report.sections.push_back(std::move(intensities));
}

}  // namespace hil::modules
