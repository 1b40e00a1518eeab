// What all kernels of images share: their arguments, cameras, the states of paths, and which pixel a place
// is.
#ifndef RTSTDB_QUERY_IMAGE_IMAGE_GLSL
#define RTSTDB_QUERY_IMAGE_IMAGE_GLSL
#include "common/halt.glsl"
#include "common/instance.glsl"
#include "common/places.glsl"
#include "shared/image.h"
#include "shared/query.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ImageArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer CamerasBuffer { CameraRecord cameras[]; };
layout(set = 0, binding = 1, scalar) buffer PathsBuffer { PathRecord paths[]; };
layout(set = 0, binding = 2) uniform samplerBuffer instances;
layout(set = 0, binding = 3, scalar) readonly buffer PlacesBuffer { uint places[]; };

struct Pixel {
  uint image;
  uint column;
  uint row;
  uint index;      // in the image
  bool is_inside;  // a tile at the right or lower border may reach beyond the image
};

Pixel pixel_of(uint place) {
  const uvec2 size = min(uvec2(args.width, args.height), uvec2(image_tile_side));
  const uint pixels = size.x * size.y;
  const uint across = (args.width + size.x - 1u) / size.x;
  const uint down = (args.height + size.y - 1u) / size.y;
  const uint tile = args.first_tile + place / pixels;
  const uint of_image = tile % (across * down);
  const uint in_tile = place % pixels;
  Pixel pixel;
  pixel.image = tile / (across * down);
  pixel.column = of_image % across * size.x + in_tile % size.x;
  pixel.row = of_image / across * size.y + in_tile / size.x;
  pixel.index = pixel.row * args.width + pixel.column;
  pixel.is_inside = pixel.column < args.width && pixel.row < args.height;
  return pixel;
}

// An instant as instances count it.
struct Instant {
  int t_ns;  // since the epoch
  uint instance_base;
};

Instant instant_of(uint low_word_ns) {
  const uint since_epoch_ns = low_word_ns - args.epoch_ns;
  const bool late = since_epoch_ns >= epoch_length_ns;
  return Instant(int(late ? since_epoch_ns - epoch_length_ns : since_epoch_ns), late ? args.late_base : 0u);
}

Instance instance_of_entity(uint entity, Instant at) {
  return fetch_instance(instances, places[entity] + at.instance_base);
}

// The state and the axes of a camera at an instant.
struct CameraPose {
  vec3 p;
  vec4 q;
  vec3 v;
  vec3 w;
};

CameraPose pose_of(CameraRecord camera, Instant at) {
  CameraPose pose = CameraPose(camera.p_m, camera.q, vec3(0.0), vec3(0.0));
  if (camera.carrier == no_entity) return pose;
  const Instance carrier = instance_of_entity(camera.carrier, at);
  const vec4 q = orientation_of(carrier, at.t_ns);
  pose.p = position_of(carrier, at.t_ns) + rotate(q, camera.p_m);
  pose.q = quat_product(q, camera.q);
  pose.v = carrier.v + cross(carrier.w, pose.p - position_of(carrier, at.t_ns));
  pose.w = carrier.w;
  return pose;
}

// The place of this invocation, or one at or beyond args.end.
uint started_place() {
  const uint place = place_of_invocation(args.first, args.per_group);
  return place < args.end && skips_when_halted(args.halt, place + args.halt_from) ? 0xFFFFFFFFu : place;
}

#endif
