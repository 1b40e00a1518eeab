#pragma once
// What the parameters of a block are in YAML.

#include <hil/schema.hpp>

namespace hil::modules {

config::Schema block_schema();

}  // namespace hil::modules
