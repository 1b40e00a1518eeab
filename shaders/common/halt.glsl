// How a chunk that takes longer than was thought ends early: the host writes a word that whoever begins with an element reads. For software
// devices, whose memory the host shares (rtstdb/accel/submit.hpp).
#ifndef RTSTDB_COMMON_HALT_GLSL
#define RTSTDB_COMMON_HALT_GLSL
#include "shared/halt.h"

layout(buffer_reference, buffer_reference_align = 8, scalar) volatile buffer Halt { HaltWords words; };

bool halt_is_wanted(uvec2 halt) { return (halt.x | halt.y) != 0u && Halt(halt).words.wanted != 0u; }

// The element, and what comes behind it in its chunk, is to be asked once more.
void leave(uvec2 halt, uint element) { atomicMin(Halt(halt).words.first_unstarted, element); }

// Whether the element is not to begin any more; then it is left.
bool is_left(uvec2 halt, uint element) {
  const bool wanted = halt_is_wanted(halt);
  if (wanted) leave(halt, element);
  return wanted;
}

#endif
