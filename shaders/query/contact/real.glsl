// The precision of a kernel of pairs of convex bodies: single, or with CONTACT_DOUBLE double. The same text
// is compiled for both.
#ifndef RTSTDB_QUERY_CONTACT_REAL_GLSL
#define RTSTDB_QUERY_CONTACT_REAL_GLSL
#ifdef CONTACT_DOUBLE
#define real double
#define real3 dvec3
#define real4 dvec4
#define real3x3 dmat3
const real real_epsilon = 2.3e-16LF;
const real real_tiny = 1e-200LF;  // a divisor in place of zero
const real real_max = 1e300LF;
#else
#define real float
#define real3 vec3
#define real4 vec4
#define real3x3 mat3
const real real_epsilon = 1.2e-7;
const real real_tiny = 1e-37;
const real real_max = 3.4e38;
#endif
#endif
