// 63-bit Morton codes, 21 bits per axis (paper, Section 5; Karras 2012).
#ifndef RTSTDB_COMMON_MORTON_GLSL
#define RTSTDB_COMMON_MORTON_GLSL

uint64_t spread_by_three(uint x) {
  uint64_t v = uint64_t(x & 0x1FFFFFu);
  v = (v | (v << 32)) & 0x001F00000000FFFFul;
  v = (v | (v << 16)) & 0x001F0000FF0000FFul;
  v = (v | (v << 8)) & 0x100F00F00F00F00Ful;
  v = (v | (v << 4)) & 0x10C30C30C30C30C3ul;
  v = (v | (v << 2)) & 0x1249249249249249ul;
  return v;
}

uvec2 morton_code(vec3 center, vec3 lo, vec3 hi) {
  // One scale for all axes keeps cells cubic, so that flat scenes are not split along their thin side first.
  const vec3 extent = hi - lo;
  const float largest = max(max(extent.x, extent.y), max(extent.z, 1e-30));
  const uvec3 cell = uvec3(clamp((center - lo) * (2097151.0 / largest), vec3(0.0), vec3(2097151.0)));
  return unpackUint2x32(spread_by_three(cell.x) << 2 | spread_by_three(cell.y) << 1 |
                        spread_by_three(cell.z));
}

#endif
