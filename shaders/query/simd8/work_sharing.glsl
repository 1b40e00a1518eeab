// Work sharing between the lanes of a subgroup. With one ray per lane, lanes wait for one another most of the
// time: rays find instances at different rates, and their searches inside instances take different times.
// Here a lane goes down the TLAS for its own ray, and each instance that the ray finds becomes a work item,
// which any lane without work takes. The result returns to the ray's own lane. (Compare Garanzha and Loop
// 2010, whose rays wait in queues.)
//
// A ray's result does not depend on the lanes that run its items: hits are computed and compared by the code
// of ray/traverse.glsl.
//
// For subgroups of eight lanes, all of them active: they go through all loops together.
//
// Macros: RAY_ANY, RAY_MOVING (ray/ray.comp).
#ifndef RTSTDB_QUERY_SIMD8_WORK_SHARING_GLSL
#define RTSTDB_QUERY_SIMD8_WORK_SHARING_GLSL
#define RAY_WORK_SHARING
#include "query/ray/steps.glsl"
// After steps.glsl, whose functions it uses.
#include "query/ray/ray_buffers.glsl"

// When the lanes change between the loops; measured optima (docs/decisions/0026). They stay in the TLAS while
// this many lanes have nodes left there,
const uint enough_going = 6u;
// or while there are fewer work items than lanes.
const uint enough_items = 8u;
// They stay in the geometries while this many lanes have an item, and take next rays when this many have
// none.
const uint enough_at_work = 4u;
const uint enough_free = 4u;

// The ray of a lane.
struct RayState {
  bool is_active;
  uint index;
  TracedRay ray;
  Segment world;
  Search search;  // in the TLAS
  uint current;   // in the TLAS
  PendingInstances pending;
  Found best;
  bool waits;  // for an item that some lane runs
};

// A work item: the search in an instance for the ray of lane `owner`; `no_lane`: the lane has no work.
struct WorkItem {
  uint owner;
  uint below;
  Search search;  // in the geometry's tree
  uint instance;
  uint entity;
  float lambda_min;
  Segment ray;
  Found best;
};

const uint no_lane = 8u;

bool is_under_way(WorkItem item) { return item.below != ref_none; }

RayState no_ray(TracedRay some_ray) {
  return RayState(false, 0u, some_ray, make_segment(-some_ray.origin, some_ray.direction), nothing_begun(),
                  ref_none, no_pending(), nothing_within(0.0), false);
}

WorkItem no_item(Segment some_ray) {
  return WorkItem(no_lane, ref_none, nothing_begun(), 0u, 0u, 0.0, some_ray, nothing_within(0.0));
}

RayState begin_ray(uint index, TracedRay ray, uint root) {
  RayState state = no_ray(ray);
  state.is_active = true;
  state.index = index;
  state.current = root;
  state.best = nothing_within(ray.lambda_max);
  return state;
}

// Whether the ray has instances that have not been entered, or nodes left in the TLAS.
bool has_instances_left(RayState state) {
  return state.current != ref_none || state.pending.leaf[0] != ref_none;
}

bool is_done(RayState state) { return !has_instances_left(state) && !state.waits; }

// Goes down the TLAS.
void find_instances(inout RayState state, WorkItem item) {
  const float limit = reach_of(state.best);
  uint going;
  uint items;
  do {
    ++state.search.rounds;
    visit_next(state.current, state.pending, state.search, state.ray.share, state.world, state.ray.lambda_min,
               limit);
    const uint both = sum_of_lanes((goes_on(state.current, state.pending) ? 1u : 0u) +
                                   (count_of(state.pending) + (is_under_way(item) ? 1u : 0u) << 8));
    going = both & 0xFFu;
    items = both >> 8;
  } while (going >= enough_going || (going != 0u && items < enough_items));
}

// Gives the first pending instance of rays that have one to lanes without an item, both in the order of
// lanes.
void take_items(inout RayState state, inout uint owner, inout uint leaf) {
  const bool idle = owner == no_lane;
  const bool has_one = state.pending.leaf[0] != ref_none;
  const uint idle_before = lanes_before(idle);
  const uint given_before = lanes_before(has_one);
  const bool gives = has_one && given_before < count_of_lanes(idle);
  uint from = no_lane;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    from = of_lane(gives ? given_before : no_lane, lane) == idle_before ? lane : from;
  }
  const uint given = of_lane(state.pending.leaf[0], from & 7u);
  const bool takes = idle && from != no_lane;
  owner = takes ? from : owner;
  leaf = takes ? given : leaf;
  const PendingInstances rest = rest_of(state.pending, state.best);
  if (gives) state.pending = rest;
}

void begin_items(inout RayState state, inout WorkItem item) {
  uint owner = item.owner;
  uint leaf = ref_none;
  take_items(state, owner, leaf);
  take_items(state, owner, leaf);
  const bool begins = leaf != ref_none;
  const uint of = owner & 7u;
  Segment world;
  world.minus_o = of_lane(state.world.minus_o, of);
  world.d = of_lane(state.world.d, of);
  const int t_ns = of_lane(state.ray.t_ns, of);
  const uint mask = of_lane(state.ray.mask, of);
  const float lambda_min = of_lane(state.ray.lambda_min, of);
  const float lambda_max = of_lane(state.best.lambda, of);
  const uint instance_base = of_lane(state.ray.instance_base, of);
  const uint instance = begins ? (leaf & ref_instance_mask) + instance_base : 0u;
  const Instance candidate = instance_at(instance);
  const Segment ray = enter_instance(world, candidate, t_ns, head_of(begins ? candidate.blas_root : 0u));
  if (begins) {
    item.owner = owner;
    item.below = (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
    item.search.depth = 0u;
    item.instance = instance;
    item.entity = candidate.entity;
    item.lambda_min = lambda_min;
    item.ray = ray;
    item.best = nothing_within(lambda_max);
  }
}

// Bounds every item of a ray by the best hit of all its items.
void share_bounds(inout WorkItem item) {
  float nearest = item.best.lambda;
  bool found = false;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    const bool same = of_lane(item.owner, lane) == item.owner;
    const float lambda = of_lane(item.best.lambda, lane);
    nearest = same ? lesser_of(nearest, lambda) : nearest;
    found = found || (same && of_lane(item.best.status, lane) == status_hit);
  }
  // A hit beyond the bound would be discarded.
  if (nearest < item.best.lambda) item.best = nothing_within(nearest);
#ifdef RAY_ANY
  item.below = found ? ref_none : item.below;
#endif
}

// Goes through the geometries. `more_waits`: there are rays or instances that wait.
void run_items(inout WorkItem item, bool more_waits, float faces) {
  uint at_work;
  do {
    ++item.search.rounds;
    item.below = go_through_leaves(item.below, item.search, item.ray, item.lambda_min, faces, 0u,
                                   item.instance, item.entity, item.best);
    share_bounds(item);
    at_work = count_of_lanes(is_under_way(item));
  } while (at_work >= enough_at_work || (at_work != 0u && !more_waits));
}

// Returns the best hits of items to the rays that they run for.
void return_results(inout RayState state, inout WorkItem item) {
  Found best = state.best;
  uint by = no_lane;
  bool waits = false;
  [[unroll]] for (uint lane = 0u; lane < 8u; ++lane) {
    const bool mine = of_lane(item.owner, lane) == gl_SubgroupInvocationID;
    const float lambda = of_lane(item.best.lambda, lane);
    const uint entity = of_lane(item.best.entity, lane);
    const uint triangle = of_lane(item.best.triangle, lane);
    const bool hit = mine && of_lane(item.best.status, lane) == status_hit;
    const bool better = hit && precedes(lambda, entity, triangle, best);
    best.status = better ? status_hit : best.status;
    best.lambda = better ? lambda : best.lambda;
    best.entity = better ? entity : best.entity;
    best.triangle = better ? triangle : best.triangle;
    by = better ? lane : by;
    waits = waits || (mine && of_lane(item.below, lane) != ref_none);
  }
  best.u = of_lane(item.best.u, by & 7u);
  best.v = of_lane(item.best.v, by & 7u);
  best.instance = of_lane(item.best.instance, by & 7u);
  best.slot = of_lane(item.best.slot, by & 7u);
  best.front = of_lane(item.best.front ? 1u : 0u, by & 7u) != 0u;
  if (by != no_lane) state.best = best;
  state.waits = waits;
  item.owner = is_under_way(item) ? item.owner : no_lane;
#ifdef RAY_ANY
  state.current = unless_found(state.current, state.best);
  [[unroll]] for (uint k = 0u; k < max_pending; ++k) state.pending.leaf[k] =
      unless_found(state.pending.leaf[k], state.best);
#endif
}

#endif
