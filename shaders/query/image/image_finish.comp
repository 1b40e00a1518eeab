#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Ends a sample of each pixel: adds its light to the sum, and writes the colour after the last sample.
#include "query/image/hit_input.glsl"
#include "query/image/image.glsl"
#include "query/image/path_input.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer shadow_hits;
layout(set = 0, binding = 5) uniform samplerBuffer states;

layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer Words { uint words[]; };
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer WordPairs { uvec2 pairs[]; };

// IEC 61966-2-1, in steps of 1/255; NaN gives 0.
uvec3 srgb_of(vec3 linear) {
  const vec3 c = clamp(linear, 0.0, 1.0);
  const vec3 encoded =
      mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
  return uvec3(255.0 * encoded + 0.5);
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  PathRecord path = path_from(states, args.read_from + place);
  const bool is_lit = fetch_status(shadow_hits, place) == status_miss;
  const vec3 radiance = path.radiance_cdpm2 + (is_lit ? path.shadowed_cdpm2 : vec3(0.0));
  path.sum_cdpm2 += radiance;
  paths[args.write_from + place] = path;
  const Pixel pixel = pixel_of(place);
  if (!pixel.is_inside || args.sample_index + 1u < args.samples) return;
  const CameraRecord camera = cameras[pixel.image];
  const vec3 mean = path.sum_cdpm2 / float(args.samples);
  if ((camera.color.x | camera.color.y) != 0u) {
    const vec3 storable = min(mean, vec3(65504.0));
    WordPairs(camera.color).pairs[pixel.index] =
        uvec2(packHalf2x16(storable.xy), packHalf2x16(vec2(storable.z, 1.0)));
  }
  if ((camera.srgb.x | camera.srgb.y) != 0u) {
    const uvec3 bytes = srgb_of(mean / camera.white_cdpm2);
    Words(camera.srgb).words[pixel.index] = bytes.x | bytes.y << 8u | bytes.z << 16u | 0xFF000000u;
  }
}
