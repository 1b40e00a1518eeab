// Counts and lists what a region finds. Included after the declarations of `args`, `ids` and `rounds`.
// Macros: REGION_KEY, the type of an entry of `ids`.
uint found = 0u;

#if defined(REGION_PAIRS)
void keep(uint base, bool hit, REGION_KEY id) {
  if (hit && found < space_length) ids[base + found] = id;
  found += hit ? 1u : 0u;
}
#elif defined(REGION_COUNT)
void keep(uint base, bool hit, REGION_KEY id) { found += hit ? 1u : 0u; }
#elif defined(REGION_LOWEST)
bool is_below(uint a, uint b) { return a < b; }
bool is_below(uvec2 a, uvec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }

// A heap with the largest id on top, so that the lowest ids remain.
void keep(uint base, bool hit, REGION_KEY id) {
  const bool full = found >= args.capacity;
  uint place = hit && !full ? found : 0u;
  while (place > 0u && is_below(ids[base + (place - 1u) / 2u], id)) {
    ++rounds;
    ids[base + place] = ids[base + (place - 1u) / 2u];
    place = (place - 1u) / 2u;
  }
  const bool sinks = hit && full && is_below(id, ids[base]);
  uint child = sinks ? 1u : args.capacity;
  while (child < args.capacity) {
    ++rounds;
    const bool right = child + 1u < args.capacity && is_below(ids[base + child], ids[base + child + 1u]);
    child += right ? 1u : 0u;
    const bool rises = is_below(id, ids[base + child]);
    if (rises) ids[base + place] = ids[base + child];
    place = rises ? child : place;
    child = rises ? 2u * child + 1u : args.capacity;
  }
  rounds += 2u;
  if (hit && (!full || sinks)) ids[base + place] = id;
  found += hit ? 1u : 0u;
}
#else
void keep(uint base, bool hit, REGION_KEY id) {
  if (hit && found < args.capacity) ids[base + found] = id;
  found += hit ? 1u : 0u;
}
#endif
