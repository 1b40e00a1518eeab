// Motion of an entity as a function of time. Mirrors rtstdb/geometry/entity.cpp.
#ifndef RTSTDB_COMMON_MOTION_GLSL
#define RTSTDB_COMMON_MOTION_GLSL

vec3 rotate(vec4 q, vec3 p) {
  precise vec3 t = 2.0 * cross(q.xyz, p);
  precise vec3 turned = p + q.w * t + cross(q.xyz, t);
  return turned;
}

// The rotated axes, by column.
mat3 axes_of(vec4 q) {
  return mat3(rotate(q, vec3(1.0, 0.0, 0.0)), rotate(q, vec3(0.0, 1.0, 0.0)), rotate(q, vec3(0.0, 0.0, 1.0)));
}

vec4 conjugate(vec4 q) { return vec4(-q.xyz, q.w); }

vec4 quat_product(vec4 a, vec4 b) {
  return vec4(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

// Exponential map: the rotation by |w| t about w. Branch-free; the series replaces the quotient where that
// loses precision.
vec4 rotation_after(vec3 w, float t) {
  const float rate = length(w);
  const float half_angle = 0.5 * rate * t;
  const float quotient = half_angle * half_angle < 1e-6 ? 0.5 * t * (1.0 - half_angle * half_angle / 6.0)
                                                        : sin(half_angle) / max(rate, 1e-30);
  return vec4(w * quotient, cos(half_angle));
}

vec4 orientation_at(vec4 q, vec3 w, float t) { return normalize(quat_product(rotation_after(w, t), q)); }

// The same for long times: whole turns are removed in double precision.
vec4 rotation_after_long(dvec3 w, double t) {
  const double rate = sqrt(dot(w, w));
  const double turn = 6.283185307179586476925LF;
  const double turns = rate * t / turn;
  const float half_angle = float(0.5LF * turn * (turns - floor(turns + 0.5LF)));
  return vec4(vec3(w) * (sin(half_angle) / max(float(rate), 1e-30)), cos(half_angle));
}

// The difference of two int64 nanosecond instants in seconds.
double seconds_between(uvec2 from, uvec2 to) {
  return double(int64_t(packUint2x32(to)) - int64_t(packUint2x32(from))) * 1e-9LF;
}

#endif
