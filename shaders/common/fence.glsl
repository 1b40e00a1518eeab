#ifndef RTSTDB_COMMON_FENCE_GLSL
#define RTSTDB_COMMON_FENCE_GLSL

// Lavapipe 22.3 turns a memory barrier into an execution barrier of the workgroup, which breaks any divergent
// control flow around it; it also does not need one, since its invocations are ordinary x86 or Arm threads'
// code between atomics. The device sets this constant from its driver (rtstdb/gpu/pipeline.cpp).
layout(constant_id = 0) const bool fence_in_divergent_flow = true;

// Orders what this invocation does with buffers and their texels around an atomic, where not every invocation
// comes by.
void divergent_fence() {
  if (!fence_in_divergent_flow) return;
  memoryBarrierBuffer();
  memoryBarrierImage();
}

#endif
