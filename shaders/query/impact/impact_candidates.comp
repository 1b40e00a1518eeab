#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The entities whose bounding spheres come near that of a body within a window. The spheres are around the
// entities' origins, which move on lines, so their least distance has a closed form. A workgroup for each
// search: each invocation tests a range of the instances, counts first and then lists at its place, so that
// the list is in the order of the instances.
#include "common/halt.glsl"
#include "common/instance.glsl"
#include "common/loops.glsl"
#include "shared/impact.h"
#include "shared/query.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SweepArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer instances;
layout(set = 0, binding = 1, scalar) readonly buffer SweepsBuffer { SweepRecord sweeps[]; };
layout(set = 0, binding = 2, scalar) buffer CountsBuffer { RegionCount counts[]; };
layout(set = 0, binding = 3, scalar) buffer IdsBuffer { uint ids[]; };

shared uint found_by[64];
shared bool halted;

bool comes_near(SweepRecord sweep, Instance i) {
  const vec3 p = position_of(i, sweep.t_ns) - sweep.p_m;
  const vec3 v = i.v - sweep.v_mps;
  const float reach = sweep.reach_m + length((abs(i.box_center) + i.box_half) * i.scale);
  const float closest_s = clamp(-dot(p, v) / max(dot(v, v), 1e-30), 0.0, sweep.window_s);
  // Rounding of positions, which are in the world, and of the path in the window.
  const float rounding =
      4e-6 * (length(sweep.p_m) + length(p) + (length(v) + length(i.v)) * (sweep.window_s + 1.0) + reach);
  return length(p + closest_s * v) <= reach + rounding;
}

void main() {
  const uint index = args.first + gl_WorkGroupID.x;
  if (index >= args.end) return;
  const uint lane = gl_LocalInvocationID.x;
  if (lane == 0u) halted = skips_when_halted(args.halt, index + args.halt_from);
  barrier();
  if (halted) return;
  const SweepRecord sweep = sweeps[index];
  const uint each = (args.instances + 63u) / 64u;
  const uint begin = min(lane * each, args.instances);
  const uint end = min(begin + each, args.instances);
  uint found = 0u;
  for (uint place = begin; place < end; ++place) {
    Instance i = fetch_instance(instances, place + sweep.instance_base);
    fetch_instance_box(instances, place + sweep.instance_base, i);
    const bool wanted = (i.mask & sweep.mask) != 0u && i.entity != sweep.excluded;
    found += wanted && comes_near(sweep, i) ? 1u : 0u;
  }
  found_by[lane] = found;
  barrier();
  uint before = 0u;
  uint all = 0u;
  for (uint k = 0u; k < 64u; ++k) {
    before += k < lane ? found_by[k] : 0u;
    all += found_by[k];
  }
  for (uint place = begin; place < end && found > 0u; ++place) {
    Instance i = fetch_instance(instances, place + sweep.instance_base);
    fetch_instance_box(instances, place + sweep.instance_base, i);
    const bool wanted = (i.mask & sweep.mask) != 0u && i.entity != sweep.excluded;
    if (wanted && comes_near(sweep, i)) {
      if (before < args.capacity) ids[index * args.capacity + before] = i.entity;
      ++before;
    }
  }
  const bool cut_short = !loops_still_turn(args.loop_probe);
  if (lane == 0u) counts[index] = RegionCount(all, cut_short ? 1u : 0u);
}
