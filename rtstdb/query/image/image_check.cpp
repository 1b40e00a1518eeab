#include "rtstdb/query/image/image_check.hpp"

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>
#include <string>

#include <rtstdb/light.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/image/image_stages.hpp"

namespace rtstdb::query {
namespace {

constexpr double min_exposure_value = -20.0, max_exposure_value = 30.0;
constexpr double min_quaternion_length = 1e-6, max_quaternion_length = 1e6;

Error outside(const ImageQueryOptions& options, const std::string& what, std::uint64_t value,
              const std::string& allowed) {
  return {ErrorCode::capacity, "image query '" + options.name + "' asks for " + what + " " +
                                   std::to_string(value) + "; " + allowed + " are possible"};
}

std::string up_to(std::uint64_t limit) {
  return "1 to " + std::to_string(limit);
}

double length_of(const glm::quat& q) noexcept {
  return glm::length(glm::dvec4(q.w, q.x, q.y, q.z));
}

bool has_output(const ImageOutputs& o) noexcept {
  return o.color || o.srgb || o.depth || o.identity || o.normal || o.motion;
}

/// Stages are counted in 32 bits.
constexpr std::uint64_t max_stages = 0xFFFFFFFFu;

/// Refuses a value outside [lowest, highest]; NaN is outside.
std::optional<BadInput> check_value(const char* field, double value, double lowest, double highest,
                                    std::uint32_t element) noexcept {
  if (value >= lowest && value <= highest) return std::nullopt;
  return with_field(BadInput{.reason = BadInputReason::bad_camera, .element = element, .entity = {}}, field,
                    value, {.lowest = lowest, .highest = highest});
}

/// Checks a field in single precision; its limits are rounded to single precision.
std::optional<BadInput> check_value(const char* field, float value, double lowest, double highest,
                                    std::uint32_t element) noexcept {
  if (value >= static_cast<float>(lowest) && value <= static_cast<float>(highest)) return std::nullopt;
  return with_field(BadInput{.reason = BadInputReason::bad_camera, .element = element, .entity = {}}, field,
                    static_cast<double>(value), {.lowest = lowest, .highest = highest});
}

/// Refuses a duration outside [0, longest].
std::optional<BadInput> check_duration(const char* field, Nanoseconds value, Nanoseconds longest,
                                       std::uint32_t element) noexcept {
  if (value >= Nanoseconds(0) && value <= longest) return std::nullopt;
  return with_duration(BadInput{.reason = BadInputReason::bad_camera, .element = element, .entity = {}},
                       field, value, Nanoseconds(0), longest);
}

Result<void> check_shadows(const ImageQueryOptions& options) {
  if (auto known = check_enumerator(options.name, "shadows", options.shadows, Shadows::mapped); !known)
    return known;
  if (options.shadows != Shadows::mapped) return {};
  if (options.mode != ImageMode::real_time || options.first_hits != FirstHits::rasterised)
    return Error{ErrorCode::bad_input, "image query '" + options.name +
                                           "' has shadows 'mapped', which need the mode 'real_time' and "
                                           "first hits 'rasterised'; it has '" +
                                           to_string(options.mode) + "' and '" +
                                           to_string(options.first_hits) + "'"};
  if (options.shadow_map_side < min_shadow_map_side || options.shadow_map_side > max_shadow_map_side)
    return outside(options, "a side of shadow maps in texels of", options.shadow_map_side,
                   std::to_string(min_shadow_map_side) + " to " + std::to_string(max_shadow_map_side));
  if (options.shadow_maps == 0 || options.shadow_maps > max_shadow_maps)
    return outside(options, "a number of shadow maps of", options.shadow_maps, up_to(max_shadow_maps));
  return {};
}

Result<void> check_fixed_lights(const ImageQueryOptions& options) {
  if (options.fixed_lights.size() > max_fixed_lights)
    return outside(options, "a number of fixed lights of", options.fixed_lights.size(),
                   "0 to " + std::to_string(max_fixed_lights));
  for (std::size_t k = 0; k < options.fixed_lights.size(); ++k) {
    const FixedLight& fixed = options.fixed_lights[k];
    const auto refuse = [&](const std::string& why) {
      return Error{ErrorCode::bad_input,
                   "image query '" + options.name + "', fixed light " + std::to_string(k) + ": " + why};
    };
    if (const auto valid = validate_light(fixed.light); !valid) return refuse(valid.error().message);
    if (fixed.light.kind != LightKind::directional && fixed.light.kind != LightKind::sky)
      return refuse(std::string("its kind is ") + to_string(fixed.light.kind) +
                    "; allowed are directional and sky");
    if (const double length = length_of(fixed.q_world);
        !(length >= min_quaternion_length && length <= max_quaternion_length))
      return refuse("the length of q_world is " + std::to_string(length) + "; allowed are 1e-6 to 1e6");
  }
  return {};
}

}  // namespace

Result<void> check_image_options(const ImageQueryOptions& options) {
  if (auto known = check_enumerator(options.name, "mode", options.mode, ImageMode::real_time); !known)
    return known;
  if (auto known = check_enumerator(options.name, "first hits", options.first_hits, FirstHits::rasterised);
      !known)
    return known;
  if (options.capacity == 0 || options.capacity > max_images_per_query)
    return outside(options, "a capacity of images of", options.capacity, up_to(max_images_per_query));
  if (options.width == 0 || options.width > max_image_side)
    return outside(options, "a width in pixels of", options.width, up_to(max_image_side));
  if (options.height == 0 || options.height > max_image_side)
    return outside(options, "a height in pixels of", options.height, up_to(max_image_side));
  const std::uint64_t pixels = std::uint64_t{options.width} * options.height * options.capacity;
  if (pixels > max_image_pixels_per_query)
    return outside(options, "a number of pixels in all images of", pixels, up_to(max_image_pixels_per_query));
  if (options.samples_per_pixel == 0 || options.samples_per_pixel > max_image_samples)
    return outside(options, "a number of samples of a pixel of", options.samples_per_pixel,
                   up_to(max_image_samples));
  if (options.bounces > max_image_bounces)
    return outside(options, "a number of bounces of", options.bounces,
                   "0 to " + std::to_string(max_image_bounces));
  if (options.emitter_points == 0 || options.emitter_points > max_emitter_points)
    return outside(options, "a number of zones of an emitting entity of", options.emitter_points,
                   up_to(max_emitter_points));
  if (options.lobe_rays == 0 || options.lobe_rays > max_lobe_rays)
    return outside(options, "a number of rays into a lobe of", options.lobe_rays, up_to(max_lobe_rays));
  if (auto checked = check_shadows(options); !checked) return checked;
  if (auto checked = check_fixed_lights(options); !checked) return checked;
  if (const std::uint64_t stages = ImageStages(options).max_stages(); stages > max_stages)
    return outside(options, "stages, for its pixels times samples times bounces, of", stages,
                   up_to(max_stages));
  if (!has_output(options.outputs))
    return Error{ErrorCode::bad_input, "image query '" + options.name + "' has no output"};
  return {};
}

HalfTangents half_tangents(const Camera& camera, const ImageQueryOptions& options) noexcept {
  const double x = std::tan(0.5 * static_cast<double>(camera.horizontal_angle_rad));
  return {x, x * options.height / options.width};
}

std::optional<BadInput> check_camera(const Camera& camera, const ImageQueryOptions& options,
                                     std::uint32_t element, const RowSource& rows, TimeSpan& times) noexcept {
  if (const auto bad = check_point(camera.p_m, element, {"p_m.x", "p_m.y", "p_m.z"})) return bad;
  if (const auto bad = check_value("length of q", length_of(camera.q), min_quaternion_length,
                                   max_quaternion_length, element))
    return bad;
  const double lowest_rad = 2.0 * std::atan(min_image_half_tangent);
  const double aspect = static_cast<double>(options.height) / options.width;
  const double highest_rad = 2.0 * std::atan(max_image_half_tangent / std::max(1.0, aspect));
  if (const auto bad = check_value("horizontal_angle_rad", static_cast<double>(camera.horizontal_angle_rad),
                                   lowest_rad, highest_rad, element))
    return bad;
  if (const auto bad = check_value("near_m", camera.near_m, min_image_near_m, max_image_near_m, element))
    return bad;
  if (const auto bad = check_value("exposure_value", camera.exposure_value, min_exposure_value,
                                   max_exposure_value, element))
    return bad;
  constexpr Nanoseconds longest(max_query_window_ns);
  const Nanoseconds longest_row = options.first_hits == FirstHits::rasterised ? Nanoseconds(0) : longest;
  if (const auto bad = check_duration("row_time", camera.row_time, longest_row, element)) return bad;
  if (const auto bad = check_duration("exposure", camera.exposure, longest, element)) return bad;
  const Nanoseconds lasts = (options.height - 1) * camera.row_time + camera.exposure;
  if (const auto bad =
          check_duration("time from the first to the last instant of the image", lasts, longest, element))
    return bad;
  if (const auto bad = check_time(camera.t, element, rows, times)) return bad;
  if (const auto bad = check_time(camera.t + lasts, element, rows, times)) return bad;
  return check_carrier(camera.carrier, element, rows);
}

}  // namespace rtstdb::query
