#pragma once
// The receiver of a laser scanner: the intensity of a return, the threshold of detection, and the noise of
// the measured range.
//
// Threads: constant after construction; any thread.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <optional>
#include <string_view>

#include <hil/world/beam_return.hpp>
#include <rtstdb/material.hpp>

namespace hil::modules {

/// The least range in intensities, which would be infinite at 0.
inline constexpr double min_intensity_range_m = 1e-3;

/// reflectance * fraction * cosine / range^2; for a retro-reflector its gain replaces the cosine, which is
/// that of the angle of incidence, 0 to 1.
double intensity_per_m2(const rtstdb::Material& material, double fraction, double cosine,
                        double range_m) noexcept;

struct ReceiverOptions {
  double threshold_per_m2 = 0.0;  ///< a return with this intensity or less is not detected
  double range_noise_m = 0.0;     ///< standard deviation of the normal distribution
  std::int64_t noise_seed = 0;
};

class Receiver {
 public:
  Receiver() = default;
  explicit Receiver(const ReceiverOptions& options) : options_(options) {}
  const ReceiverOptions& options() const noexcept { return options_; }

  /// What the receiver measures; empty: no hit, or not detected. `direction_world`: the unit vector along the
  /// beam. The noise is a function of the seed and the number alone, so a return has the same noise in every
  /// run with the seed, and in the history. A measured range is at least 0.
  std::optional<Detection> detect(const BeamReturn& beam_return, const rtstdb::Material& material,
                                  const glm::dvec3& direction_world,
                                  const ReturnNumber& number) const noexcept;

 private:
  ReceiverOptions options_;
};

}  // namespace hil::modules
