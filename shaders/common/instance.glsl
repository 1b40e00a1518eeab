// Computes instances and their conservative bounds over a window, and reads instances from texels.
#ifndef RTSTDB_COMMON_INSTANCE_GLSL
#define RTSTDB_COMMON_INSTANCE_GLSL
#include "common/bounds.glsl"
#include "common/extents.glsl"
#include "common/motion.glsl"
#include "shared/entity.h"

// The box of a geometry in the world: its centre, and the axes of the entity's frame, scaled to the half
// extents.
struct Placed {
  vec3 center;
  mat3 axes;
};

// `center` is already scaled.
Placed placed(vec3 p, vec4 q, vec3 center, vec3 scale) {
  return Placed(p + rotate(q, center),
                mat3(scale.x * rotate(q, vec3(1.0, 0.0, 0.0)), scale.y * rotate(q, vec3(0.0, 1.0, 0.0)),
                     scale.z * rotate(q, vec3(0.0, 0.0, 1.0))));
}

Box box_of_oriented(Placed at, vec3 faces) {
  const vec3 e = abs(at.axes[0]) * faces.x + abs(at.axes[1]) * faces.y + abs(at.axes[2]) * faces.z;
  return Box(at.center - e, at.center + e);
}

// The extent of the geometry itself, at most that of `oriented`, the box around its rotated box.
Box box_of_turned(Placed at, Extents extents, Box oriented) {
  vec3 above;
  vec3 below;
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    const vec2 extent = extent_along(vec3(at.axes[0][axis], at.axes[1][axis], at.axes[2][axis]), extents);
    above[axis] = extent.x;
    below[axis] = extent.y;
  }
  return Box(max(at.center - below, oriented.lo), min(at.center + above, oriented.hi));
}

// Bounds on the motion of an entity's points during the window.
struct Turning {
  float rho;    // the points stay within a ball of this radius around the origin,
  float bulge;  // deviate from the chords between their end positions by at most this,
  float slop;   // and are computed with this error
};

// The boxes at both ends, enlarged so that their linear mix contains all positions in between. Points deviate
// from the chords between their end positions by at most rho phi^2 / 8 (a term that the paper's Eq. 1 omits),
// and stay within the ball of radius rho around the origin, which moves on a line. For each side the tighter
// of the two bounds is taken, the same one at both ends. Proof and reference:
// rtstdb/geometry/motion_bounds.hpp.
MotionBox grown(Box begin, Box end, vec3 p, vec3 p_end, Turning turning) {
  const float rho = turning.rho;
  const bvec3 ball_above = greaterThan(p + p_end - 2.0 * rho, begin.lo + end.lo - 2.0 * turning.bulge);
  const bvec3 ball_below = lessThan(p + p_end + 2.0 * rho, begin.hi + end.hi + 2.0 * turning.bulge);
  MotionBox result;
  result.begin.lo = mix(begin.lo - turning.bulge, p - rho, ball_above) - turning.slop;
  result.end.lo = mix(end.lo - turning.bulge, p_end - rho, ball_above) - turning.slop;
  result.begin.hi = mix(begin.hi + turning.bulge, p + rho, ball_below) + turning.slop;
  result.end.hi = mix(end.hi + turning.bulge, p_end + rho, ball_below) + turning.slop;
  result.overhang = vec3(0.0);
  result.unused = 0.0;
  return result;
}

// The boxes over [0, window_s] of an instance given at the begin of the window, with the overhang of its
// oriented bounds.
MotionBox motion_bounds(vec3 p, vec4 q, vec3 v, vec3 w, vec3 center, vec3 scale, Extents extents,
                        float window_s) {
  const vec3 p_end = p + v * window_s;
  const Placed at_begin = placed(p, q, center, scale);
  const Placed at_end = placed(p_end, orientation_at(q, w, window_s), center, scale);
  const Box begin = box_of_oriented(at_begin, extents.faces);
  const Box end = box_of_oriented(at_end, extents.faces);
  Turning turning;
  turning.rho = length(abs(center) + extents.faces * scale);
  const float phi = length(w) * window_s;
  turning.bulge = turning.rho * phi * phi * 0.125;
  // The rounding error of this computation and of the pose at query time, which is derived from an epoch up
  // to a second earlier.
  const float rounded_s = window_s + 1.0;
  const float reach = max(max(abs(p.x), abs(p.y)), abs(p.z)) + length(v) * rounded_s + turning.rho;
  turning.slop = 2e-6 * (reach + turning.rho * length(w) * rounded_s);
  const MotionBox around = grown(begin, end, p, p_end, turning);
  MotionBox result =
      grown(box_of_turned(at_begin, extents, begin), box_of_turned(at_end, extents, end), p, p_end, turning);
  result.overhang = max(max(result.begin.lo - around.begin.lo, result.end.lo - around.end.lo),
                        max(around.begin.hi - result.begin.hi, around.end.hi - result.end.hi));
  return result;
}

struct Instance {
  vec3 p;
  uint mask;
  vec4 q;
  vec3 v;
  uint blas_root;
  vec3 w;
  uint entity;
  vec3 scale;
  bool closed;  // its geometry bounds a body
  int from_ns;  // time of the stored state, since its epoch
  vec3 box_center;
  vec3 box_half;
};

// The time for which a row's state is stored for the stretch that begins at `epoch`: the begin of the motion
// if that lies in the stretch, since the row is most precise there; otherwise the epoch.
int from_ns_of(uvec2 valid_from, uvec2 epoch) {
  const int64_t after_ns = int64_t(packUint2x32(valid_from)) - int64_t(packUint2x32(epoch));
  return after_ns > 0 && after_ns < int64_t(epoch_length_ns) ? int(after_ns) : 0;
}

Instance instance_of(EntityRecord row, GeometryRecord geometry, uvec2 instant) {
  const double age_s = seconds_between(row.valid_from, instant);
  const dvec3 p = dvec3(row.p_world_m) + dvec3(row.p_low_m);
  const dvec3 v = dvec3(row.v_world_mps) + dvec3(row.v_low_mps);
  const dvec3 w = dvec3(row.w_world_radps) + dvec3(row.w_low_radps);
  Instance instance;
  instance.p = vec3(p + v * age_s);
  instance.q = normalize(quat_product(rotation_after_long(w, age_s), row.q_world));
  instance.v = row.v_world_mps;
  instance.w = row.w_world_radps;
  instance.mask = row.mask;
  instance.blas_root = geometry.root;
  instance.entity = row.index;
  instance.scale = row.scale;
  instance.closed = geometry.closed != 0u;
  instance.from_ns = 0;
  instance.box_center = geometry.box_center_m;
  instance.box_half = geometry.box_half_m;
  return instance;
}

MotionBox bounds_of(Instance i, Extents extents, float window_s) {
  return motion_bounds(i.p, i.q, i.v, i.w, i.box_center * i.scale, i.scale, extents, window_s);
}

// An instance at an instant, with both times counted from its epoch. The subtraction is exact, since it is
// one of integers.
float since(Instance i, int t_ns) { return float(t_ns - i.from_ns) * 1e-9; }

// All kernels compute the same bits: `precise` keeps multiplication and addition apart.
vec3 position_of(Instance i, int t_ns) {
  precise vec3 p = i.p + i.v * since(i, t_ns);
  return p;
}

vec4 orientation_of(Instance i, int t_ns) { return orientation_at(i.q, i.w, since(i, t_ns)); }

struct OrientedBox {
  vec3 center;
  vec4 q;
  vec3 half_extent;
};

// The instance's bounds at an instant.
OrientedBox bounds_at(Instance i, int t_ns) {
  const vec4 q = orientation_of(i, t_ns);
  return OrientedBox(position_of(i, t_ns) + rotate(q, i.box_center * i.scale), q, i.box_half * i.scale);
}

// The centre of the instance's bounds at an instant.
vec3 center_velocity_at(Instance i, int t_ns) {
  precise vec3 velocity = i.v + cross(i.w, rotate(orientation_of(i, t_ns), i.box_center * i.scale));
  return velocity;
}

// The first five texels of an instance, which every query needs; the box is read only where it is used.
Instance instance_from(vec4 t0, vec4 t1, vec4 t2, vec4 t3, vec4 t4) {
  Instance instance;
  instance.p = t0.xyz;
  instance.mask = floatBitsToUint(t0.w);
  instance.q = t1;
  instance.v = t2.xyz;
  instance.blas_root = floatBitsToUint(t2.w);
  instance.w = t3.xyz;
  instance.entity = floatBitsToUint(t3.w);
  instance.scale = t4.xyz;
  const uint from_and_closed = floatBitsToUint(t4.w);
  instance.closed = (from_and_closed & instance_closed_bit) != 0u;
  instance.from_ns = int(from_and_closed & ~instance_closed_bit);
  return instance;
}

Instance fetch_instance(samplerBuffer instances, uint index) {
  const int base = int(index * instance_texels);
  return instance_from(texelFetch(instances, base), texelFetch(instances, base + 1),
                       texelFetch(instances, base + 2), texelFetch(instances, base + 3),
                       texelFetch(instances, base + 4));
}

// First texel of the distance field of the instance's geometry, or field_none.
uint field_of_instance(samplerBuffer instances, uint index) {
  return floatBitsToUint(texelFetch(instances, int(index * instance_texels) + 5).w);
}

// The number of the instance's geometry, or no_entity.
uint geometry_of_instance(samplerBuffer instances, uint index) {
  return floatBitsToUint(texelFetch(instances, int(index * instance_texels) + 6).w);
}

void fetch_instance_box(samplerBuffer instances, uint index, inout Instance instance) {
  const int base = int(index * instance_texels);
  instance.box_center = texelFetch(instances, base + 5).xyz;
  instance.box_half = texelFetch(instances, base + 6).xyz;
}

#endif
