// Halts a chunk that takes longer than predicted: the host writes a word that every invocation reads before
// it begins an element. For software devices, which share the host's memory (rtstdb/accel/submit.hpp).
#ifndef RTSTDB_COMMON_HALT_GLSL
#define RTSTDB_COMMON_HALT_GLSL
#include "shared/halt.h"

layout(buffer_reference, buffer_reference_align = 8, scalar) volatile buffer Halt { HaltWords words; };

bool halt_requested(uvec2 halt) { return (halt.x | halt.y) != 0u && Halt(halt).words.wanted != 0u; }

// Reports that this element, and those after it in its chunk, were not started.
void report_unstarted(uvec2 halt, uint element) { atomicMin(Halt(halt).words.first_unstarted, element); }

// Whether the chunk is halted; then the element is reported as not started.
bool skips_when_halted(uvec2 halt, uint element) {
  const bool wanted = halt_requested(halt);
  if (wanted) report_unstarted(halt, element);
  return wanted;
}

#endif
