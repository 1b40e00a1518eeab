#pragma once
// The outputs of a camera and their places.
//
// With `objects`, of the last image, one slot for each of the nearest bodies in view:
//     object<i>.valid         1: the slot holds an object
//     object<i>.entity        index of the body, as in world.json
//     object<i>.x_min, .y_min, .x_max, .y_max
//                             box of its visible pixels: distances of its edges from the left and upper
//                             edge of the image, in pixels
//     object<i>.depth         m, of its nearest visible pixel
//     object<i>.pixels        visible pixels
//     object<i>.share         visible pixels over those that the body would cover alone, in this image
//     object<i>.share_exact   0: pixels are left out of the share, since what they cover is not known
//     object_count            bodies of the object layers in view
//     digest                  a hash of all depths and bodies so far
// Always:
//     image_count             images so far
//     age                     ms since the last image's first instant
//     missing_tiles           of the last image

#include <cstddef>

#include <hil/world/world_module.hpp>

#include "runtime/modules/camera/camera_options.hpp"

namespace hil::modules {

WorldPorts camera_ports(const config::Value& parameters, const CameraOptions& options);

/// Indices in Ports::outputs.
class CameraOutputs {
 public:
  static constexpr std::size_t per_object = 10;

  static constexpr std::size_t image_count() noexcept { return 0; }
  static constexpr std::size_t age() noexcept { return 1; }
  static constexpr std::size_t missing_tiles() noexcept { return 2; }
  static constexpr std::size_t object_count() noexcept { return 3; }
  static constexpr std::size_t digest() noexcept { return 4; }
  /// The first of per_object outputs.
  static constexpr std::size_t object(std::size_t i) noexcept { return 5 + i * per_object; }
};

}  // namespace hil::modules
