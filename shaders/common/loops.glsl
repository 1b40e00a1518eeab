#ifndef RTSTDB_COMMON_LOOPS_GLSL
#define RTSTDB_COMMON_LOOPS_GLSL

// Lavapipe lets a subgroup make 65,535 rounds through loops, all its loops and lanes taken together; from then on every loop
// stops after one round, without a word. A search counts its own rounds, so that a lane on its own stops here first: each
// loop that is come by counts at least one round, since on lavapipe an empty one makes one too.
const uint max_rounds = 65000u;

// Searches end their loops where the condition stands (`do ... while`): a condition before the body costs a round more, in which all
// that the loop holds runs for nobody. Mesa 22.3's lavapipe then needs the condition once more, around what the body changes:
//
//   do {
//     if (condition) { ... }
//   } while (condition);
//
// Lanes that have left a loop run along until the last has, and only what is chosen between at the end of an `if` is kept from
// them: a value that the body computes outright and that is used behind the loop is the one of the last round, made from
// what their variables were when they left. (Seen: region_triangles.glsl lost one entity in 1 of 10,000 answers.)

// Lanes of one subgroup may use up each other's rounds, which no lane can count. Called last of all, this tells: a loop of two
// rounds makes only one when loops have stopped. `loop_probe` is 2, unknown to the compiler.
bool loops_still_turn(uint loop_probe) {
  uint rounds = 0u;
  for (uint k = 0u; k < loop_probe; ++k) ++rounds;
  return rounds == loop_probe;
}

#endif
