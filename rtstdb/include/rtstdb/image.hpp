#pragma once
// Images of the world (paper, Render Query): what a camera sees, in colour, depth and identities.
//
// Camera    A pinhole without distortion. It looks along +x; +y is left and +z is up, as in a frustum region.
//           Pixels are square. Column 0 is at the left, row 0 at the top.
// Surface   Scatters and emits light on both sides, as its entity's material says (material.hpp).
// Light     Lights that rows name (light.hpp), entities whose material emits light, and the fixed lights of
//           the query. A shadow ray ends before a light by 3e-6 of the sum of its length and the largest
//           coordinate of its end in the frame of the light's entity; for emitting surfaces, divided by the
//           cosine of the angle between ray and normal. Only things farther in front of the light than that
//           hide it. The inner side of a closed geometry (GeometryInfo::closed) lights nothing outside the
//           box of the body; for this all triangles must have the same orientation, outward or inward. The
//           light of lamps of 10 cm and more is right up to 10,000 diameters away and 10 km from the origin
//           of the world.
// Units     Colours are luminances of the linear sRGB primaries in cd/m2: a grey (L, L, L) has luminance L.
//
// The rules of all queries (query.hpp) hold: frames, times, threads, lifetime.

#include <glm/ext/quaternion_float.hpp>
#include <glm/ext/vector_float2.hpp>
#include <glm/ext/vector_float3.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/entity.hpp>
#include <rtstdb/light.hpp>
#include <rtstdb/prepared_query.hpp>

namespace rtstdb {

class ImageQuery;
struct Ray;

/// A camera at one instant: one image. With a carrier, position and orientation are in the carrier's frame
/// (unscaled), and the camera moves with it.
struct Camera {
  glm::vec3 p_m{0.0f};
  glm::quat q{1.0f, 0.0f, 0.0f, 0.0f};  ///< camera to world or carrier; its length must be 1e-6 to 1e6
  /// Full angle of view. The tangents of half of it and of half the vertical one must be
  /// min_image_half_tangent to max_image_half_tangent.
  float horizontal_angle_rad = 1.0f;
  float near_m = 0.01f;  ///< surfaces at a smaller depth are not seen; min_image_near_m to max_image_near_m
  /// The begin of the exposure of row 0. Row r begins r * row_time later: a rolling shutter; 0: a global one.
  /// Colour is averaged over `exposure`; the other outputs, and depth, are those at the middle of the row's
  /// exposure, through the centre of each pixel. The whole image lasts at most max_query_window_ns.
  WorldTime t{};
  Nanoseconds row_time{0};
  Nanoseconds exposure{0};
  /// Exposure value at ISO 100, for Image::srgb alone: the luminance 1.2 * 2^exposure_value is white. Source:
  /// ISO 12232, saturation-based speed. Between -20 and 30; a sunny day is 15, a lit room 6.
  float exposure_value = 12.0f;
  std::uint32_t mask = mask_all;  ///< of the entities and lights that the image shows
  EntityId carrier{};             ///< default: none
  std::uint32_t seed = 0;         ///< of the random numbers of ImageMode::path_traced
};

/// Which outputs an image has. One that is not chosen costs nothing, and its span is empty.
struct ImageOutputs {
  bool color = false;     ///< Image::color
  bool srgb = true;       ///< Image::srgb
  bool depth = false;     ///< Image::depth_m
  bool identity = false;  ///< Image::entities, triangles and materials
  bool normal = false;    ///< Image::normals
  bool motion = false;    ///< Image::motion_px_s
};

enum class ImageMode : std::uint8_t {
  /// Unbiased light transport, with noise that falls with the root of samples_per_pixel: the reference.
  /// Source: Kajiya, "The Rendering Equation", 1986; Veach, "Robust Monte Carlo Methods", 1997.
  path_traced,
  /// Without noise. By surface:
  ///   each       gets the light of all lights, with sharp shadows; of an entity that emits light, from
  ///              emitter_points zones of its surface with a shadow each.
  ///   mirror, glass   If smooth, it shows what one ray meets: the reflection or the refraction, whichever is
  ///              brighter. The other one shows the sky.
  ///   first      With 2 bounces or more, lobe_rays rays in fixed directions search what its matt part gets
  ///              from other surfaces and from the skies, and as many what its rough mirror reflects. A
  ///              surface that such a ray meets counts as matt. The lights with shadow maps light it, and the
  ///              skies, as much of them as the rays of the matt part have found.
  ///   later      Nothing hides the skies from their matt and rough parts.
  real_time,
};

/// How the first hit of the ray through the middle of a pixel is found: for all outputs but colour, and in
/// real-time mode with one sample also for colour.
enum class FirstHits : std::uint8_t {
  traced,  ///< as by a ray query
  /// By the rasteriser of the device, in less time. The pixel's ray then meets the triangle that was drawn,
  /// by the test of ray queries, or is traced if it misses that triangle. So a hit differs from that of a
  /// ray query only beside a silhouette, and between surfaces that nearly coincide. A rolling shutter is
  /// refused, since every row has another instant. On a device that can not draw (DeviceInfo::draws) all
  /// are traced.
  rasterised,
};

/// How real-time mode finds what is in the shadow of a light. The shadow of an entity that emits light is
/// always traced.
enum class Shadows : std::uint8_t {
  traced,  ///< with a ray from each surface to each light, at the instant of its row and sample
  /// With maps of what each light sees in the middle of the exposure, which the rasteriser draws: faster
  /// where lights are many, and as exact as a texel of a map. Needs FirstHits::rasterised. On a device
  /// that can not draw all shadows are traced. A directional light has four maps, which cover what the
  /// camera sees; a spot one, if its outer angle is at most 120 degrees; another spot and a point six.
  /// Directional lights come first, then spots and points, each by entity index; as soon as shadow_maps is
  /// not enough for a light, its shadows and those of all later ones are traced. Beyond what the camera sees,
  /// in mirrors, a directional light has no shadows. Needs ImageMode::real_time.
  mapped,
};

/// Linear colour as four IEEE 754 binary16 numbers: red, green, blue, and 1. Values above 65504 are 65504.
using HalfColor = std::array<std::uint16_t, 4>;
/// Eight-bit sRGB (IEC 61966-2-1): red, green, blue, and 255.
using SrgbColor = std::array<std::uint8_t, 4>;

/// One image, row by row from the top left: each span has width * height elements or none.
struct Image {
  std::uint32_t width = 0, height = 0;
  std::span<const HalfColor> color{};
  std::span<const SrgbColor> srgb{};
  /// Depth along the view direction, not along the pixel's ray; infinite where nothing is seen.
  std::span<const float> depth_m{};
  std::span<const EntityId> entities{};        ///< invalid where nothing is seen
  std::span<const std::uint32_t> triangles{};  ///< index in the mesh of the entity's geometry
  std::span<const MaterialId> materials{};
  std::span<const glm::vec3> normals{};  ///< world frame, unit, of the triangle, toward the camera; or zero
  /// Pixels per second to the right and down at which the surface point moves in the image, the camera's own
  /// motion included; zero where nothing is seen.
  std::span<const glm::vec2> motion_px_s{};
  /// The tiles of image_tile_px * image_tile_px pixels that are missing, row by row: their pixels are black,
  /// and nothing is seen there. Only with LatePolicy::partial, under which pixels are made in groups of
  /// 4,096.
  std::span<const std::uint32_t> missing_tiles{};
  /// Pixels for which a ray search reached the device's limits: they lack light or show nothing.
  std::uint32_t incomplete_pixels = 0;
  /// Lights are missing. Fixed lights come first, then the lights and emitting entities of the lowest
  /// indices, max_lights_per_image in all; an emitting entity whose triangles do not fit into the 65,536 of
  /// all such meshes is left out.
  bool lights_overflow = false;
};

/// A light of a query's images that is no entity: at rest, and in every mask.
struct FixedLight {
  Light light{};                              ///< directional or a sky
  glm::quat q_world{1.0f, 0.0f, 0.0f, 0.0f};  ///< light to world; its length must be 1e-6 to 1e6
};

struct ImageQueryOptions {
  using Prepared = ImageQuery;
  std::string name{};                   ///< for reports and error texts
  std::uint32_t capacity = 1;           ///< images in a batch: 1 to max_images_per_query
  std::uint32_t width = 0, height = 0;  ///< 1 to max_image_side each
  ImageMode mode = ImageMode::path_traced;
  ImageOutputs outputs{};
  FirstHits first_hits = FirstHits::traced;
  /// Samples of colour, 1 to max_image_samples. In real-time mode one is through the middle of pixel and
  /// exposure; more smooth edges and average over the exposure.
  std::uint32_t samples_per_pixel = 16;
  /// Reflections and refractions before light reaches the camera: 0 to max_image_bounces. Light that needs
  /// more is missing. It matters most in closed bodies that are clear in part, where light is reflected until
  /// it meets the clear part at a steep angle. White spheres in the path tracer lose, with 16 and with 64
  /// bounces, up to 6 % and 1.5 % (refractive index up to 1.5), 14 % and 4 % (2.5), 35 % and 9 % (4).
  std::uint32_t bounces = 4;
  Shadows shadows = Shadows::traced;     ///< of real-time mode
  std::uint32_t shadow_map_side = 1024;  ///< texels, min_shadow_map_side to max_shadow_map_side
  std::uint32_t shadow_maps = 8;         ///< of an image, at most: 1 to max_shadow_maps
  /// Real-time mode: zones of each entity that emits light, 1 to max_emitter_points, with a shadow ray each.
  /// If the surface has at most as many flat sides, each side has zones of its own; otherwise sides that are
  /// turned and placed alike share zones. Triangles and their order do not matter. Where nothing hides
  /// spheres, boxes and cylinders up to ten times as long as wide, their illuminance is within 10 % from two
  /// diameters of the middle on with 16, from 1.2 diameters with 64. (The diameter is the largest distance of
  /// two points. If the plane of the lit surface cuts the body: within 10 % of what a surface that faces the
  /// body gets.) Fewer have no such bound: with one, a long body that is seen from its end is several times
  /// too bright, and a body may hide all of its own light. A zone is hidden or seen as a whole.
  std::uint32_t emitter_points = 16;
  std::uint32_t lobe_rays = 16;  ///< real-time mode: into each lobe, 1 to max_lobe_rays
  /// Beside the lights of the world; at most max_fixed_lights.
  std::vector<FixedLight> fixed_lights{};
  LatePolicy late = LatePolicy::discard;
};

/// Images of cameras. `cameras` has `capacity` elements; `images` has one for each camera of the last
/// transaction. A camera is an element (BadInput::element), which is answered by tiles: AnswerInfo counts
/// tiles, and Image::missing_tiles stands for the marks of LatePolicy::partial.
/// Answers: the same from run to run, and whatever the chunks, on one device.
/// Memory: about 30 MB on the device for an image of 256 * 256 pixels or more; for the rasteriser 8 bytes for
/// each pixel of all images and 88 for each entity that the database can hold; for shadow maps four bytes for
/// each texel; in real-time mode 0.23 MB for each of emitter_points, and 10 MB in host memory; the outputs in
/// host memory.
/// Errors of prepare: capacity for a count or a size outside its range, and for more than 2^32 stages of the
/// device's work; bad_input for no output, for an enumerator that does not exist, for shadow maps without
/// real-time mode or the rasteriser, and for a fixed light that is no light, or of another kind.
class ImageQuery : public Query {
 public:
  virtual std::span<Camera> cameras() noexcept = 0;
  virtual std::span<const Image> images() const noexcept = 0;
};

/// The ray through the middle of a pixel at the middle of its row's exposure, in the camera's frame or its
/// carrier's; lambda is the depth. Misuse: a pixel outside the image.
Ray pixel_ray(const Camera& camera, std::uint32_t width, std::uint32_t height, std::uint32_t column,
              std::uint32_t row) noexcept;

/// The luminance of white at an exposure value (Camera::exposure_value).
inline double white_cdpm2(double exposure_value) noexcept {
  return 1.2 * std::exp2(exposure_value);
}

const char* to_string(ImageMode mode) noexcept;
const char* to_string(FirstHits first_hits) noexcept;
const char* to_string(Shadows shadows) noexcept;

}  // namespace rtstdb
