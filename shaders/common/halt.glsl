// Halts a chunk that takes longer than predicted: the host writes a word that every invocation reads before
// it begins an element. For software devices, which share the host's memory (rtstdb/accel/submit.hpp).
#ifndef RTSTDB_COMMON_HALT_GLSL
#define RTSTDB_COMMON_HALT_GLSL
#include "shared/halt.h"

layout(buffer_reference, buffer_reference_align = 8, scalar) volatile buffer Halt { HaltWords words; };

bool halt_is_wanted(uvec2 halt) { return (halt.x | halt.y) != 0u && Halt(halt).words.wanted != 0u; }

// Marks this element and all later ones of its chunk as not started.
void leave(uvec2 halt, uint element) { atomicMin(Halt(halt).words.first_unstarted, element); }

// Whether the chunk was halted; the invocation then must not begin the element.
bool is_left(uvec2 halt, uint element) {
  const bool wanted = halt_is_wanted(halt);
  if (wanted) leave(halt, element);
  return wanted;
}

#endif
