#pragma once
// The share of light that a surface of GGX microfacets reflects in all directions together, with one
// reflection at each microfacet: the table that shaders/query/image/surface.glsl reads.

#include <glm/vec4.hpp>

#include <vector>

namespace rtstdb::query {

/// By roughness, then by the cosine of the angle of incidence, image_albedo_side samples each from 0 to 1. A
/// surface that reflects the share s at normal incidence reflects s * x + y of the light (Schlick's
/// approximation of Fresnel's equations). z and w are 0.
/// Source: Karis, "Real Shading in Unreal Engine 4", 2013 (split sum).
std::vector<glm::vec4> specular_albedo_table();

}  // namespace rtstdb::query
