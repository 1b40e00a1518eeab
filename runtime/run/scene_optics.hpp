#pragma once
// The materials and lights of a scenario as those of the database.
//
// Threads: pure functions.

#include <rtstdb/light.hpp>
#include <rtstdb/material.hpp>

#include "runtime/config/optics_section.hpp"

namespace hil::run {

rtstdb::Material material_of(const config::WorldMaterial& material);
rtstdb::Light light_of(const config::WorldLight& light);

}  // namespace hil::run
