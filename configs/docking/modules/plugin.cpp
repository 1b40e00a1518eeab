#include <hil/plugin.hpp>

#include "configs/docking/modules/docking.hpp"

HIL_PLUGIN("docking", "0.1", hil::modules::docking_port_type(), hil::modules::pixel_study_type())
