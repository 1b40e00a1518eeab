// Axis-aligned boxes.
#ifndef RTSTDB_COMMON_BOUNDS_GLSL
#define RTSTDB_COMMON_BOUNDS_GLSL

struct Box {
  vec3 lo;
  vec3 hi;
};

// The boxes of a moving object at the begin and at the end of a window. At any instant in between, its
// triangles lie inside the linear mix of both. For a window of one instant, `end` instead encloses the
// centres of the entities' oriented bounds. Oriented bounds may exceed these boxes along each axis by at most
// `overhang`, at any instant of the window. 4 texels of vec4.
struct MotionBox {
  Box begin;
  Box end;
  vec3 overhang;
  float unused;
};

Box box_union(Box a, Box b) { return Box(min(a.lo, b.lo), max(a.hi, b.hi)); }

float box_half_area(Box b) {
  const vec3 e = max(b.hi - b.lo, vec3(0.0));
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

// Maps floats to unsigned integers in the same order, for atomic minimum and maximum.
uint ordered(float x) {
  const uint bits = floatBitsToUint(x);
  return bits ^ ((bits >> 31) != 0u ? 0xFFFFFFFFu : 0x80000000u);
}

float unordered(uint bits) {
  return uintBitsToFloat(bits ^ ((bits >> 31) != 0u ? 0x80000000u : 0xFFFFFFFFu));
}

MotionBox motion_union(MotionBox a, MotionBox b) {
  return MotionBox(box_union(a.begin, b.begin), box_union(a.end, b.end), max(a.overhang, b.overhang), 0.0);
}

Box swept(MotionBox b) { return box_union(b.begin, b.end); }

vec3 center_of(Box b) { return 0.5 * (b.lo + b.hi); }

#endif
