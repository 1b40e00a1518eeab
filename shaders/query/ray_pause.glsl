// What is left of a ray's search, kept from one dispatch to the next, so that a ray asked again takes as many rounds as it needs. What it
// finds does not depend on where it pauses: its way is the same one.
//
// Include behind traverse.glsl and ray.glsl, with RAY_PAUSES defined.
#ifndef RTSTDB_QUERY_RAY_PAUSE_GLSL
#define RTSTDB_QUERY_RAY_PAUSE_GLSL

layout(set = 0, binding = 9, scalar) buffer PausedBuffer { uint paused[]; };

#ifdef RAY_LIST
const uint list_words = paused_hit_words * RAY_LIST;
#else
const uint list_words = 0u;
#endif

// Where that of the ray at a place of `again` begins: with 0 when nothing is left of it.
uint pause_at(uint place) { return place * (paused_ray_words + list_words); }

void pause_word(bool resumes, inout uint at, inout uint word) {
  if (resumes) word = paused[at];
  if (!resumes) paused[at] = word;
  ++at;
}

void pause_word(bool resumes, inout uint at, inout float number) {
  uint word = floatBitsToUint(number);
  pause_word(resumes, at, word);
  number = uintBitsToFloat(word);
}

// Writes a search down, or brings it back.
void pause_or_resume(bool resumes, uint place, inout Way way) {
  uint at = pause_at(place);
  uint left = 1u;
  pause_word(resumes, at, left);
  pause_word(resumes, at, way.current);
  [[unroll]] for (uint k = 0u; k < most_met; ++k) pause_word(resumes, at, way.met.leaf[k]);
  pause_word(resumes, at, way.below);
  pause_word(resumes, at, way.depth_below);
  pause_word(resumes, at, way.search.depth);
  uint front = way.best.front ? 1u : 0u;
  pause_word(resumes, at, way.best.status);
  pause_word(resumes, at, way.best.lambda);
  pause_word(resumes, at, way.best.u);
  pause_word(resumes, at, way.best.v);
  pause_word(resumes, at, way.best.instance);
  pause_word(resumes, at, way.best.entity);
  pause_word(resumes, at, way.best.triangle);
  pause_word(resumes, at, way.best.slot);
  pause_word(resumes, at, front);
  way.best.front = front != 0u;
  for (uint k = 0u; k < way.search.depth; ++k) pause_word(resumes, at, entity_stack[k]);
  for (uint k = 0u; k < way.depth_below; ++k) pause_word(resumes, at, geometry_stack[k]);
#ifdef RAY_LIST
  [[unroll]] for (uint k = 0u; k < RAY_LIST; ++k) {
    pause_word(resumes, at, list_lambda[k]);
    pause_word(resumes, at, list_entity[k]);
    pause_word(resumes, at, list_triangle[k]);
    pause_word(resumes, at, list_instance[k]);
    pause_word(resumes, at, list_slot[k]);
  }
#endif
}

#endif
