#ifndef RTSTDB_COMMON_LOOPS_GLSL
#define RTSTDB_COMMON_LOOPS_GLSL

// Lavapipe limits a subgroup to 65,535 iterations, counted over all its loops and lanes together. After that
// every loop ends after one iteration, without an error. A search counts its own iterations ("rounds") and
// ends before that limit if its lane runs alone. Each loop that is reached counts at least one round, since
// lavapipe counts an empty one too.
const uint max_rounds = 65000u;

// Searches test loop conditions at the end (`do ... while`), since lavapipe executes one more round of the
// body for a condition at the begin. Mesa 22.3 then requires the condition again around the body:
//
//   do {
//     if (condition) { ... }
//   } while (condition);
//
// Lanes that have left a loop execute until the last lane leaves. Only values that are selected at the end of
// an `if` are protected: a value that the body computes unconditionally and that is used after the loop is
// that of the last round.

// Lanes of a subgroup can use up each other's rounds, which no lane can count. A search ends with this test:
// a loop of two rounds makes only one when the limit was reached. `loop_probe` is 2, in a way that the
// compiler can not know.
bool loops_still_turn(uint loop_probe) {
  uint rounds = 0u;
  for (uint k = 0u; k < loop_probe; ++k) ++rounds;
  return rounds == loop_probe;
}

#endif
