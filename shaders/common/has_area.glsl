// Whether a triangle has an area in double precision. Gives the same result as rtstdb/geometry/has_area.hpp,
// bit for bit: the same operations, none of them fused. Rays do not hit triangles without area.
#ifndef RTSTDB_COMMON_HAS_AREA_GLSL
#define RTSTDB_COMMON_HAS_AREA_GLSL

bool has_area(vec3 a, vec3 b, vec3 c) {
  precise dvec3 ab = dvec3(b) - dvec3(a);
  precise dvec3 ac = dvec3(c) - dvec3(a);
  precise dvec3 across = ab.yzx * ac.zxy - ac.yzx * ab.zxy;
  return across != dvec3(0.0);
}

#endif
