// Saves the state of a ray's search at the end of a dispatch and restores it in the next, so that a retried
// ray may take any number of iterations. A search visits the same nodes in the same order wherever it pauses,
// so its result is the same.
//
// Included after traverse.glsl and ray_buffers.glsl, with RAY_PAUSES defined.
#ifndef RTSTDB_QUERY_RAY_PAUSE_GLSL
#define RTSTDB_QUERY_RAY_PAUSE_GLSL

layout(set = 0, binding = 8) uniform usamplerBuffer retried_rays;
layout(set = 0, binding = 9, scalar) buffer PausedBuffer { uint paused[]; };

// A retried ray, and whether its search begins instead of going on.
uint retry_word(uint place) { return texelFetch(retried_rays, int(place >> 2))[place & 3u]; }
uint retried_ray(uint place) { return retry_word(place) & ~ray_begins_bit; }
bool begins_again(uint place) { return (retry_word(place) & ray_begins_bit) != 0u; }

#ifdef RAY_LIST
const uint list_words = paused_hit_words * RAY_LIST;
#else
const uint list_words = 0u;
#endif

// Where the saved search of the ray at a place of `retried_rays` begins; its first word is 0 when the search
// has ended.
uint pause_at(uint place) { return place * (paused_ray_words + list_words); }

void carry_over(bool resumes, inout uint at, inout uint word) {
  if (resumes) word = paused[at];
  if (!resumes) paused[at] = word;
  ++at;
}

void carry_over(bool resumes, inout uint at, inout float number) {
  uint word = floatBitsToUint(number);
  carry_over(resumes, at, word);
  number = uintBitsToFloat(word);
}

// Saves a search, or restores it, word by word.
void pause_or_resume(bool resumes, uint place, inout TraversalState state) {
  uint at = pause_at(place);
  uint left = 1u;
  carry_over(resumes, at, left);
  carry_over(resumes, at, state.current);
  [[unroll]] for (uint k = 0u; k < max_pending; ++k) carry_over(resumes, at, state.pending.leaf[k]);
  carry_over(resumes, at, state.below);
  carry_over(resumes, at, state.depth_below);
  carry_over(resumes, at, state.search.depth);
  uint front = state.best.front ? 1u : 0u;
  carry_over(resumes, at, state.best.status);
  carry_over(resumes, at, state.best.lambda);
  carry_over(resumes, at, state.best.u);
  carry_over(resumes, at, state.best.v);
  carry_over(resumes, at, state.best.instance);
  carry_over(resumes, at, state.best.entity);
  carry_over(resumes, at, state.best.triangle);
  carry_over(resumes, at, state.best.slot);
  carry_over(resumes, at, front);
  state.best.front = front != 0u;
  for (uint k = 0u; k < state.search.depth; ++k) carry_over(resumes, at, entity_stack[k]);
  for (uint k = 0u; k < state.depth_below; ++k) carry_over(resumes, at, geometry_stack[k]);
#ifdef RAY_LIST
  [[unroll]] for (uint k = 0u; k < RAY_LIST; ++k) {
    carry_over(resumes, at, list_lambda[k]);
    carry_over(resumes, at, list_entity[k]);
    carry_over(resumes, at, list_triangle[k]);
    carry_over(resumes, at, list_instance[k]);
    carry_over(resumes, at, list_slot[k]);
  }
#endif
}

#endif
