#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

#include <hil/splitmix64.hpp>
#include <hil/world/receiver.hpp>

namespace hil::modules {
namespace {

/// Uniform in (0, 1].
double uniform(std::uint64_t word) noexcept {
  return (static_cast<double>(word >> 11) + 1.0) * 0x1p-53;
}

/// A number of the standard normal distribution (Box, Muller, 1958) that the arguments determine.
double standard_normal(std::int64_t seed, const ReturnNumber& number) noexcept {
  std::uint64_t state = splitmix64(static_cast<std::uint64_t>(seed));
  state = splitmix64_finalizer(state ^ (static_cast<std::uint64_t>(number.sweep_begin_ns) + splitmix64_step));
  state = splitmix64_finalizer(state ^ (number.beam + splitmix64_step));
  state = splitmix64_finalizer(state ^ (number.ordinal + splitmix64_step));
  const double radius = std::sqrt(-2.0 * std::log(uniform(splitmix64(state))));
  constexpr double two_pi = 6.283185307179586;
  return radius * std::cos(two_pi * uniform(splitmix64(state + splitmix64_step)));
}

}  // namespace

double intensity_per_m2(const rtstdb::Material& material, double fraction, double cosine,
                        double range_m) noexcept {
  const double range = std::max(range_m, min_intensity_range_m);
  const double gain = material.is_retro_reflector() ? material.retro_gain : cosine;
  return material.reflectance * fraction * gain / (range * range);
}

std::optional<Detection> Receiver::detect(const BeamReturn& beam_return, const rtstdb::Material& material,
                                          const glm::dvec3& direction_world,
                                          const ReturnNumber& number) const noexcept {
  const rtstdb::RayHit& hit = beam_return.hit;
  if (hit.status != rtstdb::HitStatus::hit) return std::nullopt;
  const double range_m = static_cast<double>(hit.lambda);
  const double cosine = std::min(std::abs(glm::dot(glm::dvec3(hit.n_world), direction_world)), 1.0);
  const double intensity =
      intensity_per_m2(material, static_cast<double>(beam_return.fraction), cosine, range_m);
  if (intensity <= options_.threshold_per_m2) return std::nullopt;
  if (options_.range_noise_m == 0.0) return Detection{range_m, intensity};
  const double noise_m = options_.range_noise_m * standard_normal(options_.noise_seed, number);
  return Detection{std::max(range_m + noise_m, 0.0), intensity};
}

}  // namespace hil::modules
