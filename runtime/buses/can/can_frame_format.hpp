#pragma once
// The frames of a CAN bus in a recording.

#include "runtime/contribution/frame_format.hpp"

namespace hil::buses::can {

/// Of io::can::BusFrame.
contribution::FrameFormat can_frame_format();

}  // namespace hil::buses::can
