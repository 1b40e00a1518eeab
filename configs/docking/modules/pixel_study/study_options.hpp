#pragma once
// The parameters of a pixel study.
//
// SI units. Threads: plain data.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/schema.hpp>
#include <rtstdb/query.hpp>

#include "configs/docking/modules/docking_port/port_geometry.hpp"

namespace hil::modules {

/// How a pixel is measured: by a square grid of rays, or by one beam along its middle.
struct PixelMethod {
  std::uint32_t samples_per_axis = 1;  ///< rays
  double beam_rad = 0.0;               ///< full opening angle; 0: rays

  bool is_beam() const noexcept { return beam_rad > 0.0; }
  std::uint32_t samples() const noexcept { return samples_per_axis * samples_per_axis; }
};

struct StudyOptions {
  std::string body;  ///< with the port
  BodyPort port{};
  double port_radius_m = 1.0;
  std::string reflector;     ///< the body that has to be detected
  double reflector_m = 0.0;  ///< its size across the line of sight
  std::vector<double> distances_m;
  std::vector<PixelMethod> methods;  ///< rays by ascending samples, then beams by ascending width
  std::uint32_t pixels = 0;
  double field_of_view_rad = 0.0;
  double range_m = 0.0;
  std::vector<std::string> layers;
  double threshold_per_m2 = 0.0;
  std::uint32_t shifts = 0;         ///< random ones, within a pixel
  std::uint32_t needed_shifts = 0;  ///< a method detects if it does in this many shifts
  /// With more rays in a pixel, only `share_beside_port` of the pixels that can not see the port is traced.
  std::uint32_t all_pixels_up_to_samples = 0;
  double share_beside_port = 0.0;
  rtstdb::ConeMode mode = rtstdb::ConeMode::exact;  ///< of beams
  std::uint32_t batch = 0;                          ///< rays or beams in one step
  bool images = true;
};

config::Schema study_schema();

/// Empty with a mistake when the values do not fit together.
std::optional<StudyOptions> read_study_options(const config::Value& parameters,
                                               config::Diagnostics& diagnostics);

/// "4096 rays", "beam of 0.052°".
std::string name_of(const PixelMethod& method);

}  // namespace hil::modules
