#ifndef RTSTDB_COMMON_LOOPS_GLSL
#define RTSTDB_COMMON_LOOPS_GLSL

// Lavapipe lets a subgroup make 65,535 rounds through loops, all its loops and lanes taken together; from then on every loop
// stops after one round, without a word. A search counts its own rounds, so that a lane on its own stops here first: each
// loop that is come by counts at least one round, since on lavapipe an empty one makes one too.
const uint max_rounds = 65000u;

// Lanes of one subgroup may use up each other's rounds, which no lane can count. Asked last of all, this tells: a loop of two
// rounds makes only one when loops have stopped. `two` is 2, unknown to the compiler.
bool loops_still_turn(uint two) {
  uint rounds = 0u;
  for (uint k = 0u; k < two; ++k) ++rounds;
  return rounds == two;
}

#endif
