#pragma once
// The world from above, as modules contribute it to the report: outlines of bodies, tracks of vehicles, the
// field of view of a sensor and the points that it measured.
//
// World frame: x east, y north, z up. Metres, radians, nanoseconds of run time. Threads: plain data.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::contribution {

struct PointM {
  double x_m = 0.0;
  double y_m = 0.0;
};

/// How a shape is drawn; later ones lie above earlier ones.
enum class Layer : std::uint8_t { ground, road, marking, detector, structure, pole, vehicle, ego };

const char* to_string(Layer layer) noexcept;
std::optional<Layer> layer_from(const std::string& word);

/// The outline of a body on the ground, in either turn, not closed by a repeated point.
struct Shape {
  Layer layer = Layer::structure;
  std::string label;
  std::vector<PointM> footprint;
  std::string body_layer{};  ///< the body's first layer in the scenario; empty: the shape is no body
};

struct TrackPoint {
  std::int64_t time_ns = 0;
  double x_m = 0.0;
  double y_m = 0.0;
};

/// The path of a vehicle.
struct Track {
  std::string name;
  bool ego = false;
  std::vector<TrackPoint> points;
};

/// The field of view of a sensor, from its first direction to its last (either turn). Directions count from
/// +x to +y.
struct FieldOfView {
  PointM origin;
  double first_direction_rad = 0.0;
  double last_direction_rad = 0.0;
  double range_m = 0.0;
};

/// A point that a sensor measured: where it is, the direction and range of the beam, and the number of the
/// body that the beam met. The files keep 0.1 mm and 1 microradian.
struct SensorPoint {
  double x_m = 0.0;
  double y_m = 0.0;
  double z_m = 0.0;
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
  double range_m = 0.0;
  std::uint32_t entity = 0;
};

struct Map {
  std::vector<Shape> shapes;
  std::vector<Track> tracks;
  std::optional<FieldOfView> field_of_view;
  std::vector<SensorPoint> sensor_points;
};

}  // namespace hil::contribution
