#pragma once
// The share of light that a surface of GGX microfacets reflects in all directions together, with one
// reflection at each microfacet: the table that shaders/query/image/surface.glsl reads.

#include <glm/vec4.hpp>

#include <span>

namespace rtstdb::query {

/// Writes the image_albedo_side * image_albedo_side entries of `table`: by roughness, then by the cosine of
/// the angle of incidence, each from 0 to 1 in equal steps. A surface that reflects the share s at normal
/// incidence reflects s * x + y of the light (Schlick's approximation of Fresnel's equations). z and w are 0.
/// Misuse: a table of another size.
/// Source: Karis, "Real Shading in Unreal Engine 4", 2013 (split sum).
void write_specular_albedo(std::span<glm::vec4> table) noexcept;

}  // namespace rtstdb::query
