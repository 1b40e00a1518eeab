#pragma once
// The retro-reflectors around the station's docking port: the entities reflector_0 to reflector_7 of
// configs/docking/docking.yaml.
//
// Station frame: metres, the origin in the middle of the port, y out of it. The distances between reflectors
// differ, so that the pattern is recognised.

#include <glm/ext/vector_double3.hpp>

#include <array>

namespace hil::docking::guidance {

inline constexpr std::size_t reflector_count = 8;

inline const std::array<glm::dvec3, reflector_count> reflectors_m{
    glm::dvec3{0.90, 0.02, 0.00},  glm::dvec3{0.52, 0.02, 0.66},   glm::dvec3{-0.12, 0.02, 0.82},
    glm::dvec3{-0.78, 0.02, 0.44}, glm::dvec3{-0.86, 0.02, -0.20}, glm::dvec3{-0.42, 0.02, -0.74},
    glm::dvec3{0.20, 0.02, -0.88}, glm::dvec3{0.72, 0.02, -0.52}};

}  // namespace hil::docking::guidance
