// Rays by a lane each, whose lanes work for one another. A ray alone waits most of the time: some have met four instances when others
// have met none, and of those that are below an instance few are in its tree as long as the last one is. So a lane goes down the
// entities' tree for its own ray, and what the ray meets is entered by any lane that has nothing to do, as an errand. What that finds
// goes back to the ray's own lane. (Work that lanes take from one another: Garanzha and Loop 2010, whose rays wait in queues.)
//
// What a ray finds does not depend on who runs its errands: its hits are compared as traverse.glsl compares them, and made by
// the same lines.
//
// For subgroups of eight lanes, all of them in use: they go through all loops together.
//
// Include with RAY_ANY or RAY_MOVING defined as for ray_steps.glsl.
#ifndef RTSTDB_QUERY_CREW_GLSL
#define RTSTDB_QUERY_CREW_GLSL
#define RAY_CREW
#include "query/ray_steps.glsl"
// Behind it, for what it reads of instances and triangles.
#include "query/ray.glsl"

// When lanes turn to something else; found by trying (docs/decisions/0015). Down the entities' tree they go while so many have a way
// there,
const uint enough_going = 6u;
// or while there are fewer errands than lanes.
const uint enough_errands = 8u;
// Below they stay while so many have an errand, and take next rays when so many have none.
const uint enough_at_work = 4u;
const uint enough_free = 4u;

// A lane's own ray.
struct Own {
  bool asks;
  uint index;
  Asked ray;
  Segment world;
  Search search;  // of the entities' tree
  uint current;   // there
  Met met;
  Found best;
  bool waits;  // for an errand that is under way
};

// Into an instance, for the ray of the lane `owner`; none has it when there is nothing to do.
struct Errand {
  uint owner;
  uint below;
  Search search;  // of the geometry's tree
  uint instance;
  uint entity;
  float lambda_min;
  Segment ray;
  Found best;
};

const uint nobody = 8u;

bool is_under_way(Errand errand) { return errand.below != ref_none; }

Own no_ray(Asked any_ray) {
  return Own(false, 0u, any_ray, make_segment(-any_ray.origin, any_ray.direction), nothing_begun(), ref_none,
             none_met(), nothing_within(0.0), false);
}

Errand no_errand(Segment any_ray) {
  return Errand(nobody, ref_none, nothing_begun(), 0u, 0u, 0.0, any_ray, nothing_within(0.0));
}

Own begin_ray(uint index, Asked ray, uint root) {
  Own own = no_ray(ray);
  own.asks = true;
  own.index = index;
  own.current = root;
  own.best = nothing_within(ray.lambda_max);
  return own;
}

// To instances that have not been entered.
bool has_way_left(Own own) { return own.current != ref_none || own.met.leaf[0] != ref_none; }

bool is_done(Own own) { return !has_way_left(own) && !own.waits; }

// Down the entities' tree.
void meet_instances(inout Own own, Errand errand) {
  const float limit = reach_of(own.best);
  uint going;
  uint errands;
  do {
    ++own.search.rounds;
    meet_next(own.current, own.met, own.search, own.ray.share, own.world, own.ray.lambda_min, limit);
    const uint both = sum_of_lanes((goes_on(own.current, own.met) ? 1u : 0u) +
                                   (count_of(own.met) + (is_under_way(errand) ? 1u : 0u) << 8));
    going = both & 0xFFu;
    errands = both >> 8;
  } while (going >= enough_going || (going != 0u && errands < enough_errands));
}

// For lanes that have none, the first errand of rays that have one, in the order of lanes.
void take_errands(inout Own own, inout uint owner, inout uint leaf) {
  const bool idle = owner == nobody;
  const bool has_one = own.met.leaf[0] != ref_none;
  const uint idle_before = lanes_before(idle);
  const uint given_before = lanes_before(has_one);
  const bool gives = has_one && given_before < count_of_lanes(idle);
  uint from = nobody;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    from = of_lane(gives ? given_before : nobody, lane) == idle_before ? lane : from;
  }
  const uint given = of_lane(own.met.leaf[0], from & 7u);
  const bool takes = idle && from != nobody;
  owner = takes ? from : owner;
  leaf = takes ? given : leaf;
  const Met rest = rest_of(own.met, own.best);
  if (gives) own.met = rest;
}

void begin_errands(inout Own own, inout Errand errand) {
  uint owner = errand.owner;
  uint leaf = ref_none;
  take_errands(own, owner, leaf);
  take_errands(own, owner, leaf);
  const bool begins = leaf != ref_none;
  const uint of = owner & 7u;
  Segment world;
  world.minus_o = of_lane(own.world.minus_o, of);
  world.d = of_lane(own.world.d, of);
  const int t_ns = of_lane(own.ray.t_ns, of);
  const uint mask = of_lane(own.ray.mask, of);
  const float lambda_min = of_lane(own.ray.lambda_min, of);
  const float lambda_max = of_lane(own.best.lambda, of);
  const uint instance_base = of_lane(own.ray.instance_base, of);
  const uint instance = begins ? (leaf & ref_instance_mask) + instance_base : 0u;
  const Instance candidate = instance_at(instance);
  const Segment ray = enter_instance(world, candidate, t_ns, head_of(begins ? candidate.blas_root : 0u));
  if (begins) {
    errand.owner = owner;
    errand.below = (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
    errand.search.depth = 0u;
    errand.instance = instance;
    errand.entity = candidate.entity;
    errand.lambda_min = lambda_min;
    errand.ray = ray;
    errand.best = nothing_within(lambda_max);
  }
}

// What one errand has found bounds all that are run for the same ray: what lies behind it need not be looked for any more.
void tell_one_another(inout Errand errand) {
  float nearest = errand.best.lambda;
  bool found = false;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    const bool same = of_lane(errand.owner, lane) == errand.owner;
    const float lambda = of_lane(errand.best.lambda, lane);
    nearest = same ? lesser_of(nearest, lambda) : nearest;
    found = found || (same && of_lane(errand.best.status, lane) == status_hit);
  }
  // A hit behind it is none that the ray would be told of.
  if (nearest < errand.best.lambda) errand.best = nothing_within(nearest);
#ifdef RAY_ANY
  errand.below = found ? ref_none : errand.below;
#endif
}

// Down the geometries' trees. `more_waits`: there is something else to do.
void run_errands(inout Errand errand, bool more_waits, float faces) {
  uint at_work;
  do {
    ++errand.search.rounds;
    errand.below = go_through_leaves(errand.below, errand.search, errand.ray, errand.lambda_min, faces, 0u,
                                     errand.instance, errand.entity, errand.best);
    tell_one_another(errand);
    at_work = count_of_lanes(is_under_way(errand));
  } while (at_work >= enough_at_work || (at_work != 0u && !more_waits));
}

// What errands have found so far goes to the rays that they are run for.
void hand_in(inout Own own, inout Errand errand) {
  Found best = own.best;
  uint by = nobody;
  bool waits = false;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    const bool mine = of_lane(errand.owner, lane) == gl_SubgroupInvocationID;
    const float lambda = of_lane(errand.best.lambda, lane);
    const uint entity = of_lane(errand.best.entity, lane);
    const uint triangle = of_lane(errand.best.triangle, lane);
    const bool hit = mine && of_lane(errand.best.status, lane) == status_hit;
    const bool better = hit && precedes(lambda, entity, triangle, best);
    best.status = better ? status_hit : best.status;
    best.lambda = better ? lambda : best.lambda;
    best.entity = better ? entity : best.entity;
    best.triangle = better ? triangle : best.triangle;
    by = better ? lane : by;
    waits = waits || (mine && of_lane(errand.below, lane) != ref_none);
  }
  best.u = of_lane(errand.best.u, by & 7u);
  best.v = of_lane(errand.best.v, by & 7u);
  best.instance = of_lane(errand.best.instance, by & 7u);
  best.slot = of_lane(errand.best.slot, by & 7u);
  best.front = of_lane(errand.best.front ? 1u : 0u, by & 7u) != 0u;
  if (by != nobody) own.best = best;
  own.waits = waits;
  errand.owner = is_under_way(errand) ? errand.owner : nobody;
#ifdef RAY_ANY
  own.current = unless_found(own.current, own.best);
  [[unroll]] for (uint k = 0u; k < max_met; ++k) own.met.leaf[k] = unless_found(own.met.leaf[k], own.best);
#endif
}

#endif
