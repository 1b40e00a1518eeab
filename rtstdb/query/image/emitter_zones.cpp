#include "rtstdb/query/image/emitter_zones.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>

#include <rtstdb/result.hpp>

namespace rtstdb::query {
namespace {

/// Samples of a surface: a minimum, and for each zone.
constexpr std::uint32_t min_samples = 4096;
constexpr std::uint32_t samples_per_zone = 64;
/// A sample stands for a part of a triangle no longer than this share of the body's diameter.
constexpr double longest_part = 1.0 / 48.0;
/// The corners of a flat side are this near its plane, as a share of the diameter.
constexpr double flat_share = 1e-4;
/// A triangle with a smaller share of the area makes no side of its own.
constexpr double min_side_area = 1e-7;
/// Distance of a shadow ray's end from the edges of its triangle, as a share of the diameter. Beside an edge,
/// rounding decides which triangle the ray meets. Zones of smaller triangles use what is possible.
constexpr double target_inset = 2e-4;
/// How far the points toward the borders are from the middle, in standard deviations.
constexpr double border_deviations = 1.4;

/// The distance of a point in a triangle from the nearest edge.
double inset_of(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) noexcept {
  const auto from_edge = [&](const glm::dvec3& begin, const glm::dvec3& end) {
    return glm::length(glm::cross(end - begin, p - begin)) / std::max(glm::distance(begin, end), 1e-300);
  };
  return std::min({from_edge(a, b), from_edge(b, c), from_edge(c, a)});
}

/// Orders positions by their coordinates.
bool is_before(const glm::dvec3& p, const glm::dvec3& q) noexcept {
  return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z);
}

/// A number in [0, 1) that follows from a position.
double scrambled(const glm::dvec3& p, std::uint64_t purpose) noexcept {
  std::uint64_t x = purpose;
  for (int k = 0; k < 3; ++k) {
    x ^= std::bit_cast<std::uint32_t>(static_cast<float>(p[k]));
    x *= 0x9E3779B97F4A7C15u;
    x ^= x >> 29;
  }
  x *= 0xBF58476D1CE4E5B9u;
  return static_cast<double>(x >> 11) * 0x1p-53;
}

}  // namespace

// ---- moments

void EmitterZones::Moments::add(const Sample& sample) noexcept {
  const auto weight = static_cast<double>(sample.area);
  area += weight;
  for (std::size_t i = 0; i < dimensions; ++i) {
    const double weighted = weight * static_cast<double>(sample.at[i]);
    first[i] += weighted;
    for (std::size_t j = 0; j <= i; ++j)
      second[i][j] += weighted * static_cast<double>(sample.at[j]);
  }
}

EmitterZones::Feature EmitterZones::Moments::mean() const noexcept {
  Feature mean;
  for (std::size_t i = 0; i < dimensions; ++i)
    mean[i] = first[i] / area;
  return mean;
}

double EmitterZones::Moments::covariance(std::size_t i, std::size_t j) const noexcept {
  return second[std::max(i, j)][std::min(i, j)] / area - first[i] / area * (first[j] / area);
}

double EmitterZones::Moments::spread() const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < dimensions; ++i)
    sum += covariance(i, i);
  return area * std::max(sum, 0.0);
}

/// The direction of largest spread, times the standard deviation, by the power method. `across`: another
/// axis, to which the direction is perpendicular; or nullptr.
EmitterZones::Feature EmitterZones::Moments::main_axis(const Feature* across) const noexcept {
  const auto remove_across = [&](Feature& v) {
    if (across == nullptr) return;
    double along = 0.0, length = 0.0;
    for (std::size_t i = 0; i < dimensions; ++i) {
      along += v[i] * (*across)[i];
      length += (*across)[i] * (*across)[i];
    }
    if (length <= 0.0) return;
    for (std::size_t i = 0; i < dimensions; ++i)
      v[i] -= along / length * (*across)[i];
  };
  std::array<Feature, dimensions> matrix;
  for (std::size_t i = 0; i < dimensions; ++i)
    for (std::size_t j = 0; j < dimensions; ++j)
      matrix[i][j] = covariance(i, j);
  // Begins with the column of the largest diagonal element.
  std::size_t largest = 0;
  for (std::size_t i = 1; i < dimensions; ++i)
    if (matrix[i][i] > matrix[largest][largest] * (1.0 + 1e-9)) largest = i;
  Feature v = matrix[largest];
  if (across != nullptr) {
    double best = -1.0;
    for (std::size_t i = 0; i < dimensions; ++i) {
      Feature column = matrix[i];
      remove_across(column);
      double length = 0.0;
      for (const double x : column)
        length += x * x;
      if (length > best) {
        best = length;
        v = column;
      }
    }
  }
  double value = 0.0;
  for (int turn = 0; turn < 40; ++turn) {
    double length = 0.0;
    for (const double x : v)
      length += x * x;
    length = std::sqrt(length);
    if (length < 1e-30) return {};
    for (double& x : v)
      x /= length;
    Feature next{};
    for (std::size_t i = 0; i < dimensions; ++i)
      for (std::size_t j = 0; j < dimensions; ++j)
        next[i] += matrix[i][j] * v[j];
    remove_across(next);
    value = 0.0;
    for (std::size_t i = 0; i < dimensions; ++i)
      value += v[i] * next[i];
    v = next;
  }
  double length = 0.0;
  for (const double x : v)
    length += x * x;
  if (length < 1e-60 || value <= 0.0) return {};
  for (double& x : v)
    x *= std::sqrt(value / length);
  return v;
}

// ---- samples

EmitterZones::EmitterZones(std::uint32_t zones, std::uint32_t max_triangles)
    : zones_count_(zones), samples_wanted_(zones == 0 ? 0 : std::max(min_samples, samples_per_zone * zones)) {
  const std::size_t max_samples = std::size_t{max_triangles} + 2 * std::size_t{samples_wanted_};
  facets_.reserve(max_triangles);
  sides_.reserve(max_triangles);
  order_.reserve(max_samples);
  samples_.reserve(max_samples);
  planes_.reserve(zones);
  zones_.reserve(zones);
}

/// Reads the triangles in an order that follows from their corners, as all sums after it.
void EmitterZones::read(std::span<const glm::uvec3> triangles, std::span<const glm::vec3> positions_m,
                        const glm::dvec3& scale) noexcept {
  facets_.clear();
  glm::dvec3 lowest(std::numeric_limits<double>::infinity()), highest = -lowest;
  for (const glm::uvec3& corners : triangles) {
    const auto corner = [&](std::uint32_t k) { return glm::dvec3(positions_m[k]) * scale; };
    Corners at{corner(corners.x), corner(corners.y), corner(corners.z)};
    while (is_before(at.b, at.a) || is_before(at.c, at.a))
      at = {at.b, at.c, at.a};
    const glm::dvec3 across = glm::cross(at.b - at.a, at.c - at.a);
    const double length = glm::length(across);
    if (!(length > 0.0)) continue;
    facets_.push_back({at, across / length, 0.5 * length});
    lowest = glm::min(lowest, glm::min(at.a, glm::min(at.b, at.c)));
    highest = glm::max(highest, glm::max(at.a, glm::max(at.b, at.c)));
  }
  std::ranges::sort(facets_, [](const Facet& x, const Facet& y) {
    if (x.area != y.area) return x.area > y.area;
    if (x.at.a != y.at.a) return is_before(x.at.a, y.at.a);
    if (x.at.b != y.at.b) return is_before(x.at.b, y.at.b);
    return is_before(x.at.c, y.at.c);
  });
  middle_ = 0.5 * (lowest + highest);
  diameter_ = facets_.empty() ? 0.0 : glm::length(highest - lowest);
  area_ = 0.0;
  double volume = 0.0;
  for (const Facet& facet : facets_) {
    area_ += facet.area;
    volume += facet.area * glm::dot(facet.n, facet.at.a - middle_);
  }
  // The front is made the outer side; that of an open mesh is any.
  if (volume < 0.0)
    for (Facet& facet : facets_)
      facet.n = -facet.n;
}

/// Assigns each facet to its flat side: the plane of the largest facet in it. Returns how many sides there
/// are, or 1, one for all, if they are more than the zones.
std::uint32_t EmitterZones::find_sides() noexcept {
  sides_.assign(facets_.size(), 0);
  planes_.clear();
  for (std::size_t k = 0; k < facets_.size(); ++k) {
    const Facet& facet = facets_[k];
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t side = 0; side < planes_.size(); ++side) {
      const Facet& plane = facets_[planes_[side]];
      if (glm::dot(plane.n, facet.n) <= 0.0) continue;
      double off = 0.0;
      for (const glm::dvec3& corner : {facet.at.a, facet.at.b, facet.at.c})
        off = std::max(off, std::abs(glm::dot(plane.n, corner - plane.at.a)));
      if (off < least) {
        least = off;
        nearest = side;
      }
    }
    if (least > flat_share * diameter_ && facet.area > min_side_area * area_) {
      if (planes_.size() == zones_count_) {
        std::ranges::fill(sides_, 0u);
        return 1;
      }
      nearest = planes_.size();
      planes_.push_back(static_cast<std::uint32_t>(k));
    }
    sides_[k] = static_cast<std::uint32_t>(nearest);
  }
  return static_cast<std::uint32_t>(planes_.size());
}

/// Bisects the triangle until its parts are small. The sample of a part is a random point of it, so that
/// those of long and thin parts side by side are spread over all of their length.
void EmitterZones::add_samples(const Facet& facet, std::uint32_t side) noexcept {
  std::array<Corners, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = facet.at;
  const double longest_m = longest_part * diameter_;
  while (depth > 0) {
    Corners part = stack[--depth];
    const double ab = glm::distance(part.a, part.b), bc = glm::distance(part.b, part.c),
                 ca = glm::distance(part.c, part.a);
    // The longest edge comes first.
    if (bc >= ab && bc >= ca)
      part = {part.b, part.c, part.a};
    else if (ca >= ab)
      part = {part.c, part.a, part.b};
    const double area = 0.5 * glm::length(glm::cross(part.b - part.a, part.c - part.a));
    const bool is_small = area * samples_wanted_ <= area_ || std::max({ab, bc, ca}) <= longest_m;
    if (!is_small && depth + 2 <= stack.size()) {
      const glm::dvec3 half = 0.5 * (part.a + part.b);
      stack[depth++] = {part.a, half, part.c};
      stack[depth++] = {half, part.b, part.c};
      continue;
    }
    const glm::dvec3 center = (part.a + part.b + part.c) / 3.0;
    const double root = std::sqrt(scrambled(center, 1)), mixed = scrambled(center, 2);
    const glm::dvec3 p = (1.0 - root) * part.a + root * ((1.0 - mixed) * part.b + mixed * part.c);
    const glm::dvec3 at = (p - middle_) / diameter_;
    samples_.push_back(
        {{static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z),
          static_cast<float>(facet.n.x), static_cast<float>(facet.n.y), static_cast<float>(facet.n.z)},
         static_cast<float>(area / area_),
         static_cast<float>(inset_of(p, facet.at.a, facet.at.b, facet.at.c) / diameter_),
         side});
  }
}

// ---- zones

EmitterZones::Zone EmitterZones::zone_of(std::uint32_t begin, std::uint32_t end) const noexcept {
  Zone zone{begin, end, {}};
  for (std::uint32_t k = begin; k < end; ++k)
    zone.moments.add(samples_[order_[k]]);
  return zone;
}

/// Splits a zone where the sum of the spreads of both parts is least, along its main axis.
bool EmitterZones::split(Zone& zone, Zone& rest) noexcept {
  const Feature axis = zone.moments.main_axis(nullptr);
  const auto along = [&](std::uint32_t sample) {
    double sum = 0.0;
    for (std::size_t i = 0; i < dimensions; ++i)
      sum += axis[i] * static_cast<double>(samples_[sample].at[i]);
    return sum;
  };
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (std::uint32_t k = zone.begin; k < zone.end; ++k) {
    const double x = along(order_[k]);
    lowest = std::min(lowest, x);
    highest = std::max(highest, x);
  }
  if (!(highest > lowest)) return false;
  constexpr std::size_t bins = 64;
  std::array<double, bins> area{}, first{};
  const auto bin_of = [&](double x) {
    return std::min(static_cast<std::size_t>((x - lowest) / (highest - lowest) * bins), bins - 1);
  };
  double whole = 0.0, whole_first = 0.0;
  for (std::uint32_t k = zone.begin; k < zone.end; ++k) {
    const double x = along(order_[k]);
    const auto weight = static_cast<double>(samples_[order_[k]].area);
    area[bin_of(x)] += weight;
    first[bin_of(x)] += weight * x;
    whole += weight;
    whole_first += weight * x;
  }
  std::size_t bound = 1;
  double best = -1.0, below = 0.0, below_first = 0.0;
  for (std::size_t k = 1; k < bins; ++k) {
    below += area[k - 1];
    below_first += first[k - 1];
    if (below <= 0.0 || below >= whole * (1.0 - 1e-12)) continue;
    const double difference = below_first / below - (whole_first - below_first) / (whole - below);
    const double gain = below * (whole - below) * difference * difference;
    if (gain > best * (1.0 + 1e-6)) {
      best = gain;
      bound = k;
    }
  }
  if (best <= 0.0) return false;
  const auto begin = order_.begin() + zone.begin, end = order_.begin() + zone.end;
  const auto middle = std::partition(begin, end, [&](std::uint32_t s) { return bin_of(along(s)) < bound; });
  const auto bound_index = static_cast<std::uint32_t>(middle - order_.begin());
  rest = zone_of(bound_index, zone.end);
  zone = zone_of(zone.begin, bound_index);
  return true;
}

shared::EmitterZone EmitterZones::record_of(const Zone& zone) const noexcept {
  const Feature mean = zone.moments.mean();
  // Covariances of the vectors that begin at two places of the feature; symmetric parts.
  const auto squares = [&](std::size_t a, std::size_t b) {
    const Moments& moments = zone.moments;
    return glm::vec3(glm::dvec3(moments.covariance(a, b), moments.covariance(a + 1, b + 1),
                                moments.covariance(a + 2, b + 2)));
  };
  const auto products = [&](std::size_t a, std::size_t b) {
    const auto both = [&](std::size_t i, std::size_t j) {
      return 0.5 * (zone.moments.covariance(a + i, b + j) + zone.moments.covariance(a + j, b + i));
    };
    return glm::vec3(glm::dvec3(both(0, 1), both(1, 2), both(2, 0)));
  };
  const auto square_m2 = static_cast<float>(diameter_ * diameter_);
  return {.center_m = glm::vec3(middle_ + diameter_ * glm::dvec3(mean[0], mean[1], mean[2])),
          .area_m2 = static_cast<float>(zone.moments.area * area_),
          .n = glm::vec3(glm::dvec3(mean[3], mean[4], mean[5])),
          .n_squares = squares(3, 3),
          .n_products = products(3, 3),
          .extent_squares_m2 = square_m2 * squares(0, 0),
          .extent_products_m2 = square_m2 * products(0, 0),
          .n_extent_squares_m = static_cast<float>(diameter_) * squares(3, 0),
          .n_extent_products_m = static_cast<float>(diameter_) * products(3, 0)};
}

void EmitterZones::set_points(const Zone& zone, std::span<shared::EmitterPoint> points) const noexcept {
  const Feature mean = zone.moments.mean();
  const Feature along = zone.moments.main_axis(nullptr);
  const Feature across = zone.moments.main_axis(&along);
  std::array<Feature, shared::points_per_zone> targets;
  for (std::size_t i = 0; i < dimensions; ++i) {
    targets[0][i] = mean[i];
    targets[1][i] = mean[i] + border_deviations * along[i];
    targets[2][i] = mean[i] - border_deviations * along[i];
    targets[3][i] = mean[i] + border_deviations * across[i];
    targets[4][i] = mean[i] - border_deviations * across[i];
  }
  std::array<double, shared::points_per_zone> least;
  std::array<std::uint32_t, shared::points_per_zone> nearest{};
  least.fill(std::numeric_limits<double>::infinity());
  float deepest = 0.0f;
  for (std::uint32_t k = zone.begin; k < zone.end; ++k)
    deepest = std::max(deepest, samples_[order_[k]].inset);
  const float min_inset = std::min(static_cast<float>(target_inset), 0.5f * deepest);
  for (std::uint32_t k = zone.begin; k < zone.end; ++k) {
    const Sample& sample = samples_[order_[k]];
    if (sample.inset < min_inset) continue;
    for (std::size_t point = 0; point < targets.size(); ++point) {
      double square = 0.0;
      for (std::size_t i = 0; i < dimensions; ++i) {
        const double off = static_cast<double>(sample.at[i]) - targets[point][i];
        square += off * off;
      }
      if (square < least[point]) {
        least[point] = square;
        nearest[point] = order_[k];
      }
    }
  }
  for (std::size_t point = 0; point < targets.size(); ++point) {
    const Sample& sample = samples_[nearest[point]];
    points[point] = {
        .p_m = glm::vec3(middle_ + diameter_ * glm::dvec3(sample.at[0], sample.at[1], sample.at[2])),
        .n = {sample.at[3], sample.at[4], sample.at[5]}};
  }
}

void EmitterZones::divide(std::span<const glm::uvec3> triangles, std::span<const glm::vec3> positions_m,
                          const glm::dvec3& scale, std::span<shared::EmitterZone> zones,
                          std::span<shared::EmitterPoint> points) noexcept {
  RTSTDB_ASSERT(triangles.size() <= facets_.capacity(), "the mesh has more triangles than the capacity");
  RTSTDB_ASSERT(zones.size() == zones_count_, "the number of zones is not that of the constructor");
  read(triangles, positions_m, scale);
  std::ranges::fill(zones, shared::EmitterZone{});
  std::ranges::fill(points, shared::EmitterPoint{});
  if (facets_.empty()) return;
  const std::uint32_t sides = find_sides();
  samples_.clear();
  for (std::size_t k = 0; k < facets_.size(); ++k)
    add_samples(facets_[k], sides_[k]);
  order_.resize(samples_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  zones_.clear();
  auto begin = order_.begin();
  for (std::uint32_t side = 0; side < sides; ++side) {
    const auto end =
        std::partition(begin, order_.end(), [&](std::uint32_t s) { return samples_[s].side == side; });
    if (end != begin)
      zones_.push_back(zone_of(static_cast<std::uint32_t>(begin - order_.begin()),
                               static_cast<std::uint32_t>(end - order_.begin())));
    begin = end;
  }
  while (zones_.size() < zones_count_) {
    const auto largest =
        std::ranges::max_element(zones_, {}, [](const Zone& zone) { return zone.moments.spread(); });
    Zone rest;
    if (!split(*largest, rest)) break;
    zones_.push_back(rest);
  }
  for (std::size_t k = 0; k < zones_.size(); ++k) {
    zones[k] = record_of(zones_[k]);
    set_points(zones_[k], points.subspan(k * shared::points_per_zone, shared::points_per_zone));
  }
}

}  // namespace rtstdb::query
