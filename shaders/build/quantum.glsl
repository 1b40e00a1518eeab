// Quantizes boxes relative to their node; see shared/node.h.
#ifndef RTSTDB_BUILD_QUANTUM_GLSL
#define RTSTDB_BUILD_QUANTUM_GLSL
#include "common/bounds.glsl"

struct Quanta {
  vec3 origin;
  vec3 per_quantum;
  vec3 margin;
  uint exponents;  // biased exponents: x | y << 8 | z << 16
};

// The quantum of one axis as an exponent: the smallest power of two of which 254 cover the extent.
uint quantum_exponent(float extent) {
  const float needed = max(extent, 1e-30) / 254.0;
  const uint bits = floatBitsToUint(needed);
  return clamp((bits >> 23) + ((bits & 0x7FFFFFu) != 0u ? 1u : 0u), 1u, 254u);
}

Quanta quanta_of(Box all) {
  // An absolute margin for the rounding of coordinates in the traversal; the traversal adds the relative part
  // itself.
  const vec3 rounding = max(abs(all.lo), abs(all.hi)) * 2.5e-7;
  const vec3 extent = all.hi - all.lo + 2.0 * rounding;
  const uvec3 exponent =
      uvec3(quantum_exponent(extent.x), quantum_exponent(extent.y), quantum_exponent(extent.z));
  const vec3 quantum = uintBitsToFloat(exponent << 23);
  Quanta quanta;
  quanta.per_quantum = 1.0 / quantum;
  // Half a quantum of margin below, so that the margin of the lowest child fits into its byte.
  quanta.origin = all.lo - rounding - 0.5 * quantum;
  quanta.margin = 2e-3 + rounding * quanta.per_quantum;
  quanta.exponents = exponent.x | exponent.y << 8 | exponent.z << 16;
  return quanta;
}

uvec3 low_edge(vec3 lo, Quanta quanta) {
  return uvec3(clamp(floor((lo - quanta.origin) * quanta.per_quantum - quanta.margin), 0.0, 255.0));
}

uvec3 high_edge(vec3 hi, Quanta quanta) {
  return uvec3(clamp(ceil((hi - quanta.origin) * quanta.per_quantum + quanta.margin), 0.0, 255.0));
}

#endif
