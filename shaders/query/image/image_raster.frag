#version 460
// Which triangle of which instance covers the pixel.

layout(location = 0) flat in uvec2 identity;
layout(location = 0) out uvec2 words;

void main() { words = identity; }
