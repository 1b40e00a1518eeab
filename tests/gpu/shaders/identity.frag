#version 460
layout(location = 0) flat in uvec2 identity;
layout(location = 0) out uvec2 words;

void main() { words = identity; }
