#pragma once
// One image of a camera outside of a run's tick: of a history, or of a view at the end of a run.
//
// Threads: one; allocates and blocks.

#include <atomic>
#include <cstdint>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/modules/camera/visible_bodies.hpp"
#include "runtime/modules/recorded_camera.hpp"

namespace hil::modules {

/// Rows of pixels from the top left.
struct StillImage {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> rgb;     ///< sRGB: red, green, blue
  std::vector<float> depth_m;        ///< infinite where nothing is seen
  std::vector<VisibleBody> bodies;   ///< the nearest first
  std::uint64_t ignored_pixels = 0;  ///< those of bodies beyond VisibleBodies::max_bodies
  double exposure_value = 0.0;       ///< of rgb
  bool is_in_daylight = false;       ///< the camera sees no light
  std::uint32_t incomplete_pixels = 0;
  bool lights_overflow = false;
  bool is_dark = false;  ///< no light is in the camera's mask, nor daylight
};

/// Takes the image whose exposure begins at a run time, of a version of the world.
///
/// RecordedCamera::has_daylight: where the camera's mask has no light and no surface that emits light, a sun
/// and a sky light the image. RecordedCamera::has_automatic_exposure: the geometric mean of the luminances
/// above 0 is a quarter of white (Reinhard et al., "Photographic Tone Reproduction for Digital Images",
/// 2002).
///
/// Errors: those of prepare, of snapshot, and of the transaction (bad_input for a camera that is refused,
/// device_lost). `stop`: when it becomes true, the image ends with the error bad_input; null: never.
rtstdb::Result<StillImage> take_still_image(rtstdb::Database& database, RecordedCamera camera,
                                            const rtstdb::ReadAt& read_at, std::int64_t time_ns,
                                            const std::atomic<bool>* stop = nullptr);

}  // namespace hil::modules
