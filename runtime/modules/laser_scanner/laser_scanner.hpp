#pragma once
// A laser scanner with one turning beam, carried by a body (paper, Section 6). Every beam has its own start
// time and meets bodies where they are then; each step asks for the beams of its own period and no others.
// What the scanner makes of them leaves as an object list.
//
// The first sweep begins with the task's first release, so a sweep is a whole number of steps.
//
// Outputs  object<i>.valid, .x, .y (m), .vx, .vy (m/s over ground), .length (m), .age (ms): objects in the
//          carrier's axes at the instant they were measured, `age` ago; the origin is the parameter list_origin
//          object_count, scan_index, hits (beams of the last step that hit), digest (of every answer so far:
//          two runs that agree in it got the same answers)

#include "runtime/modules/module.hpp"

namespace hil::modules {

ModuleType laser_scanner_type();

}  // namespace hil::modules
