#ifndef RTSTDB_COMMON_LOOPS_GLSL
#define RTSTDB_COMMON_LOOPS_GLSL

// Lavapipe limits a subgroup to 65,535 loop iterations, over all its loops and lanes; after that every loop silently stops
// after one iteration. So a search counts its own iterations, as `rounds`, and a lane by itself stops at max_rounds first. Each
// loop counts at least one round, since on lavapipe an empty loop makes one too.
const uint max_rounds = 65000u;

// Loops of searches have their condition at the end (`do ... while`): a condition before the body costs one more round, in which
// the body runs without effect. Mesa 22.3's lavapipe then needs the condition a second time, around what the body changes:
//
//   do {
//     if (condition) { ... }
//   } while (condition);
//
// Lanes that have left a loop still run its body until the last lane leaves. Lavapipe protects only values that are selected at
// the end of an `if`: a value that the body computes unconditionally and that is used after the loop would be that of the last
// round, computed from the variables that such lanes had when they left.

// Lanes of one subgroup share the limit of rounds, and no lane can count those of others. Called at the end, this finds out
// whether loops have stopped: a loop of two rounds then makes only one. `loop_probe` is 2, unknown to the compiler.
bool loops_still_turn(uint loop_probe) {
  uint rounds = 0u;
  for (uint k = 0u; k < loop_probe; ++k) ++rounds;
  return rounds == loop_probe;
}

#endif
