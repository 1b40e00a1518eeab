// Reads one shared struct in scalar layout and writes each of its fields, word by word, in the order of the
// field list. Compiled once per struct: PROBE_STRUCT is its name, PROBE_FIELDS its field list.
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "shaders_generated/all_shared.h"

layout(local_size_x = 1) in;
// Two in a row: the second shows where the first one ends.
layout(set = 0, binding = 0, scalar) readonly buffer Values { PROBE_STRUCT values[2]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Words { uint words[]; };

uint next_word = 0;

void echo(uint value) { words[next_word++] = value; }
void echo(int value) { echo(uint(value)); }
void echo(float value) { echo(floatBitsToUint(value)); }
void echo(uvec2 value) {
  echo(value.x);
  echo(value.y);
}
void echo(uvec3 value) {
  echo(value.xy);
  echo(value.z);
}
void echo(uvec4 value) {
  echo(value.xyz);
  echo(value.w);
}
void echo(ivec2 value) { echo(uvec2(value)); }
void echo(ivec3 value) { echo(uvec3(value)); }
void echo(ivec4 value) { echo(uvec4(value)); }
void echo(vec2 value) { echo(floatBitsToUint(value)); }
void echo(vec3 value) { echo(floatBitsToUint(value)); }
void echo(vec4 value) { echo(floatBitsToUint(value)); }

#define ECHO_FIRST(type, name) echo(values[0].name);
#define ECHO_SECOND(type, name) echo(values[1].name);

void main() {
  PROBE_FIELDS(ECHO_FIRST)
  PROBE_FIELDS(ECHO_SECOND)
}
